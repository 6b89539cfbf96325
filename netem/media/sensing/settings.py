"""The keys of `[media.<name>]` for a sensing medium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import ClassVar

from netem.media import MediumSettings
from netem.media.answers import Camera, FloorPlan, ShownPose
from netem.media.sensing.field_of_view import FieldOfView, Obstacle


@dataclass(frozen=True)
class SensingSettings(MediumSettings):
    link_type: ClassVar = 150               # USER3
    strikable: ClassVar = frozenset({"links", "sensor"})
    shows_bodies: ClassVar = True
    exposure_period_ns: int                                 # exposures at 0, period, 2 period, ...
    latency_ns: int                                         # from an exposure to the arrival of its detections
    noise_m: float = 0.0                                    # standard deviation of x, y and z each
    range_m: float | None = None                            # None: unlimited
    half_angle_deg: float = 180.0                           # to both sides of the camera's heading
    bodies: dict[str, tuple[str, ...]] = field(default_factory=dict)    # body -> outputs of its plant with its pose
    cameras: dict[str, str] = field(default_factory=dict)   # observer -> body that carries its camera
    fixed_cameras: tuple[str, ...] = ()                     # observers whose cameras are fixed, and see them as well
    every_exposure_to: tuple[str, ...] = ()                 # observers that need not request looks
    obstacles: tuple[Obstacle, ...] = ()
    record_out_of_view: bool = True                         # False: no copy of a body that is out of view

    def __post_init__(self) -> None:
        if self.exposure_period_ns < 1:
            raise ValueError(f"exposure_period_ns={self.exposure_period_ns}: expected at least 1")
        if self.latency_ns < 2:
            raise ValueError(f"latency_ns={self.latency_ns}: expected at least 2: an exposure is evaluated after 1 ns")
        if not (isfinite(self.noise_m) and self.noise_m >= 0):
            raise ValueError(f"noise_m={self.noise_m}: expected 0 or more")
        for name, outputs in self.bodies.items():
            if len(outputs) not in (3, 4):
                raise ValueError(f"bodies: {name}={list(outputs)}: expected the plant's outputs for x, y, heading, or "
                                 f"for x, y, z, heading")
        _ = self.view

    @property
    def view(self) -> FieldOfView:
        return FieldOfView(inf if self.range_m is None else self.range_m, self.half_angle_deg, self.obstacles)

    def links_to_themselves(self) -> Sequence[str]:
        return self.fixed_cameras

    def poses(self) -> Mapping[str, ShownPose]:
        return {name: ShownPose(self.exposure_period_ns, outputs) for name, outputs in self.bodies.items()}

    def camera(self, observer: str) -> Camera:
        carrier = self.cameras.get(observer, observer)
        carried = carrier in self.bodies and observer not in self.fixed_cameras
        return Camera(carrier if carried else None, self.view, self.exposure_period_ns, self.latency_ns, self.noise_m)

    def floor_plan(self) -> FloorPlan:
        own = {name: name for name in self.every_exposure_to if name in self.bodies and name not in self.fixed_cameras}
        return FloorPlan({**own, **self.cameras}, self.every_exposure_to, self.range_m, self.half_angle_deg,
                         self.obstacles)

    def check_nodes(self, nodes: Sequence[str]) -> None:
        """Raise ValueError, one line a mistake, for names that are not those of `nodes` and for missing cameras."""
        there = f"no such node on this medium; there are {', '.join(nodes)}"
        lines = [f"bodies: {name}: {there}" for name in self.bodies if name not in nodes]
        lines += [f"cameras: {name}: {there}" for pair in self.cameras.items() for name in pair if name not in nodes]
        lines += [f"fixed_cameras={name}: {there}" for name in self.fixed_cameras if name not in nodes]
        lines += [f"fixed_cameras={name}: cameras puts its camera on {self.cameras[name]}; name it in one of both keys"
                  for name in self.fixed_cameras if name in self.cameras]
        lines += [f"every_exposure_to={name}: {there}" for name in self.every_exposure_to if name not in nodes]
        lines += [f"cameras: {observer}: {body} is not one of the bodies: {', '.join(self.bodies) or 'there are none'}"
                  for observer, body in self.cameras.items() if body in nodes and body not in self.bodies]
        if lines:
            raise ValueError("\n".join(lines))
