"""Finds links that are too slow for discovery: a control frame has to arrive before its sub-slot ends.

    a control frame sent at slot start + control offset that arrives `late` after airtime and latency have passed
    belongs to its slot only if         late < slot - control offset = the rest of the control sub-slot

A robot that receives a control frame in a slot that is not its sender's concludes that the robots use different
schedules, and falls back to the slots of the start. If the link is too slow even for those, it falls back at every
control frame and no discovery ever ends: the run is refused. If only later, shorter slots are too short, the team falls
back once, discovers in the slots of the start and goes on, which is slow but no reason to refuse a run.

`late` is the least time that the link's impairments add to every copy: a constant delay, the least value of a bounded
one, the time of a frame at a rate limit, summed over the link. An impairment that acts only in a window is left out,
since its effect ends with the window. Clocks that differ may hide a lateness of one guard time.
Not modelled: a lateness of a whole number of control cycles, which looks like a later cycle.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence

from agents.synchronization.discovery_frame import frame_bytes
from agents.synchronization.late_values import constructed
from agents.synchronization.team import Team
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.scenario_view import ImpairmentView
from netem.core.link_name import LinkName


def late_control_frames(team: Team, slot_ns: int, impairments: Sequence[ImpairmentView], links: Collection[LinkName],
                        clocks: Mapping[str, ClockSettings], length_ns: int) -> Iterator[str]:
    """Yield one sentence for each set of impairments that keeps discovery in slots of `slot_ns` from ending.

    `links` are those that the radio has at some time of the run, `clocks` those of the robots. Requires `team.layout`.
    """
    offset_ns = team.layout.control_offset_ns(slot_ns)
    rest_ns = slot_ns - offset_ns
    too_slow: dict[tuple[str, int], list[LinkName]] = defaultdict(list)
    for link, delays in _delays(impairments, frame_bytes(len(team.names)), length_ns).items():
        late_ns = sum(delay_ns for _, delay_ns in delays)
        if link in links and late_ns >= rest_ns + _hidden_ns(team, clocks[link[1]], clocks[link[2]]):
            too_slow[" and ".join(place for place, _ in delays), late_ns].append(link)
    for (places, late_ns), named in too_slow.items():
        medium, sender, receiver = named[0]
        others = f" and {len(named) - 1} more" if len(named) > 1 else ""
        yield (f"{places}: {medium}: {sender} -> {receiver}{others}: every control frame comes at least {late_ns} ns "
               f"late, so discovery would never end: expected less than {rest_ns} ns, the rest of the control sub-slot "
               f"(a slot of {slot_ns} ns less its offset of {offset_ns} ns); shorten the delay, lengthen "
               f"team.boot_slot_s to {_enough_s(team, late_ns):.6f} or more, or tell the robots the topology")


def _delays(impairments: Sequence[ImpairmentView], size_bytes: int,
            length_ns: int) -> dict[LinkName, list[tuple[str, int]]]:
    """Return for each link the impairments that delay every frame of the run, with the least delay [ns] of each."""
    found: dict[LinkName, list[tuple[str, int]]] = defaultdict(list)
    for spec, impairment in constructed(impairments):
        always = not spec.windows_ns or any(start <= 0 and end >= length_ns for start, end in spec.windows_ns)
        if impairment is not None and always and (least_ns := impairment.least_delay_ns(size_bytes)):
            for link in spec.links:
                found[link].append((spec.place, least_ns))
    return found


def _hidden_ns(team: Team, sender: ClockSettings, receiver: ClockSettings) -> int:
    """Return by how much the receiver's clock can show a frame's arrival too early [ns]."""
    apart_ns = 0 if (sender.offset_ns, sender.drift_ppm) == (receiver.offset_ns, receiver.drift_ppm) else round(
        team.guard_s * 1e9)
    return apart_ns + receiver.tick_ns - 1


def _enough_s(team: Team, late_ns: int) -> float:
    """Return a slot length [s] with a rest of the control sub-slot above `late_ns`, rounded up to microseconds.

    From rest > (slot - data + 2 control) / 3 of `Layout.control_offset_ns`."""
    quantum_ns = max(1, round(team.slot_quantum_s * 1e9))
    slot_ns = 3 * late_ns + team.layout.data_airtime_ns - 2 * team.layout.control_airtime_ns + 3 + quantum_ns
    return -(-slot_ns // 1000) * 1e-6
