"""The batons that this process uses: those in C, where c_batons.c was compiled, or else those in Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

__all__ = ["Baton", "EventBaton", "pass_on"]

if TYPE_CHECKING:
    from firmware_sim.blocking.c_batons import Baton, pass_on

    EventBaton = Baton
else:
    try:
        from firmware_sim.blocking.c_batons import Baton, pass_on

        EventBaton = Baton
    except ModuleNotFoundError:
        from firmware_sim.blocking.python_batons import Baton, EventBaton, pass_on
