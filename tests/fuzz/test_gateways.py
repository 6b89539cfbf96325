"""Random inputs at each gateway: none raises, none is lost without a count, and what comes after them is heard.

More: `python -m tests.fuzz.test_gateways COUNT SEED`. What they do to an autopilot behind a gateway is in
test_datagrams.py.
"""

from __future__ import annotations

import os
import socket
import ssl
import sys
import tempfile
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import can
import msgpack
import pytest

from netem.gateways import Door, Gateway
from netem.gateways.certificates import EMULATOR, Certificates
from netem.gateways.serial_port import SerialGateway, SerialSettings
from netem.gateways.tcp import TcpGateway, TcpSettings
from netem.gateways.udp import UdpGateway, UdpSettings
from netem.media.can.can_gateway import CanGateway, CanGatewaySettings
from netem.media.can.frame import FD_BYTES, unpack
from tests.free_port import free_port
from tests.netem.gateways.certificate_folders import make
from tests.netem.gateways.door import Bench, Echo, connect, read

FEW, MANY = 1_000, 100_000
AT_ONCE = 50
PATIENCE_S = 60.0
GROUP = "239.74.163.2"


def until(gateway: Gateway, true: Callable[[], bool], found: list[bytes]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end_s, gateway.counters()
        taken = gateway.receive(100)
        found += taken
        if not taken:
            time.sleep(0.0005)


def at_udp(count: int, rng: Random, folder: Path) -> None:
    gateway, found = UdpGateway("g", "m", UdpSettings(most_per_s=10**9)), []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        for sent in range(AT_ONCE, count + 1, AT_ONCE):
            for _ in range(AT_ONCE):
                here.sendto(rng.randbytes(int(rng.expovariate(1 / 100))), gateway.listening)
            until(gateway, lambda: gateway.received + gateway.refused >= sent, found)   # noqa: B023
    gateway.close()
    assert len(found) == count


def at_tcp(count: int, rng: Random, folder: Path) -> None:
    """Chunks of any length, and connections that end at any time, politely or not."""
    gateway = TcpGateway("g", "m", TcpSettings(listen="127.0.0.1:0", most_bytes_per_s=10**9))
    found: list[bytes] = []
    sent = bytearray()
    here = socket.create_connection(gateway.listening)
    for _ in range(count):
        chunk = rng.randbytes(int(rng.expovariate(1 / 30)))
        here.sendall(chunk)
        sent += chunk
        gateway.send(rng.randbytes(rng.randrange(50)))
        if rng.random() < 0.02:
            until(gateway, lambda: gateway.bytes_received >= len(sent), found)          # noqa: B023
            here.close()                        # with unread bytes: a reset
            here = socket.create_connection(gateway.listening)
    until(gateway, lambda: gateway.bytes_received >= len(sent), found)
    here.close()
    gateway.close()
    assert b"".join(found) == bytes(sent)


def at_serial(count: int, rng: Random, folder: Path) -> None:
    gateway = SerialGateway("g", "m", SerialSettings(pty=folder / "tty", most_bytes_per_s=10**9))
    found: list[bytes] = []
    sent = bytearray()
    here = os.open(folder / "tty", os.O_RDWR | os.O_NOCTTY)
    for k in range(1, count + 1):
        chunk = rng.randbytes(int(rng.expovariate(1 / 30)))
        os.write(here, chunk)
        sent += chunk
        if k % 20 == 0:                         # what a terminal holds has a limit
            until(gateway, lambda: gateway.bytes_received >= len(sent), found)          # noqa: B023
            gateway.send(rng.randbytes(30))
        if rng.random() < 0.002:
            os.close(here)
            until(gateway, lambda: not gateway.peers, found)
            here = os.open(folder / "tty", os.O_RDWR | os.O_NOCTTY)
    until(gateway, lambda: gateway.bytes_received >= len(sent), found)
    os.close(here)
    gateway.close()
    assert b"".join(found) == bytes(sent)


def a_message(rng: Random) -> bytes:
    """Noise, or a message of udp_multicast with fields of any value.

    Numbers stay small: python-can 4.6 makes `bytearray(data)` of a number, and so takes as many bytes of memory.
    """
    values: list[Any] = [None, True, -1, rng.randrange(1 << 16), 0.5, "text", rng.randbytes(rng.randrange(80)), [], {}]
    if rng.random() < 0.5:
        return rng.randbytes(rng.randrange(100))
    fields: dict[str, Any] = {"timestamp": 0.0, "arbitration_id": rng.randrange(0x800), "is_extended_id": False,
                              "is_remote_frame": False, "is_error_frame": False, "channel": None, "dlc": 2,
                              "data": b"ab", "is_fd": False, "bitrate_switch": False, "error_state_indicator": False}
    for _ in range(rng.randrange(3)):
        fields[rng.choice(list(fields))] = rng.choice(values)
    return bytes(msgpack.packb(fields))


def at_multicast(count: int, rng: Random, folder: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)
    gateway = CanGateway("g", "m", CanGatewaySettings("udp_multicast", GROUP, fd=True, options={"port": port},
                                                      most_per_s=10**9))
    found: list[bytes] = []
    gateway.receive(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for sent in range(AT_ONCE, count + 1, AT_ONCE):
            for _ in range(AT_ONCE):
                here.sendto(a_message(rng), (GROUP, port))
            until(gateway, lambda: gateway.counters()["no CAN frames"] + len(found) >= sent, found)     # noqa: B023
    gateway.close()
    assert len(found) > count // 10
    assert all(unpack(data) and len(data) <= FD_BYTES for data in found)


def at_slcan(count: int, rng: Random, folder: Path) -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    gateway = CanGateway("g", "m", CanGatewaySettings("slcan", os.ttyname(slave), most_per_s=10**9,
                                                      options={"sleep_after_open": 0.0}))
    found: list[bytes] = []
    gateway.receive(1)
    for k in range(count):
        line = bytearray(b"t1232AABB" if rng.random() < 0.5 else b"T1ABCDEF08" + b"00" * 8)
        if rng.random() < 0.5:
            line[rng.randrange(len(line))] = rng.randrange(128)
        os.write(master, line + b"\r" if rng.random() < 0.9 else rng.randbytes(rng.randrange(20)))
        if k % AT_ONCE == 0:
            found += gateway.receive(100)
    wanted = can.Message(arbitration_id=0x7A, data=b"\x55", is_extended_id=False)
    until(gateway, lambda: os.write(master, b"\rt07A155\r") > 0
          and any(unpack(data).data == wanted.data for data in found[-20:]), found)
    gateway.close()
    os.close(master)
    os.close(slave)
    assert all(unpack(data) for data in found)


def first_message(context: ssl.SSLContext) -> bytes:
    """Return what a client sends first."""
    sent = ssl.MemoryBIO()
    with suppress(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), sent, server_hostname=EMULATOR).do_handshake()
    return sent.read()


def at_tls(count: int, rng: Random, folder: Path) -> None:
    """Noise, first messages of TLS with errors, and connections that end at any time: each is refused and counted."""
    make(folder / "certificates", "r1")
    echo, bench = Echo(folder / "echo"), Bench(folder / "certificates")
    door = bench.open("r1", Door("127.0.0.1:0", ("r1",)), echo.onward)
    bench.begin()
    context = Certificates(folder / "certificates").client_context("r1")
    hello = first_message(context)
    port = int(door.address.rpartition(":")[2])
    for sent in range(1, count + 1):
        said = bytearray(hello[:rng.randrange(len(hello))] if rng.random() < 0.3 else hello)
        for _ in range(rng.randrange(4) if said else 0):
            said[rng.randrange(len(said))] = rng.randrange(256)
        with socket.create_connection(("127.0.0.1", port)) as here, suppress(ConnectionError):
            here.sendall(said if rng.random() < 0.7 else rng.randbytes(int(rng.expovariate(1 / 100))))
        if sent % AT_ONCE == 0:
            bench.watched.until(lambda: door.refused >= sent)       # noqa: B023
    bench.watched.until(lambda: door.refused == count)
    assert echo.connections == []
    with connect(door.address, context) as client:
        client.sendall(b"hello")
        assert read(client, 5) == b"hello"
    bench.front.close()
    echo.close()


ATTACKS = {"udp": at_udp, "tcp": at_tcp, "tls": at_tls, "serial": at_serial, "udp_multicast": at_multicast,
           "slcan": at_slcan}


@pytest.mark.parametrize("kind", ATTACKS)
def test_random_inputs_are_taken_or_counted(kind: str, tmp_path: Path) -> None:
    ATTACKS[kind](FEW, Random(1), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ATTACKS)
def test_a_hundred_thousand_random_inputs_are_taken_or_counted(kind: str, tmp_path: Path) -> None:
    ATTACKS[kind](MANY, Random(2), tmp_path)


if __name__ == "__main__":
    for name, attack in ATTACKS.items():
        began_s = time.monotonic()
        attack(int(sys.argv[1]), Random(int(sys.argv[2])), Path(tempfile.mkdtemp()))
        print(f"{name}: {sys.argv[1]} inputs in {time.monotonic() - began_s:.1f} s")
