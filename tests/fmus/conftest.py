"""FMUs for tests: marconet's own, and foreign ones from C and XML that share no code with fmus/fmi."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.build import build_model, compile_library
from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.platform_names import library_suffix, platform_fmi2, platform_fmi3

FOREIGN = Path(__file__).parent / "foreign"
Archive = dict[str, bytes]

COUNTER_XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Counter" guid="counter">
  <CoSimulation modelIdentifier="counter" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="V"/></UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="10" causality="input"><Real unit="V" start="0"/></ScalarVariable>
    <ScalarVariable name="s" valueReference="11" causality="output" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="12" causality="parameter" variability="tunable">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="steps" valueReference="20" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
    <ScalarVariable name="mood" valueReference="21" causality="parameter" variability="tunable">
      <Integer start="0"/></ScalarVariable>
    <ScalarVariable name="odd" valueReference="30" causality="output" variability="discrete"><Boolean/></ScalarVariable>
    <ScalarVariable name="label" valueReference="40" causality="parameter" variability="fixed">
      <String start="none"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""

ARRAY_XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Array" instantiationToken="array">
  <CoSimulation modelIdentifier="array" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="u" valueReference="1" causality="input" start="0"/>
    <Float64 name="a" valueReference="2" causality="output" initial="exact" start="0 0 0">
      <Dimension start="3"/></Float64>
    <Float32 name="f" valueReference="3" causality="parameter" variability="tunable" start="0"/>
    <Int32 name="mood" valueReference="4" causality="parameter" variability="tunable" start="0"/>
    <UInt64 name="n" valueReference="5" causality="structuralParameter" variability="fixed" start="3"/>
    <Binary name="blob" valueReference="6" causality="input" variability="discrete"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def own_fmu(cache: Path) -> Callable[..., Path]:
    """Path of an own model's FMU: own_fmu("wheel_motor", "2.0")."""
    return lambda model, version="3.0": build_model(model, version, cache)


@pytest.fixture(scope="session")
def own(cache: Path, own_fmu: Callable[..., Path]) -> Callable[..., PlantDescription]:
    """Description of an own model: own("wheel_motor", "2.0")."""
    return lambda model, version="3.0": describe(own_fmu(model, version), cache)


@pytest.fixture(params=["2.0", "3.0"])
def version(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def binaries() -> dict[str, bytes]:
    return {name: compile_library({f"{name}.c": (FOREIGN / f"{name}.c").read_bytes()}, name)
            for name in ("counter2", "array3")}


@pytest.fixture(scope="session")
def counter_files(binaries: dict[str, bytes]) -> Archive:
    """Content of the foreign FMI 2.0 FMU."""
    return {"modelDescription.xml": COUNTER_XML.encode(),
            f"binaries/{platform_fmi2()}/counter{library_suffix()}": binaries["counter2"]}


@pytest.fixture(scope="session")
def array_files(binaries: dict[str, bytes]) -> Archive:
    """Content of the foreign FMI 3.0 FMU."""
    return {"modelDescription.xml": ARRAY_XML.encode(),
            f"binaries/{platform_fmi3()}/array{library_suffix()}": binaries["array3"]}


@pytest.fixture
def pack(tmp_path: Path) -> Callable[..., Path]:
    """Write files as an FMU: pack(counter_files, name="a.fmu", replace={"old": "new"} in its XML)."""

    def write(files: Archive, name: str = "foreign.fmu", replace: dict[str, str] | None = None) -> Path:
        xml = files.get("modelDescription.xml", b"").decode()
        for old, new in (replace or {}).items():
            assert old in xml
            xml = xml.replace(old, new)
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            for file, data in files.items():
                archive.writestr(file, xml.encode() if file == "modelDescription.xml" else data)
        return tmp_path / name

    return write


@pytest.fixture
def counter(pack: Callable[..., Path], counter_files: Archive, cache: Path) -> PlantDescription:
    return describe(pack(counter_files), cache)


@pytest.fixture
def array(pack: Callable[..., Path], array_files: Archive, cache: Path) -> PlantDescription:
    return describe(pack(array_files), cache)
