"""The "ours" column of docs/reproduction.md, "Observers and model-based holds": computed here, row by row.

`pytest -s tests/agents/synchronization/test_reproduction_holds.py -k limit1-sender` prints the row "limit1-sender".
"""

from __future__ import annotations

from collections.abc import Callable
from math import log

import numpy as np
import pytest
from scipy.linalg import expm

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent, block_diagonal
from agents.synchronization.exact_loop import ExactLoop, spectral_radius
from agents.synchronization.graph import Floats
from agents.synchronization.model_hold import Hold
from agents.synchronization.model_loop import ModelLoop, slot_limit_ns
from agents.synchronization.noise_bounds import BiasBound, largest_outputs, standard_deviations
from agents.synchronization.observed_loop import ObservedLoop, broadcast_errors, broadcast_noise
from agents.synchronization.observer import observable_basis
from agents.synchronization.round_plan import plan_round
from tests.agents.reproduction_page import documented

SECTION = "Remark 6 and section 4.7: observers and model-based holds"
ONE_STATE, TWO_STATES = [-5.0], [-5.0, -6.0]
POLES = [TWO_STATES, ONE_STATE, TWO_STATES, TWO_STATES, ONE_STATE]
MS = 1_000_000


class Example:
    """Section 6.5 with the slots of (6.20), or of a row's own; every property is the text of one row's "ours"."""

    def __init__(self, agents: tuple[LinearAgent, ...], loops: tuple[ClosedLoop, ClosedLoop]) -> None:
        self.agents, self.loops = agents, loops
        self.plans = [plan_round(agents, loop.laplacian) for loop in loops]
        self.taus_s = [plan.slot_ns * 1e-9 for plan in self.plans]

    def shown(self) -> str:
        return " ".join(str(observable_basis(agent).shape[1]) for agent in self.agents)

    def observed(self, k: int) -> ObservedLoop:
        return ObservedLoop(self.agents, self.plans[k].laplacian, self.plans[k].parts, POLES)

    def apart(self, k: int) -> str:
        """The largest distance of the radii of the loop with observers from those of its two parts."""
        loop, tau_s = self.observed(k), self.taus_s[k]
        together = np.abs(np.linalg.eigvals(loop.round_maps(tau_s)[0]))
        plain = np.linalg.eigvals(ExactLoop(self.agents, loop.laplacian, loop.parts).round_map(tau_s))
        own = np.exp(np.concatenate([*POLES, [-1, -1]]) * 3 * tau_s)
        found = np.abs(np.sort(together) - np.sort(np.abs([*plain, *own]))).max()
        return "below 1e-12" if found < 1e-12 else f"{found:.1e}"

    def sums(self) -> str:
        return self._for_each(broadcast_errors)

    def noises(self) -> str:
        return self._for_each(broadcast_noise)

    def _for_each(self, figure: Callable[[LinearAgent, list[float], float], float]) -> str:
        return " ".join(f"{figure(agent, poles, 3 * self.taus_s[0]):.3g}"
                        for agent, poles in zip(self.agents, POLES, strict=True))

    def maps(self, observers: bool) -> tuple[Floats, Floats, Floats]:
        """M, N and the matrix of the outputs, L1."""
        loop, tau_s = self.observed(0), self.taus_s[0]
        if observers:
            return *loop.round_maps(tau_s), loop.outputs
        plain = ExactLoop(self.agents, loop.laplacian, loop.parts)
        M, N = np.eye(15), np.zeros((15, 5))
        for slot, part in enumerate(loop.parts):        # what the part broadcasts has its noise
            noise = np.zeros((15, 5))
            for agent in part:
                noise[10 + agent, agent] = 1.0
            M, N = plain.slot_map(slot, tau_s) @ M, plain.slot_map(slot, tau_s) @ N + plain.flow(tau_s) @ noise
        return M, N, np.hstack([plain.closed_loop.C_cl, np.zeros((5, 5))])

    def deviations(self, observers: bool) -> str:
        return " ".join(f"{each:.3f}" for each in standard_deviations(*self.maps(observers)))

    def largest(self, observers: bool) -> str:
        return f"{largest_outputs(*self.maps(observers)).max():.1f}"

    def bound(self) -> BiasBound:
        return BiasBound(self.loops[0], 3, self.taus_s[0])

    def model(self, k: int, hold: Hold, steps: int) -> ModelLoop:
        fast = [[4 * pole for pole in poles] for poles in POLES]
        return ModelLoop(self.agents, self.plans[k].laplacian, self.plans[k].parts, fast, hold, steps)

    def limit(self, k: int, hold: Hold, steps: int, end_ms: int) -> str:
        found = slot_limit_ns(self.model(k, hold, steps), end_ms * MS // 40, end_ms * MS)
        assert found is not None
        return f"{found * 1e-6:.3f} ms"

    def rate(self, k: int, slot_ms: float, hold: Hold) -> str:
        return f"{-log(self.model(k, hold, 4).spectral_radius(round(slot_ms * MS))) / (3e-3 * slot_ms):.3f} 1/s"

    def plain_rate(self, k: int, slot_ms: float) -> str:
        loop = ExactLoop(self.agents, self.plans[k].laplacian, self.plans[k].parts)
        return f"{-log(loop.spectral_radius(slot_ms * 1e-3)) / (3e-3 * slot_ms):.3f} 1/s"

    def driven(self, k: int, knows_input: bool) -> str:
        """Limit of models without an input, or with the input that the sender had at its slot, held; u not sampled."""
        loop, parts = self.loops[k], self.plans[k].parts
        n, B = 10, loop.B_d
        U = -block_diagonal([agent.K for agent in self.agents]) @ loop.laplacian @ loop.C_cl

        def radius(tau_s: float) -> float:
            rows = [[loop.A_open, B @ U, np.zeros((n, 5))],
                    [np.zeros((n, n)), loop.A_open, B if knows_input else np.zeros((n, 5))]]
            flow = expm(np.vstack([np.block(rows), np.zeros((5, 25))]) * tau_s)
            M, ends = np.eye(25), np.cumsum([0, *(agent.states for agent in self.agents)])
            for part in parts:
                for agent in part:
                    own = slice(ends[agent], ends[agent + 1])
                    M[n:2 * n][own] = M[:n][own]
                for agent in part:
                    M[2 * n + agent] = U[agent] @ M[n:2 * n]
                M = flow @ M
            return spectral_radius(M)

        stable, unstable = next((m * 1e-4, (m + 1) * 1e-4) for m in range(1, 400) if radius((m + 1) * 1e-4) >= 1)
        while unstable - stable > 1e-8:
            middle = (stable + unstable) / 2
            stable, unstable = (middle, unstable) if radius(middle) < 1 else (stable, middle)
        return f"{stable * 1e3:.3f} ms"


ROWS: dict[str, Callable[[Example], str]] = {
    "states-shown": lambda e: e.shown(),
    "separation1": lambda e: e.apart(0),
    "separation2": lambda e: e.apart(1),
    "K": lambda e: e.sums(),
    "broadcast-noise": lambda e: e.noises(),
    "deviation-measured": lambda e: e.deviations(False),
    "deviation-observed": lambda e: e.deviations(True),
    "largest-measured": lambda e: e.largest(False),
    "largest-observed": lambda e: e.largest(True),
    "bias": lambda e: f"{e.bound().gain:.1f}",
    "bias-printed": lambda e: f"{e.bound().printed_gain:.3g}",
    "limit1-sender": lambda e: e.limit(0, Hold.SENDER, 4, 30),
    "limit2-sender": lambda e: e.limit(1, Hold.SENDER, 4, 30),
    "limit1-sender-once": lambda e: e.limit(0, Hold.SENDER, 1, 30),
    "limit2-sender-once": lambda e: e.limit(1, Hold.SENDER, 1, 30),
    "limit1-team": lambda e: e.limit(0, Hold.TEAM, 4, 100),
    "limit2-team": lambda e: e.limit(1, Hold.TEAM, 4, 140),
    "limit1-no-input": lambda e: e.driven(0, False),
    "limit2-no-input": lambda e: e.driven(1, False),
    "limit1-held-input": lambda e: e.driven(0, True),
    "limit2-held-input": lambda e: e.driven(1, True),
    "rate1-sender": lambda e: e.rate(0, 20.0, Hold.SENDER),
    "rate1-held": lambda e: e.plain_rate(0, 4.8),
    "rate1-team": lambda e: e.rate(0, 20.0, Hold.TEAM),
    "rate1-team-short": lambda e: e.rate(0, 1.0, Hold.TEAM),
    "broadcasts1-sender": lambda e: f"{1 / (3 * 20e-3):.2f}",
}


@pytest.fixture(scope="module")
def example(five_agents: tuple[LinearAgent, ...], loop1: ClosedLoop, loop2: ClosedLoop) -> Example:
    return Example(five_agents, (loop1, loop2))


@pytest.mark.parametrize("name", ROWS)
def test_the_page_says_what_the_code_gives(name: str, example: Example) -> None:
    ours = ROWS[name](example)
    print(f"{name}: {ours}")

    assert documented(SECTION)[name] == ours


def test_the_page_has_no_row_that_is_not_computed() -> None:
    assert set(documented(SECTION)) == set(ROWS)
