"""Budgets: what they say, what nothing can use, and the checker beside brute force and the maker of patterns."""

from __future__ import annotations

from itertools import combinations, pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.search.budget import BadBudget, LossLimit, breach, read_budget
from experiments.search.loss_patterns import crossed, extremal, greedy, mutated, randomly, repeating

NODES = {"radio": ("a", "b", "c")}
LIMITS = st.lists(st.tuples(st.integers(1, 4), st.integers(1, 5)).map(lambda pair: LossLimit(pair[0], sum(pair))),
                  min_size=1, max_size=2)


def brute_force(lost: set[int], limits: list[LossLimit], frames: int) -> bool:
    """Whether every window of every limit is within it."""
    return all(sum(number in lost for number in range(start, start + limit.of)) <= limit.most
               for limit in limits for start in range(-limit.of, frames))


def test_a_budget_holds_on_each_link_that_it_selects_and_several_hold_together() -> None:
    budget = read_budget(["radio: * -> c: at most 2 lost in a row", "radio: a -> c : at most 3 lost of 10",
                          "faults: at most 2 of kill, pause"], NODES, {})

    assert budget.losses == {("radio", "a", "c"): (LossLimit(2, 3), LossLimit(3, 10)),
                             ("radio", "b", "c"): (LossLimit(2, 3),)}
    assert (budget.faults, budget.kinds) == (2, ("kill", "pause"))


@pytest.mark.parametrize(("text", "problem"), [
    ("radio: * -> *: at most 0 lost in a row", "allows no loss, so nothing can use it: expected at least 1"),
    ("radio: * -> *: at most 5 lost of 5", "expected at most M lost of K with M < K"),
    ("radio: d -> *: at most 1 lost in a row", "'d' names no node on medium 'radio'"),
    ("radoi: * -> *: at most 1 lost in a row", "nearest: 'radio'"),
    ("faults: at most 0", "allows no fault, so nothing can use it: expected at least 1"),
    ("faults: at most 1 of kil", 'there is no fault \'kil\'; did you mean "kill"?'),
    ("radio: a -> b: never", 'expected "MEDIUM: SENDER -> RECEIVER: at most 2 lost in a row"'),
])
def test_what_nothing_can_use_is_refused_in_one_line(text: str, problem: str) -> None:
    with pytest.raises(BadBudget) as refused:
        read_budget([text], NODES, {})

    assert problem in str(refused.value)
    assert "\n" not in str(refused.value)


@given(st.sets(st.integers(0, 15)), LIMITS)
def test_the_checker_finds_what_brute_force_finds(lost: set[int], limits: list[LossLimit]) -> None:
    assert (breach(sorted(lost), limits) == "") == brute_force(lost, limits, 20)


@given(st.integers(1, 40), LIMITS, st.integers(0, 1000))
def test_every_pattern_that_is_made_is_within_its_limits(frames: int, limits: list[LossLimit], seed: int) -> None:
    rng = Random(seed)
    made = [*extremal(frames, limits), *(randomly(frames, limits, rng) for _ in range(3))]
    made += [mutated(pattern, frames, limits, rng) for pattern in made for _ in range(3)]
    made += [crossed(one, other, frames, limits, rng) for one, other in pairwise(made)]

    for pattern in made:
        assert breach(pattern, limits) == ""
        assert list(pattern) == sorted(set(pattern))
        assert all(0 <= number < frames for number in pattern)


@given(st.integers(1, 8), LIMITS)
def test_greedy_loses_as_many_frames_as_any_pattern_within_one_limit(frames: int, limits: list[LossLimit]) -> None:
    one = limits[:1]
    most = max(size for size in range(frames + 1) for lost in combinations(range(frames), size)
               if brute_force(set(lost), one, frames))

    assert len(greedy(range(frames), one)) == most


@given(st.integers(2, 40), LIMITS, st.integers(0, 1000))
def test_a_pattern_that_repeats_is_the_same_up_to_the_end_and_within_its_limits_beyond(
        frames: int, limits: list[LossLimit], seed: int) -> None:
    pattern = randomly(frames, limits, Random(seed)) if seed % 2 else next(iter(extremal(frames, limits)))

    first, every = repeating(pattern, frames, limits)

    if every is None:
        assert first == pattern
    else:
        longer = [number for number in range(10 * frames) if number % every in first]
        assert tuple(number for number in longer if number < frames) == pattern
        assert breach(longer, limits) == ""


def test_one_lost_one_delivered_repeats_every_second_frame() -> None:
    limits = (LossLimit(1, 2),)

    assert [repeating(pattern, 9, limits) for pattern in extremal(9, limits)] == [((0,), 2), ((1,), 2)]
