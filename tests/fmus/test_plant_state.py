"""A plant goes on in another instance, from its FMU's state or from a diary of the calls, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Any

import msgspec
import pytest

from fmus.build import build_model, model_folder
from fmus.describe import read_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from fmus.presets import read_presets

QUADROTOR = model_folder("quadrotor")
HUMMINGBIRD = read_presets(QUADROTOR, read_model(QUADROTOR / "variables.toml"))["hummingbird"]
START: dict[str, dict[str, Any]] = {"quadrotor": dict(HUMMINGBIRD.parameters), "unicycle": {}}


def exercise(plant: Plant, rng: Random, from_ns: int, steps: int, model: str) -> Iterator[tuple[float, ...]]:
    """Random inputs at random instants, and the outputs read there."""
    outputs = plant.output_group(plant.description.names("output"), finite=False)
    now_ns = from_ns
    for _ in range(steps):
        now_ns += 1 + int(rng.random() * 3_000_000)
        plant.advance_to(now_ns)
        if rng.random() < 0.3:
            if model == "quadrotor":
                plant.input_group([f"u[{motor}]" for motor in range(1, 5)]).write([400 + 50 * rng.random()
                                                                                    for _ in range(4)])
            else:
                plant.set("v_cmd", rng.random())
        yield outputs.read_for_record()


@pytest.mark.parametrize("fmi", ["3.0", "2.0"])
@pytest.mark.parametrize("model", ["quadrotor", "unicycle"])
@pytest.mark.parametrize("saves_state", [True, False])
@pytest.mark.parametrize("step_ns", [None, 1_000_000])
def test_a_plant_goes_on_to_the_last_bit(fmi: Any, model: str, saves_state: bool, step_ns: int | None) -> None:
    description = describe(build_model(model, fmi))
    assert description.saves_state
    description = msgspec.structs.replace(description, saves_state=saves_state)
    rng, again = Random(1), Random(1)
    whole = Plant(description, "whole", START[model], step_ns, mortal=True)
    first = Plant(description, "first", START[model], step_ns, mortal=True)
    expected = list(exercise(whole, rng, 0, 400, model))

    found = list(exercise(first, again, 0, 200, model))
    state = first.state()
    first.close()
    second = Plant(description, "second", START[model], step_ns, mortal=True)
    second.restore(state)
    found += exercise(second, again, second.now_ns, 100, model)
    third = Plant(description, "third", START[model], step_ns, mortal=True)
    third.restore(second.state())
    found += exercise(third, again, third.now_ns, 100, model)

    assert [[value.hex() for value in row] for row in found] == [[value.hex() for value in row] for row in expected]
    assert expected[0] != expected[-1]


def test_a_plant_that_has_stopped_stays_so() -> None:
    plant = Plant(describe(build_model("unicycle")), "one", {}, mortal=True)
    plant.advance_to(1_000_000)
    state = plant.state()
    plant.close()
    found = msgspec.msgpack.decode(state)
    found["stopped"] = "it stopped"
    again = Plant(describe(build_model("unicycle")), "two", {}, mortal=True)

    again.restore(msgspec.msgpack.encode(found))

    with pytest.raises(Exception, match="it stopped"):
        again.get("x")
