"""The energy that the radio of each node has drawn, from its time in three states and the power in each:

    transmitting    own frame on the air, [on_air, end)                             transmit_w
    receiving       not transmitting, a frame that reaches the node is on the air   receive_w
    idle            all other time: listening to an empty channel, or asleep        idle_w

    E(t) = transmit_w * T_transmit(t) + receive_w * T_receive(t) + idle_w * T_idle(t)       [J]

Source of the model: L. Feeney, M. Nilsson 2001. A receiver draws power for every frame that reaches it, also for one
that is addressed to another node.
Not modelled: energy to change between states; frames without an intended receiver, of which the ledger has no row; the
tail of a frame that is under way when the run ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.judge.costs import NotAccrued
from experiments.judge.formula.curve import Curve, Floats
from experiments.judge.frame_copies import Mask
from experiments.judge.run_data import RunData
from experiments.judge.run_files import LEDGER
from experiments.scenario.metric_keys import matching
from experiments.scenario.subjects import Named
from netem.core.fate import Fate

NS_PER_S = 1e9


@dataclass(frozen=True)
class RadioEnergy:
    ON: ClassVar = Named.SENDERS
    UNIT: ClassVar = "J"

    on: str                             # "medium: node", each a pattern
    transmit_w: float                   # W, drawn from the supply, not radiated
    receive_w: float = 0.0
    idle_w: float = 0.0

    def __post_init__(self) -> None:
        for name in ("transmit_w", "receive_w", "idle_w"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name}={getattr(self, name)}: expected >= 0")

    @property
    def subjects(self) -> Sequence[str]:
        return (self.on,)

    def accrue(self, data: RunData) -> Mapping[str, Curve]:
        if any(line.startswith(LEDGER) for line in data.missing):
            raise NotAccrued("nothing is known about frames")
        medium, _, node = (part.strip() for part in self.on.partition(":"))
        nodes = {name: tuple(each["nodes"]) for name, each in (data.scenario.get("media") or {}).items()}
        for each, sender, receiver in data.ledger.link.names:
            nodes.setdefault(each, (sender, receiver))
            nodes[each] = tuple(dict.fromkeys([*nodes[each], sender, receiver]))
        media = matching(medium, nodes)
        here = sorted({name for each in media for name in matching(node, nodes[each])})
        return {name: self._energy(data, media, name) for name in here}

    def _energy(self, data: RunData, media: Sequence[str], node: str) -> Curve:
        """The energy of one node, over its radios on all of `media`, each with a transceiver of its own."""
        ends, slopes = [np.array([0.0, data.length_ns])], []
        for medium in media:
            on_air = data.ledger.ints("on_air_ns") >= 0
            own = data.ledger.end_of(medium=medium, sender=node) & on_air
            heard = (data.ledger.end_of(medium=medium, receiver=node) & on_air
                     & ~data.ledger.fate.among(Fate.TOO_WEAK.value))
            sends, hears = self._busy(data, own), self._busy(data, heard)
            ends += [sends[0], hears[0]]
            slopes.append((sends, hears))
        t = np.unique(np.concatenate(ends))
        watts = np.zeros(t.size - 1)
        for sends, hears in slopes:
            sending, hearing = _inside(sends, t), _inside(hears, t)
            watts += np.where(sending, self.transmit_w, np.where(hearing, self.receive_w, self.idle_w))
        total = np.r_[0.0, np.cumsum(watts * np.diff(t) / NS_PER_S)]
        return Curve(t, total[:-1], total[1:])

    def _busy(self, data: RunData, rows: Mask) -> tuple[Floats, Floats]:
        """Return instants, and the number of copies on the air from each on, within the run."""
        starts, ends = data.ledger.ints("on_air_ns")[rows], data.ledger.ints("end_ns")[rows]
        ends = np.where(ends >= 0, ends, data.length_ns)
        at = np.minimum(np.r_[starts, ends], data.length_ns).astype(np.float64)
        order = np.argsort(at, kind="stable")
        change = np.repeat([1.0, -1.0], starts.size)[order]
        return at[order], np.cumsum(change)


def _inside(busy: tuple[Floats, Floats], t: Floats) -> Mask:
    """Mask of the pieces of `t` during which at least one copy is on the air."""
    at, copies = busy
    k = np.searchsorted(at, t[:-1], side="right") - 1
    found: Mask = (k >= 0) & (copies[np.maximum(k, 0)] > 0) if at.size else np.zeros(t.size - 1, dtype=np.bool_)
    return found
