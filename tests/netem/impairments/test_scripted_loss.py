from __future__ import annotations

import pytest

from netem.core.fate import Fate
from netem.impairments.scripted_loss import ScriptedLoss


def test_exactly_the_named_frames_are_lost(frames):
    script = ScriptedLoss([3, 7])

    lost = [transit.number for transit in frames(30) if not list(script.carry(transit))]

    assert lost == [3, 7]
    assert script.loses_as is Fate.LOST


def test_with_every_the_script_repeats(frames):
    script = ScriptedLoss([3, 7], every=10)

    lost = [transit.number for transit in frames(30) if not list(script.carry(transit))]

    assert lost == [3, 7, 13, 17, 23, 27]


@pytest.mark.parametrize(("settings", "message"), [
    (([],), r"lose_frames=\[\]: name at least one frame"),
    (([3, -1],), r"lose_frames=\[-1\]: expected 0 <= number"),
    (([3, 10], 10), r"lose_frames=\[10\]: expected 0 <= number < every \(10\)"),
    (([0], 0), "every=0: expected every >= 1"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        ScriptedLoss(*settings)
