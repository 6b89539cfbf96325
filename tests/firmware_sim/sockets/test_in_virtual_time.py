"""What only virtual time has: instants, promises, frames on the port, refusals by name."""

from __future__ import annotations

import asyncio
import select
import socket
import time
from ipaddress import IPv4Address

import pytest

from firmware_sim.sockets.udp_packet import UdpPacket, pack_ip, unpack_ip
from firmware_sim.sockets.virtual_files import NotInVirtualTime
from netem.wire.instants import NEVER_NS
from tests.firmware_sim.sockets.conftest import BARE, LAN, run

MS = 1_000_000
HERE, THERE = IPv4Address("10.0.0.1"), IPv4Address("10.0.0.2")


def udp(port: int = 5000, host: str = "") -> socket.socket:
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.bind((host, port))
    return one


def from_other(payload: bytes, port: int = 5000, destination: IPv4Address = HERE) -> bytes:
    return pack_ip(UdpPacket(THERE, 4000, destination, port, payload), 0)


def counters(program) -> dict[str, int]:
    return {name: count for name, count in program.node.counters().items() if count}


# --- IP

def test_a_datagram_is_an_ip_packet_at_the_instant_of_sending(begin):
    def main():
        time.sleep(0.001)
        udp().sendto(b"hello", ("other", 6000))

    report = run(begin(main, LAN))

    (time_ns, port, data), = report.offers
    assert (time_ns, port) == (MS, 0)
    assert unpack_ip(data) == UdpPacket(HERE, 5000, THERE, 6000, b"hello")


def test_a_datagram_is_received_at_its_arrival_and_waiting_for_it_is_a_soft_promise(begin):
    got = []

    def main():
        one = udp()
        one.settimeout(0.5)
        got.append((one.recvfrom(100), time.monotonic()))
        one.recv(100)

    program = begin(main, LAN)
    report = run(program, 2 * MS, [(MS, 0, from_other(b"hi"))])

    assert got == [((b"hi", ("10.0.0.2", 4000)), 0.001)]
    assert (report.soft_ns, report.firm_ns) == (501 * MS, 0)


def test_ports_addresses_and_damage_are_told_apart_and_counted(begin):
    got = []

    def main():
        with udp(5000) as one, udp(5001, "10.0.0.1") as other:
            time.sleep(0.01)
            for each in (one, other):
                each.setblocking(False)
                while select.select([each], [], [], 0)[0]:
                    got.append((each.getsockname()[1], each.recv(10)))

    broken = bytearray(from_other(b"broken"))
    broken[-1] ^= 1
    frames = [from_other(b"a"), from_other(b"b", 5001), from_other(b"c", 5002), bytes(broken), b"noise",
              from_other(b"d", destination=THERE), from_other(b"e", destination=IPv4Address("10.0.255.255")),
              from_other(b"f", 5001, IPv4Address("255.255.255.255"))]
    program = begin(main, LAN)
    run(program, 100 * MS, [(MS * k, 0, frame) for k, frame in enumerate(frames, 1)])

    assert got == [(5000, b"a"), (5000, b"e"), (5001, b"b")]        # one bound to an address hears no broadcast
    assert counters(program) == {"lan.no_socket": 2, "lan.malformed": 2, "lan.other_address": 1}


def test_what_goes_to_nobody_is_counted_and_what_has_no_network_is_refused(begin):
    errors = []

    def main():
        one = udp()
        one.sendto(b"x", ("10.0.9.9", 1))
        for host in ("203.0.113.9", "224.0.0.1"):
            try:
                one.sendto(b"x", (host, 1))
            except OSError as error:
                errors.append(str(error))

    program = begin(main, LAN)
    report = run(program)

    assert report.offers == []
    assert counters(program) == {"lan.no_host": 1}
    assert "Network is unreachable: 203.0.113.9 is in no network of node robot (10.0.0.1 in 10.0.0.0/16 on lan)" \
        in errors[0]
    assert "multicast (224.0.0.1) is not there in virtual time: send to the broadcast address" in errors[1]


def test_a_broadcast_needs_its_option_goes_out_once_and_comes_back_to_its_own_sockets(begin):
    got = []

    def main():
        one = udp()
        with pytest.raises(PermissionError):
            one.sendto(b"x", ("10.0.255.255", 5000))
        one.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        for host in ("<broadcast>", "10.0.255.255"):
            one.sendto(host.encode(), (host, 5000))
            got.append(one.recvfrom(100))

    report = run(begin(main, LAN))

    assert [unpack_ip(data).destination for _, _, data in report.offers] == [
        IPv4Address("255.255.255.255"), IPv4Address("10.0.255.255")]
    assert got == [(b"<broadcast>", ("10.0.0.1", 5000)), (b"10.0.255.255", ("10.0.0.1", 5000))]


def test_what_a_program_says_to_itself_is_no_frame(begin):
    got = []

    def main():
        one = udp()
        for host in ("127.0.0.1", "localhost", "10.0.0.1", "robot", ""):
            one.sendto(host.encode(), (host, 5000))
            got.append(one.recvfrom(100))

    report = run(begin(main, LAN))

    assert report.offers == []
    assert [source for _, (source, _) in got] == ["127.0.0.1", "127.0.0.1", "10.0.0.1", "10.0.0.1", "127.0.0.1"]


def test_nodes_have_names(begin):
    found = []

    def main():
        found.append((socket.gethostname(), socket.getfqdn("other"), socket.gethostbyname("other"),
                      socket.gethostbyaddr("10.0.0.2"), socket.gethostbyname_ex("robot"),
                      socket.getaddrinfo("other", 80, type=socket.SOCK_DGRAM)[0][4]))

    run(begin(main, LAN))

    assert found == [("robot", "other", "10.0.0.2", ("other", [], ["10.0.0.2"]), ("robot", [], ["10.0.0.1"]),
                      ("10.0.0.2", 80))]


# --- bare

def test_bare_datagrams_are_frames_whatever_the_address_and_come_back_from_there(begin):
    got = []

    def main():
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        one.sendto(b"out", ("192.168.4.1", 14550))
        got.append(one.recvfrom(100))
        other = udp(14551, "0.0.0.0")
        got.append(other.recvfrom(100))

    program = begin(main, BARE)
    report = run(program, 100 * MS, [(MS, 0, b"in"), (2 * MS, 0, b"again")])

    assert [data for _, _, data in report.offers] == [b"out"]
    assert got == [(b"in", ("192.168.4.1", 14550)), (b"again", ("127.0.0.1", 1))]


def test_with_both_an_address_of_a_network_goes_there_and_the_rest_goes_bare(begin):
    def main():
        one = udp()
        one.sendto(b"bare", ("127.0.0.1", 14550))
        one.sendto(b"ip", ("other", 14550))

    report = run(begin(main, LAN, BARE))

    assert [(port, data[-4:]) for _, port, data in report.offers] == [(1, b"bare"), (0, report.offers[1][2][-4:])]
    assert unpack_ip(report.offers[1][2]).payload == b"ip"


# --- waiting

def test_select_ends_at_the_instant_of_the_time_out_or_of_the_frame(begin):
    times = []

    def main():
        one = udp()
        for _ in range(3):
            times.append((bool(select.select([one], [], [], 0.005)[0]), time.monotonic_ns()))
        one.recv(10)

    run(begin(main, LAN), 100 * MS, [(7 * MS, 0, from_other(b"x"))])

    assert times == [(False, 5 * MS), (True, 7 * MS), (True, 7 * MS)]


def test_an_event_loop_without_sockets_promises_firmly(begin):
    async def main():
        await asyncio.sleep(0.25)

    report = run(begin(main, LAN), MS)

    assert report.firm_ns == 250 * MS


def test_an_event_loop_ends_at_the_end_of_the_run_by_the_ctrl_c_of_asyncio_run(begin):
    ended = []

    async def main():
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            ended.append(time.monotonic())
            raise

    program = begin(main, LAN)
    run(program, 1000 * MS)
    run(program, 1000 * MS, last=True)

    assert ended == [1.0]
    assert program.over


def test_a_loop_that_polls_lets_time_pass(begin):
    def main():
        one = udp()
        one.setblocking(False)
        while True:
            try:
                return one.recv(10)
            except BlockingIOError:
                pass

    program = begin(main, LAN)
    run(program, 100 * MS, [(20 * MS, 0, from_other(b"x"))])

    assert program.over


# --- refusals

@pytest.mark.parametrize(("call", "what"), [
    (lambda one: one.sendmsg([b"x"]), "sendmsg is not there in virtual time: join the parts and use send or sendto"),
    (lambda one: one.recvmsg(10), "recvmsg is not there in virtual time: use recv or recvfrom"),
    (lambda one: one.listen(), "listen is not there in virtual time: there is no TCP; use datagrams"),
    (lambda one: one.dup(), "dup is not there in virtual time"),
    (lambda one: one.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, bytes(8)),
     "the socket option IP_ADD_MEMBERSHIP is not there in virtual time: there is no multicast"),
    (lambda one: one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, bytes(16)),
     "the socket option SO_RCVTIMEO is not there in virtual time: use settimeout"),
    (lambda one: select.epoll(), "select.epoll is not there in virtual time: use select.poll"),
    (lambda one: select.select([one, 0], [], [], 0.1), "the descriptor 0 together with sockets is not there"),
    (lambda one: asyncio.run(asyncio.create_subprocess_exec("true")), "starting a child process in asyncio is not"),
])
def test_what_is_not_there_is_refused_by_name_and_told_in_the_run(begin, call, what):
    errors = []

    def main():
        for _ in range(2):
            try:
                call(udp(0))
            except NotInVirtualTime as error:
                errors.append(str(error))

    report = run(begin(main, LAN))

    assert len(errors) == 2
    assert what in errors[0]
    assert [event[1] for event in report.events] == ["not in virtual time"]      # once
    assert what in report.events[0][2]


def test_promises_of_a_program_that_only_waits_for_a_pair_of_sockets_are_firm(begin):
    def main():
        _here, there = socket.socketpair()
        there.recv(1)

    assert run(begin(main, LAN), MS).firm_ns == NEVER_NS


def test_sockets_of_other_threads_are_the_librarys(begin):
    begin(lambda: None, LAN)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        assert type(one) is socket.socket
