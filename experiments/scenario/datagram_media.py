"""Checks for agents with the key `sockets` or `zenoh`: the program is a function, and the media carry datagrams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from experiments.scenario.model import AgentSpec, MediumSpec
from experiments.scenario.problems import Problems, near


def check_programs(key: str, agents: Iterable[AgentSpec], blocking: Mapping[str, bool], problems: Problems) -> None:
    """Add a problem for each of `agents`, which have the key, whose program is a board's and not a function."""
    for agent in agents:
        if not blocking.get(agent.name, True):
            problems.add(("agents", agent.name, key), "this program is a class, which sends through `board.port`; "
                                                      f"{key} is there for a program that is a function")


def complaints_about(agent: AgentSpec, name: str, media: Mapping[str, MediumSpec]) -> Iterator[str]:
    """Yield why the medium `name` cannot carry datagrams of the agent's program: unknown, not the agent's, unable."""
    if name not in media:
        yield f"no such medium; {near(name, media)}"
        return
    if name not in agent.media:
        yield f"the agent has no port on this medium; it is on {', '.join(agent.media) or 'none'}"
    if complaint := unable(media[name]):
        yield complaint


def unable(spec: MediumSpec) -> str:
    """Return why a medium carries no datagrams, "" if it does or if its settings are wrong."""
    if spec.settings is None or spec.settings.datagram_format() is not None:
        return ""
    if spec.settings.carries_can_frames:
        return "a CAN bus carries CAN frames: open it with can.Bus"
    return f"a {spec.kind} carries no datagrams"
