"""Unpacks any FMI 2.0 or 3.0 co-simulation FMU and reads its description with FMPy.

The result is kept by the content of the archive, so a second look neither unpacks nor imports FMPy.
"""

from __future__ import annotations

import hashlib
import math
import zipfile
import zlib
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec

from fmus.cache import cache_folder, kept
from fmus.describe import TOOL
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantError
from fmus.platform_names import library_suffix, platform_fmi2, platform_fmi3

LAYOUT = 4              # counts changes of what is kept


def describe(path: str | Path, cache: Path | None = None) -> PlantDescription:
    """Description of the FMU at `path`; raises PlantError if it cannot be used on this machine."""
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
    try:
        with zipfile.ZipFile(path) as archive:
            if "modelDescription.xml" not in archive.namelist():
                raise PlantError(f"{path}: holds no modelDescription.xml: it is a zip archive but not an FMU")
            archive.extractall(draft / "fmu")
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
        raise PlantError(f"{path}: not a whole zip archive ({error}): it may be truncated; fetch or build it again") \
            from None
    description = _read(draft, path)
    (draft / "description.json").write_bytes(msgspec.json.encode(description))


def _read(draft: Path, path: Path) -> PlantDescription:
    import fmpy

    try:
        xml = fmpy.read_model_description(str(draft / "fmu"), validate=False)
    except Exception as error:      # FMPy raises whatever the XML makes it stumble over
        raise PlantError(f"{path}: modelDescription.xml cannot be read: {error}") from error
    if xml.fmiVersion != "2.0" and not xml.fmiVersion.startswith("3."):
        raise PlantError(f"{path}: is FMI {xml.fmiVersion}: only FMI 2.0 and 3.0 can be loaded; export it again")
    fmi: Literal["2.0", "3.0"] = "2.0" if xml.fmiVersion == "2.0" else "3.0"
    slave = xml.coSimulation
    if slave is None:
        offered = [name for name, there in (("model exchange", xml.modelExchange),
                                            ("scheduled execution", getattr(xml, "scheduledExecution", None))) if there]
        raise PlantError(f"{path}: offers {' and '.join(offered) or 'nothing'}, not co-simulation: "
                         "export it again as a co-simulation FMU")
    variable_step = _true(slave.canHandleVariableCommunicationStepSize)
    return PlantDescription(
        file=path.name,
        fmi=fmi,
        model_name=xml.modelName,
        about=xml.description or "",
        token=xml.guid or "",
        binary=_binary(draft, path, fmi, slave.modelIdentifier),
        resources="fmu/resources",
        variable_step=variable_step,
        fixed_step_s=None if variable_step else _fixed_step_s(xml),
        once_per_process=_true(slave.canBeInstantiatedOnlyOncePerProcess),
        ours=xml.generationTool == TOOL,
        log_formatter=_log_formatter() if fmi == "2.0" else None,
        variables={v.name: _variable(v) for v in xml.modelVariables},
    )


def _variable(v: Any) -> Variable:
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        variability=v.variability,
        initial=v.initial,
        unit=v.unit or (v.declaredType.unit if v.declaredType is not None else None),
        start=v.start,
        about=v.description or "",
        elements=math.prod(v.shape or ()),
        min=_finite(v.min),
        max=_finite(v.max),
    )


def _finite(text: str | None) -> float | None:
    """A bound of the description; one that is no finite number bounds nothing."""
    try:
        value = float(text or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _binary(draft: Path, path: Path, fmi: str, identifier: str) -> str:
    platform = platform_fmi3() if fmi == "3.0" else platform_fmi2()
    binary = f"fmu/binaries/{platform}/{identifier}{library_suffix()}"
    if (draft / binary).is_file():
        return binary
    there = sorted(folder.name for folder in (draft / "fmu" / "binaries").glob("*") if any(folder.iterdir()))
    has = f"has binaries for {', '.join(there)}" if there else "has no binaries"
    if platform in there:
        raise PlantError(f"{path}: binaries/{platform} holds no {identifier}{library_suffix()}: "
                         "the archive does not match its modelIdentifier; export it again")
    raise PlantError(f"{path}: no binary for this platform, {platform}: it {has}"
                     f"{' and sources' if (draft / 'fmu' / 'sources').is_dir() else ''}; export it for {platform}")


def _fixed_step_s(xml: Any) -> float | None:
    named = getattr(xml.coSimulation, "fixedInternalStepSize", None)
    if named is None and xml.defaultExperiment is not None:
        named = xml.defaultExperiment.stepSize
    return float(named) if named is not None and float(named) > 0 else None


def _log_formatter() -> str | None:
    """Messages of FMI 2.0 are printf formats with arguments, which Python cannot take apart; FMPy ships C that does."""
    import fmpy

    library = Path(fmpy.__file__).parent / "logging" / fmpy.platform / f"logging{fmpy.sharedLibraryExtension}"
    return str(library) if library.is_file() else None


def _true(flag: Any) -> bool:
    return flag is True or str(flag).lower() in ("true", "1")
