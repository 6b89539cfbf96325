"""How later looks are weighted: the three formulations of the cost of self-triggering.

    PER_TRANSMISSION   gamma^k at look k, (5.5) as printed     V = min { l + S + gamma E V(x+) }
    PER_SECOND         exp(-beta t), beta = -ln(gamma)         V = min { l + S + exp(-beta tau) E V(x+) }
    AVERAGE_COST       the long-run mean per second, g         h = min { l + S - g tau + E h(x+) }

Differs from the dissertation: (5.5) discounts by the number of looks, so S adds S / (1 - gamma) to every policy and
cannot change which is best; as (5.7) allows tau = 0, the best interval is 0 for every x and V* = S / (1 - gamma).
(5.5) weights the first look by gamma, (5.9) by 1; here it is 1. PER_SECOND depends on S as the dissertation says, but
every S above about 1 gives tau_max. AVERAGE_COST is well-posed with a shortest interval above 0.
"""

from __future__ import annotations

from enum import Enum
from math import log

import numpy as np

from agents.optimal_triggering.held_loop import Floats

GAMMA = 0.96


class Formulation(Enum):
    PER_TRANSMISSION = "per_transmission"
    PER_SECOND = "per_second"
    AVERAGE_COST = "average_cost"

    def discount(self, tau_s: Floats, gamma: float = GAMMA) -> Floats:
        """Return the weight of the next look's value after an interval of tau_s."""
        if self is Formulation.PER_TRANSMISSION:
            return np.full_like(tau_s, gamma)
        if self is Formulation.PER_SECOND:
            return np.exp(log(gamma) * tau_s)
        return np.ones_like(tau_s)
