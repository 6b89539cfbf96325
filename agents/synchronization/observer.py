"""A Luenberger observer of one agent: it estimates the state from the noisy outputs measured in the agent's slots.

    between two slots   xh' = A xh + B u                        u as the agent itself set it
    own slot            xh+ = xh + L (y - C xh),  y = C x + nu

The agent broadcasts C xh+ instead of y (Remark 6): in (6.11) e(t+) = e_o(t). For the error eps = xh - x

    eps' = A eps,   eps+ = (I - L C) eps + L nu                 whatever u is

Only the modes that (A, C) shows can be placed. In an orthonormal basis Q of the row space of (C; C A; ...) they are
A_o = Q' A Q, C_o = C Q; the other eigenvalues of A stay those of the observer and must be stable (detectability). L = Q
L_o places the eigenvalues of (I - L_o C_o) F, F = exp(A_o h), at exp(p_k h), h the time of a round: without noise these
modes of eps decay with the poles p_k [1/s]. With a vector g_k for each pole, L_o = F^-1 (G V^-1)', v_k = (F' - exp(p_k
h) I)^-1 C_o' g_k, G = [g_k], V = [v_k] (Moore 1976); with one output L is unique.

Not modelled: the disturbance omega, which no robot measures: it disturbs the estimate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.graph import Floats
from agents.synchronization.matrix_exponential import held_input_step, matrix_exponential

Complexes = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
OBSERVABLE = 1e-9           # singular values of the observability matrix below this share of the largest count as 0
PLACED = 1e-6               # largest error of a placed eigenvalue


def observable_basis(agent: LinearAgent) -> Floats:
    """Return orthonormal columns Q that span what the outputs show of the state; as many as poles can be chosen."""
    return _bases(agent)[0]


def hidden_eigenvalues(agent: LinearAgent) -> Complexes:
    """Return the eigenvalues of A that no output shows; no observer moves them."""
    hidden = _bases(agent)[1]
    return np.linalg.eigvals(hidden.T @ agent.A @ hidden).astype(complex) if hidden.size else np.zeros(0, dtype=complex)


def _bases(agent: LinearAgent) -> tuple[Floats, Floats]:
    blocks = [agent.C]
    for _ in range(agent.states - 1):
        blocks.append(blocks[-1] @ agent.A)
    _, values, rows = np.linalg.svd(np.vstack(blocks))
    shown = int(np.sum(values > OBSERVABLE * values[0]))
    return rows[:shown].T, rows[shown:].T


def pole_problems(agent: LinearAgent, poles: Sequence[float]) -> Iterator[str]:
    """Yield the reasons why no observer of `agent` has these poles [1/s]."""
    shown, hidden = observable_basis(agent).shape[1], hidden_eigenvalues(agent)
    if len(poles) != shown:
        yield (f"expected {shown}, a pole for each of the {agent.states} states that (A, C) shows: the observability "
               f"matrix has rank {shown}" + (f", the eigenvalues {_listed(hidden)} stay" if hidden.size else ""))
    if hidden.size and hidden.real.max() >= 0:
        yield (f"(A, C) is not detectable: no output shows the eigenvalues {_listed(hidden)}, expected real parts "
               "below 0; measure another output, or leave observer_poles out")
    if not all(-np.inf < pole < 0 for pole in poles):
        yield "expected negative numbers [1/s], or the observer is not Hurwitz; -10: an error shrinks to 1/e in 0.1 s"
    elif len(set(poles)) != len(poles):
        yield "expected different poles; spread them a little"


def observer_gain(agent: LinearAgent, poles: Sequence[float], h_s: float) -> Floats:
    """Return L for corrections every `h_s`; ValueError if it does not exist for this time between corrections."""
    Q = observable_basis(agent)
    C, F, wanted = agent.C @ Q, matrix_exponential(Q.T @ agent.A @ Q * h_s), np.exp(np.asarray(poles) * h_s)
    one = np.eye(len(F))
    G = np.array([[np.cos((k + 1) * j) for k in range(len(F))] for j in range(agent.outputs)])
    try:
        V = np.stack([np.linalg.solve(F.T - pole * one, C.T @ g) for pole, g in zip(wanted, G.T, strict=True)], axis=1)
        L = np.asarray(np.linalg.solve(F, np.linalg.solve(V.T, G.T)), dtype=float)
    except np.linalg.LinAlgError:
        L = np.full((len(F), agent.outputs), np.nan)
    if np.all(np.isfinite(L)):
        reached = np.sort_complex(np.linalg.eigvals((one - L @ C) @ F))
        if np.abs(reached - np.sort(wanted)).max() <= PLACED:
            placed: Floats = Q @ L
            return placed
    raise ValueError(f"observer_poles={list(poles)}: no gain places them with a measurement every {h_s:.6g} s; choose "
                     "poles that are no eigenvalues of A and lie further apart")


def _listed(values: Complexes) -> str:
    return ", ".join(f"{v.real:.6g}" if v.imag == 0 else f"{v.real:.6g} {v.imag:+.6g}j" for v in values)


class Observer:
    """The estimate of one agent's state, on its local clock; `set_input` says what u is from now on."""

    def __init__(self, agent: LinearAgent, poles: Sequence[float], start: Sequence[float], now_ns: int) -> None:
        self._agent, self._poles = agent, tuple(poles)
        self.estimate: Floats = np.array(start, dtype=float)
        self._u: Floats = np.zeros(agent.inputs)
        self._at_ns = now_ns
        self._steps: dict[int, tuple[Floats, Floats]] = {}
        self._L: Floats = np.zeros((agent.states, agent.outputs))

    def expect_corrections_every(self, h_ns: int) -> None:
        self._L = observer_gain(self._agent, self._poles, h_ns * 1e-9)

    def set_input(self, now_ns: int, u: Sequence[float]) -> None:
        self._advance(now_ns)
        self._u = np.array(u)

    def correct(self, now_ns: int, y: Sequence[float]) -> None:
        self._advance(now_ns)
        self.estimate = self.estimate + self._L @ (np.array(y) - self._agent.C @ self.estimate)

    def output_at(self, now_ns: int) -> tuple[float, ...]:
        """Return C xh at `now_ns`, which is not before the last call."""
        Phi, Gamma = self._step(now_ns - self._at_ns)
        return tuple((self._agent.C @ (Phi @ self.estimate + Gamma @ self._u)).tolist())

    def _advance(self, now_ns: int) -> None:
        if now_ns > self._at_ns:
            Phi, Gamma = self._step(now_ns - self._at_ns)
            self.estimate = Phi @ self.estimate + Gamma @ self._u
            self._at_ns = now_ns

    def _step(self, h_ns: int) -> tuple[Floats, Floats]:
        if h_ns not in self._steps:
            if len(self._steps) >= 64:          # a clock that is trimmed gives ever new steps
                self._steps.clear()
            self._steps[h_ns] = held_input_step(self._agent.A, self._agent.B, h_ns * 1e-9)
        return self._steps[h_ns]
