"""A UDP endpoint: which peer it speaks to, and that nothing from outside makes it fail or wait."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from netem.gateways.udp import MOST_TOLD, PEER_SILENT_NS, UdpGateway, UdpSettings

HERE = ("127.0.0.1", 0)


@pytest.fixture
def client() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(HERE)
        found.settimeout(2.0)
        yield found


@pytest.fixture
def gateway() -> Iterator[UdpGateway]:
    found = UdpGateway("ground", "line", UdpSettings())
    yield found
    found.close()


def test_it_answers_the_first_that_speaks(client: socket.socket, gateway: UdpGateway) -> None:
    gateway.send(b"to nobody")
    client.sendto(b"hello", gateway.listening)

    assert gateway.receive(1_000) == [b"hello"]
    gateway.send(b"welcome")
    assert client.recvfrom(100) == (b"welcome", gateway.listening)
    assert (gateway.sent, gateway.unsent, gateway.received) == (1, 1, 1)


def test_it_speaks_to_its_peer_before_anybody_spoke(client: socket.socket) -> None:
    gateway = UdpGateway("ground", "line", UdpSettings(peer="{}:{}".format(*client.getsockname())))
    gateway.send(b"heartbeat")

    assert client.recv(100) == b"heartbeat"
    gateway.close()


def test_a_peer_that_does_not_listen_is_no_error(gateway: UdpGateway) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(HERE)
        gateway.peer = gone.getsockname()
    for _ in range(5):
        gateway.send(b"anybody?")           # the answer is an ICMP error at a later call

    assert gateway.receive(1_000) == []


def test_a_flood_is_taken_in_parts_and_empty_datagrams_count(client: socket.socket, gateway: UdpGateway) -> None:
    for _ in range(20):
        client.sendto(b"", gateway.listening)

    assert gateway.receive(15) == [b""] * 15
    assert gateway.receive(15) == [b""] * 5


def test_a_second_peer_is_refused_with_one_event_and_the_first_keeps_the_stream(client: socket.socket) -> None:
    told: list[tuple[str, str]] = []
    gateway = UdpGateway("ground", "line", UdpSettings(), event=lambda kind, detail, level: told.append((kind, detail)))
    first, second = "{}:{}".format(*client.getsockname()), ""
    client.sendto(b"first", gateway.listening)
    assert gateway.receive(10) == [b"first"]

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(HERE)
        second = "{}:{}".format(*other.getsockname())
        for _ in range(3):
            other.sendto(b"second", gateway.listening)
        assert gateway.receive(10) == []
    gateway.send(b"stream")

    assert client.recv(100) == b"stream"
    assert (gateway.received, gateway.refused) == (1, 3)
    assert told == [("gateway peer", f"gateways.ground speaks with {first}"),
                    ("gateway peer refused", f"gateways.ground speaks with {first}: datagrams of {second} are dropped; "
                                             "give it a gateway of its own")]
    gateway.close()


def test_a_peer_may_be_followed_by_another_once_it_has_been_silent(client: socket.socket) -> None:
    told: list[tuple[str, str]] = []
    now_ns = [0]
    gateway = UdpGateway("ground", "line", UdpSettings(), event=lambda kind, detail, level: told.append((kind, detail)),
                         clock_ns=lambda: now_ns[0])
    client.sendto(b"first", gateway.listening)
    gateway.receive(10)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(HERE)
        now_ns[0] = PEER_SILENT_NS - 1
        other.sendto(b"too early", gateway.listening)
        assert gateway.receive(10) == []
        now_ns[0] = PEER_SILENT_NS
        other.sendto(b"mine now", gateway.listening)
        assert gateway.receive(10) == [b"mine now"]
        assert gateway.peer == other.getsockname()

    assert [kind for kind, _ in told] == ["gateway peer", "gateway peer refused", "gateway peer"]
    assert told[-1][1].endswith("which has been silent")
    gateway.close()


def test_a_flood_of_addresses_leaves_a_bounded_number_of_events(client: socket.socket) -> None:
    told: list[str] = []
    gateway = UdpGateway("ground", "line", UdpSettings(), event=lambda kind, detail, level: told.append(kind))
    client.sendto(b"first", gateway.listening)
    gateway.receive(10)

    for _ in range(3 * MOST_TOLD):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(HERE)
            other.sendto(b"?", gateway.listening)
            gateway.receive(10)

    assert gateway.refused == 3 * MOST_TOLD
    assert told.count("gateway peer refused") <= MOST_TOLD
    gateway.close()


def test_an_address_that_is_taken_is_named(gateway: UdpGateway) -> None:
    port = gateway.listening[1]
    with pytest.raises(OSError, match=rf"gateways.other: cannot listen on 127.0.0.1:{port}: Address already in use"):
        UdpGateway("other", "line", UdpSettings("{}:{}".format(*gateway.listening)))
