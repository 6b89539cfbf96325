"""Modules that lie beside a scenario. Each folder has its own, even if two folders use one name for different files."""

from __future__ import annotations

import sys
from hashlib import blake2b
from importlib import import_module
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any


def module_for(name: str, folder: Path) -> ModuleType:
    """The installed module `name`; if there is none, the one that lies in `folder`, the scenario's.

    What such a module imports from its own folder is found there too, under its plain name.
    """
    folder = folder.absolute()
    file = folder / f"{name}.py"
    if file.is_file() and find_spec(name) is None:
        return _loaded(name, file)
    if (folder / name.partition(".")[0]).is_dir() and str(folder) not in sys.path:
        sys.path.append(str(folder))
    return import_module(name)


def class_for(path: str, folder: Path) -> Any:
    """The class that "package.module:Class" names, or the function of a blocking program.

    That it is there was checked when the scenario was loaded.
    """
    module_name, _, class_name = path.partition(":")
    return getattr(module_for(module_name, folder), class_name)


def _loaded(name: str, file: Path) -> ModuleType:
    own_name = f"{name}@{blake2b(str(file.parent).encode(), digest_size=6).hexdigest()}"
    if own_name in sys.modules:
        return sys.modules[own_name]
    spec = spec_from_file_location(own_name, file)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[own_name] = module_from_spec(spec)
    sys.path.insert(0, str(file.parent))
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[own_name]
        raise
    finally:
        sys.path.remove(str(file.parent))
    return module
