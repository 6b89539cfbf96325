"""The front of TLS doors, a process of its own: what passes, who is let in, and what is told about the others."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import pytest

from netem.gateways import GONE, LOST, REFUSED, SPEAKS, Door, tls_front_process
from netem.gateways.addresses import Address
from netem.gateways.certificates import CHECK, EMULATOR, Certificates
from netem.gateways.door_messages import OpenDoor, Opened, Refused, to_run
from netem.gateways.tls_front_process import Front, FrontDoor, Half
from tests.netem.gateways.certificate_folders import make
from tests.netem.gateways.door import PATIENCE_S, Bench, Echo, connect, is_closed, read

ANYWHERE = "127.0.0.1:0"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("certificates") / "ours"
    make(made, "r1", "r2", "operator")
    return made


@pytest.fixture
def echo(tmp_path: Path) -> Iterator[Echo]:
    made = Echo(tmp_path / "echo")
    yield made
    made.close()


@pytest.fixture
def bench(folder: Path) -> Iterator[Bench]:
    made = Bench(folder)
    yield made
    made.front.close()


def as_client(folder: Path, name: str, *, checks: bool = False) -> ssl.SSLContext:
    context = Certificates(folder).client_context(name)
    if checks:
        context.set_alpn_protocols([CHECK])
    return context


def test_bytes_pass_both_ways_unchanged_and_who_came_and_went_is_told(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    bench.begin()
    sent = Random(1).randbytes(3_000_000)

    with connect(door.address, as_client(folder, "r1")) as client:
        here = f"127.0.0.1:{client.getsockname()[1]}"
        assert bench.until_told("r1", SPEAKS) == f"speaks with {here}, whose certificate is r1's"
        found = bytearray()
        for first in range(0, len(sent), 100_000):
            client.sendall(sent[first:first + 100_000])
            found += read(client, 100_000)

    assert bytes(found) == sent
    assert bench.until_told("r1", GONE) == f"speaks no more with {here}, whose certificate is r1's"
    assert door.refused == 0


def test_who_sends_more_than_the_other_side_reads_is_made_to_wait(bench, folder, tmp_path):
    deaf = Echo(tmp_path / "deaf", reads=False)
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), deaf.onward)
    with connect(door.address, as_client(folder, "r1")) as client:
        client.settimeout(0.5)
        sent = 0
        with suppress(TimeoutError):
            while sent < 200_000_000:
                sent += client.send(bytes(65536))

        assert sent < 20_000_000        # the system's buffers of three sockets, and what the front keeps
    deaf.close()


def test_what_was_sent_before_either_side_closed_arrives(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    bench.begin()
    with connect(door.address, as_client(folder, "r1")) as client:
        client.sendall(b"last words")
        assert read(client, 10) == b"last words"
        echo.connections[0].sendall(bytes(500_000))
        echo.connections[0].shutdown(socket.SHUT_RDWR)

        assert len(read(client, 500_001)) == 500_000
    bench.until_told("r1", GONE)


def test_another_name_is_refused_and_nothing_it_sends_is_passed_on(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    bench.begin()
    with connect(door.address, as_client(folder, "r2")) as client:
        client.sendall(b"I am r1")

        assert is_closed(client)

    assert bench.until_told("r1", REFUSED).endswith(": its certificate is r2's; this door is r1's")
    assert (door.refused, echo.connections, bench.told["r1"]) == (1, [], [])


def test_a_client_that_asks_gets_one_line_whether_it_is_admitted(bench, folder, echo):
    door = bench.open("view", Door(ANYWHERE, ("operator", "r1"), most=1), echo.onward)
    bench.begin()

    def asked(name: str) -> bytes:
        with connect(door.address, as_client(folder, name, checks=True)) as client:
            return read(client, 1000)

    assert asked("r1") == b"welcome r1\n"
    assert asked("r2") == b"refused: its certificate is r2's; this door is operator's or r1's\n"
    assert bench.until_told("view", REFUSED)
    with connect(door.address, as_client(folder, "operator")):
        bench.until_told("view", SPEAKS)
        assert asked("r1").startswith(b"refused: 1 are connected, the most that this door takes; ")


def test_beyond_the_most_a_client_is_refused_until_another_leaves(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",), most=1), echo.onward)
    bench.begin()
    with connect(door.address, as_client(folder, "r1")):
        bench.until_told("r1", SPEAKS)
        with connect(door.address, as_client(folder, "r1")) as second:
            assert is_closed(second)
        assert "the most that this door takes" in bench.until_told("r1", REFUSED)
    bench.until_told("r1", GONE)

    with connect(door.address, as_client(folder, "r1")) as client:
        client.sendall(b"again")
        assert read(client, 5) == b"again"


def test_an_address_that_is_not_among_only_from_is_closed_before_the_handshake(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",), ("10.0.0.0/8",)), echo.onward)
    bench.begin()

    with pytest.raises((ssl.SSLError, ConnectionError)):
        connect(door.address, as_client(folder, "r1"))

    assert ": it is not among only_from = ['10.0.0.0/8']; " in bench.until_told("r1", REFUSED)


def test_two_doors_have_names_of_their_own_and_a_taken_address_is_an_error(bench, folder, echo):
    one = bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    two = bench.open("r2", Door("[::1]:0", ("r2",)), echo.onward)
    with pytest.raises(OSError, match=f"third: cannot listen on {one.address}: .*in use; end the program"):
        bench.open("third", Door(one.address, ("r1",)), echo.onward)
    bench.begin()

    for door, name in ((one, "r1"), (two, "r2")):
        with connect(door.address.replace("[", "").replace("]", ""), as_client(folder, name)) as client:
            client.sendall(b"hello")
            assert read(client, 5) == b"hello"


def test_refusals_are_told_once_for_each_reason_and_all_counted(bench, folder, echo):
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    bench.begin()
    for _ in range(5):
        with connect(door.address, as_client(folder, "r2")) as client:
            assert is_closed(client)
    with socket.create_connection(("127.0.0.1", int(door.address.rpartition(":")[2]))) as plain:
        plain.sendall(b"GET / HTTP/1.1\r\n\r\n")
        bench.watched.until(lambda: door.refused == 6)

    assert [kind for kind, _ in bench.told["r1"]] == [REFUSED, REFUSED]
    assert "it does not speak TLS; " in bench.told["r1"][1][1]


def test_what_is_behind_the_door_has_gone(bench, folder, tmp_path):
    door = bench.open("r1", Door(ANYWHERE, ("r1",)), f"unix/{tmp_path}/nobody")
    bench.begin()
    with connect(door.address, as_client(folder, "r1")) as client:
        assert is_closed(client)

    assert "what is behind the door does not answer" in bench.until_told("r1", REFUSED)


def test_a_front_that_ends_is_told_and_left(bench, folder, echo):
    bench.open("r1", Door(ANYWHERE, ("r1",)), echo.onward)
    bench.begin()

    bench.front._process._process.kill()

    assert "the process of the run's TLS doors has ended" in bench.until_told("r1", LOST)
    assert bench.watched.watches == 0


def test_a_front_without_certificates_says_so(tmp_path):
    bench = Bench(tmp_path / "none")
    with pytest.raises(OSError, match="none: is no folder; make new ones with marconet certificates new"):
        bench.open("r1", Door(ANYWHERE, ("r1",)), "unix/nowhere")
    bench.front.close()


RUN = """
import sys
from pathlib import Path
from netem.gateways import Door
from netem.gateways.tls_front import TlsFront
front = TlsFront(Path(sys.argv[1]))
front.open("r1", Door("127.0.0.1:0", ("r1",)), "unix/nowhere", lambda *_: None)
print(front._process._process.pid, flush=True)
sys.stdin.read()
"""


def test_the_front_ends_with_the_run_that_is_killed(folder):
    with subprocess.Popen([sys.executable, "-c", RUN, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as run:
        assert run.stdout is not None
        front = os.pidfd_open(int(run.stdout.readline()))
        run.send_signal(signal.SIGKILL)

        ended, _, _ = select.select([front], [], [], PATIENCE_S)

    os.close(front)
    assert ended


class Noting:
    """The run of a front in this process; `told` are its messages."""

    def __init__(self) -> None:
        self.told: list[Any] = []
        self.transport = self
        self.untold_bytes = 0

    def get_write_buffer_size(self) -> int:
        return self.untold_bytes

    def write(self, line: bytes) -> None:
        self.told.append(to_run.decode(line))


def test_who_says_nothing_is_closed_after_a_while_and_does_not_keep_others_out(folder, monkeypatch):
    monkeypatch.setattr(tls_front_process, "HANDSHAKE_WITHIN_S", 0.2)
    monkeypatch.setattr(tls_front_process, "MOST_IN_HANDSHAKE", 2)
    run = Noting()

    async def meet() -> list[bytes]:
        front = Front(run)      # type: ignore[arg-type]
        front.open(OpenDoor(0, str(folder), "r1", ANYWHERE, "unix/nowhere", ["r1"], [], 8))
        opened = run.told[0]
        assert isinstance(opened, Opened)
        silent = [await asyncio.open_connection("127.0.0.1", opened.port) for _ in range(6)]
        try:
            return [await asyncio.wait_for(reader.read(), PATIENCE_S) for reader, _ in silent]
        finally:
            for _, writer in silent:
                writer.close()
            front.close()

    assert asyncio.run(meet()) == [b""] * 6
    refused = [message for message in run.told if isinstance(message, Refused)]
    assert [message.refused for message in refused] == [1, 2, 3, 4, 5, 6]
    assert all(message.why.startswith("it did not finish the TLS handshake in time") for message in refused)


def test_a_small_message_does_not_wait_for_the_one_before(folder, monkeypatch):
    """Nagle's algorithm would hold back the second of two small messages for 40 ms."""
    let_in: list[int] = []

    async def look(door: FrontDoor, outer: Half, address: Address) -> None:
        let_in.append(outer.transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    monkeypatch.setattr(FrontDoor, "_let_in", look)
    run = Noting()

    async def meet() -> None:
        front = Front(run)      # type: ignore[arg-type]
        front.open(OpenDoor(0, str(folder), "r1", ANYWHERE, "unix/nowhere", ["r1"], [], 8))
        reader, writer = await asyncio.open_connection("127.0.0.1", run.told[0].port, ssl=as_client(folder, "r1"),
                                                       server_hostname=EMULATOR)
        with suppress(ConnectionError):
            await asyncio.wait_for(reader.read(), PATIENCE_S)
        writer.close()
        front.close()

    asyncio.run(meet())

    assert let_in == [1]


def test_a_run_that_does_not_read_makes_the_front_leave_messages_out_but_not_the_count(folder):
    run = Noting()

    async def meet() -> None:
        front = Front(run)      # type: ignore[arg-type]
        front.open(OpenDoor(0, str(folder), "r1", ANYWHERE, "unix/nowhere", ["r1"], [], 8))
        for untold_bytes in (0, 1 << 20, 0):
            run.untold_bytes = untold_bytes
            reader, writer = await asyncio.open_connection("127.0.0.1", run.told[0].port)
            writer.write(b"this is no TLS at all")
            await asyncio.wait_for(reader.read(), PATIENCE_S)
            writer.close()
        front.close()

    asyncio.run(meet())

    assert [message.refused for message in run.told[1:]] == [1, 3]
