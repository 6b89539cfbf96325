"""One behaviour suite that every member of IMPAIRMENTS runs, and two impairments as an author may write them."""

from __future__ import annotations

import dataclasses
import typing
from itertools import accumulate
from pathlib import Path
from random import Random

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.construct import PASSED_IN
from netem.impairments.contract import only_loses
from netem.impairments.flow import Flow
from netem.impairments.recordings import Recordings
from netem.impairments.table import IMPAIRMENTS
from netem.impairments.window import Window
from netem.media.links import Links
from netem.records.ledger import Ledger
from tests.examples import examples


@dataclasses.dataclass
class Batches:
    """An author's own: copies come out at full microseconds, in order, also past the end of a window."""

    loses_as: typing.ClassVar[Fate] = Fate.LOST
    every_ns: int
    latest_ns: int = dataclasses.field(default=0, init=False)

    def carry(self, transit: Transit) -> typing.Iterator[Transit]:
        self.latest_ns = max(self.latest_ns, -(-transit.arrival_ns // self.every_ns) * self.every_ns)
        yield msgspec.structs.replace(transit, arrival_ns=self.latest_ns)

    def carry_outside(self, transit: Transit) -> Transit:
        if transit.arrival_ns >= self.latest_ns:
            return transit
        return msgspec.structs.replace(transit, arrival_ns=self.latest_ns)


@dataclasses.dataclass
class EverySecond:
    """An author's own with `carry` alone."""

    loses_as: typing.ClassVar[Fate] = Fate.LOST
    odd: bool = dataclasses.field(default=False, init=False)

    def carry(self, transit: Transit) -> typing.Iterator[Transit]:
        self.odd = not self.odd
        if self.odd:
            yield transit


KINDS: dict[str, typing.Any] = {**IMPAIRMENTS, "own:Batches": Batches, "own:EverySecond": EverySecond}
TRACE = "delay_ms,lost\n0,0\n2.5,0\n1,1\n0.000001,0\n"
EXAMPLES = {
    "independent loss": ("bernoulli_loss", {"loss_ratio": 0.3}),
    "bursty loss": ("gilbert_elliott", {"loss_ratio": 0.3, "mean_burst_frames": 4.0}),
    "bursts that let some through": ("gilbert_elliott", {"loss_ratio": 0.3, "mean_burst_frames": 4.0,
                                                         "loss_while_bad": 0.8, "loss_while_good": 0.1}),
    "netem's bursts": ("gemodel", {"p": 0.2, "r": 0.3, "one_minus_h": 0.9, "one_minus_k": 0.05}),
    "fades": ("gilbert_elliott_by_time", {"mean_good_ns": 40_000_000, "mean_bad_ns": 20_000_000,
                                          "loss_while_bad": 0.9}),
    "four states": ("four_state_loss", {"p13": 0.2, "p31": 0.3, "p32": 0.3, "p23": 0.5, "p14": 0.1}),
    "script": ("scripted_loss", {"lose_frames": [0, 2], "every": 3}),
    "script of delays": ("scripted_delay", {"delay_frames": [1, 3], "delays_ns": [5000, 1]}),
    "script of bit errors": ("scripted_corruption", {"corrupt_frames": [0, 4], "bits": [[0, 9], [3]]}),
    "script of duplicates": ("scripted_duplicate", {"duplicate_frames": [2], "extra_delays_ns": [0]}),
    "recording": ("trace", {"file": "trace.csv", "at_end": "wrap"}),
    "constant delay": ("delay", {"delay_ns": 5}),
    "uniform delay": ("delay", {"delay_ns": 1000, "distribution": "uniform", "jitter_ns": 5000}),
    "normal delay": ("delay", {"delay_ns": 1000, "distribution": "normal", "jitter_ns": 5000, "correlation": 0.6}),
    "pareto delay in order": ("delay", {"distribution": "pareto", "jitter_ns": 5000, "keep_order": True}),
    "paretonormal delay": ("delay", {"distribution": "paretonormal", "jitter_ns": 5000, "correlation": -0.4}),
    "empirical delay": ("delay", {"distribution": "empirical", "samples_ns": [4, 0, 9]}),
    "duplication": ("duplicate", {"duplicate_ratio": 0.4, "extra_delay_ns": 30}),
    "reordering": ("reorder", {"hold_ns": 700, "reorder_ratio": 0.3, "gap_frames": 2}),
    "bit errors": ("corrupt", {"bit_error_ratio": 0.02}),
    "damaged frames": ("corrupt", {"frame_ratio": 0.4}),
    "rate limit": ("rate_limit", {"rate_bps": 9600, "queue_frames": 2}),
    "fast rate limit": ("rate_limit", {"rate_bps": 80_000_000, "queue_frames": 5}),
    "short queue": ("rate_limit", {"rate_bps": 9600, "queue_ns": 20_000_000}),
    "constant delay in order": ("delay", {"delay_ns": 2500, "keep_order": True}),
    "own, in order": ("own:Batches", {"every_ns": 1700}),
    "own, with carry alone": ("own:EverySecond", {}),
}

few = settings(max_examples=examples(25), deadline=None)
copies = st.lists(st.tuples(st.integers(0, 10 ** 9), st.integers(0, 10 ** 6), st.binary(max_size=40)), max_size=30)
examples = pytest.mark.parametrize("example", EXAMPLES)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("recordings") / "trace.csv"
    path.write_text(TRACE)
    return path


def settings_of(example: str, recording: Path) -> dict[str, typing.Any]:
    settings = dict(EXAMPLES[example][1])
    return settings | {"file": str(recording)} if "file" in settings else settings


def build(example: str, recording: Path, seed: int = 7) -> typing.Any:
    kind = KINDS[EXAMPLES[example][0]]
    rng = {"rng": stream(seed, example)} if draws(kind) else {}
    return kind(**settings_of(example, recording), **rng)


def draws(kind: type) -> bool:
    return any(field.name == "rng" for field in dataclasses.fields(kind))


def entering(link: list[tuple[int, int, bytes]]) -> list[Transit]:
    """Copies in the order of time; an impairment before this one may have put their arrivals out of order."""
    in_order = sorted(link, key=lambda copy: copy[0])
    return [Transit(n, sent_ns, sent_ns + late_ns, data) for n, (sent_ns, late_ns, data) in enumerate(in_order)]


def carried(impairment: typing.Any, transits: list[Transit]) -> list[list[Transit]]:
    return [list(impairment.carry(transit)) for transit in transits]


def test_every_member_of_the_table_has_an_example_here():
    assert {kind for kind, _ in EXAMPLES.values()} == set(KINDS)


@examples
@few
@given(link=copies)
def test_no_copy_comes_out_before_it_came_in(example, recording, link):
    impairment = build(example, recording)

    for transit, out in zip(entering(link), carried(impairment, entering(link)), strict=True):
        assert all(copy.arrival_ns >= transit.arrival_ns and type(copy.arrival_ns) is int for copy in out)


@examples
@few
@given(link=copies)
def test_number_and_entry_stay_and_data_changes_only_in_a_copy_marked_corrupt(example, recording, link):
    impairment = build(example, recording)

    for transit, out in zip(entering(link), carried(impairment, entering(link)), strict=True):
        for copy in out:
            assert (copy.number, copy.sent_ns) == (transit.number, transit.sent_ns)
            assert len(copy.data) == len(transit.data)
            assert copy.corrupt == (copy.data != transit.data)


@examples
@few
@given(link=copies)
def test_what_came_in_is_left_as_it_was_and_twins_are_objects_of_their_own(example, recording, link):
    impairment, transits = build(example, recording), entering(link)

    out = carried(impairment, transits)

    untouched = entering(link)
    for transit, before, yielded in zip(transits, untouched, out, strict=True):
        assert transit == before
        assert len({id(copy) for copy in yielded}) == len(yielded)


@examples
@few
@given(link=copies)
def test_a_copy_that_is_already_corrupt_stays_corrupt(example, recording, link):
    transits = entering(link)
    for transit in transits:
        transit.corrupt = True

    out = carried(build(example, recording), transits)

    assert all(copy.corrupt for yielded in out for copy in yielded)


@examples
def test_the_same_seed_replays_the_same_and_another_seed_does_not(example, recording, frames):
    first, again, other = (carried(build(example, recording, seed), frames(500)) for seed in (7, 7, 8))

    assert first == again
    assert (first != other) == draws(KINDS[EXAMPLES[example][0]]) or example.startswith("constant delay")


@examples
def test_it_does_something(example, recording, frames):
    out = carried(build(example, recording), frames(500, every_ns=1000))

    assert out != [[transit] for transit in frames(500, every_ns=1000)]


@examples
def test_outside_its_window_it_neither_touches_a_copy_nor_draws(example, recording, frames):
    impairment = build(example, recording)
    windowed = Window(impairment, [(200, 300)])
    before = draws(type(impairment)) and impairment.rng.getstate()
    outside = [transit for transit in frames(500, every_ns=1) if not 200 <= transit.sent_ns < 300]

    out = [tuple(windowed.carry(transit)) for transit in outside]

    assert all(len(yielded) == 1 and yielded[0] is transit for yielded, transit in zip(out, outside, strict=True))
    assert (draws(type(impairment)) and impairment.rng.getstate()) == before


@examples
def test_inside_its_window_it_acts_as_without_one(example, recording, frames):
    windowed = Window(build(example, recording), [(0, 1_000_000_000)])

    out = carried(windowed, frames(500))

    assert out == carried(build(example, recording), frames(500))
    assert windowed.loses_as is build(example, recording).loses_as


WINDOWS_NS = [(2_000, 5_000), (5_000, 6_000), (9_000, 14_000)]         # the first two touch
across_edges = st.lists(st.tuples(
    st.integers(0, 20_000) | st.sampled_from([edge + by for window in WINDOWS_NS for edge in window for by in (-1, 0)]),
    st.binary(min_size=1, max_size=10)), max_size=40)


def is_inside(transit: Transit) -> bool:
    return any(start <= transit.sent_ns < end for start, end in WINDOWS_NS)


def undelayed(link: list[tuple[int, bytes]]) -> list[Transit]:
    return entering([(sent_ns, 0, data) for sent_ns, data in link])


def may_overtake(example: str, earlier: Transit, later: Transit) -> bool:
    """Whether the kind itself makes `later`, as it comes out, come before `earlier`."""
    kind, keys = EXAMPLES[example]
    if kind == "delay":
        return not keys.get("keep_order", False)            # each copy has a delay of its own
    if kind == "reorder":
        return is_inside(later) and later.arrival_ns == later.sent_ns           # it was chosen
    if kind == "duplicate":
        return earlier.arrival_ns > earlier.sent_ns         # only the twin is overtaken
    return kind in ("trace", "scripted_delay")              # each row, each named frame has a delay of its own


@examples
@few
@given(link=across_edges)
def test_across_the_edges_of_three_windows_nothing_overtakes_but_by_the_kind_itself(example, recording, link):
    out = carried(Window(build(example, recording), WINDOWS_NS), undelayed(link))

    in_order = [copy for yielded in out for copy in yielded]
    for place, later in enumerate(in_order):
        overtaken = [earlier for earlier in in_order[:place]
                     if earlier.arrival_ns > later.arrival_ns and earlier.number != later.number]
        assert all(is_inside(earlier) and may_overtake(example, earlier, later) for earlier in overtaken)


@examples
@few
@given(link=copies)
def test_a_copy_that_enters_outside_comes_out_once_unchanged_and_never_earlier(example, recording, link):
    windowed = Window(build(example, recording), [(start * 50_000, end * 50_000) for start, end in WINDOWS_NS])

    for transit, out in zip(entering(link), carried(windowed, entering(link)), strict=True):
        if not any(start * 50_000 <= transit.sent_ns < end * 50_000 for start, end in WINDOWS_NS):
            copy, = out
            assert (copy.number, copy.sent_ns, copy.data, copy.corrupt, copy.copy) == (
                transit.number, transit.sent_ns, transit.data, transit.corrupt, transit.copy)
            assert copy.arrival_ns >= transit.arrival_ns


@examples
@few
@given(link=across_edges)
def test_what_enters_outside_changes_nothing_for_what_enters_inside(example, recording, link):
    transits = undelayed(link)

    out = carried(Window(build(example, recording), WINDOWS_NS), transits)

    alone = carried(build(example, recording), [transit for transit in transits if is_inside(transit)])
    assert [yielded for transit, yielded in zip(transits, out, strict=True) if is_inside(transit)] == alone


@examples
@few
@given(link=across_edges)
def test_every_copy_across_the_edges_ends_in_one_fate(example, recording, link):
    ledger, arrived = Ledger(), []
    windowed = Window(build(example, recording), WINDOWS_NS)

    def deliver(receiver: str, medium: str, arrival_ns: int, data: bytes) -> bool:
        arrived.append(arrival_ns)
        return True

    links = Links(ledger, deliver, {("radio", "a", "b"): [("windowed", windowed)]})
    for transit in undelayed(link):
        ledger.expect(1)
        links.receive(Frame("radio", "a", transit.number, transit.sent_ns, transit.data), "b", transit.sent_ns,
                      checksum=False)

    result = ledger.finish()                    # raises if copies are missing
    assert result.rows == result.expected >= len(link)
    assert len(arrived) == sum(count for fate, count in result.by_fate.items() if fate.startswith("delivered"))


@examples
@few
@given(gaps=st.lists(st.integers(0, 3_000_000), max_size=30), late=st.lists(st.integers(0, 9_000), min_size=31),
       windowed=st.booleans(), every_ns=st.sampled_from([2_000, 9_000_000]))
def test_no_copy_comes_later_than_the_bound_that_the_kind_gives(example, recording, gaps, late, windowed, every_ns):
    """Frames of 10 bytes, `every_ns` apart at least; an impairment before this one delayed each by up to 9 us."""
    impairment = build(example, recording)
    if not hasattr(impairment, "most_delay_ns"):
        return
    most_ns = 9_000 + impairment.most_delay_ns(Flow((10,), every_ns))
    window = Window(impairment, [(0, 10_000_000), (20_000_000, 25_000_000)]) if windowed else impairment
    sent_ns = list(accumulate(gaps, lambda at_ns, gap_ns: at_ns + every_ns + gap_ns, initial=0))

    out = carried(window, [Transit(n, at_ns, at_ns + late[n], b"0123456789") for n, at_ns in enumerate(sent_ns)])

    assert all(copy.arrival_ns - copy.sent_ns <= most_ns for yielded in out for copy in yielded)
    assert all(len(yielded) <= getattr(impairment, "most_copies", 1) for yielded in out)


@examples
def test_what_delays_says_how_much_at_most(example, recording, frames):
    impairment = build(example, recording)

    out = carried(impairment, frames(500))

    delays = any(copy.arrival_ns > copy.sent_ns for yielded in out for copy in yielded)
    assert hasattr(impairment, "most_delay_ns") or not delays or example.startswith("own")


@examples
def test_a_copy_that_enters_when_nothing_is_under_way_any_more_passes_at_once(example, recording):
    windowed = Window(build(example, recording), WINDOWS_NS)
    inside = undelayed([(at_ns, b"0123456789") for at_ns in range(2_000, 14_000, 100)])
    carried(windowed, inside)
    much_later = Transit(len(inside), 10**12, 10**12, b"late")

    out = list(windowed.carry(much_later))

    assert out == [much_later]


@pytest.mark.parametrize("name", IMPAIRMENTS)
def test_fields_are_the_toml_keys_and_a_generator_passed_by_keyword(name):
    kind = IMPAIRMENTS[name]
    types = typing.get_type_hints(kind)
    keys = [field for field in dataclasses.fields(kind) if field.init and field.name not in PASSED_IN]

    assert isinstance(kind.loses_as, Fate)
    for key in keys:
        assert not key.kw_only
        assert types[key.name] in (int, int | None, list[int]) or not key.name.endswith("_ns")
    passed_in = [field for field in dataclasses.fields(kind) if field.name in PASSED_IN]
    assert all(field.kw_only and types[field.name] in (Random, Recordings) for field in passed_in)


@examples
@few
@given(link=copies)
def test_one_that_only_loses_passes_the_others_as_they_came_and_does_lose(example, recording, link):
    if not only_loses(KINDS[EXAMPLES[example][0]]):
        return
    later = [(2 * 10 ** 9 + n * 1_000_000, 0, b"") for n in range(200)]         # each example loses a tenth or more

    out = carried(build(example, recording), entering([*link, *later]))

    assert all(copies == [came] for came, copies in zip(entering([*link, *later]), out, strict=True) if copies)
    assert not all(out)
    assert KINDS[EXAMPLES[example][0]].loses_as is Fate.LOST


@examples
@few
@given(link=copies)
def test_one_that_only_delays_passes_each_copy_once_and_as_it_came_apart_from_its_arrival(example, recording, link):
    if not getattr(KINDS[EXAMPLES[example][0]], "only_delays", False):
        return

    out = carried(build(example, recording), entering(link))

    for came, leaving in zip(entering(link), out, strict=True):
        (left,) = leaving
        assert left.arrival_ns >= came.arrival_ns
        assert msgspec.structs.replace(left, arrival_ns=came.arrival_ns) == came


def test_those_that_only_delay_are_known():
    assert {name for name, kind in IMPAIRMENTS.items() if getattr(kind, "only_delays", False)} == {
        "delay", "reorder", "scripted_delay"}
