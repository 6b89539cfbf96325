"""The case study of section 4.6: reference, gains, start and length of the 12 s run."""

from __future__ import annotations

from math import pi

from agents.tracking.controller import Inputs, State
from agents.tracking.reference_inputs import Piece, ReferenceInputs
from agents.triggering.gain_table import GainTable

START: State = (3.0, 3.0, pi / 2)
LENGTH_NS = 12_000_000_000
REFERENCE = ReferenceInputs((Piece(0, Inputs(1.0, 1.0)), Piece(2_260_000_000, Inputs(0.6, 0.15)),
                             Piece(9_250_000_000, Inputs(2.0, 2.0))))
GAINS = GainTable({(0.6, 0.15): 22.0, (1.0, 1.0): 53.0, (2.0, 2.0): 56.0}, unified=96.0)
SMALLEST_GAIN_PER_S = 9.0       # Z_l
