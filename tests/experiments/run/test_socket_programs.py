"""Programs with sockets and asyncio in whole runs: one hash on both hosts, and nothing outside ever sees them."""

from __future__ import annotations

import random
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from experiments.judge.run_files import RUN
from experiments.run.runner import run
from experiments.scenario import load
from netem.wire.errors import NodeFailure

PROGRAMS = '''
import asyncio
import random
import select
import socket
import sys
import threading
import time
from random import random as drawn
from time import monotonic, sleep

import helper
from firmware_sim.blocking.here import this_program


def talk(port, pause_ms):
    """Broadcast, answer what is heard, and tell it."""
    me = socket.gethostname()
    helper.seen.append(me)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    out.bind(("", port))
    for k in range(10):
        sleep(pause_ms / 1000 * (1 + drawn()))
        out.sendto(f"{me} {k} {random.randrange(1000)}".encode(), ("<broadcast>", port))
        while select.select([out], [], [], 0.001)[0]:
            data, source = out.recvfrom(100)
            this_program().board.count("from " + socket.gethostbyaddr(source[0])[0])
            if data.split()[0] != me.encode() and b"!" not in data:
                out.sendto(data + b"!", source)
    this_program().board.event("state", f"{helper.seen} {sys.argv} {sys.stdin.read()!r} {threading.active_count()}")


async def beacons(period_s):
    """The same in asyncio."""
    class Hear(asyncio.DatagramProtocol):
        def datagram_received(self, data, source):
            this_program().board.count("heard")

    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(Hear, local_addr=("0.0.0.0", 4000), allow_broadcast=True)
    for k in range(5):
        transport.sendto(bytes([k]), ("10.0.255.255", 4000))
        await asyncio.sleep(period_s)
    transport.close()


def to_the_real_world(port):
    """Send where somebody on this machine listens."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for _ in range(5):
        for address in (("127.0.0.1", port), ("<broadcast>", port), ("10.0.0.2", port)):
            out.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            out.sendto(b"is anybody there?", address)
        sleep(0.01)

    async def in_asyncio():
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=("127.0.0.1", port))
        transport.sendto(b"is anybody there?")
        await asyncio.sleep(0.01)
        transport.close()

    asyncio.run(in_asyncio())


def tcp(port):
    try:
        socket.create_connection(("127.0.0.1", port))
    except Exception:
        pass


def sleeper():
    while True:
        this_program().board.count("ticks")
        sleep(0.1)


def spin():
    while True:
        pass
'''
HELPER = "seen = []\n"
SCENARIO = '''
# Programs with sockets.
# Question: do they hear each other?
seed = 5
length_s = 1.0
node_timeout_s = {timeout_s}

[agents_defaults]
program = "talkers:{program}"
parameters = {{ {parameters} }}
sockets = {{ {sockets} }}

[agents.r1]
[agents.r2]
[agents.r3]

[media.air]
{medium}
{more}
'''
RADIO = 'kind = "broadcast_radio"\npreset = "crazyflie_p2p"'
LAN = 'kind = "packet_network"\nrate_bps = 1_000_000\ndelay_ms = 1'
TALK = "port = 4000, pause_ms = 20.0"


def scenario(folder: Path, program: str = "talk", parameters: str = TALK, medium: str = RADIO,
             sockets: str = 'air = "ip"', more: str = "", timeout_s: float = 30):
    folder.mkdir(exist_ok=True)
    (folder / "talkers.py").write_text(PROGRAMS)
    (folder / "helper.py").write_text(HELPER)
    (folder / "s.toml").write_text(SCENARIO.format(program=program, parameters=parameters, medium=medium, more=more,
                                                   sockets=sockets, timeout_s=timeout_s))
    return load(folder / "s.toml")


@pytest.mark.parametrize(("program", "parameters", "medium"), [
    ("talk", TALK, RADIO), ("beacons", "period_s = 0.03", LAN),
    pytest.param("talk", TALK, LAN, marks=pytest.mark.slow)])
def test_both_hosts_leave_the_same_ledger_and_count_the_same(tmp_path, program, parameters, medium):
    made = scenario(tmp_path / "s", program, parameters, medium)

    results = [run(made, host=host, out=tmp_path / name, report=False)
               for name, host in (("p", "process"), ("i", "inline"))]

    assert len({result.summary.ledger_hash for result in results}) == 1
    first, *others = [RUN.read(result.folder)["counters"] for result in results]
    assert all(counters == first for counters in others)
    assert results[0].summary.frames["delivered"] >= 10


def test_programs_in_one_process_have_modules_arguments_and_random_numbers_of_their_own(tmp_path, capfd):
    text = PROGRAMS.replace('this_program().board.event("state", ', "print(me, ")
    made = scenario(tmp_path / "s")
    (tmp_path / "s" / "talkers.py").write_text(text)

    run(made, host="inline", out=tmp_path / "i", report=False)

    said = [line for line in capfd.readouterr().out.splitlines() if line[:1] == "r"]
    assert said == [f"r{k} ['r{k}'] ['talkers:talk'] '' 1" for k in sorted(
        (1, 2, 3), key=lambda k: [line[:2] for line in said].index(f"r{k}"))]


def test_after_a_run_inline_everything_is_as_before(tmp_path):
    places = [(time, "sleep"), (time, "monotonic"), (threading, "Lock"), (random, "random"), (socket, "getaddrinfo"),
              (sys, "argv"), (sys, "stdin")]
    before = [getattr(place, name) for place, name in places]
    threads = threading.active_count()
    made = scenario(tmp_path / "s")
    beside = {name for name in sys.modules if "@" in name}, len(sys.meta_path)

    run(made, host="inline", out=tmp_path / "i", report=False)

    assert [getattr(place, name) for place, name in places] == before
    assert "__new__" not in vars(socket.socket)
    assert ({name for name in sys.modules if "@" in name}, len(sys.meta_path)) == beside
    assert threading.active_count() == threads
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        assert type(one) is socket.socket


@pytest.mark.parametrize("host", ["inline", "process"])
@pytest.mark.parametrize(("sockets", "medium"), [('air = "ip"', RADIO), ('air = "bare"', RADIO)])
def test_a_foreign_listener_on_the_very_ports_hears_nothing(tmp_path, host, sockets, medium):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("0.0.0.0", 0))
        port = listener.getsockname()[1]
        listener.settimeout(0.3)
        made = scenario(tmp_path / "s", "to_the_real_world", f"port = {port}", medium, sockets)

        result = run(made, host=host, out=tmp_path / "o", report=False)

        with pytest.raises(TimeoutError):
            listener.recv(100)
        assert sum(result.summary.frames.values()) > 0


@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
def test_no_system_call_binds_connects_or_sends_on_an_ip_socket(tmp_path):
    scenario(tmp_path / "s", "to_the_real_world", "port = 19191")
    log = tmp_path / "calls"
    traced = [shutil.which("strace"), "-f", "-qq", "-o", str(log), "-e", "trace=%network"]
    if subprocess.run([*traced, "true"], capture_output=True).returncode:
        pytest.skip("strace may not trace here")

    subprocess.run([*traced, sys.executable, "-m", "marconet.command_line", "run", str(tmp_path / "s" / "s.toml"),
                    "--host", "inline", "--out", str(tmp_path / "o"), "--no-report"], check=True, capture_output=True,
                   timeout=120)

    calls = log.read_text()
    sockets = re.findall(r"socket\(AF_INET, SOCK_DGRAM.*?\) = (\d+)", calls)
    assert sockets                                          # the real ones that hold descriptors and options
    assert not re.search(r"(?:bind|connect|sendto|sendmsg|sendmmsg|recvfrom|recvmsg)\(\d+, .*AF_INET", calls)
    assert not re.search(r"is anybody there", calls)


@pytest.mark.parametrize("host", ["inline", "process"])
def test_tcp_and_sockets_without_a_medium_are_refused_with_the_remedy(tmp_path, host):
    for program, sockets, words in (
            ("tcp", 'air = "ip"', "connecting an IP socket to 127.0.0.1:9 goes past the emulator: .*; there is no TCP "
                                  "in virtual time: use UDP"),
            ("to_the_real_world", "", r"sending on an IP socket to 127.0.0.1:9 goes past .*; say in the scenario which "
                                      r"medium carries its datagrams, \[agents.NAME\] sockets = ")):
        made = scenario(tmp_path / program, program, "port = 9", sockets=sockets)

        with pytest.raises(NodeFailure, match=words):
            run(made, host=host, out=tmp_path / f"{program} {host}", report=False)


KILL = '''
[[faults]]
kind = "kill"
on = "r2"
at_s = 0.35
restart_after_s = 0.2

[expect]
"count.r2.ticks" = { min = 9, max = 9 }
'''


def test_a_killed_program_starts_again_on_both_hosts_with_fresh_modules(tmp_path):
    made = scenario(tmp_path / "s", "sleeper", "", more=KILL)

    results = [run(made, host=host, out=tmp_path / host, report=False) for host in ("inline", "process")]

    assert [verdict.value for result in results for verdict in result.summary.verdicts] == [
        results[0].summary.verdicts[0].value] * 2


def test_an_inline_program_that_computes_for_ever_is_named_with_its_line_and_ended(tmp_path):
    made = scenario(tmp_path / "s", "spin", "", timeout_s=4)
    line = PROGRAMS.splitlines().index("    while True:", PROGRAMS.splitlines().index("def spin():")) + 2
    threads = threading.active_count()

    with pytest.raises(NodeFailure, match=rf"no answer.*talkers\.py:({line}|{line - 1})"):
        run(made, host="inline", out=tmp_path / "o", report=False)

    assert threading.active_count() == threads
