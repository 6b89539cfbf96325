"""Scripts of delays, flipped bits and duplicates: exactly the named frames, each with its own value."""

from __future__ import annotations

from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments.changes import Doubled, Flipped, Late, Lost, changes_of
from netem.impairments.contract import written_out
from netem.impairments.delay import Delay
from netem.impairments.rate_limit import RateLimit
from netem.impairments.scripted_corruption import ScriptedCorruption
from netem.impairments.scripted_delay import ScriptedDelay
from netem.impairments.scripted_duplicate import ScriptedDuplicate
from netem.impairments.scripted_loss import ScriptedLoss
from netem.impairments.traced import Trace

LINK = ("radio", "a", "b")


def test_exactly_the_named_frames_are_late(frames: Any) -> None:
    script = ScriptedDelay([3, 7], [20_000_000, 5])

    late = {one.number: out.arrival_ns - one.arrival_ns for one in frames(30) for out in script.carry(one)
            if out.arrival_ns != one.arrival_ns}

    assert late == {3: 20_000_000, 7: 5}
    assert script.least_delay_ns(8) == 0


def test_exactly_the_named_bits_are_flipped(frames: Any) -> None:
    script = ScriptedCorruption([3, 7], [[0, 9], [8 * 10**6]])

    out = {one.number: (came.data, one) for came in frames(30) for one in script.carry(came)}

    assert [number for number, (_, one) in out.items() if one.corrupt] == [3]       # frame 7 ends before its bit
    assert all(one.data == came for number, (came, one) in out.items() if number != 3)
    came, changed = out[3]
    assert changed.data == bytes((came[0] ^ 0x80, came[1] ^ 0x40)) + came[2:]
    assert not changed.undetected
    assert script.loses_as is Fate.CORRUPTED
    hidden, = ScriptedCorruption([0], [[0]], undetected=True).carry(Transit(0, 0, 0, b"a"))
    assert hidden.undetected


def test_exactly_the_named_frames_arrive_twice(frames: Any) -> None:
    script = ScriptedDuplicate([3], [70])

    out = [(one.number, one.arrival_ns - came.arrival_ns) for came in frames(5) for one in script.carry(came)]

    assert out == [(0, 0), (1, 0), (2, 0), (3, 0), (3, 70), (4, 0)]


@pytest.mark.parametrize("script", [
    ScriptedLoss([3], copy=1), ScriptedDelay([3], [5], copy=1), ScriptedCorruption([3], [[0]], copy=1),
    ScriptedDuplicate([3], [5], copy=1)])
def test_one_copy_of_a_frame_may_be_meant(script: Any) -> None:
    original = Transit(3, 0, 0, b"abc")

    assert list(script.carry(original)) == [original]
    assert list(script.carry(replace(original, copy=1))) != [replace(original, copy=1)]


@pytest.mark.parametrize(("make", "message"), [
    (lambda: ScriptedDelay([], []), r"delay_frames=\[\]: name at least one frame"),
    (lambda: ScriptedDelay([1, 2], [5]), r"delays_ns=\[5\]: expected one for each of delay_frames, 2 in all"),
    (lambda: ScriptedDelay([1], [0]), r"delays_ns=\[0\]: expected more than 0"),
    (lambda: ScriptedDelay([-1], [5]), r"delay_frames=\[-1\]: expected 0 <= number"),
    (lambda: ScriptedDelay([1, 1], [5, 6]), r"delay_frames=\[1\]: named twice; name each frame once"),
    (lambda: ScriptedDelay([1], [5], copy=-1), r"copy=-1: expected copy >= 0"),
    (lambda: ScriptedCorruption([1], [[-3]]), r"bits=\[-3\]: expected 0 or more"),
    (lambda: ScriptedCorruption([1], [[]]), r"bits=\[\[\]\]: expected at least one bit of each frame"),
    (lambda: ScriptedDuplicate([1], [-3]), r"extra_delays_ns=\[-3\]: expected 0 or more"),
    (lambda: ScriptedLoss([1], copy=-1), r"copy=-1: expected copy >= 0")])
def test_nonsense_is_refused_with_value_and_rule(make: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(("script", "changes"), [
    (ScriptedLoss([1]), [Lost()]), (ScriptedDelay([1], [5]), [Late(5)]), (ScriptedDuplicate([1], [5]), [Doubled(5)]),
    (ScriptedCorruption([1], [[0, 12]]), [Flipped((0, 12))]),
    (ScriptedCorruption([1], [[8]], undetected=True), [Flipped((8,), True)])])
def test_a_trace_tells_what_a_script_did_and_its_entry_does_it_again(script: Any, changes: list[Any]) -> None:
    """The trace passes everything on; an entry that the changes make is the script itself."""
    trace = Trace()
    watched = trace.watch("impairments[0] x", LINK, script)

    passed = [list(watched.carry(Transit(number, 9, 9, b"abc"))) for number in range(3)]

    assert passed == [list(script.carry(Transit(number, 9, 9, b"abc"))) for number in range(3)]
    (one,) = trace.watched
    assert (one.cause, one.link, one.copies, watched.loses_as) == ("impairments[0] x", LINK, 0, script.loses_as)
    assert [(effect.number, effect.copy, effect.sent_ns, changes_of(effect)) for effect in one.effects] == [
        (1, 0, 9, changes)]
    entry = changes[0].entry("radio: a -> b", {1: changes[0]})
    fields = {"delays_ns" if key == "delays_ms" else "extra_delays_ns" if key == "extra_delays_ms" else key:
              [round(part * 1e6) for part in value] if key.endswith("_ms") else value
              for key, value in entry.items() if key not in ("on", "kind")}
    assert type(script)(**fields) == script


def test_what_draws_is_written_out_and_what_does_not_stays_whole() -> None:
    assert written_out(Delay(5, "uniform", 3, rng=Random(0)))
    assert not written_out(Delay(5, rng=Random(0)))
    assert not written_out(RateLimit(8))
