"""A UDP endpoint: which peers it speaks to, and that nothing from outside makes it fail or wait."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from netem.gateways import FLOODED, GONE, REFUSED, SPEAKS
from netem.gateways.udp import MOST_TOLD, STAMPED, UdpGateway, UdpSettings
from netem.wire.instants import NEVER_NS

HERE = ("127.0.0.1", 0)
S = 1_000_000_000

Client = Callable[[], socket.socket]


@pytest.fixture
def client() -> Iterator[Client]:
    with ExitStack() as opened:
        def found() -> socket.socket:
            made = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            made.bind(HERE)
            made.settimeout(2.0)
            return made

        yield found


class Heard:
    """A gateway with a clock that the test sets, and its events."""

    def __init__(self, **settings: object) -> None:
        self.now_ns = 0
        self.told: list[tuple[str, str]] = []
        self.gateway = UdpGateway("ground", "line", UdpSettings(**settings),    # type: ignore[arg-type]
                                  event=lambda kind, detail, level: self.told.append((kind, detail)),
                                  clock_ns=lambda: self.now_ns)

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.told]


@pytest.fixture
def made() -> Iterator[Callable[..., Heard]]:
    found: list[Heard] = []

    def make(**settings: object) -> Heard:
        found.append(Heard(**settings))
        return found[-1]

    yield make
    for each in found:
        each.gateway.close()


def name(of: socket.socket) -> str:
    return "{}:{}".format(*of.getsockname())


def test_it_answers_whoever_spoke(client: Client, made: Callable[..., Heard]) -> None:
    here, gateway = client(), made().gateway
    gateway.send(b"to nobody")
    here.sendto(b"hello", gateway.listening)

    assert gateway.receive(1_000) == [b"hello"]
    gateway.send(b"welcome")
    assert here.recvfrom(100) == (b"welcome", gateway.listening)
    assert (gateway.sent, gateway.unsent, gateway.received) == (1, 1, 1)


def test_its_peer_gets_the_stream_before_anybody_spoke_and_is_never_forgotten(client: Client,
                                                                             made: Callable[..., Heard]) -> None:
    here = client()
    heard = made(peer=name(here))
    heard.gateway.send(b"heartbeat")
    here.sendto(b"hello", heard.gateway.listening)
    assert heard.gateway.receive(10) == [b"hello"]

    heard.now_ns = 1_000_000 * S
    assert heard.gateway.receive(10) == []
    heard.gateway.send(b"still there")

    assert [here.recv(100), here.recv(100)] == [b"heartbeat", b"still there"]
    assert heard.gateway.due_ns() == NEVER_NS
    assert heard.told == []


def test_each_peer_that_spoke_gets_the_whole_stream(client: Client, made: Callable[..., Heard]) -> None:
    first, second, silent = client(), client(), client()
    heard = made(peer=name(silent))
    for here in (first, second):
        here.sendto(b"hello", heard.gateway.listening)
    assert heard.gateway.receive(10) == [b"hello", b"hello"]

    for k in range(20):
        heard.gateway.send(b"%d" % k)

    for here in (first, second, silent):
        assert [here.recv(100) for _ in range(20)] == [b"%d" % k for k in range(20)]
    assert heard.told == [(SPEAKS, f"gateways.ground speaks with {name(here)}") for here in (first, second)]
    assert heard.gateway.counters() == {
        "datagrams received": 2, "datagrams refused": 0, "datagrams beyond the rate": 0, "datagrams sent": 60,
        "datagrams not sent": 0}


def test_a_peer_that_does_not_listen_is_no_error_and_takes_nothing_from_another(client: Client,
                                                                               made: Callable[..., Heard]) -> None:
    here, gone = client(), client()
    gateway = made().gateway
    for each in (gone, here):
        each.sendto(b"hello", gateway.listening)
    assert len(gateway.receive(10)) == 2
    gone.close()

    for k in range(5):
        gateway.send(b"%d" % k)             # the answer is an ICMP error at a later call

    assert gateway.receive(1_000) == []
    assert [here.recv(100) for _ in range(5)] == [b"%d" % k for k in range(5)]


def test_what_came_is_taken_in_parts_and_empty_datagrams_count(client: Client, made: Callable[..., Heard]) -> None:
    here, gateway = client(), made().gateway
    for _ in range(20):
        here.sendto(b"", gateway.listening)

    assert gateway.receive(15) == [b""] * 15
    assert gateway.receive(15) == [b""] * 5


def test_one_more_peer_than_there_is_room_for_is_refused_with_one_event(client: Client,
                                                                       made: Callable[..., Heard]) -> None:
    first, second = client(), client()
    heard = made(most_peers=1)
    first.sendto(b"first", heard.gateway.listening)
    for _ in range(3):
        second.sendto(b"second", heard.gateway.listening)

    assert heard.gateway.receive(10) == [b"first"]
    heard.gateway.send(b"stream")

    assert first.recv(100) == b"stream"
    assert (heard.gateway.received, heard.gateway.refused) == (1, 3)
    assert heard.told[1:] == [(REFUSED, f"gateways.ground drops the datagrams of {name(second)}: it speaks with "
                               f"{name(first)} and takes no more than 1; raise most_peers, or give it a gateway of its "
                               "own")]


def test_a_silent_peer_is_forgotten_at_its_instant_and_makes_room(client: Client, made: Callable[..., Heard]) -> None:
    first, second = client(), client()
    heard = made(most_peers=1, forget_after_ns=10 * S)
    heard.now_ns = 3 * S
    first.sendto(b"first", heard.gateway.listening)
    heard.gateway.receive(10)
    assert heard.gateway.due_ns() == 13 * S

    heard.now_ns = 13 * S - 1
    second.sendto(b"too early", heard.gateway.listening)
    assert heard.gateway.receive(10) == []
    heard.now_ns = 13 * S
    assert heard.gateway.receive(10) == []
    assert heard.gateway.peers == set()
    second.sendto(b"mine now", heard.gateway.listening)
    assert heard.gateway.receive(10) == [b"mine now"]

    assert heard.kinds == [SPEAKS, REFUSED, GONE, SPEAKS]
    assert heard.told[2][1] == (f"gateways.ground forgets {name(first)}, which has been silent for 10 s; it takes part "
                                "again as soon as it speaks")


def test_only_those_named_may_speak(client: Client, made: Callable[..., Heard]) -> None:
    here = client()
    strict = made(only_from=("10.1.0.0/16",))
    here.sendto(b"let me in", strict.gateway.listening)
    assert strict.gateway.receive(10) == []
    assert strict.told == [(REFUSED, f"gateways.ground drops the datagrams of {name(here)}: it is not among only_from "
                            "= ['10.1.0.0/16']")]

    wide = made(listen="0.0.0.0:0", only_from=("127.0.0.0/8",))
    here.sendto(b"hello", ("127.0.0.1", wide.gateway.listening[1]))
    assert wide.gateway.receive(10) == [b"hello"]


def test_it_listens_on_version_6_too(made: Callable[..., Heard]) -> None:
    try:
        heard = made(listen="[::1]:0")
    except OSError:
        pytest.skip("this machine has no IPv6 loopback")
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as here:
        here.bind(("::1", 0))
        here.settimeout(2.0)
        here.sendto(b"hello", heard.gateway.listening)

        assert heard.gateway.receive(10) == [b"hello"]
        heard.gateway.send(b"welcome")
        assert here.recv(100) == b"welcome"
        assert heard.told == [(SPEAKS, f"gateways.ground speaks with [::1]:{here.getsockname()[1]}")]


def test_a_peer_that_floods_is_bounded_and_told_once_and_the_other_is_heard(client: Client,
                                                                           made: Callable[..., Heard]) -> None:
    flooding, other = client(), client()
    heard = made(most_per_s=100)
    for _ in range(150):
        flooding.sendto(b"flood", heard.gateway.listening)
    other.sendto(b"other", heard.gateway.listening)

    taken = heard.gateway.receive(1_000)

    assert taken == [b"flood"] * 100 + [b"other"]
    assert heard.gateway.flooded == 50
    assert heard.kinds == [SPEAKS, FLOODED, SPEAKS]
    heard.now_ns = S // 2                       # credit for 50 more
    for _ in range(60):
        flooding.sendto(b"flood", heard.gateway.listening)
    assert heard.gateway.receive(1_000) == [b"flood"] * 50
    assert heard.kinds == [SPEAKS, FLOODED, SPEAKS]


def test_a_flood_of_addresses_leaves_a_bounded_number_of_events(client: Client, made: Callable[..., Heard]) -> None:
    heard = made(most_peers=1)
    client().sendto(b"first", heard.gateway.listening)
    heard.gateway.receive(10)

    for _ in range(3 * MOST_TOLD):
        client().sendto(b"?", heard.gateway.listening)
        heard.gateway.receive(10)

    assert heard.gateway.refused == 3 * MOST_TOLD
    assert heard.kinds.count(REFUSED) == MOST_TOLD


def test_a_datagram_arrives_when_the_system_takes_it_in_not_when_it_is_read(client: Client) -> None:
    gateway = UdpGateway("ground", "line", UdpSettings())
    client().sendto(b"a", gateway.listening)
    select.select([gateway], [], [], 2.0)
    readable_ns = time.monotonic_ns()
    time.sleep(0.05)                            # the emulator is busy meanwhile

    [(at_ns, data)] = gateway.arrivals(10)

    assert data == b"a"
    assert at_ns <= readable_ns + 5_000_000     # less than the 50 ms; the system may adjust its clock a little
    gateway.close()


def test_it_tells_that_nobody_spoke_unless_it_has_a_peer(client: Client, made: Callable[..., Heard]) -> None:
    alone, spoken_to, has_peer = made(), made(), made(peer="127.0.0.1:9")
    client().sendto(b"a", spoken_to.gateway.listening)
    select.select([spoken_to.gateway], [], [], 2.0)
    spoken_to.gateway.receive(1)

    port = alone.gateway.listening[1]
    assert alone.gateway.alone().startswith(
        f"no program outside the run sent a datagram to 127.0.0.1:{port}, so the gateway sent no frame: ")
    assert spoken_to.gateway.alone() == has_peer.gateway.alone() == ""


def test_without_time_stamps_a_datagram_arrives_when_it_is_read(client: Client, made: Callable[..., Heard]) -> None:
    heard = made()
    heard.gateway._socket.setsockopt(socket.SOL_SOCKET, STAMPED, 0)
    client().sendto(b"a", heard.gateway.listening)
    select.select([heard.gateway], [], [], 2.0)
    heard.now_ns = 7 * S

    assert heard.gateway.arrivals(10) == [(7 * S, b"a")]


def test_an_address_that_is_taken_is_named_with_the_remedy(made: Callable[..., Heard]) -> None:
    gateway = made().gateway
    port = gateway.listening[1]
    with pytest.raises(OSError, match=rf"gateways.other: cannot listen on 127.0.0.1:{port}: Address already in use; "
                       "end the program or run that has it, or listen on another port, 0 for one that the system"):
        UdpGateway("other", "line", UdpSettings("{}:{}".format(*gateway.listening)))
