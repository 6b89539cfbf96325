"""The keys of `[media.<name>]` for a broadcast radio: a preset by name, and values that replace those of the preset."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal

from netem.core.nearest import did_you_mean
from netem.media import MediumSettings
from netem.media.answers import DatagramFormat, ShownPose
from netem.media.decoding import Decoding
from netem.media.decoding.table import DECODINGS
from netem.media.level_errors import LevelErrorSettings
from netem.media.mac.table import MACS
from netem.media.radio_presets import PRESETS, RadioPreset
from netem.topology import WeakArea
from netem.topology.fixed_graph import FixedGraph
from netem.topology.table import TopologySettings


@dataclass(frozen=True)
class CarrierSenseSettings:
    """Values that replace those of the preset's carrier sense; None: the preset's."""

    scheme: Literal["unslotted", "dcf"] | None = None
    slot_ns: int | None = None
    wait_ns: int | None = None
    cca_ns: int | None = None
    turnaround_ns: int | None = None
    min_exponent: int | None = None
    max_exponent: int | None = None
    max_attempts: int | None = None


@dataclass(frozen=True)
class RadioSettings(MediumSettings):
    link_type: ClassVar = 147               # USER0
    strikable: ClassVar = frozenset({"links", "channel", "carriers"})
    poses_key: ClassVar[Sequence[str]] = ("topology", "bodies")

    preset: str = "ideal"
    decode: Literal["radio_network", "local", "capture"] = "radio_network"
    mac: Literal["none", "aloha", "csma"] = "none"
    queue_frames: int = 8                       # most frames that a node's `aloha` or `csma` queues while it is busy
    topology: TopologySettings = field(default_factory=FixedGraph)

    # None: the preset's
    bit_rate_bps: int | None = None
    preamble_ns: int | None = None
    header_bits: int | None = None
    bits_per_symbol: int | None = None
    trailer_ns: int | None = None
    max_payload_bytes: int | None = None
    receive_latency_ns: int | None = None
    checksum: bool | None = None
    tx_power_dbm: float | None = None
    sensitivity_dbm: float | None = None
    capture_db: float | None = None
    csma: CarrierSenseSettings = field(default_factory=CarrierSenseSettings)
    bit_errors: LevelErrorSettings | None = None        # None: a frame in range has no bit errors

    def __post_init__(self) -> None:
        if self.queue_frames < 0:
            raise ValueError(f"queue_frames={self.queue_frames}: expected queue_frames >= 0")
        if self.preset not in PRESETS:
            hint = did_you_mean(self.preset, PRESETS, f"the presets are {', '.join(PRESETS)}")
            raise ValueError(f"preset={self.preset!r}: no such radio: {hint}")
        radio = self.radio()
        if self.bit_errors is not None and radio.bit_rate_bps is None:
            raise ValueError("bit_errors: bits without bit_rate_bps have no energy: set it, or take another preset")
        if self.bit_errors is not None and not radio.checksum:
            raise ValueError("bit_errors: expected checksum = true; without one use the impairment corrupt")

    def radio(self) -> RadioPreset:
        """Return the preset with the values of this scenario."""
        preset = PRESETS[self.preset]
        return replace(preset, **_given(self, RadioPreset, besides="csma"),
                       csma=replace(preset.csma, **_given(self.csma, type(preset.csma))))

    def datagram_format(self) -> DatagramFormat:
        return DatagramFormat(self.radio().max_payload_bytes, addressed=False)

    def longest_frame_bytes(self) -> int | None:
        return self.radio().max_payload_bytes

    def poses(self) -> Mapping[str, ShownPose]:
        period_ns, bodies = self.topology.moving()
        return {node: ShownPose(period_ns, outputs, "m") for node, outputs in bodies.items()}

    def standing(self, nodes: Sequence[str]) -> Collection[str]:
        return self.topology.standing(nodes)

    def located(self, at_m: Mapping[str, Sequence[float] | None]) -> Collection[str]:
        return self.topology.located(at_m)

    def weak_areas(self) -> Sequence[WeakArea]:
        return self.topology.weak_areas()

    def decoding(self) -> Decoding:
        return DECODINGS[self.decode](self.radio())

    @property
    def mac_defers(self) -> bool:
        """True if a frame may start later than its program sent it."""
        return MACS[self.mac].defers


def _given(settings: object, of: type[Any], besides: str = "") -> dict[str, Any]:
    named = [f.name for f in fields(of) if f.name != besides]
    return {name: getattr(settings, name) for name in named if getattr(settings, name) is not None}
