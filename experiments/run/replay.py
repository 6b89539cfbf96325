"""A run that meets the fates of an earlier one: recorded losses and delays instead of impairments, and node faults.

    ledger of the earlier run --each link, by number or by instant--> ReplayedLinks
    its scenario --faults of nodes, at the instants at which they occurred--> the faults of this run

Faults of links are among the recorded fates already.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa

from experiments.judge.recorded_fates import recorded_fates
from experiments.judge.run_files import LEDGER, SCENARIO
from experiments.run.repeat import Match
from experiments.scenario.model import FaultSpec, Scenario
from netem.core.link_name import LinkName
from netem.faults.table import FAULTS
from netem.media.links import Deliver
from netem.media.replayed_links import RecordedFrame, ReplayedLinks
from netem.records.ledger import Ledger


class NoFates(ValueError):
    """A run whose fates are asked for has none that this scenario could meet."""

    exit_code = 2


@dataclass(frozen=True)
class Replay:
    """The recorded frames of an earlier run by link, how frames of this run find theirs, and the faults of nodes."""

    folder: Path
    recorded: dict[LinkName, list[RecordedFrame]]
    match: Match
    faults: tuple[FaultSpec, ...]

    def links(self, ledger: Ledger, deliver: Deliver) -> ReplayedLinks:
        return ReplayedLinks(ledger, deliver, self.recorded, self.match == "instant")


def replay_of(folder: Path, scenario: Scenario, match: Match = "number") -> Replay:
    """Return the fates recorded in `folder` for a run of `scenario`; NoFates, with a remedy, if they cannot be met."""
    try:
        recorded = recorded_fates(folder)
        old: dict[str, Any] = SCENARIO.read(folder)
    except (OSError, pa.ArrowException, msgspec.MsgspecError) as error:
        raise NoFates(f"{folder}: cannot read its {LEDGER} and {SCENARIO.name}: {error}: name the folder of a run that "
                      "came to its end") from None
    nodes = {name: set(spec.nodes) for name, spec in scenario.media.items()}
    known = {link: frames for link, frames in recorded.items()
             if {link[1], link[2]} <= nodes.get(link[0], set())}
    if not known:
        raise NoFates(f"{folder}: has fates for {_some(recorded)}, and {scenario.name} has none of these links: name a "
                      "run of the same robots and media")
    return Replay(folder, known, match, tuple(_faults(old, scenario)))


def _faults(old: dict[str, Any], scenario: Scenario) -> list[FaultSpec]:
    found = []
    for table in old.get("faults") or ():
        cls = FAULTS[table["kind"]]
        if cls.on != "nodes":
            continue
        targets = tuple(tuple(target) for target in table["targets"] if target[0] in scenario.agents)
        found.append(FaultSpec(table["place"], table["name"], table["kind"], table["on"], targets,
                               msgspec.convert(table["settings"], cls),
                               tuple((start_ns, end_ns) for start_ns, end_ns in table["occurrences"]), True))
    return [spec for spec in found if spec.targets]


def told(replay: Replay, links: ReplayedLinks) -> str:
    """Return a line that says how many copies met their records, and which did not."""
    counted = links.counted
    parts = [f"{counted['as recorded']} copies as in {replay.folder}, by {replay.match}"]
    parts += [f"{counted[what]} {what}" for what in ("without a record", "later than recorded") if counted[what]]
    if unmet := links.unmet():
        parts.append(f"{unmet} recorded frames not met: not sent now, or lost in the medium")
    return "; ".join(parts)


def _some(recorded: dict[LinkName, Any]) -> str:
    names = [f"{medium}: {sender} -> {receiver}" for medium, sender, receiver in recorded]
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more links" if len(names) > 3 else "") or "no link"

