"""Judges a run: in come the records in its folder, out come figures, verdicts on `[expect]` and on guarantees."""
