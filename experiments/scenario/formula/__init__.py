"""Formulas of signal temporal logic in a scenario: their grammar, syntax tree, units and names.

docs/expectations_in_time.md has the language, `experiments.judge.formula` judges a run by it.
"""
