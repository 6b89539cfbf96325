"""Checks the recorded executions of a run against the automata that its programs declare.

    for refusal in check_run(Path("runs/my_run")): print(refusal.node, refusal.rule.value, refusal.what)
    for graphs in graphs_of_run(Path("runs/my_run"), period_ns=10**9): print(graphs.communication.edges)
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from agents.hybrid.automaton import Automaton
from agents.hybrid.checker import Refusal, Rule, Samples, check
from agents.hybrid.mode_change import KIND, ModeChange, read
from agents.hybrid.network import Graphs, Network, Pair, graphs, missing_contacts
from experiments.judge.contacts import contacts_of
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.run_data import RunData, load_run
from experiments.scenario.automata import automata_of
from netem.media.table import MEDIA
from netem.records.events import Event
from netem.records.signal_table import SignalTable
from netem.wire.instants import NEVER_NS


class _Agent(msgspec.Struct, frozen=True):
    program: str
    parameters: dict[str, object]


def refusals(automata: Mapping[str, Automaton], events: Iterable[Event], copies: FrameCopies,
             signals: Mapping[str, SignalTable], showing: Collection[str],
             contact_within_ns: int = NEVER_NS) -> list[Refusal]:
    """Return what the checker refuses, by instant and node. A change of mode `by` another node needs a frame or a
    sight of it, delivered at most `contact_within_ns` earlier; on the media `showing` copies are sights.
    """
    found: list[Refusal] = []
    changes: dict[str, list[ModeChange]] = {node: [] for node in automata}
    for node, change in _told(events, automata):
        if isinstance(change, Refusal):
            found.append(change)
        else:
            changes[node].append(change)
    for node, automaton in automata.items():
        table = signals.get(node)
        samples = None if table is None else Samples(table.names, table.time_ns, table.values)
        found += check(node, automaton, changes[node], samples, () if table is None else table.dead_ns)
    contacts = contacts_of(copies, showing)
    for made in changes.values():
        found += missing_contacts(made, contacts, contact_within_ns)
    return sorted(found, key=lambda refusal: (refusal.from_ns, refusal.node))


def check_run(folder: Path, contact_within_ns: int = NEVER_NS) -> list[Refusal]:
    """Return what the checker refuses in the run of `folder`; the scenario's programs have to be there still.

    Raises ValueError if the folder holds no scenario or no program of it declares an automaton.
    """
    data = load_run(folder)
    automata = _automata(folder, data)
    if not automata:
        raise ValueError(f"{folder}: no program of its scenario declares an automaton")
    return refusals(automata, data.events, data.ledger, data.signals, _showing(data), contact_within_ns)


def graphs_of_run(folder: Path, period_ns: int, control: Collection[Pair] = ()) -> Iterator[Graphs]:
    """Yield who heard, saw and acted on whom in each interval of a run; `control` as in `Network`.

    Raises ValueError if the folder holds no scenario.
    """
    data = load_run(folder)
    automata = _automata(folder, data)
    network = Network(tuple(data.scenario["agents"]), automata, frozenset(control))
    changes = [change for _, change in _told(data.events, network.automata) if isinstance(change, ModeChange)]
    yield from graphs(network, contacts_of(data.ledger, _showing(data)), changes, period_ns, data.length_ns)


def _told(events: Iterable[Event], automata: Collection[str]) -> Iterator[tuple[str, ModeChange | Refusal]]:
    for event in events:
        if event.kind == KIND and event.node in automata:
            change = read(event.time_ns, event.node, event.detail)
            yield event.node, change or Refusal(event.node, Rule.UNREADABLE, event.time_ns, event.time_ns,
                                                f"the event {KIND} tells no change of mode: {event.detail!r}")


def _automata(folder: Path, data: RunData) -> dict[str, Automaton]:
    if not data.scenario:
        raise ValueError(f"{folder}: expected the folder of a run, with its scenario; {'; '.join(data.missing)}")
    agents = {name: msgspec.convert(agent, _Agent) for name, agent in data.scenario["agents"].items()}
    return automata_of(agents, data.scenario.get("team") or {}, Path(data.scenario["path"]).parent)


def _showing(data: RunData) -> set[str]:
    return {name for name, medium in data.scenario["media"].items() if MEDIA[medium["kind"]].Settings.shows_bodies}
