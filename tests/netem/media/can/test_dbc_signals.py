"""Signals of frames on a bus, decoded by a DBC file: cantools is the oracle of values, the bench that of instants."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cantools
import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from netem.media.observation import MediumObserver
from tests.netem.media.can.can_bench import BIT, MS, CanBench

DBC = """VERSION ""
NS_ :
BS_ :
BU_ : a b

BO_ 288 Setpoint: 5 a
 SG_ Counter : 0|8@1+ (1,0) [0|255] "" b
 SG_ Left : 8|16@1- (0.01,0) [-20|20] "rad/s" b
 SG_ Gear : 24|4@1+ (1,0) [0|15] "" b

BO_ 512 Motor: 8 a
 SG_ Mode M : 0|8@1+ (1,0) [0|255] "" b
 SG_ Speed m1 : 8|16@1- (0.5,0) [0|0] "rpm" b
 SG_ Torque m1 : 24|16@1- (0.1,0) [0|0] "N.m" b
 SG_ Heat m2 : 8|8@1+ (1,-40) [0|0] "degC" b

BO_ 2148532496 Big: 8 b
 SG_ Value : 7|32@0+ (1,0) [0|0] "" a

VAL_ 288 Gear 0 "park" 1 "drive" 2 "reverse" ;
"""
CODEC: Any = cantools.database.load_string(DBC)


@pytest.fixture
def dbc(tmp_path: Path) -> Path:
    path = tmp_path / "drive.dbc"
    path.write_text(DBC)
    return path


def bench_with(dbc: Path, *patterns: str) -> tuple[CanBench, list[tuple[str, int, list[float]]]]:
    bench = CanBench("ab", dbc=dbc, dbc_signals=patterns, data_bit_rate_bps=2_000_000)
    found: list[tuple[str, int, list[float]]] = []
    bench.bus.observe(MediumObserver(sample=lambda table, time_ns, values: found.append((table, time_ns, values))))
    return bench, found


def frame(name: str, **values: float) -> CanFrame:
    message = CODEC.get_message_by_name(name)
    return CanFrame(message.frame_id, message.encode(values), message.is_extended_frame)


def test_signals_are_sampled_when_receivers_have_the_frame(dbc: Path) -> None:
    bench, found = bench_with(dbc, "*")
    sent = frame("Setpoint", Counter=7, Left=-12.5, Gear=2), frame("Big", Value=123456)

    bench.run((MS, "a", sent[0]), (2 * MS, "b", sent[1]))

    ends_ns = [(k + 1) * MS + (encode_frame(pack(each)).nominal_bits - 1) * BIT for k, each in enumerate(sent)]
    assert [row for row in found if row[0] != "can"] == [
        ("can_Setpoint", ends_ns[0], [7.0, -12.5, 2.0]), ("can_Big", ends_ns[1], [123456.0])]
    assert bench.bus.tables()["can_Setpoint"] == (("Counter", "1"), ("Left", "rad/s"), ("Gear", "1"))


def test_signals_of_each_multiplexer_value_have_a_table_of_their_own(dbc: Path) -> None:
    bench, found = bench_with(dbc, "Motor.*")

    bench.run((MS, "a", frame("Motor", Mode=1, Speed=-3.5, Torque=1.2)), (2 * MS, "a", frame("Motor", Mode=2, Heat=60)),
              (3 * MS, "a", CanFrame(512, bytes((9, *range(7))))), (4 * MS, "a", frame("Setpoint", Counter=1, Left=0,
                                                                                      Gear=0)))

    assert [(table, values) for table, _, values in found if table != "can"] == [
        ("can_Motor", [1.0]), ("can_Motor_m1", [-3.5, pytest.approx(1.2)]), ("can_Motor", [2.0]),
        ("can_Motor_m2", [60.0])]
    assert bench.counted["dbc_undecodable"] == 1            # the file has no signals for the value 9
    assert bench.counted["dbc_unknown_identifiers"] == 0    # a message that is there, but not recorded


def test_what_cannot_be_decoded_is_counted(dbc: Path) -> None:
    bench, found = bench_with(dbc, "Setpoint.Left")

    bench.run((MS, "a", CanFrame(288, bytes(4))), (2 * MS, "a", CanFrame(288, bytes(8))),
              (3 * MS, "a", CanFrame(0x7, b"")), (4 * MS, "a", CanFrame(288, extended=True)),
              (5 * MS, "a", CanFrame(288, remote=True, dlc=5)), (6 * MS, "a", CanFrame(288, bytes(5), fd=True)))

    assert [(table, values) for table, _, values in found if table != "can"] == [("can_Setpoint", [0.0])]
    assert (bench.counted["dbc_wrong_lengths"], bench.counted["dbc_unknown_identifiers"]) == (2, 2)


@pytest.mark.parametrize(("patterns", "complaint"), [
    (("Setpoint.Lefd",), r"dbc_signals=Setpoint.Lefd: no such MESSAGE.SIGNAL in drive.dbc; the nearest is "
                         "Setpoint.Left"),
    (("*", "Nothing.*"), r"dbc_signals=Nothing.\*: no such MESSAGE.SIGNAL"),
])
def test_a_pattern_without_signals_is_refused(dbc: Path, patterns: tuple[str, ...], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        bench_with(dbc, *patterns)


def test_too_many_signals_are_refused(tmp_path: Path) -> None:
    lines = "".join(f'BO_ {k + 1} M{k}: 8 a\n' + "".join(f' SG_ S{j} : {j}|1@1+ (1,0) [0|0] "" b\n' for j in range(64))
                    for k in range(5))
    (tmp_path / "wide.dbc").write_text(f'VERSION ""\nBU_ : a b\n{lines}')

    with pytest.raises(ValueError, match=r"320 signals of wide\.dbc: at most 256"):
        bench_with(tmp_path / "wide.dbc", "*")


def test_a_bus_without_the_key_has_no_tap(dbc: Path) -> None:
    assert CanBench("ab", dbc=dbc).bus.taps == []


SPEAKER = '''
from netem.media.can.frame import CanFrame, pack


class Speaker:
    """A setpoint every 10 ms: Counter k, Left k / 10."""

    def __init__(self, board):
        self.board, self.port, self.k = board, board.port("can0", listen_only=True), 0
        board.every(10_000_000, self.say)

    def say(self):
        self.port.send(pack(CanFrame(288, bytes((self.k, *(10 * self.k).to_bytes(2, "little"), 1, 0)))))
        self.k += 1


class Quiet:
    def __init__(self, board):
        board.port("can0", listen_only=True)
'''
SCENARIO = """# Setpoints.
# Question: do their signals reach the figures?
seed = 1
length_s = 0.1
sample_period_ms = 5
[agents]
a = { program = "speaker_of_signals:Speaker" }
b = { program = "speaker_of_signals:Quiet" }
[media.can0]
kind = "can"
bit_rate_bps = 500_000
dbc = "drive.dbc"
dbc_signals = ["Setpoint.*"]
[expect]
"can0_Setpoint.Left.max" = { min = 0.9, max = 0.9 }
"can0_Setpoint.Left.mean" = { min = 0.4499, max = 0.4501 }
"can0_Setpoint.Counter.last" = { min = 9, max = 9 }
"count.can0.dbc_wrong_lengths" = { max = 0 }
rises = "always[0.02 s, 0.099 s](can0_Setpoint.Left > 0.05 rad/s)"
"""


@pytest.fixture
def scenario(tmp_path: Path, dbc: Path) -> Iterator[Any]:
    (tmp_path / "speaker_of_signals.py").write_text(SPEAKER)

    def written(old: str = "", new: str = "") -> Path:
        assert old in SCENARIO
        (tmp_path / "case.toml").write_text(SCENARIO.replace(old, new) if old else SCENARIO)
        return tmp_path / "case.toml"

    yield written
    sys.modules.pop("speaker_of_signals", None)


def test_decoded_signals_are_figures_formulas_records_and_in_the_report(scenario: Any, tmp_path: Path) -> None:
    result = run(load(scenario()), host="inline", out=tmp_path / "runs")

    assert [verdict.holds for verdict in result.summary.verdicts] == [True] * 5
    table = load_run(result.folder).signals["can0_Setpoint"]
    assert list(table.column("Left")) == pytest.approx([k / 10 for k in range(10)])
    assert "can0_Setpoint" in (result.folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("old", "new", "complaint"), [
    ('dbc_signals = ["Setpoint.*"]', 'dbc_signals = ["Setpiont.*"]',
     "case.toml: media.can0.dbc_signals=Setpiont.*: no such MESSAGE.SIGNAL in drive.dbc; the nearest is Setpoint.Left"),
    ('dbc = "drive.dbc"\n', "", "no DBC file says what the frames mean; give its path as dbc"),
    ("Setpoint.Left.max", "Setpoint.Lift.max", "Setpoint.Lift.max"),
    ('"can0_Setpoint.Left.max"', '"can0_Setpont.Left.max"', "can0_Setpoint"),
    ("a = {", 'can0_Setpoint = { program = "speaker_of_signals:Quiet" }\na = {',
     "media.can0: it records signals as can0_Setpoint, the name of another node or medium; rename that one"),
])
def test_wrong_keys_are_refused_with_place_and_remedy(scenario: Any, tmp_path: Path, old: str, new: str,
                                                      complaint: str) -> None:
    with pytest.raises(ScenarioError) as error:
        run(load(scenario(old, new)), host="inline", out=tmp_path / "runs", report=False)

    assert complaint in "\n".join(error.value.problems)
