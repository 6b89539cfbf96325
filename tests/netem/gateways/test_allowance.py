"""What one peer may send in a time: never more than the rate allows, and all of what it allows."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from netem.gateways.allowance import Allowance

S = 1_000_000_000


@given(st.integers(1, 1000), st.lists(st.tuples(st.integers(0, S // 10), st.integers(1, 20)), max_size=100))
def test_what_is_taken_stays_below_the_rate_and_one_burst(per_s: int, asked: list[tuple[int, int]]) -> None:
    allowance, now_ns, taken = Allowance(per_s, 0), 0, 0
    for step_ns, amount in asked:
        now_ns += step_ns
        taken += amount * allowance.take(now_ns, amount)

    assert taken <= per_s + per_s * now_ns / S


def test_at_the_rate_everything_is_taken() -> None:
    allowance = Allowance(7, 0)

    assert all(allowance.take(-(-k * S // 7)) for k in range(1000))


def test_who_took_too_much_waits_until_the_credit_is_back() -> None:
    allowance = Allowance(10, 0)
    assert not allowance.take(0, 25)
    allowance.charge(25)

    due_ns = allowance.due_ns()

    assert due_ns == 3 * S // 2 + 1             # 15 missing, and one part of 1e-9 more
    assert allowance.take(due_ns, 0)
    assert allowance.due_ns() == due_ns
