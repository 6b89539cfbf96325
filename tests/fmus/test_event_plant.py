"""FMUs with clocks, in event mode: when their clocks tick, what they put out, and FMUs that do not keep the rules."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.errors import PlantError
from fmus.event_plant import EventPlant
from fmus.plant import Plant
from tests.fmus.ecu import KINDS, ecu, heard, script, transmit

MS = 1_000_000
RX = "Powertrain.Rx_Clock", "Powertrain.Rx_Data"


def described(folder: Path, kind: str = "countdown", definitions: str = "", **changes: dict[str, str]
              ) -> PlantDescription:
    return describe(ecu(folder / "ecu.fmu", kind, definitions, **changes), folder / "cache")


# frames at 1, 4, 7, ... ms: a countdown reaches each, a period of 5 ms collects them
EVERY_FRAME = [(ms * MS, 1) for ms in range(1, 26, 3)]
EVERY_5_MS = [(5 * MS, 2), (10 * MS, 2), (15 * MS, 1), (20 * MS, 2), (25 * MS, 2)]


@pytest.mark.parametrize(("kind", "expected"), [
    ("countdown", EVERY_FRAME), ("changing", EVERY_FRAME), ("constant", EVERY_5_MS), ("fixed", EVERY_5_MS),
    ("tunable", [(5 * MS, 2), (10 * MS, 2), (15 * MS, 1), *((k * MS // 2, 1) for k in (35, 40, 45, 50))])])
@pytest.mark.parametrize("look_every_ns", [25 * MS, 1_300_000])
def test_a_time_based_clock_ticks_at_its_instants_wherever_the_plant_is_looked_at(
        tmp_path: Path, kind: str, expected: list[tuple[int, int]], look_every_ns: int) -> None:
    with EventPlant(described(tmp_path, kind), "unit", {"period_ms": 3.0, "offset_ms": 1.0}) as plant:
        for time_ns in [*range(look_every_ns, 25 * MS, look_every_ns), 25 * MS]:
            plant.advance_to(time_ns)
            assert (plant.due_ns or 0) > plant.now_ns

        assert [(time_ns, len(value) // 24) for time_ns, _, value in plant.take_outgoing()] == expected


def test_the_instants_of_a_constant_clock_do_not_drift(tmp_path: Path) -> None:
    third = {"intervalDecimal=\"0.005\"": 'supportsFraction="true" intervalCounter="1" resolution="3000"'}
    with EventPlant(described(tmp_path, "constant", model=third), "unit", {"period_ms": 0.01}) as plant:
        plant.advance_to(1000 * MS)

        ticks = sorted({time_ns for time_ns, _, _ in plant.take_outgoing()})
    assert ticks == [round(k * 10**9 / 3000) for k in range(3001)]


def test_a_triggered_output_clock_ticks_at_the_end_of_a_step(tmp_path: Path) -> None:
    with EventPlant(described(tmp_path, "triggered"), "unit", {"period_ms": 3.0, "offset_ms": 1.0}) as plant:
        for time_ns in range(2 * MS, 12 * MS, 2 * MS):
            plant.advance_to(time_ns)

        assert [time_ns for time_ns, _, _ in plant.take_outgoing()] == [2 * MS, 4 * MS, 8 * MS, 10 * MS]


def test_a_step_that_returns_early_gets_its_event_there_and_goes_on(tmp_path: Path) -> None:
    description = described(tmp_path, definitions="#define EARLY 0.0021234\n")
    with EventPlant(description, "unit", {"script": script((5_000, transmit(1)))}) as plant:
        plant.advance_to(9 * MS)

        assert plant.now_ns == 9 * MS
        assert [time_ns for time_ns, _, _ in plant.take_outgoing()] == [5 * MS]


def test_what_is_delivered_acts_at_the_present_and_the_answer_comes_a_countdown_later(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with EventPlant(described(tmp_path), "unit", {"echo_ms": 0.25, "log": str(log)}) as plant:
        plant.advance_to(2 * MS)
        plant.deliver(*RX, transmit(0x10, b"ab"))
        due_ns = plant.due_ns
        plant.advance_to(3 * MS)

        assert heard(log) == [(2 * MS, transmit(0x10, b"ab"))]
        assert due_ns == 2_250_000
        assert plant.take_outgoing() == [(2_250_000, "Powertrain.Tx_Data", transmit(0x11, b"ab"))]


def test_an_answer_without_delay_comes_in_the_same_instant(tmp_path: Path) -> None:
    with EventPlant(described(tmp_path), "unit", {"echo_ms": 0.0}) as plant:
        plant.advance_to(2 * MS)
        plant.deliver(*RX, transmit(0x10))

        assert plant.take_outgoing() == [(2 * MS, "Powertrain.Tx_Data", transmit(0x11))]


def test_an_fmu_that_ticks_without_end_at_one_instant_is_stopped_with_its_name(tmp_path: Path) -> None:
    description = described(tmp_path, definitions="#define STUCK\n")

    with pytest.raises(PlantError, match=r"ecu.fmu: unit at t=0 s: the FMU is not done after 1000 event iterations"):
        EventPlant(description, "unit")


@pytest.mark.parametrize(("model", "mortal", "complaint"), [
    ({' hasEventMode="true"': ""}, False, "has no event mode"),
    ({' canHandleVariableCommunicationStepSize="true"': ' fixedInternalStepSize="0.01"'}, False, "has a fixed step"),
    ({}, True, "cannot outlive its node"),
])
def test_an_fmu_whose_clocks_cannot_be_served_is_refused(tmp_path: Path, model: dict[str, str], mortal: bool,
                                                         complaint: str) -> None:
    with pytest.raises(PlantError, match=complaint):
        EventPlant(described(tmp_path, model=model), "unit", mortal=mortal)


@pytest.mark.parametrize("interval", ["0", "-0.1", "1e-12"])
def test_a_period_below_a_nanosecond_is_refused(tmp_path: Path, interval: str) -> None:
    description = described(tmp_path, "constant", model={'"0.005"': f'"{interval}"'})

    with pytest.raises(PlantError, match="expected at least 1 ns"):
        EventPlant(description, "unit")


@pytest.mark.parametrize(("where", "old", "new", "complaint"), [
    ("terminals", 'matchingRule="org.fmi-ls-bus.transceiver"', 'matchingRule="plug"', "matchingRule=plug: expected"),
    ("terminals", 'memberName="Rx_Data"', 'memberName="Rx_Date"', "has no member Rx_Data"),
    ("terminals", 'variableName="Powertrain.Tx_Data"', 'variableName="Powertrain::Tx_Data"',
     "Tx_Data: the FMU has no variable Powertrain::Tx_Data"),
    ("terminals", "<Terminals>", "<Terminals", "not well-formed"),
    ("terminals", "<Terminals>", "<!DOCTYPE x><Terminals>", "declares a document type"),
    ("model", "ls-bus.can;", "ls-bus.lin;", "this bus is CAN"),
    ("model", 'clocks="2"', 'clocks="3"', "Rx_Data is not clocked by Rx_Clock"),
    ("model", 'intervalVariability="countdown"', 'intervalVariability="calculated"', "Tx_Clock is input, calculated"),
    ("model", 'intervalVariability="triggered"/>\n    <Clock', 'intervalVariability="countdown"/>\n    <Clock',
     "Rx_Clock is input, countdown: expected a triggered input"),
])
def test_a_wrong_bus_terminal_is_a_problem_of_the_bus_only(tmp_path: Path, where: str, old: str, new: str,
                                                           complaint: str) -> None:
    description = described(tmp_path, **{where: {old: new}})

    assert complaint in description.bus_terminals_problem
    assert description.bus_terminals == ()


def test_other_terminals_are_passed_over(tmp_path: Path) -> None:
    description = described(tmp_path, terminals={"org.fmi-ls-bus.network-terminal": "plug"})

    assert (description.bus_terminals, description.bus_terminals_problem) == ((), "")


def test_an_fmu_that_needs_event_mode_is_refused_by_a_plain_plant(tmp_path: Path) -> None:
    with pytest.raises(PlantError, match="cannot be instantiated"):
        Plant(described(tmp_path), "unit")


def test_every_kind_of_clock_has_a_test() -> None:
    assert set(KINDS) == {"countdown", "changing", "constant", "fixed", "tunable", "triggered"}
