"""FMUs that are not ours: two written in C for these tests, and FMPy's container, a binary that ships with FMPy."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.plant import Plant, PlantEnded, PlantError

MS = 1_000_000


def test_a_foreign_fmi2_fmu_runs_with_all_of_its_variable_types(counter: PlantDescription) -> None:
    with Plant(counter, "c", {"gain": 2.0, "label": "näme", "s": 10}) as plant:
        plant.set("u", 3.0)
        plant.advance_to(500 * MS)

        assert plant.get("s") == 10 + 0.5 * 2 * 3
        assert plant.get("steps") == 1
        assert plant.get("odd") is True
        assert plant.get("label") == "näme"


def test_a_tunable_parameter_changes_while_the_plant_runs_and_a_fixed_one_does_not(counter: PlantDescription) -> None:
    with Plant(counter, "c", {"u": 1.0}) as plant:
        plant.advance_to(100 * MS)
        plant.set("gain", 5)
        plant.advance_to(200 * MS)

        assert plant.get("s") == pytest.approx(0.1 + 0.5, rel=1e-15)
        with pytest.raises(PlantError, match=r"t=0\.2 s: label is a parameter: only inputs and tunable"):
            plant.set("label", "x")


@pytest.mark.parametrize(("mood", "status"), [(1, "error"), (2, "discard"), (3, "fatal")])
def test_a_failing_step_names_file_time_status_and_the_fmus_own_words(
        counter: PlantDescription, mood: int, status: str) -> None:
    plant = Plant(counter, "c", {"label": "L1"})
    plant.advance_to(250 * MS)
    plant.set("mood", mood)

    with pytest.raises(PlantError) as caught:
        plant.advance_to(300 * MS)

    assert str(caught.value) == (f"{counter.file}: c at t=0.25 s: a step of 0.05 s failed with status {status}; "
                                 f"the FMU says: [{status}] mood {mood} at t=0.25, L1")
    with pytest.raises(PlantError, match="it stopped after a step"):
        plant.advance_to(350 * MS)
    with pytest.raises(PlantError, match="it stopped after a step"):
        plant.get("s")
    plant.close()


def test_a_warning_is_no_failure(counter: PlantDescription) -> None:
    with Plant(counter, "c", {"mood": 4}) as plant:
        plant.advance_to(MS)

        assert plant.now_ns == MS


def test_a_group_refuses_an_output_that_is_not_a_number(counter: PlantDescription) -> None:
    with Plant(counter, "c") as plant:
        outputs = plant.output_group(["u", "s"])
        plant.advance_to(MS)
        plant.set("mood", 5)

        with pytest.raises(PlantError, match=r"c at t=0\.001 s: s=nan: the FMU gave a value that is not finite"):
            outputs.read()


def test_instances_get_their_own_messages_through_the_formatter_that_they_share(counter: PlantDescription) -> None:
    first, second = Plant(counter, "a", {"label": "A"}), Plant(counter, "b", {"label": "B"})
    for plant in (first, second):
        plant.set("mood", 1)

    with pytest.raises(PlantError, match=r"mood 1 at t=0, A$"):
        first.advance_to(MS)
    with pytest.raises(PlantError, match=r"mood 1 at t=0, B$"):
        second.advance_to(MS)


def test_a_refused_instance_says_why(pack: Callable[..., Path], counter_files: dict[str, bytes], cache: Path) -> None:
    wrong = describe(pack(counter_files, replace={'guid="counter"': 'guid="other"'}), cache)

    with pytest.raises(PlantError, match=r"instantiated as 'c'; the FMU says: \[error\] guid is other at 100%"):
        Plant(wrong, "c")


def test_a_foreign_fmi3_fmu_runs_with_arrays_and_structural_parameters(array: PlantDescription) -> None:
    with Plant(array, "a", {"n": 5, "a": [1.0, 2.0, 3.0], "f": 0.5, "u": 1.0}) as plant:
        plant.advance_to(1000 * MS)

        assert plant.get("a") == (2.0, 4.0, 6.0)
        assert plant.get("n") == 5
        assert plant.get("f") == 0.5


@pytest.mark.parametrize(("mood", "says"), [
    (1, "asked for t=0.025 s, but the FMU stopped at 0.025 s"),
    (3, r"asked for t=0\.025 s, but the FMU stopped at 0\.02 s: it may have a fixed internal step that its description "
        r"does not name; give it as plant\.step_ms"),
])
def test_a_step_that_ends_elsewhere_is_an_error(array: PlantDescription, mood: int, says: str) -> None:
    with Plant(array, "a") as plant:
        plant.advance_to(10 * MS)
        plant.set("mood", mood)

        with pytest.raises(PlantError, match=r"a at t=0\.01 s: " + says):
            plant.advance_to(25 * MS)


def test_a_model_that_asks_to_end_the_simulation_ends_it_with_its_own_words(array: PlantDescription) -> None:
    with Plant(array, "a") as plant:
        plant.advance_to(10 * MS)
        plant.set("mood", 2)

        with pytest.raises(PlantEnded, match=r"a: the model ended the simulation by itself at t=0\.025 s; the FMU "
                                             r"says: \[warning\] mood is 100%"):
            plant.advance_to(25 * MS)


def test_units_are_checked_where_they_are_stated(counter: PlantDescription) -> None:
    with Plant(counter, "c") as plant:
        plant.input_group(["u"], units=["V"])

        with pytest.raises(PlantError, match=r"u: unit 'mV' asked for, but the FMU declares 'V'"):
            plant.input_group(["u"], units=["mV"])


def container(own_fmu: Callable[..., Path], version: str, folder: Path) -> Path:
    """FMPy's container around our motor: its binary is FMPy's and steps ours from C."""
    from fmpy import read_model_description
    from fmpy.container_fmu.cli import create_container_fmu
    from fmpy.container_fmu.config import Component, Configuration
    from fmpy.model_description import (
        CoSimulation,
        DefaultExperiment,
        ModelDescription,
        ModelVariable,
        Unknown,
    )

    inner = own_fmu("wheel_motor", version)
    description = read_model_description(str(inner))
    motor = Component(name="motor", filename=inner, modelDescription=description)
    kind = "Real" if version == "2.0" else "Float64"
    time = ModelVariable(name="time", type=kind, causality="independent", variability="continuous")
    u = ModelVariable(name="voltage", type=kind, causality="input", variability="continuous", initial="exact",
                      start="0")
    w = ModelVariable(name="speed", type=kind, causality="output", variability="continuous", initial="calculated")
    by_name = {v.name: v for v in description.modelVariables}
    outer = ModelDescription(fmiVersion=version, modelName="Container", instantiationToken="{c0}",
                             coSimulation=CoSimulation(modelIdentifier="container_fmu"),
                             defaultExperiment=DefaultExperiment(startTime="0", stopTime="1", stepSize="0.01"),
                             modelVariables=[time, u, w], outputs=[Unknown(variable=w)],
                             initialUnknowns=[Unknown(variable=w)])
    outer.coSimulation.fixedInternalStepSize = 0.01
    (folder / "unpacked").mkdir()
    create_container_fmu(Configuration(parallelDoStep=False, modelDescription=outer, components=[motor], connections=[],
                                       variableMappings={u: [(motor, by_name["u"])], w: [(motor, by_name["omega"])]}),
                         folder / "unpacked", folder / "container.fmu")
    return folder / "container.fmu"


def test_a_third_party_binary_runs_and_agrees_with_the_motor_inside_it(
        version: str, own_fmu: Callable[..., Path], own: Callable[..., PlantDescription], tmp_path: Path,
        cache: Path) -> None:
    outer = Plant(describe(container(own_fmu, version, tmp_path), cache), "outer")
    inner = Plant(own("wheel_motor", version), "inner")
    voltage, speed = outer.input_group(["voltage"]), outer.output_group(["speed"])

    for k in range(1, 101):
        voltage.write([12.0])
        inner.set("u", 12.0)
        outer.advance_to(k * 10 * MS)
        inner.advance_to(k * 10 * MS)

        assert speed.read() == (inner.get("omega"),)
    assert speed.read()[0] > 200
    outer.close()
    inner.close()


def test_no_instance_outlives_the_interpreter(counter: PlantDescription, tmp_path: Path) -> None:
    import subprocess
    import sys

    import msgspec

    (tmp_path / "plant.json").write_bytes(msgspec.json.encode(counter))
    program = ("import msgspec, sys; from fmus.plant import Plant, PlantDescription\n"
               f"d = msgspec.json.decode(open({str(tmp_path / 'plant.json')!r}, 'rb').read(), type=PlantDescription)\n"
               "keep = [Plant(d, 'c'), Plant(d, 'd')]; keep[0].advance_to(1)\n"
               "assert 'fmpy' not in sys.modules and 'numpy' not in sys.modules\n")

    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)

    assert (done.returncode, done.stderr) == (0, "")


def test_an_incomplete_binary_names_the_function_that_it_lacks(
        pack: Callable[..., Path], array_files: dict[str, bytes], counter_files: dict[str, bytes], cache: Path) -> None:
    mixed = dict(counter_files)
    name = next(each for each in mixed if each.startswith("binaries"))
    mixed[name] = next(data for each, data in array_files.items() if each.startswith("binaries"))

    with pytest.raises(PlantError, match="its binary lacks the function fmi2Instantiate"):
        Plant(describe(pack(mixed), cache), "c")


def test_a_binary_that_is_none_is_an_error(pack: Callable[..., Path], counter_files: dict[str, bytes], cache: Path
                                           ) -> None:
    broken = {name: b"not a library" if name.startswith("binaries") else data for name, data in counter_files.items()}

    with pytest.raises(PlantError, match="its binary cannot be loaded"):
        Plant(describe(pack(broken), cache), "c")


def test_the_container_is_a_whole_archive(own_fmu: Callable[..., Path], tmp_path: Path) -> None:
    with zipfile.ZipFile(container(own_fmu, "3.0", tmp_path)) as archive:
        assert archive.testzip() is None
