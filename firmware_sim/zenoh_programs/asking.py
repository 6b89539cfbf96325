"""A query under way, at the session that asks: its replies, their consolidation, and its end.

It ends with the final of the last node that was asked, or with its time-out, which is a reply error `Timeout`.

    consolidation   replies that reach the handler
    none            each, when it arrives
    monotonic       each but those that are older than one of their key that has arrived
    latest          of each key the newest, when the query ends; of equally new ones the last

A reply without a timestamp is older than any with one. So the library does it (observed at 1.10, see
tests/firmware_sim/zenoh_programs/test_as_on_the_library.py).
"""

from __future__ import annotations

from collections.abc import Hashable

from firmware_sim.zenoh_programs.channels import Sink
from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.identifiers import EntityGlobalId
from firmware_sim.zenoh_programs.real import MODULE, ConsolidationMode, Encoding, KeyExpr, ZBytes
from firmware_sim.zenoh_programs.sample import Sample
from netem.wire.zenoh_messages import Data, Response

TIMEOUT = Data(b"Timeout", "zenoh/string")


class ReplyError(StandIn):
    real = MODULE.ReplyError
    timestamp_stack = None

    def __init__(self, data: Data) -> None:
        self.payload = ZBytes(data.payload)
        self.encoding = Encoding(data.encoding)

    def __repr__(self) -> str:
        return f"ReplyError {{ payload: {self.payload!r}, encoding: {self.encoding} }}"


class Reply(StandIn):
    """`ok` is the sample, or `err` the error; `replier_id` the entity that sent it, None at a time-out."""

    real = MODULE.Reply

    def __init__(self, ok: Sample | None, err: ReplyError | None, replier_id: EntityGlobalId | None = None) -> None:
        self.ok, self.err, self.replier_id = ok, err, replier_id

    @property
    def result(self) -> Sample | ReplyError | None:
        return self.err if self.ok is None else self.ok

    def __repr__(self) -> str:
        return f"Reply {{ result: {self.result!r}, replier_id: {self.replier_id} }}"


class Asking:
    """`waits_for` holds whoever has not sent a final yet."""

    def __init__(self, consolidation: ConsolidationMode, sink: Sink) -> None:
        self.waits_for: set[Hashable] = set()
        self.over = False
        self._consolidation = consolidation
        self._sink = sink
        self._newest: dict[str, tuple[int, Reply]] = {}     # by key: NTP64 time, -1 for none

    def take(self, message: Response, replier_id: EntityGlobalId) -> None:
        """Take a reply; ValueError or ZError if its key is none."""
        if self.over:
            return
        if message.error:
            self._sink.put(Reply(None, ReplyError(message.data), replier_id))
            return
        reply = Reply(Sample(KeyExpr(message.key), message.data, message.qos), None, replier_id)
        if self._consolidation == ConsolidationMode.NONE:
            self._sink.put(reply)
            return
        time = -1 if message.data.stamp is None else message.data.stamp.ntp64
        known = self._newest.get(message.key)
        if known is not None and time < known[0]:
            return
        self._newest[message.key] = (time, reply)
        if self._consolidation == ConsolidationMode.MONOTONIC:
            self._sink.put(reply)

    def final(self, of: Hashable) -> None:
        self.waits_for.discard(of)
        if not self.waits_for:
            self.end()

    def time_out(self) -> None:
        if not self.over:
            self.end(Reply(None, ReplyError(TIMEOUT)))

    def end(self, last: Reply | None = None) -> None:
        if self.over:
            return
        self.over = True
        if self._consolidation == ConsolidationMode.LATEST:
            for _, reply in self._newest.values():
                self._sink.put(reply)
        if last is not None:
            self._sink.put(last)
        self._sink.close()
