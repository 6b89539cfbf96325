"""Firmware that is wrong, as a user meets it: in its folder, in its calls of the board, by a crash or a loop."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from experiments.run import runner
from experiments.scenario import ScenarioError, load
from firmware_sim.firmware.build import build_for_host
from firmware_sim.firmware.errors import FirmwareError
from firmware_sim.firmware.new_folder import write_new
from netem.wire.errors import NodeFailure

SENDS = "board_send(PORT_RADIO, frame, sizeof frame);"
STARTS = "period_ns = (int64_t)value;"


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    """A new firmware with these changes of its code or its table; return its scenario."""
    write_new(folder / "blinker")
    for before, after in changes:
        found = [file for file in (folder / "blinker").iterdir() if before in file.read_text()]
        assert found, before
        found[0].write_text(found[0].read_text().replace(before, after))
    return folder / "blinker" / "two_robots.toml"


def problem(scenario: Path, **changes: list[str]) -> str:
    with pytest.raises(ScenarioError) as error:
        load(scenario, **changes)
    return "\n".join(error.value.problems)


def failure(scenario: Path, out: Path, host: runner.HostName = "inline", timeout_s: float = 20.0) -> NodeFailure:
    with pytest.raises(NodeFailure) as error:
        runner.run(load(scenario, overrides=[f"node_timeout_s={timeout_s}"]), host=host, out=out, report=False)
    return error.value


def test_a_new_firmware_runs_and_meets_what_its_scenario_expects(tmp_path: Path) -> None:
    summary = runner.run(load(changed(tmp_path)), host="inline", out=tmp_path / "out", report=False).summary

    assert summary.holds
    assert summary.frames == {"delivered": 10 + 15}


def test_every_robot_has_variables_of_its_own(tmp_path: Path) -> None:
    scenario = load(changed(tmp_path))

    result = runner.run(scenario, host="inline", out=tmp_path / "out", report=False)

    counters = result.folder.joinpath("run.json").read_text()
    assert '"a":{"frames heard":15}' in counters
    assert '"b":{"frames heard":10}' in counters


@pytest.mark.parametrize(("before", "after", "says"), [
    ("sent;\n", "sent\n", r"blinker\.c:\d+:\d+: error"),
    ("(void)port;", "", r"blinker\.c:\d+:\d+: error: unused parameter"),
    ("PORT_RADIO", "PORT_CAN", r"blinker\.c:\d+:\d+: error: .*PORT_CAN"),
    ('name = "radio"', 'nmae = "radio"', r"ports\[0\]|ports\[\.\.\.\]"),
    ('type = "int"', 'type = "text"', r"firmware\.toml: parameters\[.*\]\.type: "),
    ("default = 100_000_000", "default = [1.0]", r'period_ns: default=\[1\.0\]: expected one of type "int"'),
    ('type = "int"', 'type = "choice"', r'period_ns: choices=\[\]: expected words for type "choice"'),
    ('type = "int"', 'type = "choice"\nchoices = ["a", "b"]', 'default=100000000.*expected one of .*choice'),
    ('name = "frames heard"', 'name = "!"', "expected a letter or a digit"),
])
def test_a_wrong_folder_is_refused_before_the_run(before: str, after: str, says: str, tmp_path: Path) -> None:
    scenario = changed(tmp_path, (before, after))

    assert re.search(says, problem(scenario))


def test_a_missing_function_is_named_with_its_signature(tmp_path: Path) -> None:
    begin = "int32_t board_begin(void);\nint32_t board_begin(void)"
    folder = changed(tmp_path, ("int32_t board_start(void)", begin)).parent

    with pytest.raises(FirmwareError, match=r"defines no board_start; add int32_t board_start\(void\)"):
        build_for_host(folder)


def test_a_folder_without_a_table_is_no_firmware(tmp_path: Path) -> None:
    assert "no firmware there" in problem(changed(tmp_path), overrides=['agents_defaults.firmware="nowhere"'])


@pytest.mark.parametrize(("override", "says"), [
    ("agents.a.parameters.perod_ms=5", 'unknown key; did you mean "period_ms"?'),
    ("agents.a.parameters.period_ms=0.5", "expected at least 1e+06"),
    ('agents.a.parameters.period_ms="soon"', "expected"),
    ('agents_defaults.program="beacon:Beacon"', "expected either `program` or `firmware`: remove one of them"),
    ('agents_defaults.clock_hz=8_000_000', 'those of an emulated processor: expected "cortex_m4" with them'),
    ('agents_defaults.target="avr"', "no such target"),
    ("agents.a.media=[]", "has a port 'radio', but the robot is on no medium"),
])
def test_a_wrong_scenario_is_refused_before_the_run(override: str, says: str, tmp_path: Path) -> None:
    assert says in problem(changed(tmp_path), overrides=[override])


def test_a_program_of_an_agent_replaces_the_firmware_of_the_defaults(tmp_path: Path) -> None:
    changes = ['agents.a.program="agents.synchronization.robot:SyncRobot"']

    said = problem(changed(tmp_path), overrides=changes)

    assert "either `program` or `firmware`" not in said
    assert "team" in said                   # of the check of SyncRobot, which found its team missing


@pytest.mark.parametrize(("before", "after", "says"), [
    (STARTS, STARTS + " board_send(PORT_RADIO, (const uint8_t *)&value, 1);",
     r"a: blinker called board_send\(0\) within board_start: .* send from board_timer"),
    (STARTS, STARTS + " board_set_timer(32, 0, 0);",
     r"a: blinker called board_set_timer\(32\): timers are numbered 0 to 31"),
    (STARTS, "return 7;", "a: board_start of blinker returned 7: it refuses to start"),
])
def test_a_mistake_in_board_start_is_named(before: str, after: str, says: str, tmp_path: Path) -> None:
    assert re.search(says, failure(changed(tmp_path, (before, after)), tmp_path / "out").detail)


@pytest.mark.parametrize(("before", "after", "says"), [
    (SENDS, "board_send(PORT_RADIO + 1, frame, 1);", r"called board_send\(1\): no such number in board_ids.h"),
    (SENDS, SENDS + " board_actuate(0, 1.0);", r"called board_actuate\(0\): no such number"),
    (SENDS, SENDS + " board_count(9, 1);", r"called board_count\(9\): no such number"),
    (SENDS, "board_promise(next_ns + 5, BOARD_FIRM); " + SENDS, "PromiseBroken"),
    (SENDS, "board_adjust_clock(INT64_MAX, 0.5); board_adjust_clock(1, 0.5); " + SENDS,
     r"blinker called board_adjust_clock\(1, 0\.5\), after which its clock reads 9223372036854775808 ns"),
])
def test_a_mistake_in_board_timer_is_named(before: str, after: str, says: str, tmp_path: Path) -> None:
    assert re.search(says, failure(changed(tmp_path, (before, after)), tmp_path / "out").detail)


@pytest.mark.slow
def test_a_loop_without_end_is_named_with_its_function(tmp_path: Path) -> None:
    scenario = changed(tmp_path, (SENDS, "volatile int on = 1; while (on) {} " + SENDS))

    failed = failure(scenario, tmp_path / "out", "process", 8.0)

    assert failed.node in ("a", "b")
    assert "within node_timeout_s = 8 s: it hangs in board_timer of firmware blinker" in failed.reason


def test_a_crash_is_named_with_its_function(tmp_path: Path) -> None:
    scenario = changed(tmp_path, (SENDS, "volatile int *volatile nowhere = 0; *nowhere = 1; " + SENDS))

    failed = failure(scenario, tmp_path / "out", "process")

    assert "its process was ended by SIGSEGV in board_timer of firmware blinker" in failed.reason
