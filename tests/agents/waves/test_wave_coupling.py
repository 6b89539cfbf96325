"""One robot's use of waves, on a board of the test's: what it sends, and what it does at rare instants."""

from __future__ import annotations

import pytest

from agents.waves.team import read_wave_team
from agents.waves.wave_coupling import WaveCoupling
from agents.waves.wave_frame import WaveFrame
from tests.agents.waves.board import Board

ROUND_NS, SLOT_NS = 60_000_000, 20_000_000
INTEGRATOR = {"A": [[-1.0, 0.0], [1.0, 0.0]], "B": [[1.0], [0.0]], "C": [[1.0, 0.0], [0.0, 1.0]]}


def coupled(**keys):
    """r2 of three robots in a row, with b = K = 2: alpha = 1, rho = 0."""
    board, applied = Board(), []
    team = read_wave_team({"models": dict.fromkeys(("r1", "r2", "r3"), INTEGRATOR), "links": ["r1 <-> r2", "r2 <-> r3"],
                           "slot_s": 0.02, "damping": 2.0, **keys})
    return board, WaveCoupling(board, team, 1, lambda: applied.append(board.now_ns)), applied


def test_it_sends_the_mean_wave_since_the_last_frame_and_the_energy_so_far():
    board, coupling, _ = coupled()
    board.now_ns, board.integral = SLOT_NS, 0.06
    coupling.speak()
    board.now_ns, board.integral = SLOT_NS + ROUND_NS, 0.18

    wave, sent, other, other_sent = coupling.speak()

    assert (wave, other) == pytest.approx((2.0, 2.0))           # 0.12 in a round
    assert (sent, other_sent) == pytest.approx((0.06 * (1 + 4),) * 2)


def test_a_wave_that_is_reflected_is_in_the_mean():
    board, coupling, _ = coupled(impedance=6.0)                 # rho = 1/2
    coupling.hear(WaveFrame(0, 0, (8.0, 9.0)))
    board.run_until(30_000_000)

    wave, *_ = coupling.speak()

    assert wave == pytest.approx(0.5 * 8.0 * 0.03 / 0.06)


def test_after_a_pause_the_mean_is_over_the_whole_of_it():
    """Or a round of it would have more energy than the wave had: (int v)^2 / tau is more than int v^2."""
    board, coupling, _ = coupled()
    coupling.speak()
    board.now_ns, board.integral = 4 * ROUND_NS, 4 * 0.06 * 1.5

    wave, sent, *_ = coupling.speak()

    assert wave == pytest.approx(1.5)
    assert sent == pytest.approx(0.06 * 1.5 ** 2)


def test_a_frame_of_a_robot_that_is_no_neighbour_is_not_used():
    team = {"links": ["r1 <-> r3", "r2 <-> r3"]}
    _, coupling, applied = coupled(**team)

    coupling.hear(WaveFrame(0, 0, (8.0, 9.0)))

    assert (coupling.control(), applied) == (0.0, [])


def test_a_wave_acts_when_it_comes_and_for_a_round():
    board, coupling, applied = coupled()
    board.now_ns = 5_000_000
    coupling.hear(WaveFrame(2, 2, (8.0, 9.0)))

    assert coupling.control() == 8.0
    board.run_until(5_000_000 + ROUND_NS - 1)
    assert coupling.control() == 8.0
    board.run_until(5_000_000 + ROUND_NS)
    assert coupling.control() == 0.0
    assert applied == [5_000_000, 5_000_000 + ROUND_NS]
    assert board.counters["silent waves"] == 1


def test_of_each_neighbour_it_uses_the_wave_for_this_robot():
    _, coupling, _ = coupled(links=["r1 <-> r2", "r2 <-> r3", "r1 <-> r3"])

    coupling.hear(WaveFrame(0, 0, (8.0, 1.0, 3.0, 1.0)))        # to r2, to r3
    coupling.hear(WaveFrame(2, 2, (5.0, 1.0, 0.5, 1.0)))        # to r1, to r2

    assert coupling.control() == 8.5


def test_a_held_wave_is_told_when_it_breaks_and_when_the_line_owes_again():
    board, coupling, _ = coupled(when_silent="hold")
    coupling.hear(WaveFrame(0, 0, (8.0, 64 * 0.06)))

    board.run_until(ROUND_NS + 10_000_000)
    coupling.hear(WaveFrame(0, 6, (8.0, 3 * 64 * 0.06)))        # the frame of slot 3 was lost
    board.run_until(4 * ROUND_NS)

    broken = [(at_ns, energy) for at_ns, kind, energy in board.events[1:] if energy < 0]
    again_ns = 3 * ROUND_NS + 1                 # the credit of slot 3 lasts as long as the wave was held before
    assert [at_ns for at_ns, _ in broken] == pytest.approx([ROUND_NS + 1, again_ns], abs=1)         # its rounding
    assert [energy >= 0 for _, _, energy in board.events] == [True, False, True, False]
    assert board.events[2][0] == ROUND_NS + 10_000_000
    assert board.counters["energy breaks"] == 2
    assert len(board.warnings) == 1
    assert "passivity of the line r1 -> r2: it owes -6.4e-08, expected 0 or more" in board.warnings[0][1]


def test_with_a_later_use_the_next_wave_takes_over_without_a_gap():
    board, coupling, applied = coupled(use_after_s=0.1)
    for k in range(3):
        board.run_until(k * ROUND_NS + 70_000_000)              # the wave before is in use since 30 ms
        coupling.hear(WaveFrame(0, 3 * k, (k + 1.0, 9.0)))

    board.run_until(100_000_000 + 3 * ROUND_NS)

    assert applied == [100_000_000 + k * ROUND_NS for k in range(4)]        # the last one is the end
    assert board.counters["silent waves"] == 1
    assert coupling.control() == 0.0
    coupling.hear(WaveFrame(0, 9, (1.0, 9.0)))                  # due at 280 ms
    assert board.counters["late frames"] == 0
    board.run_until(281_000_000 + ROUND_NS)
    coupling.hear(WaveFrame(0, 12, (1.0, 9.0)))                 # due at 340 ms
    assert board.counters["late frames"] == 1
