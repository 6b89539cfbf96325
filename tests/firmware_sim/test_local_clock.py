from fractions import Fraction
from math import floor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock

DAY_NS = 86_400 * 10**9

settings = st.builds(ClockSettings, offset_ns=st.integers(-10**12, 10**12),
                     drift_ppm=st.integers(-500_000_000, 500_000_000).map(lambda parts: parts / 1e6),
                     tick_ns=st.integers(1, 10**7))
instants = st.integers(0, 30 * DAY_NS)
ppms = st.floats(-400, 400).map(lambda ppm: round(ppm, 6))


class TrueTime:
    def __init__(self, now_ns: int = 0) -> None:
        self.now_ns = now_ns

    def __call__(self) -> int:
        return self.now_ns


def exact_reading(setting: ClockSettings, true_ns: int) -> int:
    """The model's formula in rationals, with the drift read as the decimal that was written down."""
    drift = Fraction(repr(setting.drift_ppm)) / 10**6
    return setting.tick_ns * floor((setting.offset_ns + (1 + drift) * true_ns) / setting.tick_ns)


@given(settings, instants)
def test_the_reading_is_the_exact_rational_formula_even_after_weeks(setting, true_ns):
    clock = LocalClock(setting, TrueTime(true_ns))

    assert clock.now_ns() == clock.reading_at(true_ns) == exact_reading(setting, true_ns)


@given(settings, st.integers(-10**12, 30 * DAY_NS))
def test_true_at_is_the_first_instant_that_reads_at_least_the_local_time(setting, local_ns):
    clock = LocalClock(setting, TrueTime())

    true_ns = clock.true_at(local_ns)

    assert clock.reading_at(true_ns) >= local_ns
    assert clock.reading_at(true_ns - 1) < local_ns


@given(settings, st.lists(st.tuples(st.integers(1, DAY_NS), st.one_of(st.integers(-10**9, 10**9), ppms)), max_size=8),
       st.integers(-10**10, DAY_NS))
def test_true_at_stays_exact_after_any_steps_and_trims(setting, changes, ahead_ns):
    now = TrueTime()
    clock = LocalClock(setting, now)
    for wait_ns, change in changes:
        now.now_ns += wait_ns
        clock.adjust(change) if isinstance(change, int) else clock.trim(change)

    local_ns = clock.now_ns() + ahead_ns
    true_ns = clock.true_at(local_ns)

    assert clock.reading_at(true_ns) >= local_ns > clock.reading_at(true_ns - 1)


@given(settings, instants, ppms, ppms)
def test_a_trim_changes_the_rate_and_not_the_reading(setting, true_ns, ppm, later_ppm):
    now = TrueTime(true_ns)
    clock = LocalClock(setting, now)
    before_ns = clock.now_ns()

    clock.trim(ppm)
    clock.trim(later_ppm)

    assert clock.now_ns() == before_ns
    assert clock.drift_ppm == pytest.approx(setting.drift_ppm + ppm + later_ppm, abs=1e-9)


@given(settings, instants, ppms)
def test_a_trim_taken_back_at_the_same_instant_leaves_no_trace(setting, true_ns, ppm):
    clock = LocalClock(setting, TrueTime(true_ns))

    clock.trim(ppm)
    clock.trim(-ppm)

    assert [clock.reading_at(t) for t in (0, true_ns, 10 * true_ns)] == [
        exact_reading(setting, t) for t in (0, true_ns, 10 * true_ns)]


@given(settings, instants, st.integers(-10**9, 10**9))
def test_a_step_shifts_every_later_reading_by_its_size_up_to_the_tick(setting, true_ns, delta_ns):
    clock = LocalClock(setting, TrueTime(true_ns))
    before_ns = clock.now_ns()

    clock.adjust(delta_ns)

    assert abs(clock.now_ns() - before_ns - delta_ns) < setting.tick_ns


@given(settings, instants, st.integers(0, DAY_NS))
def test_an_unchanged_clock_never_runs_backwards(setting, true_ns, later_ns):
    clock = LocalClock(setting, TrueTime())

    assert clock.reading_at(true_ns) <= clock.reading_at(true_ns + later_ns)


@given(instants)
def test_an_ideal_clock_shows_true_time(true_ns):
    clock = LocalClock(ClockSettings(), TrueTime(true_ns))

    assert clock.now_ns() == clock.true_at(true_ns) == true_ns


def test_an_ideal_clock_that_was_changed_is_no_longer_ideal_and_can_become_so_again():
    now = TrueTime(10**9)
    clock = LocalClock(ClockSettings(), now)

    clock.adjust(-5)
    assert (clock.now_ns(), clock.true_at(10**9)) == (10**9 - 5, 10**9 + 5)
    clock.adjust(5)
    clock.trim(1.0)
    now.now_ns = 2 * 10**9

    assert clock.now_ns() == 2 * 10**9 + 1000


def test_hundred_ppm_gain_exactly_8_64_seconds_a_day():
    clock = LocalClock(ClockSettings(drift_ppm=100.0), TrueTime(DAY_NS))

    assert clock.now_ns() - DAY_NS == 8_640_000_000


@pytest.mark.parametrize(("nonsense", "complaint"), [
    ({"tick_ns": 0}, "tick_ns=0"), ({"drift_ppm": -1e6}, "drift_ppm=-1000000.0"), ({"drift_ppm": float("nan")}, "nan")])
def test_settings_refuse_a_clock_that_cannot_run(nonsense, complaint):
    with pytest.raises(ValueError, match=complaint):
        ClockSettings(**nonsense)


def test_a_trim_that_would_stop_the_clock_is_refused_and_changes_nothing():
    clock = LocalClock(ClockSettings(drift_ppm=-500_000.0), TrueTime(1000))

    with pytest.raises(ValueError, match="stand still"):
        clock.trim(-500_000.0)

    assert clock.now_ns() == 500
    assert clock.drift_ppm == -500_000.0
