"""`zenoh` of an agent: which medium carries the messages of which keys of its program's Zenoh.

    zenoh = "wifi"                                      all keys
    zenoh = { "fleet/**" = "wifi", "**" = "radio" }     the first key expression that intersects a key decides

Without it an agent's only medium that carries datagrams carries all keys.
"""

from __future__ import annotations

from collections.abc import Mapping

from experiments.scenario.datagram_media import check_programs, complaints_about, unable
from experiments.scenario.model import AgentSpec, MediumSpec, Scenario
from experiments.scenario.problems import Problems
from firmware_sim.zenoh_programs.specification import ZenohMedium, ZenohSpecification
from netem.wire.zenoh_frames import LEAST_ROOM
from netem.wire.zenoh_keys import includes, problem_of

Ways = tuple[tuple[str, str], ...]
ALL_KEYS = "**"


def ways(written: str | Mapping[str, str] | None) -> Ways:
    if written is None:
        return ()
    return ((ALL_KEYS, written),) if isinstance(written, str) else tuple(written.items())


def check_ways(agents: Mapping[str, AgentSpec], media: Mapping[str, MediumSpec], programs: Mapping[str, bool],
               problems: Problems) -> None:
    """Add a problem for each way whose key expression is none or matches nothing, or whose medium cannot carry it.

    `programs` says of each agent whether its program is ordinary blocking code.
    """
    check_programs("zenoh", (agent for agent in agents.values() if agent.zenoh), programs, problems)
    for name, agent in agents.items():
        earlier: list[str] = []
        for key, medium in agent.zenoh:
            alone = agent.zenoh == ((ALL_KEYS, medium),)
            place = ("agents", name, "zenoh") if alone else ("agents", name, "zenoh", key)
            if complaint := problem_of(key):
                problems.add(place, f"no key expression: {complaint}", medium)
                continue
            if covering := next((other for other in earlier if includes(other, key)), ""):
                problems.add(place, f"matches nothing: \"{covering}\" before it has all of its keys; write it before "
                             "that one, or leave it out", medium)
            earlier.append(key)
            complaints = list(complaints_about(agent, medium, media)) or [_complaint(media[medium])]
            for complaint in filter(None, complaints):
                problems.add(place, complaint, medium)


def specification(scenario: Scenario, agent: AgentSpec) -> ZenohSpecification:
    """Return what the program of `agent` needs to open a session; with a problem if the scenario leaves it open."""
    names = (*scenario.agents, *scenario.gateways)
    able = [name for name in agent.media if not _complaint(scenario.media[name])]
    chosen = agent.zenoh or tuple((ALL_KEYS, name) for name in able)
    problem = ""
    if not chosen:
        problem = (f"agents.{agent.name}: none of its media carries Zenoh ({', '.join(agent.media) or 'it has none'}); "
                   "connect it to a broadcast_radio or a packet_network")
    elif not agent.zenoh and len(able) > 1:
        problem = (f"agents.{agent.name}: {' and '.join(able)} can carry Zenoh; choose: zenoh = \"{able[0]}\" under "
                   f"[agents.{agent.name}], or a table of key expressions to media")
    used = dict.fromkeys(medium for _, medium in chosen)
    return ZenohSpecification(names, tuple(_medium(scenario.media[name]) for name in used), chosen, problem)


def _complaint(spec: MediumSpec) -> str:
    """Return why a medium cannot carry Zenoh's frames, "" if it can."""
    if complaint := unable(spec):
        return complaint
    format_ = None if spec.settings is None else spec.settings.datagram_format()
    if format_ is None:                 # the settings have a mistake of their own
        return ""
    if not format_.whole:
        return f"a {spec.kind} may cut frames; Zenoh needs a medium such as broadcast_radio or packet_network"
    if format_.longest_bytes is not None and format_.longest_bytes < LEAST_ROOM:
        return f"its frames have at most {format_.longest_bytes} bytes; Zenoh needs {LEAST_ROOM} at least"
    return ""


def _medium(spec: MediumSpec) -> ZenohMedium:
    format_ = spec.settings.datagram_format()
    return ZenohMedium(spec.name, format_.longest_bytes, format_.addressed)
