"""The options of a query, or of all queries of a querier."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.zenoh_programs.real import ConsolidationMode, Locality, QueryTarget, ReplyKeyExpr
from netem.wire.zenoh_messages import Qos


@dataclass(frozen=True)
class GetOptions:
    target: QueryTarget
    consolidation: ConsolidationMode
    accept: ReplyKeyExpr
    timeout_ns: int
    qos: Qos
    destination: Locality
