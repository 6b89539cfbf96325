"""Zenoh programs outside a run in real time: what crosses its media, with their delays, losses and partitions."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from netem.gateways import REFUSED, SPEAKS
from tests.firmware_sim.zenoh_programs.runs import LAN
from tests.free_port import free_port
from tests.netem.gateways.certificate_folders import make, zenoh_settings
from tests.netem.gateways.zenoh_between import CLIENT, PATIENCE_S, Client

SCENARIO = """# Two robots whose programs speak Zenoh.
# Question: do they hear each other?
seed = 1
length_s = {length_s}
[gateways.r1]
kind = "zenoh"
medium = "{medium}"
listen = "{r1}"
lease_s = 1.0
[gateways.r2]
kind = "zenoh"
medium = "{medium}"
listen = "{r2}"
lease_s = 1.0
"""
RADIO = '[media.radio]\nkind = "broadcast_radio"\npreset = "crazyflie_p2p"\nmac = "csma"\n'


def outside(folder: Path, more: str, medium: str, script: Callable[[Client, Client], Any],
            length_s: float = 8.0) -> tuple[RunData, Any]:
    """Run a scenario while `script` lets programs at r1 and r2 act; return the records and what `script` returned."""
    ends = {name: f"tcp/127.0.0.1:{free_port()}" for name in ("r1", "r2")}
    (folder / "case.toml").write_text(SCENARIO.format(medium=medium, length_s=length_s, **ends) + more)
    found: list[Any] = []
    wrong: list[BaseException] = []

    def act() -> None:
        with ExitStack() as at_end:
            try:
                programs = [Client(end, "client", '{"connect/timeout_ms": 30000}') for end in ends.values()]
                for program in programs:
                    at_end.callback(program.close)
                found.append(script(*programs))
            except BaseException as error:      # raised again in the thread of the test
                wrong.append(error)

    acting = threading.Thread(target=act)
    acting.start()
    result = run(load(folder / "case.toml"), host="inline", out=folder / "run", report=False, real_time=True)
    acting.join()
    if wrong:
        raise wrong[0]
    return load_run(result.folder), found[0]


def test_at_tls_doors_only_the_robots_take_part_and_the_events_say_who_was_refused(tmp_path):
    folder = tmp_path / "certificates"
    make(folder, "r1", "r2")
    ends = {name: f"tls/127.0.0.1:{free_port()}" for name in ("r1", "r2")}
    (tmp_path / "case.toml").write_text(SCENARIO.format(medium="lan", length_s=6.0, **ends) + LAN +
                                        '[network]\ntls = "certificates"\n')
    heard: list[str] = []

    def act() -> None:
        with ExitStack() as at_end:
            patient = {"connect/timeout_ms": 30_000}
            robots = [Client(ends[name], "client", json.dumps(zenoh_settings(folder, name) | patient)) for name in ends]
            for robot in robots:
                at_end.callback(robot.close)
            subprocess.run([sys.executable, str(CLIENT), ends["r1"], "client", json.dumps(
                zenoh_settings(folder, "r2") | {"connect/timeout_ms": 300})], stdin=subprocess.DEVNULL,
                capture_output=True, timeout=PATIENCE_S, check=False)
            robots[1].do("sub", "demo/**")
            robots[0].say("matching", "demo/a")
            robots[0].until("^matching True")
            robots[0].do("put", "demo/a", "hello")
            heard.append(robots[1].until("^heard"))

    acting = threading.Thread(target=act)
    acting.start()
    result = run(load(tmp_path / "case.toml"), host="inline", out=tmp_path / "run", report=False, real_time=True)
    acting.join()

    assert heard[0].startswith("heard demo/a hello")
    data = load_run(result.folder)
    told = [(event.kind, event.detail) for event in data.events if event.detail.startswith("gateways.r1 ")]
    assert [kind for kind, _ in told[:2]] == [SPEAKS, REFUSED]
    assert told[1][1].endswith(": its certificate is r2's; this door is r1's")
    assert data.counters["r1"]["connections refused"] >= 1
    assert data.counters["r1"]["connections"] == data.counters["r2"]["connections"] == 1


@pytest.mark.parametrize(("section", "wrong"), [
    ("", 'gateways.r1.listen="tls/127.0.0.1:1": a door with TLS needs certificates; make a folder of them with'),
    ('[network]\ntls = "none"\n', 'network.tls="none": '),
    ('[network]\ntls = "ours"\n', "emulator.crt: is missing; make new ones with marconet certificates new"),
    ('[network]\ntsl = "ours"\n', 'network.tsl="ours": unknown key; did you mean "tls"?'),
])
def test_a_door_without_certificates_is_refused_before_the_run(tmp_path, section, wrong):
    make(tmp_path / "ours")
    (tmp_path / "ours" / "emulator.crt").unlink()
    (tmp_path / "case.toml").write_text(SCENARIO.format(
        medium="lan", length_s=1.0, r1="tls/127.0.0.1:1", r2="tcp/127.0.0.1:2") + LAN + section)

    with pytest.raises(ScenarioError) as caught:
        load(tmp_path / "case.toml")

    assert wrong in str(caught.value)


def test_a_door_at_an_address_that_is_taken_ends_the_run_before_it_begins(tmp_path):
    make(tmp_path / "ours")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        (tmp_path / "case.toml").write_text(SCENARIO.format(
            medium="lan", length_s=1.0, r1=f"tls/127.0.0.1:{taken.getsockname()[1]}", r2=f"tcp/127.0.0.1:{free_port()}")
            + LAN + '[network]\ntls = "ours"\n')

        with pytest.raises(OSError, match=r"gateways\.r1: cannot listen on 127\.0\.0\.1:\d+: .*in use; end the"):
            run(load(tmp_path / "case.toml"), host="inline", out=tmp_path / "run", report=False, real_time=True)


def talk(talker: Client, listener: Client) -> list[float]:
    """Return how long each of 20 messages took that arrived [s]; 2 s of silence end it."""
    listener.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    talker.do("pub", "demo/a", 20, 0.02)
    heard: list[list[str]] = []
    with suppress(AssertionError):
        while len(heard) < 20:
            heard.append(listener.until("^heard demo/a", 2.0).split())
    numbers = [int(words[2]) for words in heard]
    assert numbers == sorted(set(numbers))
    return [float(words[-1]) - float(words[3]) for words in heard]


@pytest.mark.parametrize(('medium', 'more', 'least_s', 'most_lost'), [
    pytest.param("lan", LAN.replace("delay_ms = 1\n", "delay_ms = 30\n"), 0.030, 0, marks=pytest.mark.slow),
    # Its airtime is longer than that of 20 bytes at 2 Mbit/s. Stations that begin at one instant collide: in the
    # 0.4 s r2 sends three tellings and two repetitions, each of which can take one message with it.
    ("radio", RADIO, 8 * 20 / 2_000_000, 5),
])
def test_messages_cross_the_medium_in_order_and_not_sooner_than_it_lets_them(tmp_path, medium, more, least_s,
                                                                                     most_lost):
    data, took_s = outside(tmp_path, more, medium, talk)

    assert min(took_s) >= least_s
    assert len(took_s) >= 20 - most_lost
    assert data.counters["r1"]["messages received"] == 20
    assert data.counters["r2"]["messages sent"] == len(took_s)
    assert len(data.ledger.only(sender="r1", fate="delivered")) >= len(took_s)


@pytest.mark.slow
def test_under_a_partition_nothing_crosses_and_liveliness_comes_back_after_it(tmp_path):
    cut = '[[faults]]\nkind = "partition"\non = "lan"\nduring_s = [4.0, 7.0]\ngroups = [["r1"], ["r2"]]\n'

    def watch(robot: Client, watcher: Client) -> None:
        watcher.do("liveliness", "fleet/**")
        watcher.do("sub", "demo/**")
        robot.do("token", "fleet/r1")
        watcher.until("^alive fleet/r1")
        watcher.until("^dropped fleet/r1")
        robot.do("put", "demo/a", "meanwhile")
        watcher.until("^alive fleet/r1")
        robot.say("matching", "demo/a")
        robot.until("^matching True")
        robot.do("put", "demo/a", "afterwards")
        watcher.until("^heard demo/a afterwards")
        assert not any("meanwhile" in line for line in watcher.lines)

    data, _ = outside(tmp_path, LAN + cut, "lan", watch, length_s=12.0)

    assert len(data.ledger.only(sender="r1", fate="cut")) > 0


@pytest.mark.slow
def test_where_everything_is_lost_nobody_is_known(tmp_path):
    lost = '[[impairments]]\non = "lan: * -> *"\nkind = "bernoulli_loss"\nloss_ratio = 1.0\n'

    def shout(talker: Client, listener: Client) -> list[str]:
        listener.do("sub", "demo/**")
        listener.do("queryable", "demo/q", "here")
        talker.do("put", "demo/a", "hello")
        return talker.ask("demo/q", 0.5)

    data, found = outside(tmp_path, LAN + lost, "lan", shout, length_s=5.0)

    assert [line.split()[0] for line in found] == ["got"]
    assert len(data.ledger.only(fate="delivered")) == 0
    assert len(data.ledger.only(sender="r2")) > 0           # it has told what its program declared


@pytest.mark.parametrize(('more', 'wrong'), [
    ('[gateways.r3]\nkind = "zenoh"\nmedium = "lan"\nlisten = "tcp/127.0.0.1:1"\n',
     r"gateways\.r3: has the TCP address 127\.0\.0\.1:1, which gateways\.r1 has already"),
    ('[media.bus]\nkind = "can"\nbit_rate_bps = 500000\n[gateways.r3]\nkind = "zenoh"\nmedium = "bus"\n',
     r"gateways\.r3\.medium.*carries no datagrams; Zenoh needs a medium such as"),
    ('[gateways.r3]\nkind = "zenoh"\nmedium = "lan"\nlisten = "tcp/0.0.0.0:7447"\n', r"beyond the loopback"),
])
def test_gateways_that_cannot_be_are_refused_before_the_run(tmp_path, more, wrong):
    (tmp_path / "case.toml").write_text(SCENARIO.format(
        medium="lan", length_s=1.0, r1="tcp/127.0.0.1:1", r2="tcp/127.0.0.1:2") + LAN + more)

    with pytest.raises(ScenarioError, match=wrong):
        load(tmp_path / "case.toml")
