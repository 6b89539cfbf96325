"""Judges a run by formulas of signal temporal logic, and gives their robustness: see `robustness`."""
