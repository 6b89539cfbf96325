"""What the settings of a medium answer (`MediumSettings`), where a plain value does not do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from netem.media.sensing.field_of_view import FieldOfView, Obstacle
from netem.media.serial_line.byte_clock import ByteClock


class ShownPose(NamedTuple):
    """A medium that sees a node's plant at 0, period, 2 period, ..."""

    period_ns: int
    outputs: tuple[str, ...]        # x, y, heading or x, y, z, heading


class Camera(NamedTuple):
    carrier: str | None             # the node that carries it; None: it hangs at the origin
    view: FieldOfView
    period_ns: int                  # between exposures
    latency_ns: int                 # from an exposure until the observer receives its detections
    noise_m: float                  # standard deviation of each coordinate


@dataclass(frozen=True)
class FloorPlan:
    carriers: Mapping[str, str]     # observer -> the node that carries its camera
    unasked: tuple[str, ...]        # observers that see every exposure without a request
    range_m: float | None           # of every camera; None: unlimited
    half_angle_deg: float
    obstacles: tuple[Obstacle, ...]


class SerialFormat(NamedTuple):
    clock: ByteClock
    chunk_bytes: int                # most that a receiver gets at once; 0: all of a write together
