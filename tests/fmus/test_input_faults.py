"""Faults of inputs at the plant itself: groups, fixed steps, a plant that goes on elsewhere, what is not touched."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from fmus.build import build_model, model_folder
from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.input_faults import Change
from fmus.plant import Plant

MS = 1_000_000
HALF = Change("factor", 0.5)


@pytest.fixture(scope="module")
def unicycle(cache: Path) -> PlantDescription:
    return describe(build_model(model_folder("unicycle")), cache)


def test_an_input_is_changed_however_it_is_set_and_the_others_are_not(unicycle: PlantDescription) -> None:
    with Plant(unicycle, "p") as plant:
        before = plant.input_group(["v_cmd", "omega_cmd"])
        before.write([2.0, 1.0])
        plant.change_input("v_cmd", HALF, begins=True)
        after = plant.input_group(["omega_cmd", "v_cmd"])

        found = [(plant.get("v_cmd"), plant.get("omega_cmd"))]
        for write in (lambda: before.write([4.0, 3.0]), lambda: after.write([5.0, 6.0]),
                      lambda: plant.set("v_cmd", 8.0)):
            write()
            found.append((plant.get("v_cmd"), plant.get("omega_cmd")))
        plant.change_input("v_cmd", HALF, begins=False)
        found.append((plant.get("v_cmd"), plant.get("omega_cmd")))

    assert found == [(1, 1), (2, 3), (3, 5), (4, 5), (8, 5)]


def test_a_group_keeps_its_bound_call_until_a_fault_touches_its_plant(unicycle: PlantDescription) -> None:
    with Plant(unicycle, "p") as plant:
        group = plant.input_group(["v_cmd"])
        bound = group._set

        group.write([1.0])
        assert group._set is bound
        plant.change_input("v_cmd", HALF, begins=True)
        assert group._set is not bound


def test_a_plant_with_a_fixed_step_takes_the_change_at_its_next_point(unicycle: PlantDescription) -> None:
    stiff = msgspec.structs.replace(unicycle, variable_step=False)
    with Plant(stiff, "p", fixed_step_ns=10 * MS) as plant:
        plant.advance_to(4 * MS)
        plant.input_group(["v_cmd"]).write([2.0])       # waits for 10 ms
        plant.change_input("v_cmd", HALF, begins=True)
        found = []
        for t_ms in (4, 10, 14, 20):
            plant.advance_to(t_ms * MS)
            found.append(plant.get("v_cmd"))
            if t_ms == 14:
                plant.change_input("v_cmd", HALF, begins=False)
                found.append(plant.get("v_cmd"))

    assert found == [0, 1, 1, 1, 2]


@pytest.mark.parametrize("saves_state", [True, False])
def test_faults_go_on_with_the_plant_in_another_process(unicycle: PlantDescription, saves_state: bool) -> None:
    described = msgspec.structs.replace(unicycle, saves_state=saves_state)      # without, by the diary of its calls
    with Plant(described, "p", mortal=True) as plant:
        plant.set("v_cmd", 2.0)
        plant.change_input("v_cmd", HALF, begins=True)
        plant.advance_to(10 * MS)
        state, x = plant.state(), plant.get("x")
    with Plant(described, "p", mortal=True) as plant:
        plant.restore(state)

        assert (plant.get("x"), plant.get("v_cmd")) == (x, 1.0)
        plant.input_group(["v_cmd"]).write([4.0])
        assert plant.get("v_cmd") == 2.0
        plant.change_input("v_cmd", HALF, begins=False)
        assert plant.get("v_cmd") == 4.0


def test_a_tunable_parameter_changes_by_a_factor(unicycle: PlantDescription) -> None:
    with Plant(unicycle, "p", {"gain_left": 0.8}) as plant:
        plant.change("gain_left", HALF)

        assert plant.get("gain_left") == 0.4
