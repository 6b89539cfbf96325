"""Radios by name: airtime of a frame, receiver and carrier sense.

    airtime = preamble_ns + ceil((header_bits + 8 bytes) / bits_per_symbol) bits_per_symbol / bit_rate_bps + trailer_ns

rounded up to a whole nanosecond. `header_bits` are all bits at the bit rate that are not payload, checksum included.
Sources of the figures, field by field: docs/models/broadcast_radio.md.

Not modelled: clock tolerance of the radios, encryption.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from netem.media.mac import CarrierSense

MICROSECOND: Final = 1_000


@dataclass(frozen=True)
class RadioPreset:
    bit_rate_bps: int | None            # None: bits take no time
    preamble_ns: int
    header_bits: int
    bits_per_symbol: int
    trailer_ns: int
    max_payload_bytes: int | None       # None: no limit
    receive_latency_ns: int             # from the end of the frame to the program of the node
    checksum: bool
    tx_power_dbm: float
    sensitivity_dbm: float
    capture_db: float
    csma: CarrierSense

    def __post_init__(self) -> None:
        if self.bit_rate_bps is not None and self.bit_rate_bps < 1:
            raise ValueError(f"bit_rate_bps={self.bit_rate_bps}: expected at least 1 bit/s")
        if self.bits_per_symbol < 1:
            raise ValueError(f"bits_per_symbol={self.bits_per_symbol}: expected at least 1")
        for name in ("preamble_ns", "header_bits", "trailer_ns", "receive_latency_ns"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name}={getattr(self, name)}: expected {name} >= 0")
        if self.max_payload_bytes is not None and self.max_payload_bytes < 0:
            raise ValueError(f"max_payload_bytes={self.max_payload_bytes}: expected max_payload_bytes >= 0")
        if self.capture_db <= 0:
            raise ValueError(f"capture_db={self.capture_db}: expected > 0, or two frames could capture each other")

    def airtime_ns(self, payload_bytes: int) -> int:
        if self.bit_rate_bps is None:
            return self.preamble_ns + self.trailer_ns
        bits = self.header_bits + 8 * payload_bytes
        symbols = -(-bits // self.bits_per_symbol)
        return self.preamble_ns - (-symbols * self.bits_per_symbol * 10**9 // self.bit_rate_bps) + self.trailer_ns


PRESETS: Final[dict[str, RadioPreset]] = {
    "ideal": RadioPreset(
        bit_rate_bps=None, preamble_ns=0, header_bits=0, bits_per_symbol=1, trailer_ns=0, max_payload_bytes=None,
        receive_latency_ns=0, checksum=True, tx_power_dbm=0.0, sensitivity_dbm=-95.0, capture_db=6.0,
        csma=CarrierSense("unslotted", slot_ns=0, wait_ns=0, cca_ns=0, turnaround_ns=0, min_exponent=0, max_exponent=0,
                          max_attempts=1)),
    "crazyflie_p2p": RadioPreset(       # address 40, length and id 9, port header 16, checksum 16 bits
        bit_rate_bps=2_000_000, preamble_ns=4 * MICROSECOND, header_bits=81, bits_per_symbol=1, trailer_ns=0,
        max_payload_bytes=60, receive_latency_ns=0, checksum=True, tx_power_dbm=0.0, sensitivity_dbm=-85.0,
        capture_db=12.0,
        csma=CarrierSense("unslotted", slot_ns=150 * MICROSECOND, wait_ns=0, cca_ns=9 * MICROSECOND,
                          turnaround_ns=130 * MICROSECOND, min_exponent=3, max_exponent=5, max_attempts=5)),
    "xbee_802154": RadioPreset(         # MAC header 9, Digi header 2, checksum 2 bytes
        bit_rate_bps=250_000, preamble_ns=192 * MICROSECOND, header_bits=104, bits_per_symbol=4, trailer_ns=0,
        max_payload_bytes=100, receive_latency_ns=0, checksum=True, tx_power_dbm=0.0, sensitivity_dbm=-92.0,
        capture_db=3.0,
        csma=CarrierSense("unslotted", slot_ns=320 * MICROSECOND, wait_ns=0, cca_ns=128 * MICROSECOND,
                          turnaround_ns=192 * MICROSECOND, min_exponent=0, max_exponent=5, max_attempts=5)),
    "wifi_broadcast_80211b_1mbps": RadioPreset(     # MAC 24, checksum 4, LLC/SNAP 8, IPv4 20, UDP 8 bytes
        bit_rate_bps=1_000_000, preamble_ns=192 * MICROSECOND, header_bits=512, bits_per_symbol=1, trailer_ns=0,
        max_payload_bytes=1472, receive_latency_ns=0, checksum=True, tx_power_dbm=15.0, sensitivity_dbm=-80.0,
        capture_db=5.0,
        csma=CarrierSense("dcf", slot_ns=20 * MICROSECOND, wait_ns=50 * MICROSECOND, cca_ns=0,
                          turnaround_ns=5 * MICROSECOND, min_exponent=5, max_exponent=5, max_attempts=0)),
    "wifi_broadcast_80211g_6mbps": RadioPreset(     # as above plus SERVICE 16 and tail 6 bits; 6 us signal extension
        bit_rate_bps=6_000_000, preamble_ns=20 * MICROSECOND, header_bits=534, bits_per_symbol=24,
        trailer_ns=6 * MICROSECOND, max_payload_bytes=1472, receive_latency_ns=0, checksum=True, tx_power_dbm=15.0,
        sensitivity_dbm=-82.0, capture_db=5.0,
        csma=CarrierSense("dcf", slot_ns=9 * MICROSECOND, wait_ns=28 * MICROSECOND, cca_ns=0,
                          turnaround_ns=2 * MICROSECOND, min_exponent=4, max_exponent=4, max_attempts=0)),
}
