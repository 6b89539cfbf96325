"""A TCP endpoint: clients that come, leave and do not read; a server that is not there, goes, and comes again."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from netem.gateways import FLOODED, GONE, LOST, MISSING, REFUSED, SPEAKS, UNREAD
from netem.gateways.stream import MOST_UNSENT_BYTES
from netem.gateways.tcp import TcpGateway, TcpSettings
from tests.free_port import free_port

PATIENCE_S = 5.0


class Heard:
    """A gateway and its events."""

    def __init__(self, longest_bytes: int | None = None, **settings: object) -> None:
        self.told: list[tuple[str, str]] = []
        self.gateway = TcpGateway("ground", "line", TcpSettings(**settings),        # type: ignore[arg-type]
                                  event=lambda kind, detail, level: self.told.append((kind, detail)),
                                  longest_bytes=longest_bytes)

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.told]

    def until(self, true: Callable[[], bool], most: int = 100) -> list[bytes]:
        """Receive until `true()`, as the system takes its time; return what was received."""
        found: list[bytes] = []
        end_s = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end_s, self.told
            found += self.gateway.receive(most)
            time.sleep(0.001)
        return found


@pytest.fixture
def made() -> Iterator[Callable[..., Heard]]:
    found: list[Heard] = []

    def make(**settings: object) -> Heard:
        found.append(Heard(**settings))         # type: ignore[arg-type]
        return found[-1]

    yield make
    for each in found:
        each.gateway.close()


@pytest.fixture
def client() -> Iterator[Callable[[Heard], socket.socket]]:
    with ExitStack() as opened:
        def connected(to: Heard) -> socket.socket:
            before = to.gateway.connections + to.gateway.refused
            found = opened.enter_context(socket.create_connection(to.gateway.listening, timeout=PATIENCE_S))
            to.until(lambda: to.gateway.connections + to.gateway.refused > before)
            return found

        yield connected


@pytest.fixture
def server() -> Iterator[Callable[[int], socket.socket]]:
    with ExitStack() as opened:
        def listening(port: int) -> socket.socket:
            found = opened.enter_context(socket.create_server(("127.0.0.1", port)))
            found.settimeout(PATIENCE_S)
            return found

        yield listening


def test_each_client_gets_the_whole_stream_and_each_is_heard(made, client):
    heard = made(listen="127.0.0.1:0")
    first, second = client(heard), client(heard)
    for here in (first, second):
        here.sendall(b"hello")

    found = heard.until(lambda: heard.gateway.messages_received == 2)
    for k in range(20):
        heard.gateway.send(b"%02d" % k)

    assert found == [b"hello", b"hello"]
    for here in (first, second):
        assert _all(here, 40) == b"".join(b"%02d" % k for k in range(20))
    assert heard.kinds == [SPEAKS, SPEAKS]
    assert heard.gateway.counters() == {"bytes received": 10, "messages received": 2, "bytes sent": 80,
                                        "messages sent": 40, "messages not sent": 0, "connections": 2,
                                        "connections refused": 0}


def _all(here: socket.socket, count: int) -> bytes:
    found = b""
    while len(found) < count:
        found += here.recv(count - len(found))
    return found


def test_it_tells_that_no_program_connected_unless_one_has_or_it_calls_by_itself(made, client):
    alone, connected, calls = made(listen="127.0.0.1:0"), made(listen="127.0.0.1:0"), made(connect="127.0.0.1:9")
    client(connected)

    port = alone.gateway.listening[1]
    assert alone.gateway.alone().startswith(f"no program outside the run connected to 127.0.0.1:{port}, so the gate")
    assert connected.gateway.alone() == calls.gateway.alone() == ""


def test_a_message_is_cut_to_what_the_medium_takes(made, client):
    heard = made(listen="127.0.0.1:0", longest_bytes=60)
    client(heard).sendall(bytes(range(200)))

    found = heard.until(lambda: heard.gateway.bytes_received == 200)

    assert b"".join(found) == bytes(range(200))
    assert [len(message) for message in found] == [60, 60, 60, 20]


def test_of_two_clients_that_always_send_each_is_heard_in_turn(made, client):
    heard = made(listen="127.0.0.1:0", longest_bytes=4)
    first, second = client(heard), client(heard)
    first.sendall(b"aaaa" * 100)
    second.sendall(b"bbbb" * 100)
    time.sleep(0.05)

    found = [heard.gateway.receive(1) for _ in range(100)]

    assert found.count([b"aaaa"]) >= 45
    assert found.count([b"bbbb"]) >= 45


def test_a_connection_that_ends_within_a_message_leaves_whole_messages_to_the_next(made, client):
    heard = made(listen="127.0.0.1:0")
    first = client(heard)
    first.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    first.sendall(b"half a fra")
    while not any(peer.unsent for peer in heard.gateway.peers):
        heard.gateway.send(b"\xfd" + bytes(9_998) + b"\xff")
    first.close()

    found = heard.until(lambda: GONE in heard.kinds)
    unsent = heard.gateway.messages_unsent
    second = client(heard)
    heard.gateway.send(b"\xfdwhole")

    assert found == [b"half a fra"]
    assert unsent >= 1
    assert _all(second, 6) == b"\xfdwhole"


def test_a_client_that_does_not_read_loses_whole_messages_and_is_told_of_once(made, client):
    heard = made(listen="127.0.0.1:0")
    slow, other = client(heard), client(heard)
    message = bytes(50_000)
    other.settimeout(PATIENCE_S)
    sent = 0
    while heard.gateway.messages_unsent < 3:
        heard.gateway.send(message)
        sent += 1
        assert _all_while(heard, other, len(message)) == message

    assert heard.kinds == [SPEAKS, SPEAKS, UNREAD]
    assert sent * len(message) > MOST_UNSENT_BYTES
    slow.settimeout(PATIENCE_S)
    kept = b""
    while len(kept) < (sent - 3) * len(message):
        heard.gateway.receive(1)
        kept += slow.recv(1 << 20)
    assert len(kept) == (sent - 3) * len(message)


def _all_while(heard: Heard, here: socket.socket, count: int) -> bytes:
    found = b""
    while len(found) < count:
        heard.gateway.receive(1)
        found += here.recv(count - len(found))
    return found


def test_one_client_more_than_there_is_room_for_is_closed_with_one_event(made, client):
    heard = made(listen="127.0.0.1:0", most_peers=1)
    first, second, third = client(heard), client(heard), client(heard)
    heard.gateway.send(b"stream")

    assert _all(first, 6) == b"stream"
    assert (second.recv(10), third.recv(10)) == (b"", b"")
    assert heard.kinds == [SPEAKS, REFUSED]
    assert "takes no more than 1; raise most_peers" in heard.told[1][1]
    assert heard.gateway.refused == 2


def test_only_those_named_may_connect(made, client):
    heard = made(listen="127.0.0.1:0", only_from=("10.0.0.0/8",))

    assert client(heard).recv(10) == b""
    assert heard.kinds == [REFUSED]


def test_a_client_that_floods_is_made_to_wait_and_told_of_once(made, client):
    heard = made(listen="127.0.0.1:0", most_bytes_per_s=10_000)
    here = client(heard)
    began_s = time.monotonic()
    here.sendall(bytes(14_000))

    heard.until(lambda: heard.gateway.bytes_received == 14_000)

    # The third piece of 4 096 bytes exceeds the 10 000 that may come at once, by 2 288 bytes that take 0.23 s.
    assert time.monotonic() - began_s > 0.22
    assert heard.kinds == [SPEAKS, FLOODED]


def test_it_calls_again_with_back_off_until_somebody_listens(made, server):
    port = free_port()
    heard = made(connect=f"127.0.0.1:{port}", retry_ns=1_000_000, retry_longest_ns=20_000_000)
    heard.until(lambda: heard.kinds == [MISSING])
    for _ in range(3):
        heard.gateway.send(b"nobody there")

    listening = server(port)
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS])
    there, _ = listening.accept()
    heard.gateway.send(b"hello")

    assert there.recv(10) == b"hello"
    assert heard.told[0][1].startswith(f"gateways.ground cannot connect to 127.0.0.1:{port}: Connection refused; start "
                                       "the program that listens there")
    assert heard.told[1][1] == f"gateways.ground speaks with 127.0.0.1:{port} again; 3 frames were lost meanwhile"
    there.close()


def test_a_server_that_goes_is_told_of_and_called_again(made, server):
    listening = server(0)
    port = listening.getsockname()[1]
    heard = made(connect=f"127.0.0.1:{port}", retry_ns=1_000_000, retry_longest_ns=20_000_000)
    heard.until(lambda: heard.kinds == [SPEAKS])
    there, _ = listening.accept()
    there.sendall(b"last word")
    there.close()

    found = heard.until(lambda: heard.kinds == [SPEAKS, LOST, SPEAKS])

    assert found == [b"last word"]
    listening.accept()[0].close()


def test_the_back_off_doubles_up_to_the_longest(made):
    port = free_port()
    now_ns = [0]
    gateway = TcpGateway("ground", "line", TcpSettings(connect=f"127.0.0.1:{port}", retry_ns=10_000_000,
                                                       retry_longest_ns=50_000_000), clock_ns=lambda: now_ns[0])
    waits = []
    for _ in range(5):
        gateway.receive(1)
        end_s = time.monotonic() + PATIENCE_S
        while gateway._calling is not None:
            assert time.monotonic() < end_s
            gateway.receive(1)
        waits.append(gateway.due_ns() - now_ns[0])
        now_ns[0] = gateway.due_ns()

    assert waits == [10_000_000, 20_000_000, 40_000_000, 50_000_000, 50_000_000]
    gateway.close()


def test_an_address_that_is_taken_is_named_with_the_remedy(made):
    port = made(listen="127.0.0.1:0").gateway.listening[1]
    with pytest.raises(OSError, match=rf"gateways.other: cannot listen on 127.0.0.1:{port}: Address already in use"):
        TcpGateway("other", "line", TcpSettings(listen=f"127.0.0.1:{port}"))
