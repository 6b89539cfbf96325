"""The kinds of costs that a scenario can state. A new kind is a file in `experiments/judge/costs` and a line here."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

COSTS: Final = Kinds({
    "quadratic": "experiments.judge.costs.quadratic:Quadratic",
    "triggering": "experiments.judge.costs.triggering:Triggering",
    "radio_energy": "experiments.judge.costs.radio_energy:RadioEnergy",
})
