"""The consensus step by itself and its rate, against matrix powers and simulated rounds. Drifts: see the slots."""

from collections.abc import Collection, Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.slot_sync import Average, Correction, SlotSync
from firmware_sim.slot_sync_condition import contraction_per_round

ROUND_NS = 3_000_000
FAR_NS = 10**15                         # a bound that does not act

HEARS_L1 = {"1": "24", "2": "3", "3": "5", "4": "12", "5": "34"}


def ring(size: int) -> dict[str, list[str]]:
    return {str(i): [str((i + 1) % size)] for i in range(size)}


@st.composite
def strongly_connected(draw: st.DrawFn) -> dict[str, set[str]]:
    """A one-way ring and any further links."""
    size = draw(st.integers(2, 7))
    hears = {name: set(heard) for name, heard in ring(size).items()}
    for hearer, sender in draw(st.lists(st.tuples(st.sampled_from(list(hears)), st.sampled_from(list(hears))))):
        if hearer != sender:
            hears[hearer].add(sender)
    return hears


def rounds(offsets_ns: Mapping[str, int], hears: Mapping[str, Collection[str]], count: int, gain: float = 0.5,
           references: str = "") -> dict[str, int]:
    """Offsets of clocks without drift after rounds in which every frame is heard."""
    syncs = {name: SlotSync(FAR_NS, gain, reference=name in references) for name in hears}
    offsets = dict(offsets_ns)
    for _ in range(count):
        for name, heard in hears.items():
            for sender in heard:
                syncs[name].heard(sender, 0, offsets[name] - offsets[sender] + 800, airtime_ns=800)
        for name, sync in syncs.items():
            offsets[name] += sync.close_round(ROUND_NS).step_ns
    return offsets


@given(strongly_connected(), st.data(), st.floats(0.05, 0.95))
def test_rounds_are_powers_of_the_stochastic_matrix_and_all_clocks_meet(hears, data, gain):
    names = list(hears)
    offsets_ns = {name: data.draw(st.integers(-10**9, 10**9)) for name in names}
    W = (1 - gain) * np.eye(len(names))
    for i, name in enumerate(names):
        for sender in hears[name]:
            W[i, names.index(sender)] += gain / len(hears[name])
    values, vectors = np.linalg.eig(W.T)
    weights = np.real(vectors[:, np.argmin(abs(values - 1))])
    weights /= weights.sum()
    start = np.array([offsets_ns[name] for name in names], float)

    after = np.array([rounds(offsets_ns, hears, 40, gain=gain)[name] for name in names])

    # W does not lengthen errors in the maximum norm; each round rounds once to a nanosecond (1/2), floats add 1e-6.
    assert np.max(abs(after - np.linalg.matrix_power(W, 40) @ start)) <= 40 * 0.5 + 1e-3
    assert np.all(weights > 0)
    rate = contraction_per_round(hears, dict.fromkeys(hears, 0), gain)
    assert rate < 1
    # Rounding moves an eigenvalue of a Jordan block of size m by some eps^(1/m); m is below the number of nodes.
    moved = 2 * np.finfo(float).eps ** (1 / max(1, len(names) - 1))
    assert rate == pytest.approx(max(abs(v) for v in values if abs(v - 1) > 1e-9), abs=max(1e-6, moved))
    assert np.max(abs(np.linalg.matrix_power(W, 4096) @ start - weights @ start)) < 1 + rate**4096 * 1e12


@pytest.mark.parametrize(("rate_gain", "own_slot", "settles"), [
    (0.0, False, True), (0.05, False, True), (0.5, False, False), (0.1, True, False), (0.0, True, True)])
def test_a_one_way_ring_of_five_settles_or_swings_up_with_the_rate_trim(rate_gain, own_slot, settles):
    rate = contraction_per_round(ring(5), {str(i): i for i in range(5)}, 0.5, rate_gain, own_slot=own_slot)

    assert (rate < 1) is settles


@given(strongly_connected(), st.floats(0.05, 0.95), st.booleans(), st.data())
def test_steps_alone_always_bring_a_strongly_connected_team_together(hears, gain, own_slot, data):
    parts = {name: data.draw(st.integers(0, len(hears) - 1)) for name in hears}

    assert contraction_per_round(hears, parts, gain, own_slot=own_slot) < 1


@pytest.mark.parametrize(("hears", "references", "rate"), [
    ({"a": "b", "b": "a"}, "", 0.0),                    # both go half way and meet at once
    ({"a": "b", "b": "a"}, "a", 0.5),                   # b goes half way
    ({"a": "b", "b": ""}, "", 0.5),                     # b hears nobody and so leads
    ({"a": "b", "b": "a"}, "ab", 1.0),                  # two references never meet
    ({"a": "b", "b": "a", "c": "d", "d": "c"}, "", 1.0),    # two teams that do not hear each other
    ({"a": ""}, "", 0.0),
])
def test_the_rate_of_small_teams_is_the_one_seen_at_a_glance(hears, references, rate):
    together = dict.fromkeys(hears, 0)

    assert contraction_per_round(hears, together, 0.5, references=references) == pytest.approx(rate, abs=1e-12)


def test_teams_that_do_not_hear_each_other_are_found_exactly_also_with_a_rate_trim():
    two_teams = HEARS_L1 | {name + "'": [sender + "'" for sender in heard] for name, heard in HEARS_L1.items()}

    assert contraction_per_round(two_teams, dict.fromkeys(two_teams, 0), 0.5, rate_gain=0.1) == 1.0


def test_two_clocks_meet_half_way_in_one_round():
    assert rounds({"a": 1000, "b": 0}, {"a": "b", "b": "a"}, 1) == {"a": 500, "b": 500}


def test_a_reference_stays_and_the_others_come_to_it():
    offsets = rounds({"a": 1000, "b": 0}, {"a": "b", "b": "a"}, 40, references="a")

    assert offsets["a"] == 1000
    assert abs(offsets["b"] - 1000) <= 1        # half of 1 ns rounds to no step


@given(st.dictionaries(st.text("abc", min_size=1), st.integers(-10**9, 10**9), min_size=1),
       st.integers(1, 10**6), st.sampled_from(Average), st.floats(0, 1.9))
def test_no_correction_exceeds_the_bound(errors_ns, bound_ns, average, rate_gain):
    sync = SlotSync(bound_ns, average=average, rate_gain=rate_gain)
    for sender, error_ns in errors_ns.items():
        sync.heard(sender, 5_000, 5_000 + error_ns + 800 + 20, airtime_ns=800, latency_ns=20)

    step_ns, trim_ppm = sync.close_round(ROUND_NS)

    assert abs(step_ns) <= bound_ns
    assert abs(trim_ppm) <= rate_gain * bound_ns / ROUND_NS * 1e6 * (1 + 1e-12)
    assert step_ns * min(errors_ns.values()) <= 0 or min(errors_ns.values()) < 0 < max(errors_ns.values())


def test_the_rate_is_trimmed_by_a_share_of_the_step_unless_the_bound_clips_it():
    sync = SlotSync(bound_ns=60, rate_gain=0.2)

    sync.heard("x", 0, 900, airtime_ns=800)
    assert sync.close_round(ROUND_NS) == Correction(-50, pytest.approx(-0.2 * 50 / 3_000_000 * 1e6))
    sync.heard("x", 0, 2000, airtime_ns=800)
    assert sync.close_round(ROUND_NS) == Correction(-60, 0.0)


def test_a_clock_that_is_ahead_steps_back_and_one_that_is_behind_forward():
    ahead, behind = SlotSync(1000), SlotSync(1000)
    ahead.heard("x", expected_ns=0, arrived_ns=1000, airtime_ns=800)
    behind.heard("x", expected_ns=0, arrived_ns=600, airtime_ns=800)

    assert (ahead.close_round(ROUND_NS).step_ns, behind.close_round(ROUND_NS).step_ns) == (-100, 100)


def test_a_late_duplicate_does_not_count():
    sync = SlotSync(10_000)
    sync.heard("x", 0, 840, airtime_ns=800)
    sync.heard("x", 0, 5_800, airtime_ns=800)

    assert sync.close_round(ROUND_NS) == Correction(-20, 0.0)


def test_a_round_in_which_nothing_was_heard_changes_nothing_and_old_errors_are_forgotten():
    sync = SlotSync(1000, rate_gain=0.2)
    sync.heard("x", 0, 900, airtime_ns=800)
    sync.close_round(ROUND_NS)

    assert sync.close_round(ROUND_NS) == Correction(0, 0.0)


@pytest.mark.parametrize(("nonsense", "complaint"), [
    ({"bound_ns": 0}, "bound_ns=0"), ({"bound_ns": 1, "gain": 0.0}, "gain=0.0"),
    ({"bound_ns": 1, "gain": 1.0}, "gain=1.0"),
    ({"bound_ns": 1, "rate_gain": -0.1}, "rate_gain=-0.1"), ({"bound_ns": 1, "rate_gain": 2.0}, "rate_gain=2.0")])
def test_settings_without_sense_are_refused(nonsense, complaint):
    with pytest.raises(ValueError, match=complaint):
        SlotSync(**nonsense)
