"""Runs with a view, as processes: what is told to pages, what pages do to the run, and what the run is spared."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from netem.records.events import hash_of_events
from netem.records.ledger_file import read_ledger, read_metadata
from tests.experiments.run.live.view_bench import MARCONET, WITHIN_S, client_of, scenario_in, viewed
from tests.processes import children


def hashes(folder: Path) -> tuple[str, str]:
    return read_metadata(folder / "ledger.parquet")["hash"], hash_of_events(load_run(folder).events)


def test_pages_are_told_of_frames_positions_and_events_and_of_the_end(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 2.0), tmp_path / "run") as shown, client_of(shown) as client:
        end = client.until("end")
        said = shown.ends()

    assert shown.process.returncode == 0, said
    assert (end["words"], end["holds"], end["folder"]) == ("everything is as expected", True, str(tmp_path / "run"))
    assert [node["name"] for node in client.scene["nodes"]] == ["a", "b", "c"]
    times = [update["now_ns"] for update in client.updates]
    assert times == sorted(times)
    assert times[-1] == 2_000_000_000
    totals: dict[int, dict[str, int]] = {}
    for update in client.updates:
        totals.update({place: fates for place, _, fates in update["changed"]})
    rows = read_ledger(tmp_path / "run" / "ledger.parquet").to_pylist()
    assert sum(sum(fates.values()) for fates in totals.values()) == len(rows)
    places = [update["at"]["b"] for update in client.updates if "b" in update["at"]]
    assert len(places) > 5
    assert len({tuple(place) for place in places}) == len(places)       # each tells of a move


@pytest.mark.slow
def test_neither_speed_nor_pause_changes_what_a_run_does(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 4.0, '[[faults]]\nkind = "kill"\non = "b"\nat_s = 1.0\nrestart_after_s = 0.5\n')
    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown, client_of(shown) as client:
        assert client.ask("speed", speed=2.0)["told"] == "2 x real time"
        client.ask("pause")
        client.ask("go")
        client.ask("speed", speed=None)
        client.until("end")
        shown.ends()
    run(load(scenario), host="inline", out=tmp_path / "plain", report=False)

    assert hashes(tmp_path / "run") == hashes(tmp_path / "plain")


@pytest.mark.parametrize("host", [pytest.param("inline", marks=pytest.mark.slow), "process"])
def test_virtual_time_stands_still_in_a_pause_and_goes_at_the_speed_that_was_chosen(tmp_path: Path, host: str) -> None:
    scenario = scenario_in(tmp_path, 500.0)
    with viewed(scenario, tmp_path / "run", "--host", host) as shown, client_of(shown) as client:
        client.ask("pause")
        client.until("update", lambda update: update["paused"])
        until_s = time.monotonic() + 1.0
        first = len(client.updates)
        while time.monotonic() < until_s:
            client.until("update")
        still = client.updates[first:]
        client.ask("speed", speed=0.5)
        client.ask("go")
        slow = [client.until("update") for _ in range(16)]
        client.ask("speed", speed=None)
        fast = [client.until("update") for _ in range(16)]

    assert len(still) > 3
    assert len({update["now_ns"] for update in still}) == 1
    # 15 updates at 0.1 s or more apart: a virtual time of 0.75 s; a busy machine makes it slower, never faster
    assert slow[-1]["now_ns"] > slow[0]["now_ns"]
    assert all(update["speed"] < 0.5 * 1.5 for update in slow[8:])
    assert max(update["speed"] for update in fast) > 0.5 * 1.5          # held at 0.5 it would not come so far


@pytest.mark.parametrize("host", [pytest.param("inline", marks=pytest.mark.slow), "process"])
def test_faults_from_a_page_repeat_the_run(tmp_path: Path, host: str) -> None:
    scenario = scenario_in(tmp_path, 5.0)
    written = scenario.read_text()
    with viewed(scenario, tmp_path / "run", "--host", host) as shown, client_of(shown) as client:
        client.until("update", lambda update: update["now_ns"] > 300_000_000)
        told = client.fault("kill", on="b", restart_after_s="0.5")
        client.ask("pause")
        paused = client.fault("link_down", on="radio: a -> c", lasts_s="0.3")
        client.ask("go")
        client.until("update", lambda update: update["now_ns"] > 2_000_000_000)
        client.fault("plant_parameter", on="b", variable="gain_left", factor="0.5")
        client.ask("speed", speed=None)
        client.fault("pause", on="c", lasts_s="0.2")
        client.until("end")
        said = shown.ends()

    assert shown.process.returncode == 0, said
    assert told["told"].startswith("injected-0: kill at ")
    assert paused["error"] == ""
    scenario.write_text(written + (tmp_path / "run" / "injected.toml").read_text())
    run(load(scenario), host="inline", out=tmp_path / "again", report=False)
    assert hashes(tmp_path / "again") == hashes(tmp_path / "run")
    found = load_run(tmp_path / "run")
    assert [fault["kind"] for fault in found.scenario["faults"]] == ["kill", "link_down", "plant_parameter", "pause"]
    assert {event.detail.split()[0] for event in found.events if event.kind == "fault"} == {
        f"injected-{number}" for number in range(4)}
    fates = {row["fate"] for row in read_ledger(tmp_path / "run" / "ledger.parquet").to_pylist()}
    assert {"receiver gone", "cut"} <= fates


def test_marconet_fault_reaches_a_run_with_a_view(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 500.0), tmp_path / "run") as shown, client_of(shown) as client:
        client.ask("pause")
        said = subprocess.run([*MARCONET, "fault", str(tmp_path / "run"), "kill", "on=a"], capture_output=True,
                              text=True, timeout=WITHIN_S, check=False)
        client.ask("go")
        event = client.until("update", lambda update: any(kind == "fault" for _, _, kind, _, _ in update["events"]))

    assert said.stdout.startswith("injected-0: kill at "), said.stderr
    assert event["away"] == {"a": "dead"}


def test_what_the_loader_refuses_is_told_by_the_keys_that_it_is_about(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 500.0), tmp_path / "run") as shown, client_of(shown) as client:
        several = client.fault("link_down", lasts_s="soon", carriers="ring")
        unknown = client.fault("link_down", on="radio: a -> z", lasts_s="1")
        missing = client.fault("plant_input", variable="v_cmd", value="1", lasts_s="1")
        rule = client.fault("kill", on="a", restart_after_s="0")
        free = client.fault("plant_input", on="b", variable="v_cmd", value="1", factor="2", lasts_s="1")
        kind = client.fault("kil", on="a")
        timed = client.fault("kill", on="a", at_s="1")
        speed = client.ask("speed", speed=-1)

    assert several["fields"].keys() == {"on", "lasts_s", "carriers"}
    assert unknown["fields"]["on"].startswith('on="radio: a -> z": ')
    assert several["fields"]["carriers"].startswith('carriers="ring": ')
    assert missing["fields"] == {"on": "on: is missing"}
    assert list(rule["fields"]) == ["restart_after_s"]
    assert list(free["fields"]) == ["variable"]
    assert (kind["fields"], 'did you mean "kill"' in kind["error"]) == ({}, True)
    assert "begins at once" in timed["error"]
    assert speed["error"] == "speed=-1: expected 0.001 <= speed <= 1000000"
    assert not (tmp_path / "run" / "injected.toml").exists()


def status(url: str, *headers: str) -> int:
    """Return the status of a GET with exactly these headers."""
    host, _, path = url.removeprefix("http://").partition("/")
    name, _, port = host.partition(":")
    with socket.create_connection((name, int(port)), timeout=WITHIN_S) as asking:
        asking.sendall("\r\n".join([f"GET /{path} HTTP/1.1", *headers, "", ""]).encode())
        return int(asking.makefile("rb").readline().split()[1])


def test_the_door_opens_to_the_token_on_the_loopback_only(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 500.0), tmp_path / "run") as shown:
        bare, here = shown.url.partition("?")[0], f"Host: 127.0.0.1:{shown.port}"
        answers = {
            "right": status(shown.url, here),
            "right, own origin": status(shown.url, here, f"Origin: http://127.0.0.1:{shown.port}"),
            "no token": status(bare, here),
            "wrong token": status(f"{bare}?token=x", here),
            "two tokens": status(f"{shown.url}&token=x", here),
            "foreign origin": status(shown.url, here, "Origin: https://example.org"),
            "null origin": status(shown.url, here, "Origin: null"),
            "foreign host": status(shown.url, "Host: example.org"),
            "no host": status(shown.url),
            "elsewhere": status(shown.url.replace("/?", "/other?"), here)}
        refused: dict[str, int] = {}
        for what, url, origin in (("wrong token", shown.live[:-3], None), ("foreign", shown.live, "https://example.org"),
                                  ("other port", shown.live, "http://127.0.0.1:1")):
            with pytest.raises(InvalidStatus) as failed, connect(url, origin=origin):     # type: ignore[arg-type]
                pass
            refused[what] = failed.value.response.status_code
        listening = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
                     if line.split()[3] == "0A" and line.split()[1].endswith(f":{shown.port:04X}")]
        with connect(shown.live, origin=f"http://127.0.0.1:{shown.port}") as opened:      # type: ignore[arg-type]
            scene = json.loads(opened.recv(timeout=WITHIN_S))

    assert answers == {"right": 200, "right, own origin": 200, "no token": 401, "wrong token": 401, "two tokens": 401,
                       "foreign origin": 403, "null origin": 403, "foreign host": 403, "no host": 403,
                       "elsewhere": 404}
    assert refused == {"wrong token": 401, "foreign": 403, "other port": 403}
    assert listening == [f"0100007F:{shown.port:04X}"]      # 127.0.0.1
    assert scene["type"] == "scene"


@pytest.mark.slow
def test_a_paused_run_goes_on_when_its_last_page_is_closed(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 3.0), tmp_path / "run") as shown:
        with client_of(shown) as client:
            client.ask("pause")
        said = shown.ends()

    assert shown.process.returncode == 0, said
    assert load_run(tmp_path / "run").length_ns == 3_000_000_000


def test_two_pages_see_the_same_run_and_a_late_one_all_that_happened(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 500.0), tmp_path / "run") as shown, client_of(shown) as one:
        one.fault("kill", on="a")
        one.until("update", lambda update: update["now_ns"] > 500_000_000)
        with client_of(shown) as other:
            whole = other.until("update")
            other.ask("pause")
            seen = one.until("update", lambda update: update["paused"])
            same = other.until("update", lambda update: update["paused"])

    assert {tuple(link) for link in whole["links"]} >= {("radio", "b", "c"), ("radio", "c", "b")}
    assert ["fault", "injected-0 kill"] in [[kind, detail] for _, _, kind, detail, _ in whole["events"]]
    assert whole["away"] == {"a": "dead"}
    assert seen["now_ns"] == same["now_ns"]


def test_garbage_from_a_page_is_answered_and_the_run_goes_on(tmp_path: Path) -> None:
    with viewed(scenario_in(tmp_path, 2.0), tmp_path / "run") as shown, client_of(shown) as client:
        for garbage in ("", "{", "[]", '{"type": "command"}', '{"type": "end"}', b"\xff\x00", "é" * 1000):
            client.connection.send(garbage)
            answer = client.until("answer")
            assert answer["error"].startswith("expected a command as JSON"), garbage
        with connect(shown.live) as flooding:
            flooding.send("x" * 100_000)
            with pytest.raises(ConnectionClosed, match="1009"):
                list(flooding)
        assert client.until("end")["holds"]


def test_a_run_that_is_killed_is_told_to_pages_and_leaves_no_process(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 500.0)
    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown, client_of(shown) as client:
        server, = [pid for pid in descendants(shown.process.pid) if b"view.server" in command_of(pid)]
        parent, = children(shown.process.pid) or [0]
        for pid in (parent, shown.process.pid):
            if pid:
                os.kill(pid, signal.SIGKILL)
        end = client.until("end")
        until_s = time.monotonic() + WITHIN_S
        while command_of(server) and time.monotonic() < until_s:
            time.sleep(0.05)

    assert end["words"] == "The run was broken off: its process has ended."
    assert not command_of(server)


def descendants(pid: int) -> list[int]:
    found = list(children(pid))
    return found + [below for child in found for below in descendants(child)]


def command_of(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def test_a_node_that_fails_is_told_to_pages(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 2.0)
    (tmp_path / "beacon.py").write_text((tmp_path / "beacon.py").read_text().replace(
        "        self.sent += 1\n", "        self.sent += 1\n        assert self.sent < 20\n"))
    with viewed(scenario, tmp_path / "run") as shown, client_of(shown) as client:
        end = client.until("end")
        shown.ends()

    assert shown.process.returncode == 3
    assert (end["holds"], "AssertionError" in end["words"]) == (False, True)


def test_a_port_in_use_is_one_line(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 1.0)
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        said = subprocess.run([*MARCONET, "run", str(scenario), "--out", str(tmp_path / "run"), "--view", str(port)],
                              capture_output=True, text=True, timeout=WITHIN_S, check=False)

    assert said.returncode == 2
    line, = [line for line in said.stderr.splitlines() if "--view" in line]
    assert line.endswith(f"--view {port}: cannot listen at 127.0.0.1:{port}: address already in use: name another "
                         "port, or none for any free one")


@pytest.mark.slow
def test_in_real_time_a_page_injects_faults_and_sees_how_late_the_run_is(tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 4.0)
    written = scenario.read_text()
    with viewed(scenario, tmp_path / "run", "--real-time", "--host", "inline") as shown, client_of(shown) as client:
        refused = client.ask("pause")
        assert client.fault("link_down", on="radio: a -> c", lasts_s="0.3")["error"] == ""
        update = client.until("update", lambda update: update["now_ns"] > 1_000_000_000)
        client.until("end")
        shown.ends()
    scenario.write_text(written + (tmp_path / "run" / "injected.toml").read_text())
    run(load(scenario), host="inline", out=tmp_path / "again", report=False)

    assert client.scene["real_time"]
    assert "follows the wall clock" in refused["error"]
    assert update["lateness"]["worst_ns"] >= update["lateness"]["median_ns"] > 0
    assert tomllib.loads((tmp_path / "run" / "injected.toml").read_text())["faults"][0]["kind"] == "link_down"
    assert hashes(tmp_path / "again")[0] == hashes(tmp_path / "run")[0]


def test_a_view_without_a_port_does_not_take_the_scenario_for_one() -> None:
    from marconet.command_line import run as command

    context: Any = command.make_context("run", ["--view", "output_sync", "--foxglove", "8765"])

    given = context.params
    assert (given["view"], given["foxglove"], given["sources"]) == (0, 8765, ("output_sync",))
