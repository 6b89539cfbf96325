"""How long a look takes: from the request over the radio to the moment at which the drive has the command.

    d = request + answer + setpoint,  each: airtime and receive latency on the radio, the most that impairments add

A scenario tells before a run what its links add, and `prepare` tells it to each robot. Airtime counts only together
with such a delay: without one the robot takes the duration of its last exchange for d, as section 4.6 neglects it.
The way of the setpoint has no airtime here: bus and drive are within `actuation_ns`.

Not modelled: waiting for a free channel (CSMA) or a free bus, which the duration of the last exchange has.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from agents.tracking.controller import Inputs
from agents.tracking.look_frames import ANSWER_BYTES, REQUEST_BYTES
from agents.triggering.policies import Policy
from firmware_sim.scenario_view import ScenarioView

RADIO, BUS = "radio", "can"         # the robot's ports


@dataclass(frozen=True)
class LookDelay:
    request_ns: int = 0             # from the request to the reference, at most
    answer_ns: int = 0              # back, at most
    setpoint_ns: int = 0            # to the drive, at most
    least_request_ns: int = 0       # at least, also outside the windows of impairments
    least_answer_ns: int = 0
    airtime_ns: int = 0             # of request and answer: the shortest interval between looks
    impaired_ns: int = 0            # share of impairments
    places: tuple[str, ...] = ()    # the impairments, by their place in the scenario

    @property
    def total_ns(self) -> int:
        return self.request_ns + self.answer_ns + self.setpoint_ns

    @property
    def request_share(self) -> float:
        """Return the share of an exchange after which the reference answers, if both ways take their least time."""
        exchange_ns = self.least_request_ns + self.least_answer_ns
        return self.least_request_ns / exchange_ns if exchange_ns else 0.5


NONE = LookDelay()


def told(team: Mapping[str, Any], name: str) -> LookDelay:
    """Return the delay that `prepare` told the robot `name`."""
    row: Mapping[str, Any] | None = team.get("look_delays", {}).get(name)
    return NONE if row is None else LookDelay(**{**row, "places": tuple(row["places"])})


def look_delay(scenario: ScenarioView, name: str) -> LookDelay:
    """Return the delay of the looks of robot `name`, the longest of all robots on its radio; NONE if nothing delays."""
    from agents.synchronization.late_values import AddedDelay, added_delays  # late: robots need no impairments
    from netem.impairments.flow import Flow

    medium = scenario.media.get(RADIO)
    radio = medium.settings.radio() if medium is not None else None
    latency_ns = 0 if radio is None else radio.receive_latency_ns
    request_ns, answer_ns = (0 if radio is None else radio.airtime_ns(size) for size in (REQUEST_BYTES, ANSWER_BYTES))
    airtime_ns = request_ns + answer_ns
    added = added_delays(scenario.impairments, Flow((ANSWER_BYTES,), max(airtime_ns, 1)), scenario.length_ns)

    windowed = {link for spec in scenario.impairments if spec.windows_ns for link in spec.links}

    def on(link: tuple[str, str, str]) -> AddedDelay:
        delay = added.get(link, AddedDelay())
        return replace(delay, least_ns=0) if link in windowed else delay

    others = [other for other in (medium.nodes if medium is not None else ()) if other != name]
    drives = [on((BUS, name, other)) for other in (scenario.media[BUS].nodes if BUS in scenario.media else ())]
    setpoint = max(drives, key=lambda delay: delay.most_ns, default=AddedDelay())
    there, back = max(((on((RADIO, name, other)), on((RADIO, other, name))) for other in others),
                      key=lambda ways: ways[0].most_ns + ways[1].most_ns, default=(AddedDelay(), AddedDelay()))
    impaired_ns = there.most_ns + back.most_ns + setpoint.most_ns
    if not impaired_ns and not latency_ns:
        return NONE
    request_ns, answer_ns = request_ns + latency_ns, answer_ns + latency_ns
    return LookDelay(request_ns + there.most_ns, answer_ns + back.most_ns, setpoint.most_ns,
                     request_ns + there.least_ns, answer_ns + back.least_ns, max(airtime_ns, 1), impaired_ns,
                     tuple(dict.fromkeys((*there.places, *back.places, *setpoint.places))))


def delay_problems(scenario: ScenarioView, name: str, policy: Policy[Any, Inputs], delay: LookDelay, *,
                   overlapping: bool = True) -> Iterator[str]:
    """Yield one sentence if the delay leaves no interval at x = 0 for some inputs of the reference.

    `overlapping`: whether the robot sends a request before the last one is answered."""
    if not delay.total_ns:
        return
    worst: tuple[int, Inputs] | None = None
    for inputs in reference_inputs(scenario.team):
        valid_ns = policy.decide(0, (0.0, 0.0, 0.0), inputs).valid_ns
        if worst is None or valid_ns < worst[0]:
            worst = valid_ns, inputs
    if worst is None:
        return
    valid_ns, inputs = worst
    left_ns = valid_ns - delay.total_ns
    place = f"{' and '.join(delay.places) or f'media.{RADIO}.receive_latency_s'}: agents.{name}"
    takes = (f"a look takes up to {_ms(delay.total_ns)} until its command acts, {_ms(delay.impaired_ns)} of them by "
             f"impairments, and the small-gain condition (4.37) holds for tau* = {_ms(valid_ns)} after a request with "
             f"inputs ({inputs.v_mps:g}, {inputs.omega_rad_s:g}) at x = 0")
    remedy = ("shorten the delay, or use smaller gains, or set "
              f"agents.{name}.parameters.sure = false to run it all the same")
    if left_ns <= 0:
        yield f"{place}: {takes}: expected less, as the interval may be tau* - d at most; {remedy}"
    elif left_ns < delay.airtime_ns:
        yield (f"{place}: {takes}: the interval left, {_ms(left_ns)}, is shorter than the frames of a look, "
               f"{_ms(delay.airtime_ns)}; {remedy}")
    elif not overlapping and left_ns < delay.total_ns:
        yield (f"{place}: {takes}: the interval left, {_ms(left_ns)}, is shorter than a look, and this robot sends no "
               f"request before the last one is answered; use the program in Python, or {remedy}")


def reference_inputs(team: Mapping[str, Any]) -> list[Inputs]:
    """Return the inputs of the pieces in use in the table [team.reference]; none if the table is incomplete."""
    try:
        table = team["reference"]
        rows = zip(table["from_s"], table["v_mps"], table["omega_radps"], strict=False)
        return [Inputs(float(v), float(omega)) for from_s, v, omega in rows if from_s >= 0]
    except (KeyError, TypeError, ValueError):
        return []


def _ms(time_ns: int) -> str:
    return f"{time_ns / 1e6:.3f} ms"
