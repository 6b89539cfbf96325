"""The FMI functions of our binaries, called as a host may call them: states, reset, modes, refusals."""

from __future__ import annotations

import ctypes as c
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError

Own = Callable[..., PlantDescription]
OK, ERROR = 0, 3
U, OMEGA, R = 0, 1, 2       # value references: rows of wheel_motor/variables.toml


class Host:
    """One instance of the motor, function by function."""

    def __init__(self, description: PlantDescription) -> None:
        self.plant = Plant(description, "host", {"u": 6.0})
        self.fmu = self.plant._fmu
        self.three = description.fmi == "3.0"

    def call(self, name: str, *arguments: Any) -> int:
        return self.fmu.function(name)(self.fmu.handle, *arguments)

    def step(self, t_s: float, h_s: float) -> int:
        tail = [c.byref(c.c_bool()) for _ in range(3)] + [c.byref(c.c_double())] if self.three else []
        return self.call("DoStep", c.c_double(t_s), c.c_double(h_s), c.c_int(0), *tail)

    def values(self, verb: str, kind: str, references: list[int], buffer: Any) -> int:
        count = [c.c_size_t(len(buffer))] if self.three else []
        return self.call(verb + kind, (c.c_uint * len(references))(*references), c.c_size_t(len(references)), buffer,
                         *count)

    @property
    def real(self) -> str:
        return "Float64" if self.three else "Real"

    def get(self, reference: int) -> float:
        buffer = (c.c_double * 1)()
        assert self.values("Get", self.real, [reference], buffer) == OK
        return buffer[0]

    def set(self, reference: int, value: float) -> int:
        return self.values("Set", self.real, [reference], (c.c_double * 1)(value))

    def state(self, name: str) -> str:
        return name.replace("State", "State" if self.three else "state").replace(
            "Deserialize", "Deserialize" if self.three else "DeSerialize")

    def initialize(self) -> None:
        zero = c.c_double(0)
        if self.three:
            assert self.call("EnterInitializationMode", c.c_bool(False), zero, zero, c.c_bool(False), zero) == OK
        else:
            assert self.call("SetupExperiment", c.c_int(0), zero, zero, c.c_int(0), zero) == OK
            assert self.call("EnterInitializationMode") == OK
        assert self.call("ExitInitializationMode") == OK

    def told(self) -> str:
        return self.fmu.told()


@pytest.fixture
def host(own: Own, version: str) -> Iterator[Host]:
    host = Host(own("wheel_motor", version))
    yield host
    host.plant.close()


def test_a_saved_state_brings_back_values_and_time(host: Host) -> None:
    saved = c.c_void_p()
    host.step(0.0, 0.01)
    assert host.call(host.state("GetFMUState"), c.byref(saved)) == OK
    host.step(0.01, 0.02)
    first = host.get(OMEGA)

    assert host.call(host.state("SetFMUState"), saved) == OK
    assert host.step(0.03, 0.02) == ERROR      # the time is 0.01 s again
    assert host.call(host.state("SetFMUState"), saved) == OK
    assert host.step(0.01, 0.02) == OK
    assert host.get(OMEGA) == first
    assert host.call(host.state("FreeFMUState"), c.byref(saved)) == OK
    assert not saved.value
    assert host.call(host.state("FreeFMUState"), c.byref(saved)) == OK     # freeing nothing is no error


def test_a_state_goes_through_bytes_into_another_instance(host: Host, own: Own, version: str) -> None:
    host.step(0.0, 0.01)
    saved, size, again = c.c_void_p(), c.c_size_t(), c.c_void_p()
    host.call(host.state("GetFMUState"), c.byref(saved))
    assert host.call(host.state("SerializedFMUStateSize"), saved, c.byref(size)) == OK
    data = (c.c_ubyte * size.value)()
    assert host.call(host.state("SerializeFMUState"), saved, data, size) == OK
    host.step(0.01, 0.02)

    other = Host(own("wheel_motor", version))
    assert other.call(host.state("DeserializeFMUState"), data, size, c.byref(again)) == OK
    assert other.call(host.state("SetFMUState"), again) == OK
    other.step(0.01, 0.02)

    assert other.get(OMEGA) == host.get(OMEGA)
    assert other.call(host.state("DeserializeFMUState"), data, c.c_size_t(3), c.byref(again)) == ERROR
    assert "a saved state holds" in other.told()
    host.call(host.state("FreeFMUState"), c.byref(saved))
    other.call(host.state("FreeFMUState"), c.byref(again))
    other.plant.close()


def test_reset_goes_back_to_the_start_values(host: Host) -> None:
    host.step(0.0, 0.01)

    assert host.call("Reset") == OK
    assert (host.get(U), host.get(OMEGA)) == (0.0, 0.0)
    assert host.set(R, 5.0) == OK
    host.initialize()
    assert host.step(0.0, 0.01) == OK
    assert host.get(R) == 5.0


def test_an_error_while_stepping_is_left_by_reset_only(host: Host) -> None:
    host.call("Reset")
    host.set(R, 0.0)
    host.set(U, 1.0)
    host.initialize()

    assert host.step(0.0, 0.01) == ERROR or host.get(OMEGA) == pytest.approx(20)
    host.call("Reset")
    host.set(R, -1e-6)      # unstable: omega grows without bound
    host.set(U, 1.0)
    host.initialize()
    assert host.step(0.0, 1.0) == ERROR
    assert "omega = " in (said := host.told())
    assert "a value must be finite; check parameters, inputs and step size" in said
    assert host.step(1.0, 1.0) == ERROR
    assert "cannot step: the instance is in error" in host.told()
    assert host.call("Reset") == OK
    host.initialize()
    assert host.step(0.0, 1.0) == OK


@pytest.mark.parametrize(("t_s", "h_s", "says"), [
    (0.0, 0.0, "expected a finite step > 0"), (0.0, -1.0, "expected a finite step > 0"),
    (0.0, float("nan"), "expected a finite step > 0"), (0.5, 0.1, "but the last step ended at 0 s"),
    (float("nan"), 0.1, "but the last step ended at 0 s")])
def test_a_senseless_step_is_refused_and_does_no_harm(host: Host, t_s: float, h_s: float, says: str) -> None:
    assert host.step(t_s, h_s) == ERROR
    assert says in host.told()
    assert host.step(0.0, 0.1) == OK


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_the_fmu_itself_refuses_what_is_not_finite_and_keeps_all_values(host: Host, value: float) -> None:
    host.call("Reset")

    assert host.values("Set", host.real, [U, OMEGA], (c.c_double * 2)(1.0, value)) == ERROR
    assert f"omega = {value:g} set at t = 0 s: a value must be finite" in host.told()
    assert host.get(U) == 0.0


def test_values_can_be_set_only_where_the_standard_lets_them(host: Host) -> None:
    assert host.set(R, 1.0) == ERROR
    assert "cannot set R: it is a parameter and the instance is in step mode" in host.told()
    assert host.set(OMEGA, 1.0) == ERROR
    assert host.set(99, 1.0) == ERROR
    assert "value reference 99: the references end at 4" in host.told()
    assert host.values("Get", host.real, [99], (c.c_double * 1)()) == ERROR


def test_a_type_that_the_model_does_not_have_is_named(host: Host) -> None:
    kind = "Int32" if host.three else "Integer"

    assert host.values("Get", kind, [0], (c.c_int32 * 1)()) == ERROR
    assert f"has no variables of type {kind}" in host.told()
    assert host.values("Get", kind, [], (c.c_int32 * 0)()) == OK


def test_modes_are_kept_in_order(host: Host) -> None:
    assert host.call("ExitInitializationMode") == ERROR
    assert "cannot exit initialization mode: the instance is in step mode" in host.told()
    assert host.call("Terminate") == OK
    host.plant._fmu.in_step_mode[0] = False
    assert host.step(0.0, 0.1) == ERROR
    assert host.get(U) == 6.0       # values can still be read


def test_fmi2_answers_the_status_questions_of_a_synchronous_fmu(own: Own) -> None:
    host = Host(own("wheel_motor", "2.0"))
    host.step(0.0, 0.25)
    time, ended = c.c_double(), c.c_int(1)

    assert host.call("GetRealStatus", c.c_int(2), c.byref(time)) == OK
    assert host.call("GetBooleanStatus", c.c_int(3), c.byref(ended)) == OK
    assert (time.value, ended.value) == (0.25, 0)
    assert host.call("CancelStep") == ERROR
    host.plant.close()


def test_fmi3_refuses_what_it_does_not_offer(own: Own) -> None:
    host = Host(own("wheel_motor", "3.0"))

    assert host.call("EnterEventMode") == ERROR
    assert "has no event mode" in host.told()
    assert host.call("GetNumberOfContinuousStates", c.byref(c.c_size_t())) == ERROR
    assert "offers no model exchange" in host.told()
    host.plant.close()


def test_a_token_of_another_build_is_refused(own: Own, version: str) -> None:
    import msgspec

    wrong = msgspec.structs.replace(own("wheel_motor", version), token="{100% wrong}")

    with pytest.raises(PlantError, match=r"token \{100% wrong\} of the model description is not \{[-0-9a-f]{36}\}"):
        Plant(wrong, "m")
