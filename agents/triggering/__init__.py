"""Input-output triggering (Chapter 4): computes when the next measurement is due so that the loop is certified stable.

A pure library: no network, no scenario, no clock. `error_gain` has the gain of the error system over a finite horizon
and the horizon tau that the small-gain condition certifies; `policies` decide from a measurement when the next is due;
`assumptions` checks whether the assumptions of a decision still hold; `l2_gain` estimates gains of nominal systems. A
loop describes itself to a trigger by an `ErrorSystem`; that of the tracking robots, with the reachable set and the
matrix A of (4.47), is in `agents.tracking`.
"""
