"""The instant that a broken expectation leads to, found again by brute force over a small run."""

from __future__ import annotations

import math
from itertools import pairwise
from random import Random

import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_result import Verdict
from experiments.show.report.instants import instant_of
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.events import Event
from netem.records.ledger import Ledger
from netem.records.signals import SignalFile

MS = 1_000_000
LENGTH_NS = 1000 * MS
Y = {"a": lambda t: math.sin(7 * t), "b": lambda t: -2 * t * math.exp(-t)}
Copy = tuple[str, str, int, int, int, Fate]      # sender, receiver, number, offered, delivered, fate


def copies() -> list[Copy]:
    draw = Random("instants")
    found = []
    for number in range(60):
        offered = number * 15 * MS + draw.randrange(9 * MS)
        for sender, receiver in (("a", "b"), ("b", "a")):
            fate = draw.choice([Fate.DELIVERED, Fate.LOST, Fate.COLLIDED])
            delivered = offered + draw.randrange(1, 40) * MS if fate is Fate.DELIVERED else -1
            found.append((sender, receiver, number, offered, delivered, fate))
    return found


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> RunData:
    folder = tmp_path_factory.mktemp("run")
    ledger = Ledger(folder / "ledger.parquet")
    for sender, receiver, number, offered, delivered, fate in copies():
        frame = Frame("radio", sender, number, offered, b"x", on_air_ns=offered, end_ns=offered + MS)
        ledger.expect(1, "radio")
        ledger.close(frame, receiver, fate, delivered_ns=delivered)
    ledger.finish()
    recorder = SignalFile(folder / "signals.mcap")
    for node, signal in Y.items():
        recorder.declare(node, [("y", "1")])
        for k in range(100):
            recorder.append(node, k * 10 * MS, (signal(k * 0.01),))
    recorder.event(Event(300 * MS, "b", "slot missed", ""))
    recorder.finish({}, b'{"length_ns": 1000000000}')
    return load_run(folder)


def broken(data: RunData, key: str, value: float | None, window: tuple[int, int] | None = None) -> tuple[int, str]:
    found = instant_of(Verdict(key, value, None, None, holds=False), window, data)
    assert found is not None
    return found


@pytest.mark.parametrize(("statistic", "pick"), [("min", min), ("max", max)])
def test_an_extreme_leads_to_the_sample_where_it_stands(data, statistic, pick) -> None:
    value, k = pick((Y["b"](k * 0.01), k) for k in range(100))

    time_ns, words = broken(data, f"b.y.{statistic}", value)

    assert time_ns == k * 10 * MS
    assert words.startswith("b.y: ")


def test_of_several_nodes_it_leads_to_the_one_that_was_judged(data) -> None:
    value, k = max((abs(Y["a"](k * 0.01)), k) for k in range(100))

    assert broken(data, "*.y.abs_max", value)[0] == k * 10 * MS


def test_of_a_part_of_the_run_it_leads_into_that_part(data) -> None:
    inside = range(20, 40)
    value, k = max((Y["b"](k * 0.01), k) for k in inside)

    assert broken(data, "b.y.max", value, (200 * MS, 400 * MS))[0] == k * 10 * MS


def test_a_number_of_frames_leads_to_the_first_of_them(data) -> None:
    first = min(offered for _, _, _, offered, _, fate in copies() if fate is Fate.COLLIDED)

    assert broken(data, "radio.frames_collided", 40.0)[0] == first


def test_a_delivery_ratio_leads_to_the_first_copy_that_did_not_arrive_in_that_part(data) -> None:
    first = min(offered for _, _, _, offered, _, fate in copies() if fate is not Fate.DELIVERED and offered >= 500 * MS)

    assert broken(data, "delivery_ratio", 0.3, (500 * MS, 900 * MS))[0] == first


def test_an_age_leads_to_the_end_of_the_largest(data) -> None:
    worst = []
    for link in (("a", "b"), ("b", "a")):
        events = sorted((delivered, offered) for *nodes, _, offered, delivered, fate in copies()
                        if tuple(nodes) == link and fate is Fate.DELIVERED)
        newest = 0
        for delivered, offered in [*events, (LENGTH_NS, 0)]:
            worst.append((delivered - newest, delivered))
            newest = max(newest, offered)

    assert broken(data, "age_of_information_max_s", 1.0)[0] == max(worst)[1]


def test_losses_in_a_row_lead_to_the_first_frame_of_the_longest_row(data) -> None:
    rows = []
    for link in (("a", "b"), ("b", "a")):
        row: list[int] = []
        for *nodes, _, offered, _, fate in copies():
            if tuple(nodes) == link:
                row = [] if fate is Fate.DELIVERED else [*row, offered]
                rows.append(row)
    longest = max(map(len, rows))

    assert broken(data, "max_successive_losses", 9.0)[0] in {row[0] for row in rows if len(row) == longest}


@pytest.mark.parametrize(("which", "pick"), [("min", min), ("max", max)])
def test_times_between_transmissions_lead_to_the_extreme_one(data, which, pick) -> None:
    starts = sorted({offered for sender, _, _, offered, _, _ in copies() if sender == "a"})
    gap = pick(later - earlier for earlier, later in pairwise(starts))

    time_ns, _ = broken(data, f"inter_transmission_{which}_s", 0.1)

    assert time_ns - gap in starts


def test_a_counter_leads_to_the_first_event_of_its_name(data) -> None:
    assert broken(data, "count.*.slot missed", 1.0) == (300 * MS, "b: slot missed, for the first time")


@pytest.mark.parametrize("key", ["b.y.mean", "frames_queue_full", "count.*.other", "c.y.max"])
def test_what_no_instant_shows_leads_nowhere(data, key) -> None:
    assert instant_of(Verdict(key, None, None, None, holds=False), None, data) is None
