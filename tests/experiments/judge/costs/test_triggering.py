"""Costs of triggering that make no sense; what they come to is in tests/experiments/test_tracking_optimal.py."""

import re

import pytest

from experiments.judge.costs.triggering import Triggering


@pytest.mark.parametrize(("fields", "said"), [
    ({"per_frame": -1.0}, "per_frame=-1.0: expected the cost of a frame"),
    ({"on": "radio"}, "on='radio': expected \"medium: node\""),
    ({"weights": [1.0, 2.0]}, "expected 1 numbers")])
def test_a_cost_of_triggering_that_makes_no_sense_is_refused(fields, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        Triggering(**{"of": ("r1.x",), "weights": [1.0], "on": "radio: r1", "per_frame": 1.0} | fields)
