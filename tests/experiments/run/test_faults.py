"""Faults in runs, on both hosts: what each costs, instant by instant, and one ledger hash."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from experiments.scenario import load
from experiments.show.report import series
from tests.experiments.run.fault_bench import MS, PROGRAM, SCENARIO, Ran


def test_a_killed_node_is_silent_and_hears_nothing_until_its_program_starts_anew(both: Any, tmp_path: Path) -> None:
    ran = both('[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.3\nrestart_after_s = 0.405\n')

    sent_ms = [row["offered_ns"] / MS for row in ran.copies(sender="b", receiver="a")]
    assert sent_ms == [*range(3, 300, 10), *range(713, 1000, 10)]       # from its boot at 705 ms on
    for row in ran.copies(receiver="b"):
        arrival_ns = row["end_ns"] + 300_000
        assert row["fate"] == ("receiver gone" if 300 * MS <= arrival_ns < 705 * MS else "delivered")
    sent = ran.samples("b", "sent", "draw", "local")
    dead = (sent[:, 0] >= 300) & (sent[:, 0] < 705)
    assert np.isnan(sent[dead][:, 1:]).all()
    assert not np.isnan(sent[~dead]).any()
    assert sent[-1, 1] == 28                # at 990 ms; counted from 0 in the second life
    assert len(set(sent[~dead][:, 2])) == 2                             # each life draws from a stream of its own
    assert sent[-1, 3] == pytest.approx(0.99)                           # the clock ran on
    heard = len(ran.copies(receiver="b", fate="delivered"))
    assert ran.data.counters["b"]["heard"] == heard == len(ran.heard_ms("b"))
    assert [(event.time_ns / MS, event.node, event.kind) for event in ran.data.events if "fault" in event.kind] == [
        (300, "b", "fault"), (705, "b", "fault over")]
    log = (tmp_path / "process" / "run" / "logs" / "b.log").read_text()
    assert log.splitlines() == ["begins at 0", "begins at 705000000"]


def test_a_clock_may_start_anew_with_its_robot(both: Any) -> None:
    ran = both('[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.3\nrestart_after_s = 0.4\nclock = "reset"\n')

    local = ran.samples("b", "local")
    assert local[-1, 1] == pytest.approx(0.29)
    assert [row["offered_ns"] / MS for row in ran.copies(sender="b", receiver="a")][-1] == 993      # 700 + 293


@pytest.mark.parametrize("restart", ["", "restart_after_s = 0.2\n"])
def test_the_plant_outlives_its_robot_to_the_last_bit(both: Any, tmp_path: Path, restart: str) -> None:
    alive = Ran(tmp_path / "alive", "inline", "")
    ran = both(f'[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.305\n{restart}')

    outputs = [name for name in alive.data.signals["b"].names if name not in ("sent", "draw", "local")]
    assert {"x", "y"} <= set(outputs)
    found, expected = ran.samples("b", *outputs), alive.samples("b", *outputs)
    same = 51 if restart else 100           # at 505 ms the program sets the inputs again: a step in two parts
    assert found[:same].tobytes() == expected[:same].tobytes()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
    assert alive.samples("b", "x")[-1, 1] > 0.3                         # it moves


def test_inputs_may_change_when_the_robot_is_dead(both: Any) -> None:
    ran = both('[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.3\ninputs_when_dead = { v_cmd = 0.0, omega_cmd = 0.0 }\n')

    x = ran.samples("b", "x")
    assert x[30, 0] == 300
    assert np.ptp(x[31:, 1]) < 1e-3 < np.ptp(x[:30, 1])


def test_a_node_may_be_killed_again_and_again(both: Any) -> None:
    ran = both('[[faults]]\nkind = "kill"\non = "[bc]"\nat_s = 0.1\nrestart_after_s = 0.05\nevery_s = 0.2\ntimes = 4\n')

    sent_ms = [row["offered_ns"] / MS for row in ran.copies(sender="b", receiver="a")]
    assert sent_ms == [ms for ms in range(3, 1000, 10) if not any(at <= ms < at + 50 for at in (100, 300, 500, 700))]
    assert ran.samples("b", "x")[-1, 1] > 0.3


def test_what_arrives_at_a_paused_node_waits_up_to_the_depth_of_its_buffer(both: Any) -> None:
    ran = both('[[faults]]\nkind = "pause"\non = "b"\nduring_s = [0.3, 0.5]\nbuffer_frames = 7\n')

    for row in ran.copies(sender="b"):
        assert not 300 * MS <= row["offered_ns"] < 500 * MS
    late = [row for row in ran.copies(sender="b", receiver="c") if row["offered_ns"] == 500 * MS]
    assert sorted(row["fate"] for row in late) == ["collided"] + ["sender busy"] * 19      # 20 timers rang at once
    arrived = sorted(ran.copies(receiver="b"), key=lambda row: row["end_ns"])
    waiting = [row for row in arrived if 300 * MS <= row["end_ns"] + 300_000 < 500 * MS]
    assert [row["fate"] for row in waiting] == ["delivered"] * 7 + ["receiver paused"] * 33
    heard_ms = ran.heard_ms("b")
    assert heard_ms.count(500) == 7
    assert not any(300 <= ms < 500 for ms in heard_ms)
    x = ran.samples("b", "x")
    assert (np.diff(x[30:50, 1]) > 0).all()                             # the plant goes on


@pytest.mark.parametrize("by_ms", [20, -20])
def test_a_clock_that_is_stepped_moves_later_broadcasts(both: Any, by_ms: int) -> None:
    ran = both(f'[[faults]]\nkind = "clock_step"\non = "b"\nat_s = 0.5\nby_ms = {by_ms}\n')

    sent_ms = [row["offered_ns"] / MS for row in ran.copies(sender="b", receiver="a")]
    # the timer for 503 ms was armed before: set forward it rings then, late, with those for 513 and 523 at once
    late = [503] * 3 if by_ms > 0 else []
    assert sent_ms[:50] == list(range(3, 500, 10))
    assert sent_ms[50:50 + len(late)] == late
    assert sent_ms[50 + len(late):] == [ms - by_ms for ms in range(533 if by_ms > 0 else 503, 1000 + by_ms, 10)]
    assert ran.samples("b", "local")[-1, 1] == pytest.approx(0.99 + by_ms / 1e3)


@pytest.mark.parametrize("clock", ["kept", "reset"])
def test_a_clock_goes_wrong_while_its_robot_is_dead(both: Any, clock: str) -> None:
    ran = both(f'[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.1\nrestart_after_s = 0.3\nclock = "{clock}"\n'
               '[[faults]]\nkind = "clock_drift"\non = "b"\nduring_s = [0.2, 0.6]\nby_ppm = 100_000\n'
               '[[faults]]\nkind = "clock_step"\non = "b"\nat_s = 0.3\nby_ms = 5\n')

    local = ran.samples("b", "local")
    at_400_ms = 0.4 + 0.2 * 0.1 + 0.005 if clock == "kept" else 0.0
    assert local[41, 1] == pytest.approx(at_400_ms + 0.01 * 1.1)
    assert local[-1, 1] == pytest.approx(at_400_ms + 0.2 * 1.1 + 0.39)


def test_a_drifting_clock_sends_at_the_instants_of_its_rate(both: Any) -> None:
    ran = both('[[faults]]\nkind = "clock_drift"\non = "b"\nduring_s = [0.2, 0.6]\nby_ppm = 100_000\n')

    instants = [ms if ms <= 203 else 200 + (ms - 200) / 1.1 if ms <= 640 else ms - 40 for ms in range(3, 1040, 10)]
    sent_ms = [row["offered_ns"] / MS for row in ran.copies(sender="b", receiver="a")]
    # a timer that is armed rings when it was going to: those for 203 ms and for the first after 600 ms
    assert sent_ms == pytest.approx(instants, abs=1.0)
    assert sent_ms[30:55] == pytest.approx(instants[30:55], abs=1e-6)
    assert sent_ms[70:] == pytest.approx(instants[70:], abs=1e-6)


def test_a_link_that_is_down_carries_nothing_that_enters_or_would_arrive(both: Any) -> None:
    delay = '[[impairments]]\non = "radio: a -> b"\nkind = "delay"\ndelay_ms = 35\n'
    ran = both(delay + '[[faults]]\nkind = "link_down"\nname = "crossing"\non = "radio: a -> b"\n'
                       'during_s = [[0.3, 0.4], [0.35, 0.5]]\n')

    for row in ran.copies(sender="a", receiver="b"):
        entered_ns = row["end_ns"] + 300_000
        down = any(300 * MS <= at_ns < 500 * MS for at_ns in (entered_ns, entered_ns + 35 * MS))
        if entered_ns + 35 * MS < 1000 * MS:
            assert (row["fate"], row["cause"]) == (("cut", "crossing link_down") if down else ("delivered", ""))
    assert not [row for row in ran.rows if row["fate"] == "cut" and (row["sender"], row["receiver"]) != ("a", "b")]


@pytest.mark.parametrize(("keys", "pairs"), [
    ('groups = [["a"], ["b", "c"]]', {"ab", "ba", "ac", "ca"}),
    ('groups = [["a"], ["b", "c"]]\none_way = true', {"ab", "ac"}),
    ('groups = [["a"], ["b"]]', {"ab", "ba"}),
    ('shape = "halves"', {"ac", "ca", "bc", "cb"}),
    ('shape = "bridge"', {"ac", "ca"}),
    ('shape = "isolate"\nnodes = ["c"]', {"ac", "ca", "bc", "cb"})])
def test_a_partition_cuts_the_links_between_its_groups(tmp_path: Path, keys: str, pairs: set[str]) -> None:
    fault = f'[[faults]]\nkind = "partition"\non = "radio"\nduring_s = [0.3, 0.5]\n{keys}\n'
    ran = Ran(tmp_path / "run", "inline", fault)

    cut = ran.copies(fate="cut")
    assert {row["sender"] + row["receiver"] for row in cut} == pairs
    assert len(cut) == 20 * len(pairs)
    assert {row["cause"] for row in cut} == {"faults[0] partition"}


def test_bits_flipped_behind_the_checksum_reach_the_program(both: Any) -> None:
    ran = both('[[faults]]\nkind = "undetected_corruption"\non = "radio: a -> b"\nduring_s = [0.3, 0.5]\n')

    changed = ran.copies(fate="delivered corrupt")
    assert {(row["sender"], row["receiver"]) for row in changed} == {("a", "b")}
    assert len(changed) == 20
    sent = [event.detail for event in ran.data.events if (event.node, event.kind) == ("b", "heard")
            and 300 * MS <= event.time_ns < 500 * MS]
    flips = [bin(int.from_bytes(bytes.fromhex(frame), "little") ^ number).count("1")
             for frame, number in zip(sent[::2], range(31, 51), strict=True)]
    assert flips == [1] * 20


def test_random_instants_are_drawn_from_the_faults_own_stream(tmp_path: Path) -> None:
    (tmp_path / "beacon.py").write_text(PROGRAM)
    fault = '[[faults]]\nkind = "pause"\nname = "{name}"\non = "b"\nrate_per_s = 40.0\nlasts_ms = 1\n'
    drawn = []
    for faults in (fault.format(name="one"), fault.format(name="other") + fault.format(name="one")):
        (tmp_path / "faults.toml").write_text(SCENARIO + faults)
        drawn.append(load(tmp_path / "faults.toml").faults[-1].occurrences)

    assert drawn[0] == drawn[1]
    starts_s = np.array([start_ns for start_ns, _ in drawn[0]]) / 1e9
    assert 18 <= len(starts_s) <= 66                    # 40 on average: four standard deviations of a Poisson number
    assert (np.diff(starts_s) > 0).all()


def test_overlapping_random_kills_are_told_and_have_no_effect(both: Any) -> None:
    ran = both('[[faults]]\nkind = "kill"\non = "b"\nrate_per_s = 20.0\nrestart_after_ms = 100\n')

    kinds = [event.kind for event in ran.data.events if event.node == "b" and "fault" in event.kind]
    assert kinds.count("fault without effect") > 0
    down_ns = 0
    for event in ran.data.events:
        if event.kind == "fault" and event.time_ns >= down_ns:
            down_ns = event.time_ns + 100 * MS
            assert not [row for row in ran.copies(sender="b") if event.time_ns <= row["offered_ns"] < down_ns]


def test_figures_and_formulas_leave_out_what_a_dead_program_did_not_record(tmp_path: Path) -> None:
    expected = ('[expect]\n"b.sent.max" = { min = 28, max = 30 }\n"b.sent.last" = { min = 1 }\n'
                'grows = "always(b.sent <= 30)"\n'
                '[guarantees.small]\nkind = "signal"\non = "b.sent"\nbelow = 40\n')
    ran = Ran(tmp_path / "run", "inline", '[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.3\nrestart_after_s = 0.4\n'
              + expected)

    assert {verdict["key"]: verdict["holds"] for verdict in ran.data.summary["verdicts"]} == {
        "guarantee.small.violations": True, "b.sent.max": True, "b.sent.last": True, "grows": True}


def test_the_report_and_the_mcap_file_have_the_occurrences_in_time(tmp_path: Path) -> None:
    ran = Ran(tmp_path / "run", "inline", '[[faults]]\nkind = "link_down"\nname = "cut"\non = "radio: a -> b"\n'
              'during_s = [[0.3, 0.4], [0.6, 0.8]]\n[[faults]]\nkind = "clock_step"\non = "c"\nat_s = 0.5\nby_ms = 1\n')

    assert series.faulty(ran.data) == [{"from_s": pytest.approx(start), "until_s": pytest.approx(end),
                                        "text": "radio: cut link_down a -> b"}
                                       for start, end in ((0.3, 0.4), (0.6, 0.8))]
    marks, = [mark for mark in series.switching(ran.data)["marks"] if mark["label"] == "fault begins"]
    assert [event["t_s"] for event in marks["events"]] == pytest.approx([0.3, 0.5, 0.6])
    with (ran.out / "signals.mcap").open("rb") as file:
        logged = [(message.log_time, message.data) for _, _, message in make_reader(file).iter_messages()]
    assert {round(time_ns / MS) for time_ns, data in logged if b"cut link_down" in data} == {300, 400, 600, 800}


def test_a_fault_that_lasts_to_the_end_of_the_run_is_shaded_to_there(tmp_path: Path) -> None:
    ran = Ran(tmp_path / "run", "inline", '[[faults]]\nkind = "link_down"\non = "radio: a -> b"\nat_s = 0.3\n'
              '[[faults]]\nkind = "kill"\nname = "gone"\non = "b"\nat_s = 0.6\n'
              '[[faults]]\nkind = "link_down"\nname = "door"\non = "radio: a -> c"\nduring_s = [0.7, 1.5]\n'
              '[[faults]]\nkind = "clock_step"\non = "c"\nat_s = 0.5\nby_ms = 1\n'
              '[[faults]]\nkind = "kill"\non = "a"\nat_s = 0.9\nrestart_after_s = 0.5\n')

    assert [(interval["from_s"], interval["until_s"], interval["text"]) for interval in series.faulty(ran.data)] == [
        (pytest.approx(from_s), 1.0, text) for from_s, text in (
            (0.3, "radio: faults[0] link_down a -> b"), (0.6, "b: gone kill"), (0.7, "radio: door link_down a -> c"),
            (0.9, "a: faults[4] kill"))]
    foreign = replace(ran.data, scenario={"faults": [{"kind": "a kind of another version", "settings": {}}]})
    assert series.faulty(foreign) == []
