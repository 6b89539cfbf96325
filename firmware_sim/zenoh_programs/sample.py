"""A sample: what a subscriber receives, and what a reply carries."""

from __future__ import annotations

from typing import Any

from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.real import MODULE, CongestionControl, Encoding, KeyExpr, SampleKind, ZBytes
from firmware_sim.zenoh_programs.values import PRIORITIES, timestamp_of
from netem.wire.zenoh_messages import Data, Qos


class Sample(StandIn):
    real = MODULE.Sample
    source_info = None
    timestamp_stack = None

    def __init__(self, key: KeyExpr, data: Data, qos: Qos) -> None:
        self.key_expr = key
        self.payload = ZBytes(data.payload)
        self.kind = SampleKind.DELETE if data.deletes else SampleKind.PUT
        self.encoding = Encoding(data.encoding)
        self.timestamp: Any = timestamp_of(data.stamp)
        self.congestion_control = CongestionControl.BLOCK if qos.block else CongestionControl.DROP
        self.priority = PRIORITIES[max(1, qos.priority) - 1]
        self.express = qos.express
        self.attachment = None if data.attachment is None else ZBytes(data.attachment)

    def __repr__(self) -> str:
        return (f"Sample {{ key_expr: {self.key_expr!r}, payload: {self.payload!r}, kind: {self.kind}, "
                f"encoding: {self.encoding}, timestamp: {self.timestamp} }}")
