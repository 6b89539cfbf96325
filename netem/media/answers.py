"""Types of the answers that the settings of a medium give (`MediumSettings`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from netem.media.packet_network.datagram import EVERYONE, Datagram, pack, unpack
from netem.media.sensing.field_of_view import FieldOfView, Obstacle
from netem.media.serial_line.byte_clock import ByteClock


class ShownPose(NamedTuple):
    """Outputs of a node's plant that a medium reads at 0, period, 2 period, ..."""

    period_ns: int
    outputs: tuple[str, ...]        # as the medium's settings explain them
    unit: str | None = None         # that each output has, if the plant names its unit; None: any


class Camera(NamedTuple):
    carrier: str | None             # node that carries the camera; None: the camera is fixed at the origin
    view: FieldOfView
    period_ns: int                  # between exposures
    latency_ns: int                 # from an exposure until the observer receives its detections
    noise_m: float                  # standard deviation of each coordinate


@dataclass(frozen=True)
class FloorPlan:
    carriers: Mapping[str, str]     # observer -> node that carries its camera
    unasked: tuple[str, ...]        # observers that see every exposure without a request
    range_m: float | None           # range of every camera; None: unlimited
    half_angle_deg: float
    obstacles: tuple[Obstacle, ...]


class DatagramFormat(NamedTuple):
    """How a port takes the datagrams of sockets and of network libraries."""

    longest_bytes: int | None       # of a datagram that is not sent in pieces, None: no limit
    addressed: bool                 # True: with the destination's name before it, see packet_network/datagram.py
    whole: bool = True              # False: the receiver may get one in pieces, or several as one

    def enclose(self, destination: str | None, payload: bytes) -> bytes:
        """Return the frame that takes `payload` to a node, None: to all."""
        return pack(Datagram(EVERYONE if destination is None else destination, payload)) if self.addressed else payload

    def payload_of(self, frame: bytes) -> bytes | None:
        """Return what a frame carries, None if it is no datagram."""
        if not self.addressed:
            return frame
        datagram = unpack(frame)
        return None if datagram is None else datagram.payload


class SerialFormat(NamedTuple):
    clock: ByteClock
    chunk_bytes: int                # largest delivery to a receiver; 0: no limit
    idle_bytes: int                 # byte times of silence after which bytes are delivered; 0: writes are, or chunks
