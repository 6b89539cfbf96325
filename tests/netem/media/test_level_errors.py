"""Bit errors by level against the closed forms of the text books, on the radio and alone."""

from functools import partial
from math import log10, sqrt
from random import Random

import pytest
from scipy import stats

from netem.core.fate import Fate
from netem.core.random_streams import stream
from netem.media.level_errors import LevelErrors, LevelErrorSettings
from netem.media.modulations import MODULATIONS
from netem.media.radio_settings import RadioSettings
from netem.topology.path_loss import PathLoss
from tests.netem.media.radio_bench import US, Bench, graph

FRAMES = 4_000


@pytest.mark.parametrize(("modulation", "eb_n0_db"), [("bpsk", 9.59), ("dbpsk", 10.34), ("fsk", 12.60),
                                                      ("fsk_noncoherent", 13.35)])
def test_one_bit_in_100_000_is_wrong_where_the_text_books_say(modulation, eb_n0_db):
    """Proakis, figures 5.2-4 and 5.2-12: Eb/N0 for a bit error probability of 1e-5; read to 0.01 dB, 3 % of it."""
    assert MODULATIONS[modulation](10 ** (eb_n0_db / 10)) == pytest.approx(1e-5, rel=0.04)


@pytest.mark.parametrize("modulation", MODULATIONS)
def test_pure_noise_gives_every_second_bit_and_more_signal_fewer_errors(modulation):
    errors = [MODULATIONS[modulation](g / 4) for g in range(80)]

    assert errors[0] == pytest.approx(0.5)
    assert errors == sorted(errors, reverse=True)
    assert 0 <= errors[-1] < 1e-4


def test_bpsk_is_the_tail_of_the_normal_distribution():
    for g in (0.1, 1.0, 4.0, 9.0):
        assert MODULATIONS["bpsk"](g) == pytest.approx(stats.norm.sf(sqrt(2 * g)), rel=1e-12)
        assert MODULATIONS["fsk"](g) == pytest.approx(stats.norm.sf(sqrt(g)), rel=1e-12)


def test_oqpsk_is_that_of_16_orthogonal_signals_of_4_bits_each():
    """By simulation of the receiver that IEEE 802.15.4's formula assumes: the largest of 16 envelopes wins."""
    rng, g, symbols, wrong = Random(7), 1.2, 40_000, 0
    for _ in range(symbols):
        mean = sqrt(5 * g)                  # Es/N0 = 2.5 g; an envelope of unit variance in each quadrature
        sent = (rng.gauss(mean, 1)) ** 2 + rng.gauss(0, 1) ** 2
        wrong += any(rng.gauss(0, 1) ** 2 + rng.gauss(0, 1) ** 2 > sent for _ in range(15))

    bits = 8 / 15 * wrong / symbols         # of the 4 bits of a wrong symbol
    sigma = 8 / 15 * sqrt(wrong / symbols * (1 - wrong / symbols) / symbols)
    assert abs(bits - MODULATIONS["oqpsk_dsss"](g)) < 4 * sigma


@pytest.mark.parametrize(("rx_dbm", "payload_bytes"), [(-97.0, 0), (-96.0, 20), (-95.0, 50), (-90.0, 50)])
def test_the_share_of_broken_frames_is_that_of_the_closed_form(rx_dbm, payload_bytes):
    bench = Bench(["a", "b"], rng_for=partial(stream, 7), preset="xbee_802154", sensitivity_dbm=-110.0,
                  topology=graph("a -> b", level_dbm=rx_dbm),
                  bit_errors=LevelErrorSettings("fsk_noncoherent", -104.0, 500_000.0))

    bench.run((k * 10_000 * US, "a", payload_bytes) for k in range(FRAMES))

    eb_n0_db = rx_dbm + 104.0 + 10 * log10(2)                           # 500 kHz for 250 kbit/s
    p = 0.5 * 2.718281828459045 ** (-10 ** (eb_n0_db / 10) / 2)
    broken = 1 - (1 - p) ** (104 + 8 * payload_bytes)
    sigma = sqrt(broken * (1 - broken) / FRAMES)
    assert abs(bench.ledger.closed.get(Fate.CORRUPTED, 0) / FRAMES - broken) <= 4 * sigma
    assert {(row[11], row[12]) for row in bench.ledger.rows} <= {("corrupted", "bit errors"), ("delivered", "")}
    if rx_dbm < -90:
        assert 0.02 < broken < 0.98


def test_a_further_node_changes_no_draw_and_propagation_neither():
    at_m = {"a": (0.0, 0.0), "b": (150.0, 0.0), "c": (140.0, 9.0)}

    def fates(nodes, **settings):
        bench = Bench({node: at_m[node] for node in nodes}, rng_for=partial(stream, 7), preset="crazyflie_p2p",
                      topology=PathLoss("positions", **settings), bit_errors=LevelErrorSettings("fsk", -93.0))
        bench.run((k * 1_000 * US, "a", 20) for k in range(300))
        return [bench.fate("a", k, "b") for k in range(300)]

    alone = fates("ab")
    assert alone == fates("cba") == fates("abc", propagation_mps=3e8)
    assert 20 < alone.count(Fate.CORRUPTED) < 280


def test_a_frame_below_the_sensitivity_is_too_weak_and_a_strong_one_whole():
    errors = LevelErrors(LevelErrorSettings("bpsk", -100.0), 250_000, 104, Random)

    assert errors.whole_probability(-60.0, 100) == 1.0
    assert errors.whole_probability(-130.0, 100) < 1e-100


@pytest.mark.parametrize(("settings", "says"), [
    ({"preset": "ideal"}, "bit_errors: bits without bit_rate_bps have no energy"),
    ({"preset": "xbee_802154", "checksum": False}, "bit_errors: expected checksum = true"),
])
def test_a_radio_without_bits_or_checksum_is_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        RadioSettings(**settings, bit_errors=LevelErrorSettings("bpsk", -100.0))


@pytest.mark.parametrize(("settings", "says"), [
    ({"noise_dbm": float("inf")}, "noise_dbm=inf: expected a finite number"),
    ({"noise_dbm": -100.0, "bandwidth_hz": 0.0}, "bandwidth_hz=0.0: expected > 0"),
])
def test_nonsense_is_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        LevelErrorSettings("bpsk", **settings)
