"""The energy that a line still owes, as the receiver keeps it, equals the sum over all frames sent and used."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from agents.waves.incoming_wave import IncomingWave

PERIOD_NS, ROUND = 100, 5
TAU_S = PERIOD_NS * 1e-9

# For each frame sent: its wave, and when its copies come after it was sent; none: lost.
frames = st.lists(st.tuples(st.floats(-3, 3), st.lists(st.integers(0, 450), max_size=2)), min_size=1, max_size=12)


def told(line, sent, instants_ns):
    """Feed the line as a robot does; return (instant, wave in use from then on, owed just then)."""
    account, copies = 0.0, []
    for k, (wave, delays_ns) in enumerate(sent):
        account += wave * wave * TAU_S
        copies += [(k * PERIOD_NS + delay_ns, k, wave, account) for delay_ns in delays_ns]
    copies.sort(key=lambda copy: copy[:2])
    history = []
    for instant_ns in sorted({*instants_ns, *(copy[0] for copy in copies)}):
        while line.ends_ns is not None and line.ends_ns < instant_ns:
            at_ns = line.ends_ns
            line.fall_silent(at_ns)
            history.append((at_ns, line.wave, line.owed(at_ns)))
        while copies and copies[0][0] == instant_ns:
            _, k, wave, account = copies.pop(0)
            line.arrive(k * ROUND, wave, account, instant_ns)
        if line.ends_ns == instant_ns:
            line.fall_silent(instant_ns)
        history.append((instant_ns, line.wave, line.owed(instant_ns)))
    return history


def owed_by_definition(sent, history, at_ns):
    """Sum of tau v_n^2 of the frames up to the newest that has come, less the integral of w^2."""
    newest = max((k for k, (_, delays_ns) in enumerate(sent) for delay_ns in delays_ns
                  if k * PERIOD_NS + delay_ns <= at_ns), default=-1)
    given_out = 0.0
    for (from_ns, wave, _), until_ns in zip(history, [t for t, _, _ in history[1:]] + [at_ns], strict=True):
        given_out += wave * wave * max(0, min(until_ns, at_ns) - from_ns) * 1e-9
    return sum(wave * wave for wave, _ in sent[:newest + 1]) * TAU_S - given_out


@given(sent=frames, instants_ns=st.lists(st.integers(0, 2000), max_size=8), hold=st.booleans())
def test_it_owes_what_was_sent_up_to_the_newest_less_what_was_used(sent, instants_ns, hold):
    history = told(IncomingWave(PERIOD_NS, ROUND, hold=hold), sent, instants_ns)

    for at_ns, _, owed in history:
        assert abs(owed - owed_by_definition(sent, history, at_ns)) < 1e-18
        assert hold or owed >= 0


@given(waves=st.lists(st.floats(-3, 3), min_size=1, max_size=30), delay_ns=st.integers(0, 1000), hold=st.booleans())
def test_with_a_constant_delay_a_line_gives_back_all_and_never_more(waves, delay_ns, hold):
    line, account = IncomingWave(PERIOD_NS, ROUND, hold=hold), 0.0

    for k, wave in enumerate(waves):
        account += wave * wave * TAU_S
        at_ns = k * PERIOD_NS + delay_ns
        assert line.owed(at_ns) == 0            # not up to rounding: a guarantee asks for 0 or more
        assert line.arrive(k * ROUND, wave, account, at_ns)

    assert line.owed(len(waves) * PERIOD_NS + delay_ns) == 0


@given(wave=st.floats(0.001, 3), lost=st.integers(0, 3))
def test_a_held_wave_breaks_at_the_first_nanosecond_at_which_more_is_given_than_was_sent(wave, lost):
    """The credit of lost frames is used up first: each holds for one more period."""
    line = IncomingWave(PERIOD_NS, ROUND, hold=True)
    line.arrive(0, wave, wave * wave * TAU_S, 10)
    line.arrive((lost + 1) * ROUND, wave, (lost + 2) * (wave * wave * TAU_S), 10 + PERIOD_NS)

    breaks_ns = line.breaks_ns

    assert breaks_ns is not None
    assert abs(breaks_ns - (10 + (lost + 2) * PERIOD_NS + 1)) <= (1 if lost else 0)       # rounding of the credit
    assert line.owed(breaks_ns) < 0 <= line.owed(breaks_ns - 1)


@given(sent=frames)
def test_a_break_is_expected_at_the_first_nanosecond_at_which_less_than_nothing_is_owed(sent):
    line, account = IncomingWave(PERIOD_NS, ROUND, hold=True), 0.0
    for k, (wave, delays_ns) in enumerate(sent):
        account += wave * wave * TAU_S
        for delay_ns in delays_ns[:1]:
            at_ns = k * 450 + delay_ns              # in order
            line.arrive(k * ROUND, wave, account, at_ns)
            first = next((t for t in range(at_ns, at_ns + 9 * PERIOD_NS) if line.owed(t) < 0), None)
            assert line.breaks_ns == first or (first is None and line.breaks_ns is not None
                                               and line.breaks_ns >= at_ns + 9 * PERIOD_NS)


def test_no_wave_however_small_or_large_is_too_much_for_the_account():
    for wave in (0.0, 1e-300, 1e-100, 1e100, -1e100):
        for sent in (0.0, 1e-300, 1.0, 1e100):
            line = IncomingWave(PERIOD_NS, ROUND, hold=True)
            line.arrive(10 * ROUND, wave, sent, 0)
            assert line.breaks_ns is None or line.owed(line.breaks_ns) < 0


def test_an_old_or_doubled_frame_is_not_used():
    line = IncomingWave(PERIOD_NS, ROUND, hold=False)

    assert line.arrive(10, 1.0, 1.0, 0)
    assert not line.arrive(10, 2.0, 1.0, 50)
    assert not line.arrive(5, 2.0, 1.0, 60)
    assert line.wave == 1.0
    assert line.ends_ns == PERIOD_NS


def test_a_sender_that_starts_again_lends_nothing():
    line = IncomingWave(PERIOD_NS, ROUND, hold=False)
    line.arrive(0, 1.0, 5.0, 0)

    line.arrive(10 * ROUND, 1.0, TAU_S, 10 * PERIOD_NS)

    assert line.owed(11 * PERIOD_NS) <= 0       # no energy of the frames between, as it is not known
