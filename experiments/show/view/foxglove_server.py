"""Shows a run to Foxglove by its WebSocket protocol: the signals of each node, and the positions of all.

    /signals/NODE       one JSON message with the value of each signal, some ten times a second
    /tf                 a FrameTransforms with the position of each node in the frame `world`
    /events             the run's events as Log messages

Times are virtual, from the start of the run. The server of the package `foxglove-sdk` listens on 127.0.0.1. Foxglove's
protocol knows no token, so every program of this machine may read, but nobody can change anything here.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin
from typing import Any

import foxglove
from foxglove.channels import FrameTransformsChannel, LogChannel
from foxglove.messages import FrameTransform, FrameTransforms, Log, LogLevel, Quaternion, Timestamp, Vector3
from foxglove.websocket import ChannelView, Client, ServerListener

from experiments.show.view.messages import Update
from netem.wire.level import Level

LEVELS = {Level.DEBUG: LogLevel.Debug, Level.INFO: LogLevel.Info, Level.WARNING: LogLevel.Warning,
          Level.ERROR: LogLevel.Error, Level.FATAL: LogLevel.Fatal}
MOST_WAITING = 256              # messages of one client; the oldest are dropped


class Watchers(ServerListener):
    """Counts the channels that clients read."""

    def __init__(self) -> None:
        self.reads: set[tuple[int, int]] = set()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self.reads.add((client.id, channel.id))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        self.reads.discard((client.id, channel.id))


class FoxgloveServer:
    def __init__(self, port: int) -> None:
        foxglove.set_log_level("CRITICAL")
        self._watchers = Watchers()
        self._server = foxglove.start_server(name="marconet", host="127.0.0.1", port=port, capabilities=[],
                                             server_listener=self._watchers, message_backlog_size=MOST_WAITING)
        self.port: int = self._server.port
        self._channels: dict[str, foxglove.Channel] = {}
        self._positions = FrameTransformsChannel("/tf")
        self._log = LogChannel("/events")
        self._at: dict[str, FrameTransform] = {}

    @property
    def clients(self) -> int:
        """How many clients read something."""
        return len({client for client, _ in self._watchers.reads})

    def show(self, scene: Mapping[str, Any]) -> None:
        for node in scene["nodes"]:
            if node["at"] is not None:
                self._at[node["name"]] = _transform(node["name"], [*node["at"], None])

    def update(self, update: Update) -> None:
        for node, values in update.samples.items():
            channel = self._channels.get(node)
            if channel is None:
                channel = self._channels[node] = foxglove.Channel(f"/signals/{node}", schema={
                    "type": "object", "title": node, "properties": {name: {"type": "number"} for name in values}})
            channel.log(dict(values), log_time=update.now_ns)
        self._at |= {node: _transform(node, at) for node, at in update.at.items() if None not in at[:2]}
        if self._at:
            self._positions.log(FrameTransforms(transforms=list(self._at.values())), log_time=update.now_ns)
        for time_ns, node, kind, detail, level in update.events:
            self._log.log(Log(timestamp=Timestamp(*divmod(time_ns, 10**9)), level=LEVELS[Level(level)], name=node,
                              message=f"{kind}: {detail}" if detail else kind), log_time=time_ns)

    def stop(self) -> None:
        self._server.stop()


def _transform(node: str, at: Any) -> FrameTransform:
    x, y, heading = at
    half = (heading or 0.0) / 2
    return FrameTransform(parent_frame_id="world", child_frame_id=node, translation=Vector3(x=x, y=y, z=0.0),
                          rotation=Quaternion(x=0.0, y=0.0, z=sin(half), w=cos(half)))
