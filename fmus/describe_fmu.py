"""Unpacks any FMI 2.0 or 3.0 co-simulation FMU and reads its description with FMPy.

The result is cached by the content of the archive, so a second call neither unpacks nor imports FMPy. Attributes that
FMPy does not read (bounds of unsigned integers, `maxSize` of binary variables) are read from the XML here.
"""

from __future__ import annotations

import hashlib
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec

from fmus.archive import DESCRIPTION, one_line, shown, unpack
from fmus.bus_terminals import bus_terminals
from fmus.cache import cache_folder, kept
from fmus.describe import TOOL
from fmus.description import Clock, PlantDescription, Variable
from fmus.errors import PlantError
from fmus.platform_names import library_suffix, platform_fmi2, platform_fmi3

LAYOUT = 6              # raised by one whenever the content of a cached folder changes


def describe(path: str | Path, cache: Path | None = None) -> PlantDescription:
    """Return the description of the FMU at `path`; raises PlantError if the FMU cannot be used on this machine."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise PlantError(f"{path}: no such file: give the path of an FMU archive (.fmu)") from None
    except OSError as error:
        raise PlantError(f"{path}: cannot read it ({error.strerror}): give the path of an FMU archive (.fmu)") from None
    key = hashlib.sha256(f"{LAYOUT} {platform_fmi3()} ".encode() + content).hexdigest()[:16]
    home = kept((cache or cache_folder()) / "unpacked" / f"{path.stem}-{key}", partial(_unpack, path=path))
    found = msgspec.json.decode((home / "description.json").read_bytes(), type=PlantDescription)
    return msgspec.structs.replace(found, file=str(path), binary=str(home / found.binary),
                                   resources=str(home / found.resources))


def _unpack(draft: Path, path: Path) -> None:
    unpack(path, draft / "fmu")
    description = _read(draft, path)
    (draft / "description.json").write_bytes(msgspec.json.encode(description))


def _read(draft: Path, path: Path) -> PlantDescription:
    import fmpy

    text = (draft / "fmu" / DESCRIPTION).read_bytes()
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise PlantError(f"{path}: {DESCRIPTION} declares a document type: an FMU needs none, and entities are not "
                         "expanded; export it again")
    try:
        root = ElementTree.fromstring(text)
        _require_model(root)
        xml = fmpy.read_model_description(str(draft / "fmu"), validate=False)
        bounds = _bounds(root)
    except Exception as error:      # FMPy raises errors of any type for bad XML
        raise PlantError(f"{path}: {DESCRIPTION} cannot be read: {one_line(error)}: export it again") from error
    if xml.fmiVersion != "2.0" and not xml.fmiVersion.startswith("3."):
        raise PlantError(f"{path}: is FMI {shown(xml.fmiVersion)}: only FMI 2.0 and 3.0 can be loaded; export it again")
    fmi: Literal["2.0", "3.0"] = "2.0" if xml.fmiVersion == "2.0" else "3.0"
    slave = xml.coSimulation
    if slave is None:
        offered = [name for name, there in (("model exchange", xml.modelExchange),
                                            ("scheduled execution", getattr(xml, "scheduledExecution", None))) if there]
        raise PlantError(f"{path}: offers {' and '.join(offered) or 'nothing'}, not co-simulation: "
                         "export it again as a co-simulation FMU")
    variable_step = _true(slave.canHandleVariableCommunicationStepSize)
    try:
        variables = _variables(xml.modelVariables, bounds)
        terminals, problem = bus_terminals(draft / "fmu", variables) if fmi == "3.0" else ((), "")
        return PlantDescription(
            file=path.name,
            fmi=fmi,
            model_name=xml.modelName or "",
            about=xml.description or "",
            token=xml.guid or "",
            binary=_binary(draft, path, fmi, slave.modelIdentifier),
            resources="fmu/resources",
            variable_step=variable_step,
            fixed_step_s=_fixed_step_s(xml, variable_step),
            once_per_process=_true(slave.canBeInstantiatedOnlyOncePerProcess),
            ours=xml.generationTool == TOOL,
            saves_state=_true(slave.canGetAndSetFMUstate) and _true(slave.canSerializeFMUstate),
            log_formatter=_log_formatter() if fmi == "2.0" else None,
            variables=variables,
            event_mode=fmi == "3.0" and _true(slave.hasEventMode),
            bus_terminals=terminals,
            bus_terminals_problem=problem,
        )
    except ValueError as error:
        raise PlantError(f"{path}: {DESCRIPTION}: {one_line(error)}: export it again") from None


class _Bounds(msgspec.Struct, frozen=True):
    """Attributes of a variable that FMPy does not read."""

    min: str | None
    max: str | None
    most_bytes: str | None
    mime_type: str = ""
    clock: Clock | None = None
    clocks: tuple[int, ...] = ()


def _require_model(root: ElementTree.Element) -> None:
    if root.tag != "fmiModelDescription":
        raise ValueError(f"its root is {shown(root.tag)}, expected fmiModelDescription")
    if not root.get("fmiVersion"):
        raise ValueError("it names no fmiVersion")


def _bounds(root: ElementTree.Element) -> dict[str, _Bounds]:
    """Return the bounds by the variable's name and, of declared types, by `type NAME`."""
    found: dict[str, _Bounds] = {}
    for tag, prefix in (("TypeDefinitions", "type "), ("ModelVariables", "")):
        for element in root.iterfind(f"{tag}/*"):
            typed = next(iter(element), element) if element.tag in ("SimpleType", "ScalarVariable") else element
            found[prefix + element.get("name", "")] = _Bounds(
                typed.get("min"), typed.get("max"), typed.get("maxSize"), typed.get("mimeType", ""),
                _clock(element) if element.tag == "Clock" else None,
                tuple(int(text) for text in element.get("clocks", "").split()))
    return found


def _clock(element: ElementTree.Element) -> Clock:
    """Return the attributes of a clock; raises ValueError for one that is no number."""
    fraction = _true(element.get("supportsFraction", "false"))

    def seconds(decimal: str, counter: str) -> tuple[int, int] | None:
        if fraction and counter in element.attrib:
            value = Fraction(int(element.attrib[counter]), int(element.get("resolution", "0")) or 1)
        elif decimal in element.attrib:
            value = Fraction(element.attrib[decimal])
        else:
            return None
        return value.numerator, value.denominator

    return Clock(element.get("intervalVariability", ""), seconds("intervalDecimal", "intervalCounter"),
                 seconds("shiftDecimal", "shiftCounter") or (0, 1), fraction)


def _variables(found: list[Any], bounds: Mapping[str, _Bounds]) -> dict[str, Variable]:
    names = {v.valueReference: v.name for v in reversed(found)}
    variables: dict[str, Variable] = {}
    for v in found:
        if v.name in variables:
            raise ValueError(f"variable {shown(v.name)} appears twice: names are unique")
        if not 0 <= v.valueReference < 2**32:
            raise ValueError(f"variable {shown(v.name)}: valueReference={v.valueReference}: expected 0 to 2^32 - 1")
        variables[v.name] = _variable(v, names, bounds)
    return variables


def _variable(v: Any, names: Mapping[int, str], bounds: Mapping[str, _Bounds]) -> Variable:
    declared = v.declaredType
    own = bounds.get(v.name) or _Bounds(None, None, None)
    of_type = (bounds.get(f"type {declared.name}") if declared is not None else None) or _Bounds(None, None, None)
    items = {item.name: int(item.value) for item in declared.items or ()} if declared is not None else {}
    bounded = v.type != "Enumeration"       # the items of an enumeration are its range
    shape = tuple(v.shape or ())
    if any(extent < 0 for extent in shape):
        raise ValueError(f"variable {shown(v.name)}: its extents are {list(shape)}: expected none below 0")
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        variability=v.variability,
        initial=v.initial,
        unit=v.unit or (declared.unit if declared is not None else None),
        start=v.start,
        about=v.description or "",
        elements=math.prod(shape),
        min=_finite(own.min or of_type.min) if bounded else None,
        max=_finite(own.max or of_type.max) if bounded else None,
        shape=shape,
        sizes=tuple("" if dimension.start is not None else names[dimension.valueReference]
                    for dimension in v.dimensions or ()),
        items=items,
        most_bytes=int(text) if (text := own.most_bytes or of_type.most_bytes) and text.isdigit() else None,
        mime_type=own.mime_type or of_type.mime_type,
        clock=own.clock,
        clocks=own.clocks,
    )


def _finite(text: str | None) -> float | None:
    """Return the number written in the XML; None if it is absent, no number or not finite."""
    try:
        value = float(text or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _binary(draft: Path, path: Path, fmi: str, identifier: str | None) -> str:
    if not re.fullmatch(r"[A-Za-z_][\w.-]*", identifier or "", re.ASCII):
        raise PlantError(f"{path}: modelIdentifier={shown(identifier or '')!r} would name a binary outside the archive "
                         "or none: expected letters, digits and _, as a C identifier; export it again")
    platform = platform_fmi3() if fmi == "3.0" else platform_fmi2()
    binary = f"fmu/binaries/{platform}/{identifier}{library_suffix()}"
    if (draft / binary).is_file():
        return binary
    there = sorted(shown(folder.name) for folder in (draft / "fmu" / "binaries").glob("*")
                   if folder.is_dir() and any(folder.iterdir()))
    has = f"has binaries for {', '.join(there)}" if there else "has no binaries"
    if platform in there:
        raise PlantError(f"{path}: binaries/{platform} holds no {identifier}{library_suffix()}: "
                         "the archive does not match its modelIdentifier; export it again")
    raise PlantError(f"{path}: no binary for this platform, {platform}: it {has}"
                     f"{' and sources' if (draft / 'fmu' / 'sources').is_dir() else ''}; export it for {platform}")


def _fixed_step_s(xml: Any, variable_step: bool) -> float | None:
    """Return the step [s] of which communication points have to be multiples; None if any step will do.

    FMI 3.0 requires multiples of `fixedInternalStepSize` even if the communication step of the FMU may vary."""
    named = getattr(xml.coSimulation, "fixedInternalStepSize", None)
    if named is None and not variable_step and xml.defaultExperiment is not None:
        named = xml.defaultExperiment.stepSize
    step_s = _finite(None if named is None else str(named))
    if step_s is None or step_s <= 0:
        return None
    if Fraction(repr(step_s)) < Fraction(1, 10**9):
        raise ValueError(f"its step is {step_s} s: expected at least 1 ns, the resolution of simulated time")
    return step_s


def _log_formatter() -> str | None:
    """Return the path of FMPy's library that expands FMI 2.0 messages, None if it is missing.

    Such a message is a printf format with variadic arguments, which ctypes cannot read."""
    import fmpy

    library = Path(fmpy.__file__).parent / "logging" / fmpy.platform / f"logging{fmpy.sharedLibraryExtension}"
    return str(library) if library.is_file() else None


def _true(flag: Any) -> bool:
    return flag is True or str(flag).lower() in ("true", "1")
