"""Who is deployed in a run, and the losses and partitions that tests draw."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from tests.agents.bidding.teams import Ran

Link = tuple[str, str]


def deployed_at(ran: Ran, time_ns: int) -> set[str]:
    """The sensors that are deployed at an instant, alive or not, by their events."""
    there: set[str] = set()
    for node, told_ns, _, kind in sorted(((event.node, event.time_ns, event.detail, event.kind)
                                          for event in ran.data.events), key=lambda told: told[1]):
        if told_ns > time_ns:
            break
        if kind == "deployed":
            there.add(node)
        elif kind == "let go" or kind == "fault":
            there.discard(node)
    return there


def all_links(sensors: int) -> list[Link]:
    return [(f"s{i}", f"s{j}") for i in range(sensors) for j in range(sensors) if i != j]


def patterns(links: list[Link], losses: int, frames: int = 40) -> st.SearchStrategy[dict[Link, list[int]]]:
    """Losses on these links, at most `losses` in a row on each."""
    def kept(wanted: list[bool]) -> list[int]:
        found: list[int] = []
        for k, lose in enumerate(wanted):
            if lose and not all(before in found for before in range(k - losses, k)):
                found.append(k)
        return found

    one = st.lists(st.sampled_from([True, True, False]), min_size=frames, max_size=frames).map(kept)
    return st.fixed_dictionaries(dict.fromkeys(links, one))


def cut(during_ms: tuple[float, float], *groups: list[str]) -> dict[str, Any]:
    return {"kind": "partition", "on": "radio", "during_s": [at / 1000 for at in during_ms], "groups": list(groups)}
