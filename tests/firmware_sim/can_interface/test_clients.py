"""Stacks that people bring along run unmodified on `marconet` as on python-can's `virtual`: ISO-TP and UDS."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.judge.run_result import RunResult
from experiments.run.runner import run
from experiments.scenario import load

CASES = Path(__file__).parents[2] / "cases"
BYTES = 300
GET_IT = "can-isotp and udsoncan are not installed; get them with: pip install 'marconet[clients]'"
pytest.importorskip("isotp", reason=GET_IT)
pytest.importorskip("udsoncan", reason=GET_IT)

ON_VIRTUAL = """
import sys, threading, time
from can.interfaces.virtual import channels
sys.path.insert(0, sys.argv[1])
import ecus
stmin, notifier = int(sys.argv[2]), sys.argv[3] == "True"
threading.Thread(target=ecus.ecu, args=("virtual", "x"), kwargs={"stmin": stmin, "notifier": notifier},
                 daemon=True).start()
while not channels.get("x"):
    time.sleep(0.01)
ecus.tester("virtual", "x", stmin=stmin, notifier=notifier)
"""


def isotp(out: Path, stmin: int, notifier: bool, shuffle_start: int = 0) -> RunResult:
    own = f"{{stmin={stmin}, notifier={str(notifier).lower()}}}"
    scenario = load(CASES / "isotp_two_nodes" / "isotp.toml",
                    overrides=[f"agents.{name}.parameters={own}" for name in ("tester", "ecu")])
    return run(scenario, out=out, report=False, shuffle_start=shuffle_start)


def isotp_on_virtual(stmin: int, notifier: bool) -> str:
    """Output of the same programs on python-can's `virtual` bus. It runs on the wall clock, so it is run again, at most
    4 times, if a busy machine let one of its time-outs pass."""
    for _ in range(5):
        said = subprocess.run([sys.executable, "-c", ON_VIRTUAL, str(CASES / "isotp_two_nodes"), str(stmin),
                               str(notifier)], capture_output=True, text=True, check=True, timeout=60).stdout
        if "timed out" not in said:
            break
    return said


def without_times(text: str) -> list[str]:
    return sorted(re.sub(r", [\d.]+ s$| at [\d.]+$", "", line) for line in text.splitlines())


@pytest.mark.parametrize(("stmin_ms", "notifier"), [(5, False), (1, False), (5, True), (1, True)])
def test_isotp_does_the_same_on_marconet_as_on_virtual(tmp_path: Path, stmin_ms: int, notifier: bool) -> None:
    result = isotp(tmp_path, stmin_ms, notifier)

    ours = "".join((tmp_path / "logs" / f"{node}.log").read_text() for node in ("ecu", "tester"))
    theirs = isotp_on_virtual(stmin_ms, notifier)
    took_s = float(re.search(r"([\d.]+) s$", ours)[1])
    consecutive = -(-(BYTES - 6) // 7)          # 6 bytes in the first frame, 7 in each further one
    rests = consecutive - -(-consecutive // 8)  # STmin separates the frames of a block of 8
    assert result.summary.holds
    assert without_times(ours) == without_times(theirs)
    assert f"sent {BYTES}, got {BYTES} bytes, equal True" in ours
    assert took_s >= 2 * rests * stmin_ms / 1000


def test_repeated_runs_of_isotp_give_one_hash(tmp_path: Path) -> None:
    hashes = {isotp(tmp_path / str(order), 1, order == 2, order).summary.ledger_hash for order in (0, 1)}

    assert len(hashes) == 1


def test_a_uds_session_gets_its_answers_and_its_time_out(tmp_path: Path) -> None:
    results = [run(load(CASES / "uds_session" / "uds.toml"), out=tmp_path / str(order), report=False,
                   shuffle_start=order) for order in (0, 1)]

    said = (tmp_path / "0" / "logs" / "client.log").read_text()
    assert [re.search(pattern, said) is None for pattern in (
        "session ok", "VIN MARCONET123456789", r"routine answered positive=True after 4\.5\d\d s",
        "reset refused: ConditionsNotCorrect", r"no answer: Did not receive response in time")] == [False] * 5
    assert len({result.summary.ledger_hash for result in results}) == 1


def test_waiting_by_looking_at_the_clock_ends(tmp_path: Path) -> None:
    run(load(CASES / "exact_sleep_spin" / "spin.toml", overrides=['agents.b.program="spin:busy"']), out=tmp_path,
        report=False)

    strict, busy = ((tmp_path / "logs" / f"{node}.log").read_text() for node in "ab")
    assert 5_000_000 < int(strict.removeprefix("done at ")) < 5_010_000
    assert 0.02 <= float(busy.removeprefix("done at ")) < 0.0201
