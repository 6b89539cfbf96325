"""Generates variables.h and modelDescription.xml of FMI 3.0 and 2.0 from variables.toml: same rows, same order.

A row is one variable with `name`, `kind` (input, output, parameter), `unit` and `about`. `size = [rows, columns]` makes
the row an array whose elements are the scalar variables `A[1,1]`, `A[1,2]`, ...; `start` is one number for all elements
or a list with one number each. An output with a start value is a state that may be set before the first step; the model
computes an output without. `min` and `max`, themselves allowed, bound the start values of all elements. `filled_by` of
an output names parameters: elements of the output beyond the last row in which one of these has a start value other
than 0 stay 0 and are not recorded. The position of a scalar is its value reference. All variables are 64-bit floating
point numbers.

Not covered: integers, strings, clocks, display units.
"""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.bounds import outside
from fmus.description import Variable, element_names
from fmus.errors import PlantError
from fmus.parameters import Nested, expand_parameters
from fmus.units import base_units

KINDS = ("input", "output", "parameter")
FUNCTIONS = ("start", "outputs")
MOST_SCALARS = 100_000
C_WORDS = frozenset((           # reserved words, which cannot name a member of a struct
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern", "float",
    "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed", "sizeof",
    "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while", "memory"))


@dataclass(frozen=True)
class Scalar:
    """One FMI variable; its index in `Model.scalars()` is its value reference."""

    name: str
    kind: str
    unit: str
    start: float | None
    about: str
    min: float | None = None
    max: float | None = None
    tunable: bool = False

    @property
    def computed(self) -> bool:
        return self.start is None

    @property
    def variability(self) -> str:
        return "continuous" if self.kind != "parameter" else "tunable" if self.tunable else "fixed"


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
    filled_by: tuple[str, ...] = ()
    tunable: bool = False

    def scalars(self) -> list[Scalar]:
        names = element_names(self.name, self.size)
        starts = self.starts or (None,) * len(names)
        return [Scalar(name, self.kind, self.unit, start, self.about, self.min, self.max, self.tunable)
                for name, start in zip(names, starts, strict=True)]


@dataclass(frozen=True)
class Model:
    """The content of one variables.toml."""

    name: str
    description: str
    rows: tuple[Row, ...]
    functions: tuple[str, ...]      # functions that model.c defines besides model_step: start, outputs
    memory: str | None              # header that defines the struct `Memory`, of which each instance holds one

    def scalars(self) -> list[Scalar]:
        return [scalar for row in self.rows for scalar in row.scalars()]

    def idle_outputs(self, start: Mapping[str, Nested]) -> list[str]:
        """Return the names of the output elements that stay 0 with the start values `start`, by `filled_by`."""
        values = {scalar.name: scalar.start for scalar in self.scalars()} | expand_parameters(start)
        last: dict[str, int] = {}
        for name, value in values.items():
            base, _, index = name.partition("[")
            if index and value:
                last[base] = max(last.get(base, 0), _first(index))
        return [scalar.name for row in self.rows if row.filled_by for scalar in row.scalars()
                if _first(scalar.name.partition("[")[2]) > max(1, *(last.get(base, 0) for base in row.filled_by))]


def _first(index: str) -> int:
    """Return the row, counted from 1, of the rest of a name after `[`: 2 for `2,1]`."""
    return int(index.rstrip("]").partition(",")[0])


def read_model(file: Path) -> Model:
    """Read and check variables.toml; raises one PlantError with a line for each problem."""
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise PlantError(f"{file}: no such file: a model is a folder with variables.toml and model.c") from None
    except OSError as error:
        raise PlantError(f"{file}: cannot read it ({error.strerror}): a model's table is a text file") from None
    except (ValueError, RecursionError) as error:       # bad TOML, bad UTF-8, or a number too long
        raise PlantError(f"{file}: not valid TOML: {' '.join(str(error).split())[:200]}") from None
    problems: list[str] = []
    name = table.get("model")
    if not _identifier(name):
        problems.append(f"model={_shown(name)}: expected a C identifier")
    if unknown := set(table) - {"model", "description", "functions", "memory", "variable"}:
        problems.append(f"unknown keys {', '.join(map(_shown, sorted(unknown)))}")
    description, memory = table.get("description", ""), table.get("memory")
    if not _plain_text(description):
        problems.append(f"description={_shown(description)}: expected text on one line, without */")
    if memory is not None and not (isinstance(memory, str) and re.fullmatch(r"\w+\.h", memory, re.ASCII)):
        problems.append(f"memory={_shown(memory)}: expected the name of a header in the model's folder")
    functions = table.get("functions", [])
    if not isinstance(functions, list):
        problems.append(f"functions={_shown(functions)}: expected a list")
        functions = []
    problems += [f"functions: {_shown(each)}: expected one of {', '.join(FUNCTIONS)}"
                 for each in functions if each not in FUNCTIONS]
    written = table.get("variable", [])
    if not isinstance(written, list) or not all(isinstance(row, dict) for row in written):
        problems.append("variable: expected a list of tables, one for each variable")
        written = []
    rows = [_row(place, row, problems) for place, row in enumerate(written)]
    names = [row.name for row in rows]
    problems += [f"variable {each!r} appears twice: names are unique"
                 for each in sorted(set(names)) if names.count(each) > 1]
    if not rows:
        problems.append("variable: expected at least one row")
    if sum(math.prod(row.size) for row in rows) > MOST_SCALARS:
        problems.append(f"variable: expected at most {MOST_SCALARS} elements in all")
    if any(row.kind == "output" and row.starts is None for row in rows) and "outputs" not in functions:
        problems.append('an output without start is computed by the model: give it a start or functions = ["outputs"]')
    if problems:
        raise PlantError("\n".join(f"{file}: {problem}" for problem in problems))
    return Model(str(name), description, tuple(rows), tuple(functions), memory)


def _identifier(name: Any) -> bool:
    return isinstance(name, str) and name not in C_WORDS and bool(re.fullmatch(r"[A-Za-z_]\w{0,99}", name, re.ASCII))


def _plain_text(text: Any) -> bool:
    """Return whether `text` can be a comment in C and an attribute in XML."""
    return isinstance(text, str) and "*/" not in text and (not text or text.isprintable())


def _number(value: Any) -> bool:
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _row(place: int, row: dict[str, Any], problems: list[str]) -> Row:
    where = f"variable[{place}]"
    name, kind, unit, about = (row.get(key) for key in ("name", "kind", "unit", "about"))
    if not _identifier(name):
        problems.append(f"{where}.name={_shown(name)}: expected a C identifier")
    if kind not in KINDS:
        problems.append(f"{where}.kind={_shown(kind)}: expected one of {', '.join(KINDS)}")
    try:
        base_units(unit if isinstance(unit, str) else str(unit))
    except ValueError as error:
        problems.append(f"{where}.unit={_shown(unit)}: {' '.join(str(error).split())}")
    if not about or not _plain_text(about):
        problems.append(f"{where}.about={_shown(about)}: say in a few words on one line what it is, without */")
    if unknown := set(row) - {"name", "kind", "unit", "about", "size", "start", "min", "max", "filled_by", "tunable"}:
        problems.append(f"{where}: unknown keys {', '.join(map(_shown, sorted(unknown)))}")
    size = row.get("size", [])
    if not isinstance(size, list) or len(size) > 2 or not all(type(extent) is int and 0 < extent <= MOST_SCALARS
                                                              for extent in size):
        problems.append(f"{where}.size={_shown(size)}: expected one or two positive integers")
        size = []
    low, high = _bound(f"{where}.min", row.get("min"), problems), _bound(f"{where}.max", row.get("max"), problems)
    starts = _starts(where, row.get("start"), kind, math.prod(size), problems)
    for value in dict.fromkeys(starts or ()):
        if problem := outside(value, low, high):
            problems.append(f"{where}.start={value:g}: {problem}")
    filled_by = row.get("filled_by", [])
    if not isinstance(filled_by, list) or not all(isinstance(each, str) for each in filled_by) or \
            (filled_by and (kind != "output" or not size)):
        problems.append(f"{where}.filled_by={_shown(filled_by)}: expected names of parameters, at an output with a "
                        "size")
        filled_by = []
    tunable = row.get("tunable", False)
    if not isinstance(tunable, bool) or (tunable and kind != "parameter"):
        problems.append(f"{where}.tunable={_shown(tunable)}: expected true or false, true at a parameter only")
        tunable = False
    return Row(str(name), str(kind), str(unit), str(about), tuple(size), starts, low, high, tuple(filled_by), tunable)


def _starts(where: str, start: Any, kind: Any, count: int, problems: list[str]) -> tuple[float, ...] | None:
    """Return one start value for each of `count` elements; None if `start` is absent or wrong (a problem is noted)."""
    if start is None:
        if kind != "output":
            problems.append(f"{where}.start: inputs and parameters need one")
        return None
    values = start if isinstance(start, list) else [start]
    if not all(map(_number, values)):
        problems.append(f"{where}.start={_shown(start)}: expected a finite number, or a list of them")
        return None if kind == "output" else (0.0,)
    if isinstance(start, list):
        if len(start) != count:
            problems.append(f"{where}.start: {len(start)} numbers for {count} elements")
        return tuple(map(float, start))
    return (float(start),) * min(count, MOST_SCALARS)


def _bound(where: str, value: Any, problems: list[str]) -> float | None:
    if value is None or _number(value):
        return None if value is None else float(value)
    problems.append(f"{where}={_shown(value)}: expected a finite number")
    return None


def variables_of(model: Model) -> dict[str, Variable]:
    """Return the variables, by name, that the description of the model's FMU will declare, without building the FMU."""
    return {scalar.name: Variable(
        name=scalar.name, reference=reference, type="Float64", causality=scalar.kind,
        variability=scalar.variability,
        initial="calculated" if scalar.computed else "exact", unit=scalar.unit,
        start=None if scalar.start is None else repr(scalar.start), about=scalar.about, min=scalar.min, max=scalar.max)
        for reference, scalar in enumerate(model.scalars())}


def token_of(sources: dict[str, bytes]) -> str:
    """Return the GUID (FMI 2.0) and instantiation token (3.0): a digest of the sources, the same on any machine."""
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(f"{name}\0{len(sources[name])}\0".encode() + sources[name])
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"


def header(model: Model, token: str) -> str:
    """Return variables.h: the struct `Values`, and the tables about its members that fmi/instance.c reads."""
    scalars = model.scalars()
    kinds = "".join("c" if s.computed else "t" if s.tunable else s.kind[0] for s in scalars)
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
    initial = {"input": "", "parameter": ' initial="exact"'}.get(
        scalar.kind, ' initial="calculated"' if scalar.computed else ' initial="exact"')
    return f'causality="{scalar.kind}" variability="{scalar.variability}"{initial}'


def _value(scalar: Scalar) -> str:
    numbers = (("min", scalar.min), ("max", scalar.max), ("start", scalar.start))
    return f"unit={_quoted(scalar.unit)}" + "".join(f' {key}="{value!r}"' for key, value in numbers
                                                      if value is not None)


def description_fmi3(model: Model, token: str) -> str:
    """Return modelDescription.xml of FMI 3.0; time has the value reference after that of the last variable."""
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
    """Return modelDescription.xml of FMI 2.0."""
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
    """Return sources/buildDescription.xml of FMI 3.0, which says how to build the binary from the archive's sources."""
    files = "".join(f'      <SourceFile name="{name}"/>\n' for name in source_files)
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
            f'  <BuildConfiguration modelIdentifier="{model.name}">\n'
            f'    <SourceFileSet language="C99">\n{files}    </SourceFileSet>\n'
            f"  </BuildConfiguration>\n</fmiBuildDescription>\n")


def _quoted(text: str) -> str:
    """Return `text` as the value of an XML attribute, with its quotes."""
    from xml.sax.saxutils import quoteattr  # here: it imports urllib, which reading variables.toml does not need

    return quoteattr(text)
