"""A kind answers for itself: no code outside its room asks which member of it there is."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("netem", "fmus", "firmware_sim", "agents", "experiments", "marconet")
FILES = [str(path.relative_to(ROOT)) for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
TABLES = [file for file in FILES if file.endswith("/table.py")] + [
    "experiments/scenario/cost_kinds.py", "experiments/scenario/guarantee_kinds.py"]
ROOMS = {"experiments/scenario/guarantee_kinds.py": "experiments/judge/monitors",      # else the table's own folder
         "experiments/scenario/cost_kinds.py": "experiments/judge/costs"}
CHOSEN_BY = {"netem/media/mac/table.py": "mac", "netem/media/decoding/table.py": "decode",
             "agents/triggering/policies/table.py": "policy"}                          # else `kind`
# Names that the attributes of too many other things have, so that reading them by name tells nothing of a kind.
COMMON = {"name", "names", "run", "start", "check", "prepare", "Settings"}
FUNCTIONS = {"isinstance", "issubclass", "getattr", "hasattr"}
ASKING = (ast.Call, ast.MatchClass, ast.Compare, ast.Match, ast.Tuple, ast.List, ast.Set, ast.Dict, ast.Assign)


@dataclass(frozen=True)
class Kind:
    table: str
    room: str                   # its folder
    key: str                    # of the settings that choose a member
    names: frozenset[str]       # of its members
    classes: frozenset[str]     # "module:Class" of its members, their settings, and what else the room says of them
    attributes: frozenset[str]  # of its members and their settings


@cache
def kinds() -> tuple[Kind, ...]:
    return tuple(kind_of(file) for file in TABLES)


def kind_of(file: str) -> Kind:
    module = import_module(file.removesuffix(".py").replace("/", "."))
    room = ROOMS.get(file, file.rpartition("/")[0])
    tables: list[Mapping[str, Any]] = [value for name, value in vars(module).items()
                                       if name.isupper() and isinstance(value, Mapping)]
    members = [value for table in tables for value in table.values()]
    if not any(map(inspect.isclass, members)):      # functions that build them
        members = list(vars(module).values())
    classes = {cls for cls in members if inspect.isclass(cls) and _in(cls, room)}
    classes |= {cls.Settings for cls in classes if hasattr(cls, "Settings")}
    classes |= {base for cls in classes for base in cls.__mro__ if _in(base, room)}
    return Kind(file, room, CHOSEN_BY.get(file, "kind"), frozenset(name for table in tables for name in table),
                frozenset(f"{cls.__module__}:{cls.__qualname__}" for cls in classes),
                frozenset(name for cls in classes for name in _attributes(cls)) - COMMON)


def _in(cls: type, room: str) -> bool:
    return f"{cls.__module__}.".startswith(f"{room.replace('/', '.')}.")


def _attributes(cls: type) -> Iterator[str]:
    yield from (name for name in vars(cls) if not name.startswith("_"))
    if is_dataclass(cls):
        yield from (field.name for field in fields(cls))
    module = ROOT / cls.__module__.replace(".", "/")        # a compiled class does not know its source
    file = module / "__init__.py" if module.is_dir() else module.with_suffix(".py")
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ClassDef) and node.name == cls.__name__:
            yield from (each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)
                        and isinstance(each.ctx, ast.Store) and not each.attr.startswith("_"))


def questions(file: str, text: str) -> Iterator[str]:
    """A line for each place of the file that asks which member of a kind there is."""
    tree = ast.parse(text)
    types = {id(node.slice) for node in ast.walk(tree) if isinstance(node, ast.Subscript)}      # Literal["a", "b"]
    imported = {alias.asname or alias.name: f"{node.module}:{alias.name}" for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom) for alias in node.names}
    nodes = [node for node in ast.walk(tree) if isinstance(node, ASKING) and id(node) not in types
             and _names_a_member(node, imported)]
    for kind in kinds():
        if file != kind.table and not file.startswith(f"{kind.room}/"):
            for node in nodes:
                yield from (f"{file}:{line}: {what}" for line, what in _questions(node, kind, imported))


@cache
def _words() -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
    """Return the names that a constant may have, the classes, and their names without the module, of all kinds."""
    classes = frozenset[str]().union(*(kind.classes for kind in kinds()))
    return (frozenset[str]().union(*(kind.names | kind.attributes for kind in kinds())), classes,
            frozenset(name.rpartition(":")[2] for name in classes))


def _names_a_member(node: ast.AST, imported: Mapping[str, str]) -> bool:
    """Whether the node has a word of any kind in it: one look, before that at each kind, spares nearly all of those."""
    if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS):
        return False
    words, classes, class_names = _words()
    return any((isinstance(each, ast.Constant) and each.value in words)
               or (isinstance(each, ast.Name) and imported.get(each.id) in classes)
               or (isinstance(each, ast.Attribute) and each.attr in class_names) for each in ast.walk(node))


def _questions(node: ast.AST, kind: Kind, imported: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    match node:
        case ast.Call(func=ast.Name(id="isinstance" | "issubclass" as function), args=[_, asked]):
            yield from ((node.lineno, f"{function} of {name}") for name in _classes(asked, kind, imported))
        case ast.Call(func=ast.Name(id="getattr" | "hasattr" as function), args=[_, ast.Constant(value=asked), *_]):
            if asked in kind.attributes:
                yield node.lineno, f"{function} of {asked!r}"
        case ast.MatchClass():
            yield from ((node.cls.lineno, f"case {name}") for name in _classes(node.cls, kind, imported))
        case ast.Compare():
            sides = [node.left, *node.comparators]
            found = [name for side in sides for name in _classes(side, kind, imported)]
            if any(_chooses(side, kind) for side in sides):
                found += [repr(name) for side in sides for name in _names(side, kind)]
            yield from ((node.lineno, f"comparison with {name}") for name in found)
        case ast.Match() if _chooses(node.subject, kind):
            yield from ((node.subject.lineno, f"case {name!r}") for case in node.cases
                        for name in _names(case.pattern, kind))
        case ast.Tuple() | ast.List() | ast.Set() | ast.Dict() | ast.Assign():      # to be compared elsewhere
            yield from ((node.lineno, f"{each.value!r} listed") for each in ast.iter_child_nodes(node)
                        if isinstance(each, ast.Constant) and each.value in kind.names and "_" in each.value)


def _classes(node: ast.AST, kind: Kind, imported: Mapping[str, str]) -> Iterator[str]:
    for each in ast.walk(node):
        if isinstance(each, ast.Name) and imported.get(each.id) in kind.classes:
            yield each.id
        elif isinstance(each, ast.Attribute) and any(name.endswith(f":{each.attr}") for name in kind.classes) \
                and isinstance(each.value, ast.Name) and imported.get(each.value.id, "").startswith(
                    kind.room.partition("/")[0]):
            yield each.attr


def _names(node: ast.AST, kind: Kind) -> Iterator[str]:
    yield from (each.value for each in ast.walk(node) if isinstance(each, ast.Constant) and each.value in kind.names)


def _chooses(node: ast.AST, kind: Kind) -> bool:
    """Whether the expression reads the key that chooses a member: `kind`, `spec.kind`, `table["kind"]`, or `.get`."""
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name) | ast.Subscript(slice=ast.Constant(value=name)):
            return bool(name == kind.key)
        case ast.Call(func=ast.Attribute(attr="get"), args=[ast.Constant(value=name), *_]):
            return bool(name == kind.key)
        case ast.Call(func=ast.Name(id="str"), args=[inner]):
            return _chooses(inner, kind)
    return False


@pytest.mark.parametrize("package", PACKAGES)
def test_nobody_outside_its_room_asks_which_member_of_a_kind_there_is(package: str) -> None:
    found = [question for file in FILES if file.startswith(f"{package}/")
             for question in questions(file, (ROOT / file).read_text(encoding="utf-8"))]

    assert found == []


@pytest.mark.parametrize("asking", [
    "from netem.media.can.bus import CanBus\nisinstance(medium, CanBus)",
    "from netem.media.sensing.settings import SensingSettings\nisinstance(medium.settings, dict | SensingSettings)",
    "from netem.media.can.bus import CanBus as Bus\nif type(medium) is Bus: pass",
    "from netem.impairments.delay import Delay\nmatch impairment:\n    case Delay(delay_ns=0): pass",
    "from netem.media.can import bus\nisinstance(medium, bus.CanBus)",
    "getattr(medium, 'topology', None)",
    "getattr(settings, 'own_frames_to', ())",
    "hasattr(impairment, 'most_delay_ns')",
    "spec.kind == 'sensing'",
    "table.get('kind') in ('can', 'serial_line')",
    "[name for name, kind in media.items() if kind != 'can']",
    "for key, wanted in (('serial', 'serial_line'), ('radio', 'broadcast_radio')): pass",
    "match table['kind']:\n    case 'fixed' | 'switching': pass",
    "settings.mac != 'none'",
    "settings.decode == 'radio_network'",
])
def test_such_a_question_is_found(asking: str) -> None:
    assert list(questions("experiments/run/somewhere.py", asking))


def test_every_table_has_members_with_names() -> None:
    assert {kind.room for kind in kinds()} >= {
        "netem/media", "netem/media/mac", "netem/media/decoding", "netem/impairments", "netem/topology",
        "experiments/judge/monitors", "agents/triggering/policies"}
    assert all(kind.names and kind.classes for kind in kinds())
