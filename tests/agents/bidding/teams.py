"""Runs of teams that bid, and what their records say."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from agents.bidding.bid_frames import flooding_frame_bytes
from agents.bidding.bid_timing import BiddingSettings, BidTiming
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario.loader import load_tables
from experiments.scenario.model import Scenario
from netem.records.event_fields import read

US, MS, S = 1_000, 1_000_000, 1_000_000_000
DETECTED_NS = 7 * MS
RADIO: dict[str, Any] = {"kind": "broadcast_radio", "bit_rate_bps": 1_000_000, "preamble_us": 0, "header_bits": 0,
         "receive_latency_us": 20}


@dataclass
class Team:
    """`rewards[i]` are the bids of sensor `s{i}`, one for each target.

    `detects[k]` maps the sensors that detect target k to the instants [ns] at which they do.
    """

    rewards: list[list[float]]
    losses: int = 0                         # N^D
    detects: list[dict[int, int]] = field(default_factory=lambda: [{0: DETECTED_NS}])
    length_ns: int = 100 * MS
    impairments: list[dict[str, Any]] = field(default_factory=list)
    faults: list[dict[str, Any]] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)
    links: list[tuple[int, int]] | None = None          # who hears whom, both ways; None: all
    hops: int = 1

    @property
    def names(self) -> list[str]:
        return [f"s{i}" for i in range(len(self.rewards))]

    @property
    def settings(self) -> dict[str, Any]:
        """Of every sensor: slots of 0.6 ms for the 69 bytes of one task, and the shortest window."""
        tasks = min(3, len(self.detects))
        slot_ns = 600 * US * tasks
        if self.hops > 1:
            slot_ns = flooding_frame_bytes(tasks, len(self.rewards)) * 8 * US + 20 * US
        given = {"slot_ns": slot_ns, "heartbeat_rounds": 2, "max_successive_losses": self.losses,
                 "most_tasks": tasks, "most_hops": self.hops}
        least_ns = BidTiming(len(self.rewards), BiddingSettings(window_ns=1, **given)).least_window_ns
        return given | {"window_ns": least_ns} | self.parameters

    @property
    def timing(self) -> BidTiming:
        known = BiddingSettings.__dataclass_fields__
        return BidTiming(len(self.rewards), BiddingSettings(
            **{key: value for key, value in self.settings.items() if key in known}))

    def scenario(self, **changes: Any) -> Scenario:
        agents = {}
        for i, name in enumerate(self.names):
            detects = [by.get(i, -1) for by in self.detects]
            agents[name] = {"program": "agents.bidding.bidding_robot:BiddingRobot", "parameters": {
                **self.settings, "rewards": self.rewards[i], "detects_ns": detects}}
        radio = dict(RADIO)
        if self.links is not None:
            radio["topology"] = {"kind": "fixed", "links": [f"s{i} -> s{j}" for pair in self.links
                                                            for i, j in (pair, pair[::-1])]}
        tables = {"seed": 1, "length_ns": self.length_ns, "sample_period_ns": MS, "team": {"sensors": self.names},
                  "agents": agents, "media": {"radio": radio}, "impairments": self.impairments, "faults": self.faults}
        return load_tables(tables | changes, "Question: who is deployed?", Path("team.toml").absolute())

    def ran(self, host: Any = "inline") -> Ran:
        with TemporaryDirectory() as folder:
            done = run(self.scenario(), host=host, out=Path(folder) / "run", report=False)
            data = load_run(Path(folder) / "run")
            sent = list(zip(data.ledger.coded("sender").values(), data.ledger.ints("offered_ns").tolist(), strict=True))
            sizes = dict(zip(sent, data.ledger.ints("size_bytes").tolist(), strict=True))
            fates = set(data.ledger.fate.values())
            return Ran(data, done.summary.ledger_hash, done.summary.holds, sorted(set(sent)), sizes, fates)


@dataclass
class Ran:
    data: RunData
    hash: str
    holds: bool                             # no refusal of the sensors' automata either
    sent: list[tuple[str, int]]             # sender, instant
    sizes: dict[tuple[str, int], int]       # bytes of the frame that was sent so
    fates: set[str]                         # of copies

    def told(self, *kinds: str) -> list[tuple[str, int, str]]:
        """The events of these kinds: node, instant, detail."""
        return [(event.node, event.time_ns, event.detail) for event in self.data.events if event.kind in kinds]

    def deployed(self, target: int = 0) -> list[tuple[str, int]]:
        return [(node, time_ns) for node, time_ns, detail in self.told("deployed")
                if (read(detail) or {}).get("target") == str(target)]

    def let_go(self) -> list[tuple[str, int]]:
        return [(node, time_ns) for node, time_ns, _ in self.told("let go")]

    def counted(self, counter: str) -> int:
        return sum(counters.get(counter, 0) for counters in self.data.counters.values())


def lost(pattern: dict[tuple[str, str], list[int]]) -> list[dict[str, Any]]:
    """Impairments that lose the frames with these numbers on these links."""
    return [{"on": f"radio: {sender} -> {receiver}", "kind": "scripted_loss", "lose_frames": frames}
            for (sender, receiver), frames in pattern.items() if frames]
