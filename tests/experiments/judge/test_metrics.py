"""Keys, statistics and verdicts on runs small enough to work out by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.metrics import evaluate, measure
from experiments.judge.run_data import RunData, load_run
from experiments.scenario.fate_keys import FATE_OF
from experiments.scenario.metric_keys import LEDGER_METRICS, STATISTICS, unknown_keys
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.ledger import Ledger
from netem.records.signal_table import SignalTable

MS = 1_000_000
NODES = {"r1": ("y", "u"), "r2": ("y", "u"), "base": ("gap",)}


@dataclass(frozen=True)
class Between:
    min: float | None = None
    max: float | None = None
    during_ns: tuple[int, int] | None = None
    formula: str = ""
    links: Mapping[str, Sequence[tuple[str, str, str]]] = field(default_factory=dict)
    share: float | None = None


def table(node: str, **signals: Sequence[float]) -> SignalTable:
    values = np.array(list(signals.values()), dtype=float).T
    return SignalTable(node, tuple(signals), ("1",) * len(signals), np.arange(len(values)) * 10 * MS, values)


def signals_run(**changes: object) -> RunData:
    signals = {"r1": table("r1", y=[3.0, -4.0, 1.0], u=[0.0, 0.0, 0.0]),
               "r2": table("r2", y=[1.0, 2.0, -2.0], u=[1.0, 1.0, 1.0]),
               "base": table("base", gap=[5.0, 4.0, 6.0])}
    counters = {"r1": {"missed": 2, "heard": 5}, "r2": {"missed": 3, "silent": 0}}
    data = RunData(30 * MS, FrameCopies.of_rows([]), signals, counters)
    return replace(data, **changes)  # type: ignore[arg-type]


def ledger_run(path: Path) -> RunData:
    ledger = Ledger(path / "ledger.parquet")

    def close(medium: str, number: int, fate: Fate, delivered_ms: int = -1) -> None:
        start = number * 10 * MS
        ledger.expect(1, medium)
        ledger.close(Frame(medium, "r1", number, start, b"x", on_air_ns=start, end_ns=start + MS), "r2", fate,
                     delivered_ns=delivered_ms * MS if delivered_ms >= 0 else -1)
    close("radio", 0, Fate.DELIVERED, 2)
    close("radio", 1, Fate.COLLIDED)
    close("radio", 2, Fate.QUEUE_FULL)
    close("radio", 5, Fate.DELIVERED, 52)
    close("can", 0, Fate.DELIVERED, 1)
    ledger.finish()
    return RunData(100 * MS, FrameCopies.of_file(path / "ledger.parquet"))


@pytest.mark.parametrize(("key", "value"), [
    ("frames_offered", 5), ("frames_delivered", 3), ("frames_collided", 1), ("frames_queue_full", 1),
    ("frames_lost_on_link", 0), ("frames_not_delivered", 2), ("radio.frames_offered", 4), ("can.frames_delivered", 1),
    ("radio.frames_queue_full", 1), ("radio.frames_not_delivered", 2), ("can.frames_not_delivered", 0),
    ("can.frames_collided", 0), ("delivery_ratio", 3 / 5), ("radio.delivery_ratio", 0.5), ("max_successive_losses", 2),
    ("can.max_successive_losses", 0), ("inter_transmission_min_s", 0.01), ("inter_transmission_max_s", 0.03),
    ("radio.age_of_information_max_s", 0.052), ("can.age_of_information_max_s", 0.1),
    # teeth of r1 -> r2: 0 to 2 ms on [0, 2), 2 to 52 ms on [2, 52), 2 to 50 ms on [52, 100)
    ("radio.age_of_information_mean_s", (2 * 1 + 50 * 27 + 48 * 26) / 100 * 1e-3),
])
def test_frames_are_counted_and_links_timed(tmp_path: Path, key: str, value: float) -> None:
    assert measure(key, ledger_run(tmp_path)) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("key", "value"), [
    ("r1.y.first", 3), ("r1.y.last", 1), ("r2.y.last_abs", 2), ("r1.y.min", -4), ("r1.y.max", 3), ("r1.y.abs_max", 4),
    ("r1.y.mean", 0), ("r1.y.rms", math.sqrt(26 / 3)), ("r?.y.spread_last", 3), ("r1.y.spread_last", 0),
    ("r*.y.abs_max", 4), ("*.y.min", -4), ("*.y.last", 1), ("base.gap.mean", 5),
    ("count.r1.missed", 2), ("count.r*.missed", 5), ("count.*.heard", 5), ("count.r2.silent", 0),
])
def test_statistics_of_signals_and_counters_are_those_computed_by_hand(key: str, value: float) -> None:
    assert measure(key, signals_run()) == pytest.approx(value)


@pytest.mark.parametrize(("bound", "value", "holds"), [
    (Between(min=-2.5), -2.0, True), (Between(min=-1.5), -2.0, False), (Between(max=1.0), 1.0, True),
    (Between(max=0.5), 1.0, False), (Between(-2.5, 1.0), 1.0, True), (Between(-2.0, 10.0), -2.0, True),
    (Between(), 1.0, True),
])
def test_a_bound_on_several_nodes_has_to_hold_at_each_of_them(bound: Between, value: float, holds: bool) -> None:
    verdict, = evaluate({"r*.y.last": bound}, signals_run())      # the last values are 1 and -2

    assert (verdict.value, verdict.holds) == (value, holds)
    assert (verdict.key, verdict.min, verdict.max) == ("r*.y.last", bound.min, bound.max)


@pytest.mark.parametrize(("key", "during_ms", "value"), [
    ("r1.y.rms", (0, 20), math.sqrt(25 / 2)), ("r1.y.last", (10, 20), -4), ("r1.y.first", (5, 100), -4),
])
def test_a_part_of_the_run_is_judged_alone(key: str, during_ms: tuple[int, int], value: float) -> None:
    window = Between(max=100.0, during_ns=(during_ms[0] * MS, during_ms[1] * MS))

    assert measure(key, signals_run(), window) == pytest.approx(value)


def test_frames_count_in_the_part_in_which_they_were_handed_out(tmp_path: Path) -> None:
    data = ledger_run(tmp_path)                 # radio: handed out at 0, 10, 20, 50 ms; can: at 0

    assert measure("radio.frames_offered", data, Between(max=9.0, during_ns=(10 * MS, 50 * MS))) == 2
    assert measure("delivery_ratio", data, Between(max=1.0, during_ns=(0, 20 * MS))) == pytest.approx(2 / 3)


def test_a_part_without_samples_has_no_value() -> None:
    verdict, = evaluate({"r1.y.rms": Between(max=9.0, during_ns=(40 * MS, 50 * MS))}, signals_run())

    assert (verdict.value, verdict.holds) == (None, False)


def test_a_value_that_is_not_a_number_never_holds() -> None:
    diverged = signals_run(signals={"r1": table("r1", y=[1.0, math.nan])})

    for key in ("r1.y.last", "r1.y.abs_max", "r1.y.mean", "r1.y.min", "r*.y.spread_last"):
        verdict, = evaluate({key: Between()}, diverged)
        assert (verdict.value, verdict.holds) == (None, False)


EVERY_FORM = [*LEDGER_METRICS, *(f"radio.{metric}" for metric in LEDGER_METRICS),
              *(f"r1.y.{statistic}" for statistic in STATISTICS), "count.r1.missed"]


@pytest.mark.parametrize("scenario", [{}, {"agents": {"r1": {}}, "media": {"radio": {}}}])
def test_every_metric_of_an_empty_run_is_zero_or_not_a_number(scenario: Mapping[str, object]) -> None:
    empty = RunData(10 * MS, FrameCopies.of_rows([]), scenario=dict(scenario))

    for key in EVERY_FORM:
        value = measure(key, empty)
        counted = "frames_" in key
        assert value == 0 if counted else math.isnan(value), key


def test_a_run_folder_without_a_ledger_knows_no_frame_counts(tmp_path: Path) -> None:
    data = load_run(tmp_path)

    files = [line.split(":")[0] for line in data.missing]
    assert files == ["scenario.json", "summary.json", "run.json", "ledger.parquet", "signals.mcap"]
    verdict, = evaluate({"frames_lost_on_link": Between(max=10)}, data)
    assert (verdict.value, verdict.holds) == (None, False)


def test_every_fate_has_a_metric() -> None:
    assert list(FATE_OF.values()) == list(Fate)
    assert len(FATE_OF) == len(Fate)


@pytest.mark.parametrize("medium", ["", "radio.", "can."])
def test_the_fates_other_than_delivered_add_up_to_what_was_not_delivered(tmp_path: Path, medium: str) -> None:
    data = ledger_run(tmp_path)

    value = {metric: measure(f"{medium}{metric}", data) for metric in (*FATE_OF, "frames_offered")}

    others = sum(value[metric] for metric, fate in FATE_OF.items() if fate is not Fate.DELIVERED)
    assert measure(f"{medium}frames_not_delivered", data) == others
    assert others + value["frames_delivered"] == value["frames_offered"]


@pytest.mark.parametrize(("former", "now"), [("frames_lost", "frames_lost_on_link"),
                                             ("frames_corrupted", "frames_caught_by_checksum")])
@pytest.mark.parametrize("medium", ["", "radio."])
def test_a_key_that_said_more_than_it_counted_is_refused_with_what_to_write(former: str, now: str, medium: str) -> None:
    line, = unknown_keys([medium + former], NODES, ["radio"])

    assert line.startswith(f"expect.{medium}{former}: counts only what ")
    assert line.endswith(f"; write {now} for that, or frames_not_delivered for all copies that did not arrive")


def test_valid_keys_pass_before_the_run() -> None:
    assert unknown_keys([*EVERY_FORM, "r?.u.rms", "*.y.spread_last"], NODES, ["radio"]) == []


@pytest.mark.parametrize(("key", "says", "nearest"), [
    ("frames_colided", "expected <metric>", "frames_collided"),
    ("delivery", "expected <metric>", "delivery_ratio"),
    ("radoi.frames_lost_on_link", "there is no medium 'radoi'", "radio.frames_lost_on_link"),
    ("radio.frames_losst", "expected <metric>", "radio.frames_lost_on_link"),
    ("r3.y.last", "no node matches 'r3'", "r2.y.last"),
    ("bsae.gap.last", "no node matches 'bsae'", "base.gap.last"),
    ("r1.z.last", "no node that matches 'r1' has a signal 'z'", "r1.y.last"),
    ("base.gpa.min", "no node that matches 'base' has a signal 'gpa'", "base.gap.min"),
    ("r1.y.lst", "expected <metric>", "r1.y.last"),
    ("r1.y", "expected <metric>", "r1.y."),
    ("count.r9.missed", "no node matches 'r9'", "count.r2.missed"),
    ("count.r1", "expected <metric>", ""),
    ("", "expected <metric>", ""),
    ("radio..lost_on_link", "expected <metric>", "radio.frames_lost_on_link"),
])
def test_an_unknown_key_is_named_with_the_nearest_valid_one(key: str, says: str, nearest: str) -> None:
    line, = unknown_keys([key, "frames_lost_on_link"], NODES, ["radio", "can"])

    assert line.startswith(f"expect.{key}: ")
    assert says in line
    assert nearest in line.rpartition("nearest: ")[2]


def test_node_names_alone_are_enough_before_signals_are_known() -> None:
    assert unknown_keys(["r1.anything.last"], ["r1"], []) == []
    assert len(unknown_keys(["r7.anything.last"], ["r1"], [])) == 1


def test_keys_that_name_nothing_in_the_run_do_not_hold_and_say_why() -> None:
    verdicts = evaluate({"r1.z.last": Between(), "count.r7.missed": Between(), "frames_lots": Between()}, signals_run())

    assert [(verdict.value, verdict.holds) for verdict in verdicts] == [(None, False)] * 3
    assert all("nearest: " in verdict.by_how_much() for verdict in verdicts)


@pytest.mark.parametrize(("key", "says"), [
    ("count.r1.herd", "no node that matches 'r1' has a counter 'herd'; nearest: count.r1.heard; "),
    ("count.r2.heard", "no node that matches 'r2' has a counter 'heard'; nearest: count.r2."),
    ("count.*.mised", "no node that matches '*' has a counter 'mised'; nearest: count.*.missed; ")])
def test_a_counter_that_never_was_does_not_hold_whatever_the_bound(key: str, says: str) -> None:
    verdict, = evaluate({key: Between(max=0.0)}, signals_run())

    assert (verdict.value, verdict.holds) == (None, False)
    assert verdict.by_how_much().startswith(says)
    assert verdict.by_how_much().endswith(f"at its start: board.count('{key.split('.')[-1]}', 0)")


def test_a_counter_that_was_declared_and_never_counted_holds_at_0() -> None:
    verdict, = evaluate({"count.r*.silent": Between(max=0.0)}, signals_run())

    assert (verdict.value, verdict.holds, verdict.why) == (0.0, True, "")


def test_a_run_whose_nodes_never_reported_has_no_counts() -> None:
    assert math.isnan(measure("count.*.missed", signals_run(counters={})))
