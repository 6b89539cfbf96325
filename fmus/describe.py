"""From variables.toml to variables.h and modelDescription.xml of FMI 3.0 and 2.0: the same rows in the same order.

A row is one variable with `name`, `kind` (input, output, parameter), `unit` and `about`; `size = [rows, columns]` makes
it an array whose elements are the scalar variables `A[1,1]`, `A[1,2]`, ...; `start` is one number for all elements or
one each. An output with a start value is a state that may be set before the first step; one without is computed by the
model. `min` and `max`, both allowed values themselves, bound the start values of all elements. The position of a scalar
is its value reference. All variables are 64-bit floating point numbers.

Not covered: integers, strings, clocks, tunable parameters, display units.
"""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
import uuid
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from fmus.bounds import outside
from fmus.errors import PlantError
from fmus.units import base_units

KINDS = ("input", "output", "parameter")
FUNCTIONS = ("start", "outputs")


@dataclass(frozen=True)
class Scalar:
    """One FMI variable; its place in the model's list is its value reference."""

    name: str
    kind: str
    unit: str
    start: float | None
    about: str
    min: float | None = None
    max: float | None = None

    @property
    def computed(self) -> bool:
        return self.start is None


@dataclass(frozen=True)
class Row:
    """One row of variables.toml, one member of the C struct `Values`."""

    name: str
    kind: str
    unit: str
    about: str
    size: tuple[int, ...]
    starts: tuple[float, ...] | None
    min: float | None = None
    max: float | None = None

    def scalars(self) -> list[Scalar]:
        indices = list(product(*(range(1, extent + 1) for extent in self.size)))
        names = [self.name + (f"[{','.join(map(str, index))}]" if index else "") for index in indices]
        starts = self.starts or (None,) * len(names)
        return [Scalar(name, self.kind, self.unit, start, self.about, self.min, self.max)
                for name, start in zip(names, starts, strict=True)]


@dataclass(frozen=True)
class Model:
    """What variables.toml says."""

    name: str
    description: str
    rows: tuple[Row, ...]
    functions: tuple[str, ...]      # beyond model_step
    memory: str | None              # header with a struct `Memory` that each instance keeps

    def scalars(self) -> list[Scalar]:
        return [scalar for row in self.rows for scalar in row.scalars()]


def read_model(file: Path) -> Model:
    """Read and check variables.toml; a PlantError lists everything that is wrong with it."""
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise PlantError(f"{file}: no such file: a model is a folder with variables.toml and model.c") from None
    except tomllib.TOMLDecodeError as error:
        raise PlantError(f"{file}: not valid TOML: {error}") from None
    problems: list[str] = []
    name = table.get("model")
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z_]\w*", name):
        problems.append(f"model={name!r}: expected a C identifier")
    functions = table.get("functions", [])
    problems += [f"functions: {each!r}: expected one of {', '.join(FUNCTIONS)}"
                 for each in functions if each not in FUNCTIONS]
    rows = [_row(place, row, problems) for place, row in enumerate(table.get("variable", []))]
    names = [row.name for row in rows]
    problems += [f"variable {each!r} appears twice: names are unique" for each in set(names) if names.count(each) > 1]
    if not rows:
        problems.append("variable: expected at least one row")
    if any(row.kind == "output" and row.starts is None for row in rows) and "outputs" not in functions:
        problems.append('an output without start is computed by the model: give it a start or functions = ["outputs"]')
    if problems:
        raise PlantError("\n".join(f"{file}: {problem}" for problem in problems))
    return Model(str(name), table.get("description", ""), tuple(rows), tuple(functions), table.get("memory"))


def _row(place: int, row: dict[str, Any], problems: list[str]) -> Row:
    where = f"variable[{place}]"
    size = tuple(row.get("size", []))
    count = math.prod(size)
    start = row.get("start")
    if not re.fullmatch(r"[A-Za-z_]\w*", row.get("name", "")):
        problems.append(f"{where}.name={row.get('name')!r}: expected a C identifier")
    if row.get("kind") not in KINDS:
        problems.append(f"{where}.kind={row.get('kind')!r}: expected one of {', '.join(KINDS)}")
    try:
        base_units(str(row.get("unit")))
    except ValueError as error:
        problems.append(f"{where}.unit={row.get('unit')!r}: {error}")
    if not row.get("about"):
        problems.append(f"{where}.about: say in a few words what it is")
    if len(size) > 2 or any(not isinstance(extent, int) or extent < 1 for extent in size):
        problems.append(f"{where}.size={list(size)}: expected one or two positive integers")
        size, count = (), 1
    if start is None and row.get("kind") != "output":
        problems.append(f"{where}.start: inputs and parameters need one")
    if isinstance(start, list) and len(start) != count:
        problems.append(f"{where}.start: {len(start)} numbers for {count} elements")
        start = 0.0
    if unknown := set(row) - {"name", "kind", "unit", "about", "size", "start", "min", "max"}:
        problems.append(f"{where}: unknown keys {', '.join(sorted(unknown))}")
    starts = None if start is None else tuple(map(float, start)) if isinstance(start, list) else (float(start),) * count
    low, high = _bound(f"{where}.min", row.get("min"), problems), _bound(f"{where}.max", row.get("max"), problems)
    for value in starts or ():
        if problem := outside(value, low, high):
            problems.append(f"{where}.start={value:g}: {problem}")
    return Row(row.get("name", ""), row.get("kind", ""), row.get("unit", ""), row.get("about", ""), size, starts, low,
               high)


def _bound(where: str, value: Any, problems: list[str]) -> float | None:
    if value is None or (isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)):
        return None if value is None else float(value)
    problems.append(f"{where}={value!r}: expected a finite number")
    return None


def token_of(sources: dict[str, bytes]) -> str:
    """GUID or instantiation token: the same sources give the same one, on any machine."""
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(f"{name}\0{len(sources[name])}\0".encode() + sources[name])
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"


def header(model: Model, token: str) -> str:
    """variables.h: the struct `Values` and the tables of it that fmi/instance.c reads."""
    scalars = model.scalars()
    kinds = "".join("c" if s.computed else s.kind[0] for s in scalars)
    fields = "".join(f"    double {row.name}{''.join(f'[{extent}]' for extent in row.size)};"
                     f" /* [{row.unit}] {row.about} */\n" for row in model.rows)
    return (f"/* Generated from variables.toml of {model.name} by fmus/describe.py. */\n"
            "#pragma once\n"
            + (f'#include "{model.memory}"\n' if model.memory else "")
            + "".join(f"#define MODEL_HAS_{function.upper()}\n" for function in model.functions)
            + f'#define MODEL_TOKEN "{token}"\n'
            f"#define VALUES_COUNT {len(scalars)}\n"
            f"#define VALUES_START {{ {', '.join(repr(s.start or 0.0) for s in scalars)} }}\n"
            f'#define VALUES_KIND "{kinds}"\n'
            "#define VALUES_NAME { " + ", ".join(f'"{s.name}"' for s in scalars) + " }\n"
            f"typedef struct {{\n{fields}" + ("    Memory memory;\n" if model.memory else "") + "} Values;\n")


def _units(model: Model) -> str:
    used = sorted({row.unit for row in model.rows})
    exponents = {unit: "".join(f' {base}="{exponent}"' for base, exponent in base_units(unit).items()) for unit in used}
    units = "".join(f"    <Unit name={_quoted(unit)}><BaseUnit{exponents[unit]}/></Unit>\n" for unit in used)
    return f"  <UnitDefinitions>\n{units}  </UnitDefinitions>\n"


LOG_CATEGORIES = """  <LogCategories>
    <Category name="logStatusError" description="Why a call was refused or failed"/>
  </LogCategories>
"""
TOOL = "marconet"
ORIGIN = f'generationTool="{TOOL}" variableNamingConvention="structured"'


def _attributes(scalar: Scalar) -> str:
    variability = "fixed" if scalar.kind == "parameter" else "continuous"
    initial = {"input": "", "parameter": ' initial="exact"'}.get(
        scalar.kind, ' initial="calculated"' if scalar.computed else ' initial="exact"')
    return f'causality="{scalar.kind}" variability="{variability}"{initial}'


def _value(scalar: Scalar) -> str:
    numbers = (("min", scalar.min), ("max", scalar.max), ("start", scalar.start))
    return f"unit={_quoted(scalar.unit)}" + "".join(f' {key}="{value!r}"' for key, value in numbers
                                                      if value is not None)


def description_fmi3(model: Model, token: str) -> str:
    """modelDescription.xml of FMI 3.0; the time takes the value reference after the last variable."""
    scalars = model.scalars()
    variables = "".join(
        f'    <Float64 name="{s.name}" valueReference="{i}" description={_quoted(s.about)} {_attributes(s)} '
        f"{_value(s)}/>\n" for i, s in enumerate(scalars))
    outputs = [i for i, s in enumerate(scalars) if s.kind == "output"]
    structure = "".join(f'    <Output valueReference="{i}"/>\n' for i in outputs)
    structure += "".join(f'    <InitialUnknown valueReference="{i}"/>\n' for i in outputs if scalars[i].computed)
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n'
            f'<fmiModelDescription fmiVersion="3.0" modelName="{model.name}" instantiationToken="{token}" '
            f"description={_quoted(model.description)} {ORIGIN}>\n"
            f'  <CoSimulation modelIdentifier="{model.name}" canHandleVariableCommunicationStepSize="true" '
            f'canGetAndSetFMUState="true" canSerializeFMUState="true"/>\n'
            f"{_units(model)}{LOG_CATEGORIES}"
            f"  <ModelVariables>\n{variables}"
            f'    <Float64 name="time" valueReference="{len(scalars)}" causality="independent" '
            f'variability="continuous" description="simulation time"/>\n'
            f"  </ModelVariables>\n  <ModelStructure>\n{structure}  </ModelStructure>\n</fmiModelDescription>\n")


def description_fmi2(model: Model, token: str, source_files: list[str]) -> str:
    """modelDescription.xml of FMI 2.0."""
    scalars = model.scalars()
    variables = "".join(
        f'    <ScalarVariable name="{s.name}" valueReference="{i}" description={_quoted(s.about)} {_attributes(s)}>'
        f"<Real {_value(s)}/></ScalarVariable>\n" for i, s in enumerate(scalars))
    outputs = [i for i, s in enumerate(scalars) if s.kind == "output"]
    unknown = [i for i in outputs if scalars[i].computed]

    def block(tag: str, references: list[int]) -> str:
        rows = "".join(f'      <Unknown index="{i + 1}"/>\n' for i in references)
        return f"    <{tag}>\n{rows}    </{tag}>\n" if references else ""

    files = "".join(f'      <File name="{name}"/>\n' for name in source_files)
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n'
            f'<fmiModelDescription fmiVersion="2.0" modelName="{model.name}" guid="{token}" '
            f"description={_quoted(model.description)} {ORIGIN}>\n"
            f'  <CoSimulation modelIdentifier="{model.name}" canHandleVariableCommunicationStepSize="true" '
            f'canGetAndSetFMUstate="true" canSerializeFMUstate="true" canNotUseMemoryManagementFunctions="true">\n'
            f"    <SourceFiles>\n{files}    </SourceFiles>\n  </CoSimulation>\n"
            f"{_units(model)}{LOG_CATEGORIES}"
            f"  <ModelVariables>\n{variables}  </ModelVariables>\n"
            f"  <ModelStructure>\n{block('Outputs', outputs)}{block('InitialUnknowns', unknown)}"
            f"  </ModelStructure>\n</fmiModelDescription>\n")


def build_description(model: Model, source_files: list[str]) -> str:
    """sources/buildDescription.xml of FMI 3.0: how to build the binary from the sources in the archive."""
    files = "".join(f'      <SourceFile name="{name}"/>\n' for name in source_files)
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
            f'  <BuildConfiguration modelIdentifier="{model.name}">\n'
            f'    <SourceFileSet language="C99">\n{files}    </SourceFileSet>\n'
            f"  </BuildConfiguration>\n</fmiBuildDescription>\n")


def _quoted(text: str) -> str:
    """`text` as an XML attribute's value with its quotes."""
    from xml.sax.saxutils import quoteattr  # late: it brings urllib, and reading variables.toml needs no XML

    return quoteattr(text)
