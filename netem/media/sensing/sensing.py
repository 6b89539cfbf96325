"""Sensing: cameras expose at 0, period, 2 period, ..., and report their detections to observers.

    body ---shows its pose at exposure F---> medium <---look, at or before F--- observer
                                               |---detection with noise, at F + latency---> observer

Every observer that requested a look at or before an exposure receives its detections `latency_ns` after it. The body
that `cameras` names carries the observer's camera, by default the observer itself if it is a body; otherwise the camera
is fixed at the origin. A camera does not see the body that carries it. The cameras of observers in `fixed_cameras` are
fixed at the origin and see all bodies, including the observer; observers in `every_exposure_to` need not request looks.
Both together are motion capture.

Invariants:
- the ledger expects one copy for each body and each observer that looks at an exposure, with `record_out_of_view` off
  only for those in the field of view; requests are no frames;
- an exposure F is evaluated at F + 1 ns, after all its poses and requests, and its detections arrive no earlier than
  F + latency >= F + 2 ns;
- each pair (body, observer) has its own stream of noise, so a further observer does not change the draws of others.

Not modelled: false detections, confused bodies, motion during an exposure. Lost exposures and blackouts are impairments
on the link from body to observer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any, ClassVar

from mypy_extensions import mypyc_attr

from netem.core.agenda import TIMER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.impairments.correlated_uniforms import SMALLEST, normal_quantile
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.sensing.sensor_faults import CHANGES, SensorFault, changed
from netem.media.sensing.settings import SensingSettings
from netem.media.sensing.sight import LOOK, Body, Detection, pack_detection, pack_nothing
from netem.records.ledger import Ledger

ORIGIN = Body(0.0, 0.0, 0.0, 0.0)
COUNTERS = ("unreadable frames", "exposures without the camera's pose")


@mypyc_attr(allow_interpreted_subclasses=True)
class Sensing(Medium):
    Settings: ClassVar = SensingSettings

    def __init__(self, name: str, settings: SensingSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        super().__init__(name, nodes)
        self.poses = settings.poses()
        settings.check_nodes(self.nodes)
        self._settings = settings
        self._view = settings.view
        self._agenda, self._ledger, self._links, self._rng_for = agenda, ledger, links, rng_for
        self._rngs: dict[tuple[str, str], Random] = {}
        self._bodies: dict[int, dict[str, Body]] = {}           # by exposure
        self._looking: dict[int, set[str]] = {}                 # by exposure, the observers that requested a look
        self._waiting: list[int] = []                           # exposures to be evaluated, in order
        self._numbers: Counter[str] = Counter()
        self._faults: dict[tuple[str, str], list[SensorFault]] = {}     # by (body, observer)
        self._counters = {node: Counter(dict.fromkeys(COUNTERS, 0)) for node in self.nodes}
        self._neighbours: Callable[[Mapping[str, Body]], Callable[[Body], Iterable[str]]] | None = None
        if not settings.record_out_of_view:
            from netem.media.sensing.neighbours import neighbours_within

            self._neighbours = neighbours_within(self._view.range_m)

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        return [*super().links(until_ns), *((node, node) for node in self._settings.links_to_themselves())]

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        return self._counters

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        exposure_ns = self._next_exposure_ns(now_ns)
        if data == LOOK:
            self._looking.setdefault(exposure_ns, set()).add(sender)
            self._wait_for(exposure_ns)
        else:
            self._count(sender, "unreadable frames")

    def show(self, node: str, values: Sequence[float], now_ns: int) -> None:
        x_m, y_m, *height_m, heading_rad = values
        self._bodies.setdefault(now_ns, {})[node] = Body(x_m, y_m, height_m[0] if height_m else 0.0, heading_rad)
        self._wait_for(now_ns)

    def take_fault(self, how: str, cause: str, of: Sequence[str], fields: Mapping[str, Any], start_ns: int,
                   end_ns: int) -> str:
        body, observer = of
        rng = self._rng_for(f"{cause}/{self.name}: {body} -> {observer}/{start_ns}")
        self._faults.setdefault((body, observer), []).append(
            SensorFault(cause, start_ns, end_ns, CHANGES[how], fields, rng))
        return ""

    def lookahead_ns(self, t0_ns: int) -> int:
        """See `Medium`: the detections of the exposure to be evaluated, or else of the next one."""
        exposure_ns = self._waiting[0] if self._waiting else self._next_exposure_ns(t0_ns)
        return max(t0_ns, min(exposure_ns, self._next_exposure_ns(t0_ns)) + self._settings.latency_ns)

    def finish(self, end_ns: int) -> None:
        """Forget exposures that were not evaluated: their copies are not in the ledger."""
        self._waiting.clear()

    def _next_exposure_ns(self, now_ns: int) -> int:
        return -(-now_ns // self._settings.exposure_period_ns) * self._settings.exposure_period_ns

    def _wait_for(self, exposure_ns: int) -> None:
        if exposure_ns not in self._waiting:
            self._waiting.append(exposure_ns)
            self._agenda.at(exposure_ns + 1, TIMER, self.name, partial(self._expose, exposure_ns))

    def _expose(self, exposure_ns: int) -> None:
        self._waiting.remove(exposure_ns)
        bodies = self._bodies.pop(exposure_ns, {})
        looking = self._looking.pop(exposure_ns, set()).union(self._settings.every_exposure_to)
        numbers = {}
        for name in sorted(bodies):
            numbers[name] = self._numbers[name]
            self._numbers[name] += 1
        in_reach = self._neighbours(bodies) if self._neighbours is not None else None
        for observer in sorted(looking):
            self._look(observer, exposure_ns, bodies, numbers, in_reach)

    def _look(self, observer: str, exposure_ns: int, bodies: Mapping[str, Body], numbers: Mapping[str, int],
              in_reach: Callable[[Body], Iterable[str]] | None) -> None:
        """`numbers`: of each body's frame, in the order of names; `in_reach`: names that a camera may have in view."""
        fixed = observer in self._settings.fixed_cameras
        carrier = self._settings.cameras.get(observer, observer)
        camera = ORIGIN if fixed else bodies.get(carrier)
        if camera is None:
            if observer in self._settings.cameras:
                self._count(observer, "exposures without the camera's pose")
                self._tell_nothing(observer, exposure_ns)
                return
            camera = ORIGIN
        in_view = False
        arrival_ns = exposure_ns + self._settings.latency_ns
        for name in numbers if in_reach is None else in_reach(camera):
            if not fixed and name in (observer, carrier):
                continue
            fate, cause = self._view.fate(camera, bodies[name]), ""
            if in_reach is not None and fate is Fate.OUT_OF_VIEW:
                continue
            detection = self._detection(observer, name, exposure_ns, bodies[name])
            frame = Frame(self.name, name, numbers[name], exposure_ns, pack_detection(detection), exposure_ns,
                          exposure_ns)
            self._ledger.expect(1, self.name)
            if fate is None and (name, observer) in self._faults:
                found, cause = changed(detection, self._faults[name, observer])
                if found is None:
                    fate = Fate.BLACKED_OUT
                else:
                    frame.data = pack_detection(found)
            if fate is None:
                in_view = True
                self._links.receive(frame, observer, arrival_ns, checksum=True)
                for tap in self.taps:
                    tap.frame(frame, exposure_ns)
            else:
                self._ledger.close(frame, observer, fate, cause=cause)
        if not in_view:
            self._tell_nothing(observer, exposure_ns)

    def _detection(self, observer: str, name: str, exposure_ns: int, body: Body) -> Detection:
        pair = (name, observer)
        if pair not in self._rngs:
            self._rngs[pair] = self._rng_for(f"media.{self.name}.noise.{name} -> {observer}")
        rng, sigma_m = self._rngs[pair], self._settings.noise_m
        x_m, y_m, z_m = (
            value + sigma_m * normal_quantile(rng.random() or SMALLEST) if sigma_m else value for value in body[:3])
        return Detection(exposure_ns, x_m, y_m, z_m, name)

    def _tell_nothing(self, observer: str, exposure_ns: int) -> None:
        self._links.tell(observer, self.name, exposure_ns + self._settings.latency_ns, pack_nothing(exposure_ns))

    def _count(self, node: str, what: str) -> None:
        self._counters[node][what] += 1
