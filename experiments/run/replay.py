"""A run that meets the fates of an earlier one: recorded losses and delays instead of impairments, and its faults.

    ledger of the earlier run --each link, by number or by instant--> ReplayedLinks
    its scenario --faults of nodes and media, at the instants at which they occurred--> the faults of this run

Faults of links are among the recorded fates already. Those that came from outside are in the scenario of their run.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec
import pyarrow as pa

from experiments.judge.recorded_fates import recorded_fates
from experiments.judge.recorded_faults import recorded_faults
from experiments.judge.run_files import LEDGER, SCENARIO
from experiments.scenario.faults import site_of
from experiments.scenario.model import FaultSpec, Scenario
from netem.core.link_name import LinkName
from netem.faults import Fault, Site
from netem.media.links import Deliver
from netem.media.replayed_links import RecordedFrame, ReplayedLinks
from netem.records.ledger import Ledger

Match = Literal["number", "instant"]


class NoFates(ValueError):
    """A run whose fates are asked for has none that this scenario could meet."""

    exit_code = 2


@dataclass(frozen=True)
class Replay:
    """The recorded frames of an earlier run by link, how frames of this run find theirs, and the faults that act."""

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
    """Return the faults of the earlier run that act again, on those of their targets that this scenario has."""
    site = site_of(scenario.agents, scenario.media, {}, ())
    found = [msgspec.structs.replace(spec, at_random=True, targets=tuple(
                 target for target in spec.targets if _is_there(spec.settings, target, site)))
             for spec in recorded_faults(old) if spec.settings.acts_again()]
    return [spec for spec in found if spec.targets]


def _is_there(fault: Fault, target: tuple[str, ...], site: Site) -> bool:
    if fault.on == "nodes":
        return target[0] in site.nodes
    medium, *nodes = target
    return (fault.strikes in site.strikable.get(medium, ()) and set(nodes) <= set(site.nodes_on[medium])
            and not fault.refusal(target, site))


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

