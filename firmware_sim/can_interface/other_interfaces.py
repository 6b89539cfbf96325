"""Refuses other python-can interfaces in a blocking program, with an error that names the right one.

    can.Bus(interface="socketcan"), CAN_INTERFACE=socketcan, can.conf, or no interface at all --> OtherInterface

In virtual time only: with `--real-time` a program may open the hardware of the machine that it runs on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import can.interface
from can import CanInterfaceNotImplementedError

from firmware_sim.blocking.here import running
from firmware_sim.blocking.program import BlockingProgram

OWN: Final = "marconet"


class OtherInterface(CanInterfaceNotImplementedError):
    """An interface that does not lead to the emulated buses."""


@contextmanager
def only_our_interface() -> Iterator[None]:
    """Within this context `can.Bus` refuses every other interface in the threads of blocking programs."""
    find, configure = can.interface._get_class_for_interface, can.util.load_config

    def find_ours(interface: str) -> Any:
        program = running()
        if program is not None and interface != OWN:
            buses, remedy = _in_words(program)
            raise OtherInterface(f"interface={interface!r} does not lead to the emulated buses ({buses}); {remedy}")
        return find(interface)

    def configure_ours(*args: Any, **kwargs: Any) -> Any:
        try:
            return configure(*args, **kwargs)
        except CanInterfaceNotImplementedError as error:
            program = running()
            if program is None or isinstance(error, OtherInterface):
                raise
            buses, remedy = _in_words(program)
            raise OtherInterface(f"no interface of python-can is named ({error}; {buses}); {remedy}") from None

    with _replaced(can.interface, "_get_class_for_interface", find_ours), _replaced(
            can.util, "load_config", configure_ours):
        yield


def _in_words(program: BlockingProgram) -> tuple[str, str]:
    """Return the node with its buses, and the remedy."""
    channels = program.can_buses
    return f"node {program.node.name} is on {', '.join(channels) or 'no CAN bus'}", (
        f'name "{OWN}": can.Bus(interface="{OWN}", channel="{next(iter(channels), "...")}"), or CAN_INTERFACE={OWN} in '
        f"the environment, or `interface = {OWN}` in can.conf")


@contextmanager
def _replaced(module: Any, name: str, function: Callable[..., Any]) -> Iterator[None]:
    before = getattr(module, name)
    setattr(module, name, function)
    try:
        yield
    finally:
        setattr(module, name, before)
