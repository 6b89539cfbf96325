"""Imports modules beside a scenario under private names, so that they replace no other module of the same name.

    beacon.py beside the scenario       sys.modules["beacon@3f9a0c11d2e4"]          digest of the folder's path
    robots/arm.py                       sys.modules["robots@3f9a0c11d2e4.arm"]

So a user's `signal.py` replaces neither the standard library's nor that of another scenario in the same process. An
import statement in such a module looks beside the scenario first, then among what is installed, except that a module
which imports its own name (`import signal` in `signal.py`) gets the installed one. A folder without `__init__.py` is
a package only if no installed module has its name, as in Python itself.

Not covered: `importlib.import_module("helper")` in such a module looks among what is installed only.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import blake2b
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final

PACKAGES: Final = ("agents", "experiments", "firmware_sim", "fmus", "marconet", "netem", "scenarios")
ROOT: Final = Path(__file__).parents[2]         # folder of marconet's packages


class NameTaken(ImportError):
    """A folder beside the scenario has the name of a package of marconet, so an import could mean either."""


def module_for(name: str, folder: Path) -> ModuleType:
    """Return the module `name` in `folder`, the scenario's, or the installed one if there is none.

    Raises `NameTaken`, and ModuleNotFoundError if there is neither.
    """
    return _modules_in(folder.absolute()).module(name)


@contextmanager
def copies_for(node: str, folder: Path) -> Iterator[Callable[[str], Any]]:
    """Give a function like `class_for` whose modules of the folder are copies for `node`; forget them afterwards."""
    finder = _ModulesBeside(folder.absolute(), node)
    sys.meta_path.insert(0, finder)

    def copied(path: str) -> Any:
        module_name, _, name = path.partition(":")
        return getattr(finder.module(module_name), name)

    try:
        yield copied
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if name.partition(".")[0].endswith(finder.tag)]:
            del sys.modules[name]


def modules_beside(folder: Path) -> list[ModuleType]:
    """Return the modules beside a scenario in `folder` that this process has imported."""
    tag = _modules_in(folder.absolute()).tag
    return [module for name, module in list(sys.modules.items()) if name.partition(".")[0].endswith(tag)]


def imported_from(folder: Path) -> bool:
    """Return whether this process has imported a module beside a scenario in `folder`."""
    return bool(modules_beside(folder))


def _modules_in(folder: Path) -> _ModulesBeside:
    for finder in sys.meta_path:
        if isinstance(finder, _ModulesBeside) and finder.folder == folder and not finder.node:
            return finder
    found = _ModulesBeside(folder)
    sys.meta_path.insert(0, found)          # before the finder of the path, which knows the files but not the names
    return found


class _ModulesBeside(MetaPathFinder):
    """Finds the modules of one folder, for names that end in the tag of the folder and, of copies, of their node."""

    def __init__(self, folder: Path, node: str = "") -> None:
        self.folder = folder
        self.node = node
        whose = f"{folder}\0{node}" if node else str(folder)
        self.tag = "@" + blake2b(whose.encode(), digest_size=6).hexdigest()
        self._kinds: dict[str, str] = {}
        self.builtins = {**vars(builtins), "__import__": self._import}

    def module(self, name: str) -> ModuleType:
        try:
            return import_module(self._private(name, importer=""))
        except ModuleNotFoundError as error:
            self._remove_tag(error)
            raise

    def find_spec(self, fullname: str, path: Sequence[str] | None = None,
                  target: ModuleType | None = None) -> ModuleSpec | None:
        top, _, below = fullname.partition(".")
        if not top.endswith(self.tag):
            return None
        place = self.folder.joinpath(top.removesuffix(self.tag), *below.split(".") if below else ())
        for file, locations in ((place / "__init__.py", [str(place)]), (place.with_name(f"{place.name}.py"), None)):
            if file.is_file():
                return spec_from_file_location(fullname, file, loader=_Loader(fullname, str(file), self.builtins),
                                               submodule_search_locations=locations)
        if place.is_dir():
            spec = ModuleSpec(fullname, None, is_package=True)
            spec.submodule_search_locations = [str(place)]
            return spec
        return None

    def _import(self, name: str, globals: Mapping[str, object] | None = None,
                locals: Mapping[str, object] | None = None, fromlist: Sequence[str] | None = (),
                level: int = 0) -> ModuleType:
        """Replaces `__import__` in the modules of this folder."""
        if level == 0:
            name = self._private(name, str((globals or {}).get("__name__", "")))
        try:
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        except ModuleNotFoundError as error:
            self._remove_tag(error)
            raise

    def _private(self, name: str, importer: str) -> str:
        """Return the private name of a module beside the scenario, `name` itself for any other."""
        top, dot, below = name.partition(".")
        kind = self._kinds.get(top) or self._kinds.setdefault(top, self._kind(top))
        if kind == "package" and top in PACKAGES:
            raise NameTaken(f"the folder {self.folder / top} has the name of marconet's own package {ROOT / top}: "
                            "rename the folder, and the imports of it", name=top)
        if kind == "none" or (kind == "file" and dot):
            return name
        private = top + self.tag
        if importer == private and not dot and self._installed(top):
            return name
        return private + dot + below

    def _kind(self, top: str) -> str:
        """Return what an import of `top` finds in the folder: "package", "file" or "none"."""
        place, ours = self.folder / top, ROOT / top
        if top in PACKAGES and ours.is_dir() and place.is_dir() and place.samefile(ours):
            return "none"
        if (place / "__init__.py").is_file():
            return "package"
        if (self.folder / f"{top}.py").is_file():
            return "file"
        holds_modules = place.is_dir() and any(place.glob("*.py"))
        return "package" if holds_modules and (top in PACKAGES or not self._installed(top)) else "none"

    def _installed(self, top: str) -> bool:
        """Return whether a module outside the folder has this name; a blocking program has the folder on `sys.path`."""
        if top in sys.modules:
            return True
        spec = find_spec(top)
        return spec is not None and spec.origin is not None and self.folder not in Path(spec.origin).parents

    def _remove_tag(self, error: ModuleNotFoundError) -> None:
        error.msg = error.msg.replace(self.tag, "")
        error.name = error.name and error.name.replace(self.tag, "")


class _Loader(SourceFileLoader):
    """Loads a module whose import statements look beside the scenario first."""

    def __init__(self, fullname: str, path: str, own_builtins: dict[str, Any]) -> None:
        super().__init__(fullname, path)
        self._builtins = own_builtins

    def exec_module(self, module: ModuleType) -> None:
        module.__dict__["__builtins__"] = self._builtins
        super().exec_module(module)


def function_for(path: str, folder: Path) -> Callable[..., Any]:
    """Return the function that "package.module:function" names, installed or beside the scenario.

    Raises ValueError with the reason if there is none.
    """
    module_name, colon, name = path.partition(":")
    if not colon or not name.isidentifier() or not all(part.isidentifier() for part in module_name.split(".")):
        raise ValueError("expected 'package.module:function'")
    try:
        found = getattr(module_for(module_name, folder), name, None)
    except ModuleNotFoundError as error:
        raise ValueError(f"there is no module {error.name!r}") from error
    except NameTaken as error:
        raise ValueError(str(error)) from error
    if not callable(found):
        raise ValueError(f"there is no function {name!r} in {module_name}")
    function: Callable[..., Any] = found
    return function
