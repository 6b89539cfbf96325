"""Undoes what blocking programs on the host `inline` change in the emulator's process, after the run.

    os.environ                                      as before
    packages that modules beside the scenario use   a name of theirs that was bound anew has its former value

So the next run in the process finds what this one found. Not undone: changes inside objects (a cache, a list of
handlers), new names, and the state of libraries in C. The nodes of one run share all of this while it lasts.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.programs.own_modules import modules_beside


@contextmanager
def shared_state_restored(folder: Path) -> Iterator[None]:
    """Restore, at the end of this context, what programs of the scenario in `folder` changed in the process."""
    environment = dict(os.environ)
    packages = _packages_used(folder)
    before = [(module, dict(vars(module))) for name, module in list(sys.modules.items())
              if name.partition(".")[0] in packages and isinstance(module, ModuleType)]
    try:
        yield
    finally:
        for key in [key for key in os.environ if key not in environment]:
            del os.environ[key]
        for key, text in environment.items():
            if os.environ.get(key) != text:
                os.environ[key] = text
        for module, names in before:
            now = vars(module)
            now.update({name: value for name, value in names.items() if now.get(name) is not value})


def _packages_used(folder: Path) -> set[str]:
    """Return the packages from which modules beside the scenario import, but the standard library and marconet."""
    used = {_package_of(value) for module in modules_beside(folder) for value in vars(module).values()}
    return used - sys.stdlib_module_names - {"", "agents", "experiments", "firmware_sim", "fmus", "marconet", "netem"}


def _package_of(value: Any) -> str:
    name = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", "")
    return name.partition(".")[0] if isinstance(name, str) and "@" not in name else ""
