"""A UDP endpoint: whom it speaks to, and that nothing from outside makes it fail or wait."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from netem.real_time.udp_gateway import MOST_AT_ONCE, UdpGateway

HERE = ("127.0.0.1", 0)


@pytest.fixture
def client() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(HERE)
        found.settimeout(2.0)
        yield found


@pytest.fixture
def gateway() -> Iterator[UdpGateway]:
    found = UdpGateway("ground", "line", HERE)
    yield found
    found.close()


def test_it_answers_who_spoke_last(client: socket.socket, gateway: UdpGateway) -> None:
    gateway.send(b"to nobody")
    client.sendto(b"hello", gateway.listening)

    assert gateway.receive() == [b"hello"]
    gateway.send(b"welcome")
    assert client.recvfrom(100) == (b"welcome", gateway.listening)
    assert (gateway.sent, gateway.unsent, gateway.received) == (1, 1, 1)


def test_it_speaks_to_its_peer_before_anybody_spoke(client: socket.socket) -> None:
    gateway = UdpGateway("ground", "line", HERE, client.getsockname())
    gateway.send(b"heartbeat")

    assert client.recv(100) == b"heartbeat"
    gateway.close()


def test_a_peer_that_does_not_listen_is_no_error(gateway: UdpGateway) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(HERE)
        gateway.peer = gone.getsockname()
    for _ in range(5):
        gateway.send(b"anybody?")           # the answer is an ICMP error at a later call

    assert gateway.receive() == []


def test_a_flood_is_taken_in_parts_and_empty_datagrams_count(client: socket.socket, gateway: UdpGateway) -> None:
    for _ in range(200):
        client.sendto(b"", gateway.listening)

    found = gateway.receive()
    assert found == [b""] * len(found)
    assert 0 < len(found) <= MOST_AT_ONCE


def test_an_address_that_is_taken_is_named(gateway: UdpGateway) -> None:
    port = gateway.listening[1]
    with pytest.raises(OSError, match=rf"gateways.other: cannot listen on 127.0.0.1:{port}: Address already in use"):
        UdpGateway("other", "line", gateway.listening)
