"""Archives that cannot be used: each error names the file, what is wrong, and what to do."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.plant import PlantError

Pack = Callable[..., Path]
Archive = dict[str, bytes]


def refusal(path: Path, cache: Path) -> str:
    with pytest.raises(PlantError) as caught:
        describe(path, cache)
    return str(caught.value)


def test_a_missing_file(tmp_path: Path, cache: Path) -> None:
    path = tmp_path / "no.fmu"

    assert refusal(path, cache) == f"{path}: no such file: give the path of an FMU archive (.fmu)"


def test_a_folder(tmp_path: Path, cache: Path) -> None:
    assert refusal(tmp_path, cache).startswith(f"{tmp_path}: cannot read it (Is a directory)")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_archive(share: float, pack: Pack, counter_files: Archive, cache: Path) -> None:
    path = pack(counter_files)
    path.write_bytes(path.read_bytes()[:int(path.stat().st_size * share)])

    assert refusal(path, cache).startswith(f"{path}: not a whole zip archive (")


def test_a_flipped_byte(own_fmu: Callable[..., Path], tmp_path: Path, cache: Path) -> None:
    data = bytearray(own_fmu("wheel_motor").read_bytes())
    data[len(data) // 3] ^= 0xFF
    (tmp_path / "bent.fmu").write_bytes(data)

    assert "bent.fmu: not a whole zip archive (" in refusal(tmp_path / "bent.fmu", cache)


def test_a_zip_without_a_description(pack: Pack, cache: Path) -> None:
    assert "holds no modelDescription.xml: it is a zip archive but not an FMU" in refusal(pack({"a": b"b"}), cache)


@pytest.mark.parametrize("xml", ["<fmiModelDescription", "<a/>", "", '<fmiModelDescription fmiVersion="2.0"/>'])
def test_a_description_that_is_none(xml: str, pack: Pack, cache: Path) -> None:
    assert "modelDescription.xml cannot be read" in refusal(pack({"modelDescription.xml": xml.encode()}), cache)


def test_another_version_of_fmi(pack: Pack, cache: Path) -> None:
    xml = ('<fmiModelDescription fmiVersion="1.0" modelName="a" modelIdentifier="a" guid="a" '
           'numberOfEventIndicators="0" numberOfContinuousStates="0"><ModelVariables/></fmiModelDescription>')

    assert "is FMI 1.0: only FMI 2.0 and 3.0" in refusal(pack({"modelDescription.xml": xml.encode()}), cache)


def test_model_exchange_only(pack: Pack, counter_files: Archive, cache: Path) -> None:
    path = pack(counter_files, replace={
        '<CoSimulation modelIdentifier="counter" canHandleVariableCommunicationStepSize="true"/>':
        '<ModelExchange modelIdentifier="counter"/>'})

    assert "offers model exchange, not co-simulation" in refusal(path, cache)


def test_no_binary_for_this_platform(pack: Pack, counter_files: Archive, cache: Path) -> None:
    elsewhere = {name if not name.startswith("binaries") else "binaries/vax64/counter.so": data
                 for name, data in counter_files.items()} | {"sources/a.c": b""}

    said = refusal(pack(elsewhere), cache)

    assert "no binary for this platform" in said
    assert "it has binaries for vax64 and sources" in said


def test_no_binary_at_all(pack: Pack, counter_files: Archive, cache: Path) -> None:
    bare = {"modelDescription.xml": counter_files["modelDescription.xml"]}

    assert "it has no binaries; export it for" in refusal(pack(bare), cache)


def test_a_binary_of_another_name(pack: Pack, counter_files: Archive, cache: Path) -> None:
    path = pack(counter_files, replace={'modelIdentifier="counter"': 'modelIdentifier="meter"'})

    assert "holds no meter.so: the archive does not match its modelIdentifier" in refusal(path, cache) \
        or sys.platform != "linux"


def test_what_the_description_says(counter: PlantDescription, array: PlantDescription) -> None:
    u, a = counter.variables["u"], array.variables["a"]

    assert (u.reference, u.type, u.causality, u.unit, u.start) == (10, "Real", "input", "V", "0")
    assert (a.reference, a.type, a.elements) == (2, "Float64", 3)
    assert counter.variable_step
    assert counter.names("input") == ["u"]


def test_a_second_look_comes_from_the_cache(pack: Pack, counter_files: Archive, cache: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    first = describe(pack(counter_files, name="a.fmu"), cache)
    monkeypatch.setitem(sys.modules, "fmpy", None)      # an import would fail

    assert describe(pack(counter_files, name="a.fmu"), cache) == first


def test_the_nearest_names_are_offered(counter: PlantDescription) -> None:
    with pytest.raises(PlantError, match=r"stpes: no such variable; nearest names: steps"):
        counter.variable("stpes")
