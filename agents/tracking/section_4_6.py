"""The case study of section 4.6: reference, gains, start and length of the 12 s run."""

from __future__ import annotations

from math import pi

from agents.tracking.controller import Inputs, State
from agents.tracking.reference_inputs import Piece, ReferenceInputs
from agents.triggering.gain_table import GainTable, RegionalGain

START: State = (3.0, 3.0, pi / 2)
LENGTH_NS = 12_000_000_000
REFERENCE = ReferenceInputs((Piece(0, Inputs(1.0, 1.0)), Piece(2_260_000_000, Inputs(0.6, 0.15)),
                             Piece(9_250_000_000, Inputs(2.0, 2.0))))
# By `l2_gain` for inputs (e, e_omega) of norm 1 over 10 s, which reach |x| of 0.98, 1.14 and 1.41: lower estimates.
REGIONAL: dict[tuple[float, ...], RegionalGain] = {
    (0.6, 0.15): RegionalGain(3.20, 1.0), (1.0, 1.0): RegionalGain(4.91, 1.0), (2.0, 2.0): RegionalGain(9.43, 1.0)}
GAINS = GainTable({(0.6, 0.15): 22.0, (1.0, 1.0): 53.0, (2.0, 2.0): 56.0}, unified=96.0, regional=REGIONAL)
SMALLEST_GAIN_PER_S = 9.0       # Z_l
