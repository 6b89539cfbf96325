"""A run for Foxglove, read by a client of its WebSocket protocol (docs: foxglove/ws-protocol, `foxglove.sdk.v1`)."""

from __future__ import annotations

import importlib.util
import json
import math
import struct
import subprocess
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from experiments.show.view.server import _why_not
from tests.experiments.run.live.view_bench import MARCONET, WITHIN_S, Viewed, scenario_in

needs_foxglove = pytest.mark.skipif(importlib.util.find_spec("foxglove") is None,
                                    reason="needs foxglove-sdk: pip install 'marconet[foxglove]'")
MESSAGE_DATA = 1        # opcode; then the subscription and the time of the message [ns], little endian


@pytest.mark.slow
@needs_foxglove
def test_foxglove_reads_signals_positions_and_events_in_virtual_time(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 500.0)
    process = subprocess.Popen([*MARCONET, "run", str(scenario), "--out", str(tmp_path / "run"), "--no-report",
                                "--host", "inline", "--foxglove"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True)
    try:
        Viewed(process, tmp_path / "run")
        assert process.stderr is not None
        url = process.stderr.readline().split()[-1]
        port = int(url.rpartition(":")[2])
        topics: dict[int, dict[str, Any]] = {}
        found: dict[str, list[tuple[int, bytes]]] = {}
        with connect(url, subprotocols=["foxglove.sdk.v1"]) as client:      # type: ignore[list-item]
            info = json.loads(client.recv(WITHIN_S))
            while min((len(found.get(topic, [])) for topic in ("/signals/b", "/tf", "/events")), default=0) < 5:
                message = client.recv(WITHIN_S)
                if isinstance(message, str):
                    told = json.loads(message)
                    for channel in told.get("channels", []):
                        topics[channel["id"]] = channel
                        client.send(json.dumps({"op": "subscribe", "subscriptions": [
                            {"id": channel["id"], "channelId": channel["id"]}]}))
                elif message[0] == MESSAGE_DATA:
                    number, time_ns = struct.unpack_from("<IQ", message, 1)
                    found.setdefault(topics[number]["topic"], []).append((time_ns, message[13:]))
        listening = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
                     if line.split()[3] == "0A" and line.split()[1].endswith(f":{port:04X}")]
    finally:
        process.kill()
        process.communicate()

    assert (info["op"], info["name"], info["capabilities"]) == ("serverInfo", "marconet", [])
    assert listening == [f"0100007F:{port:04X}"]        # 127.0.0.1
    assert {channel["topic"] for channel in topics.values()} >= {"/signals/a", "/signals/b", "/tf", "/events"}
    poses = [(time_ns, json.loads(data)) for time_ns, data in found["/signals/b"]]
    times = [time_ns for time_ns, _ in poses]
    assert times == sorted(times)
    assert all(math.hypot(pose["x"], pose["y"]) <= 0.5 * time_ns * 1e-9 + 1e-9 for time_ns, pose in poses)  # at 0.5 m/s
    assert len({pose["x"] for _, pose in poses}) > 3
    assert all(b"world" in data and b"b" in data for _, data in found["/tf"])


def test_without_the_package_one_line_says_how_to_get_it() -> None:
    assert _why_not(ImportError("No module named 'foxglove'"), 0) == (
        "--foxglove: needs the package foxglove-sdk: pip install 'marconet[foxglove]'")
