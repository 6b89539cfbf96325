"""Judges a run. In: its records. Out: its figures, and the verdicts on `[expect]` and on its guarantees."""
