"""Agents that speak in turn, one slot each, over links with constant delays.

Agent i sends at i slot, i slot + round, ...; a round has one slot for each agent. A value sent at t is used by the
receiver from t + delay of the link until the next one comes, a round later.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.synchronization.graph import Edge, Floats
from agents.waves.agent import Agent


@dataclass(frozen=True, eq=False)
class Network:
    """`delays_ns` has every link (sender, receiver); with each link there is the opposite one."""

    agents: tuple[Agent, ...]
    delays_ns: Mapping[Edge, int]
    slot_ns: int

    def __post_init__(self) -> None:
        for (sender, receiver), delay_ns in self.delays_ns.items():
            if delay_ns < 0:
                raise ValueError(f"delay of {sender} -> {receiver}: {delay_ns} ns: expected 0 or more")
            if (receiver, sender) not in self.delays_ns:
                raise ValueError(f"link {sender} -> {receiver}: expected the opposite link too: a line has two ends")

    @property
    def round_ns(self) -> int:
        return self.slot_ns * len(self.agents)

    @cached_property
    def neighbours(self) -> list[list[int]]:
        """Return for each agent those that it hears, which are those that hear it, ascending."""
        return [sorted(sender for sender, receiver in self.delays_ns if receiver == i)
                for i in range(len(self.agents))]

    def first_ns(self, agent: int) -> int:
        """Return the instant at which an agent sends for the first time."""
        return agent * self.slot_ns

    def with_delay(self, delay_ns: int) -> Network:
        """Return the network with the same delay on each link."""
        return Network(self.agents, dict.fromkeys(self.delays_ns, delay_ns), self.slot_ns)

    def at_most(self, most_ns: int) -> Network:
        return Network(self.agents, {link: min(delay_ns, most_ns) for link, delay_ns in self.delays_ns.items()},
                       self.slot_ns)

    @property
    def longest_ns(self) -> int:
        return max(self.delays_ns.values(), default=0)

    def states(self, agent: int) -> slice:
        """Return the place of an agent's states among those of all."""
        before = sum(other.states for other in self.agents[:agent])
        return slice(before, before + self.agents[agent].states)

    @property
    def all_states(self) -> int:
        return sum(agent.states for agent in self.agents)

    def at_rest(self) -> Floats | None:
        """Return the states of all agents at rest with the output 1; None if one of them cannot stay there."""
        resting = [agent.at_rest() for agent in self.agents]
        found = [x for x in resting if x is not None]
        return np.concatenate(found) if len(found) == len(resting) else None
