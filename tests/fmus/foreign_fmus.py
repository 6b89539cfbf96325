"""FMUs as tools export them, made from C and XML that share nothing with fmus/fmi: one of each type and step rule."""

from __future__ import annotations

import zipfile
from functools import cache
from pathlib import Path

from fmus.build import compile_library
from fmus.platform_names import library_suffix, platform_fmi2, platform_fmi3

FOREIGN = Path(__file__).parent / "foreign"

TYPES_FMI3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Types" instantiationToken="types">
  <CoSimulation modelIdentifier="types" canHandleVariableCommunicationStepSize="true"/>
  <TypeDefinitions>
    <EnumerationType name="Mode"><Item name="off" value="1"/><Item name="slow" value="2"/>
      <Item name="far" value="-7000000000"/></EnumerationType>
    <Float64Type name="Share" min="0" max="1"/>
  </TypeDefinitions>
  <ModelVariables>
    <Float32 name="f32" valueReference="0" causality="parameter" variability="fixed" start="0"/>
    <Float64 name="f64" valueReference="1" causality="parameter" variability="fixed" declaredType="Share" start="0"/>
    <Int8 name="i8" valueReference="2" causality="parameter" variability="fixed" start="0"/>
    <UInt8 name="u8" valueReference="3" causality="parameter" variability="fixed" start="0" max="200"/>
    <Int16 name="i16" valueReference="4" causality="parameter" variability="fixed" start="0"/>
    <UInt16 name="u16" valueReference="5" causality="parameter" variability="fixed" start="0"/>
    <Int32 name="i32" valueReference="6" causality="parameter" variability="fixed" start="0"/>
    <UInt32 name="u32" valueReference="7" causality="parameter" variability="fixed" start="0"/>
    <Int64 name="i64" valueReference="8" causality="parameter" variability="fixed" start="0"/>
    <UInt64 name="u64" valueReference="9" causality="parameter" variability="fixed" start="0"/>
    <Boolean name="flag" valueReference="10" causality="parameter" variability="fixed" start="false"/>
    <String name="text" valueReference="11" causality="parameter" variability="fixed"><Start value=""/></String>
    <Binary name="blob" valueReference="12" causality="input" maxSize="8"><Start value="00"/></Binary>
    <Enumeration name="mode" valueReference="13" causality="parameter" variability="fixed" declaredType="Mode"
      start="1"/>
    <UInt64 name="rows" valueReference="20" causality="structuralParameter" variability="fixed" start="2"/>
    <UInt64 name="columns" valueReference="21" causality="structuralParameter" variability="fixed" start="3" max="8"/>
    <Float64 name="matrix" valueReference="22" causality="parameter" variability="fixed" start="0 0 0 0 0 0">
      <Dimension valueReference="20"/><Dimension valueReference="21"/></Float64>
    <Int16 name="vector" valueReference="23" causality="output" variability="discrete" initial="exact" start="0 0 0">
      <Dimension valueReference="21"/></Int16>
    <String name="texts" valueReference="24" causality="parameter" variability="fixed"><Dimension valueReference="21"/>
      <Start value="a"/><Start value="b"/><Start value="c"/></String>
    <Float64 name="sum" valueReference="25" causality="output"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""

TYPES_FMI2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Types" guid="types">
  <CoSimulation modelIdentifier="types" canHandleVariableCommunicationStepSize="true"/>
  <TypeDefinitions><SimpleType name="Mode"><Enumeration><Item name="off" value="1"/><Item name="slow" value="2"/>
    </Enumeration></SimpleType></TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="real" valueReference="0" causality="parameter" variability="fixed"><Real start="0"/>
      </ScalarVariable>
    <ScalarVariable name="integer" valueReference="0" causality="parameter" variability="fixed"><Integer start="0"/>
      </ScalarVariable>
    <ScalarVariable name="mode" valueReference="1" causality="parameter" variability="fixed">
      <Enumeration declaredType="Mode" start="1"/></ScalarVariable>
    <ScalarVariable name="flag" valueReference="0" causality="parameter" variability="fixed"><Boolean start="false"/>
      </ScalarVariable>
    <ScalarVariable name="text" valueReference="0" causality="parameter" variability="fixed"><String start=""/>
      </ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""

STEPS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Steps" guid="steps">
  <CoSimulation modelIdentifier="steps"{variable}/>
  {experiment}
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="y" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="heading" valueReference="3" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""

STAIR = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Stair" instantiationToken="stair">
  <CoSimulation modelIdentifier="stair" canHandleVariableCommunicationStepSize="true" hasEventMode="true"
    fixedInternalStepSize="0.02"/>
  <ModelVariables>
    <Int32 name="stair" valueReference="1" causality="output" variability="discrete"/>
    <Float64 name="level" valueReference="2" causality="output"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""


@cache
def binary(source: str, definitions: str = "") -> bytes:
    return compile_library({source: definitions.encode() + (FOREIGN / source).read_bytes()}, source)


def archive(path: Path, xml: str, identifier: str, library: bytes) -> Path:
    platform = platform_fmi3() if 'fmiVersion="3.0"' in xml else platform_fmi2()
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", xml)
        file.writestr(f"binaries/{platform}/{identifier}{library_suffix()}", library)
    return path


def types_fmi3(folder: Path) -> Path:
    return archive(folder / "types3.fmu", TYPES_FMI3, "types", binary("types3.c"))


def types_fmi2(folder: Path) -> Path:
    return archive(folder / "types2.fmu", TYPES_FMI2, "types", binary("types2.c"))


def stair(folder: Path) -> Path:
    return archive(folder / "stair.fmu", STAIR, "stair", binary("stair3.c"))


def steps(folder: Path, step_s: float = 0.0, stop_s: float = 0.0, named: bool = True) -> Path:
    """x grows by u h; of one step size only if `step_s` is given, which its description says if `named`."""
    xml = STEPS.format(variable="" if step_s else ' canHandleVariableCommunicationStepSize="true"',
                       experiment=f'<DefaultExperiment stepSize="{step_s}"/>' if step_s and named else "")
    return archive(folder / "steps.fmu", xml, "steps",
                   binary("steps2.c", f"#define STEP {step_s}\n#define STOP {stop_s}\n"))
