"""Judging. In: the records of a run. Out: its figures, and the verdicts on `[expect]` and on its guarantees."""
