"""The same scripts on the loopback's real sockets and real event loops, and in virtual time: they tell the same.

Each script gets `told`, to which it appends what it saw, and the address that stands for this host.
"""

from __future__ import annotations

import asyncio
import contextlib
import select
import selectors
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from tests.firmware_sim.sockets.conftest import LAN, run

HOST = "127.0.0.1"
Told = list[Any]


def pair() -> tuple[socket.socket, socket.socket, tuple[str, int]]:
    """Two UDP sockets, and the address of the second."""
    here, there = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    there.bind((HOST, 0))
    return here, there, there.getsockname()


def error_of(call: Callable[..., Any], *args: Any) -> Any:
    try:
        return call(*args)
    except (OSError, ValueError, TypeError, OverflowError) as error:
        return type(error).__name__, getattr(error, "errno", None)


# --- scripts

def datagrams_keep_their_borders(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        for data in (b"one", b"", bytearray(b"three"), memoryview(b"four!")):
            told.append(here.sendto(data, address))
        for _ in range(4):
            data, sender = there.recvfrom(100)
            told.append((data, sender[0] == HOST, sender[1] == here.getsockname()[1]))


def a_long_datagram_is_cut_and_its_rest_is_gone(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        for data in (b"abcdefgh", b"next", b"peeked", b"truncated", b"into"):
            here.sendto(data, address)
        told.append(there.recv(3))
        told.append(there.recv(100))
        told.append((there.recv(100, socket.MSG_PEEK), there.recv(100)))
        buffer = bytearray(4)
        told.append((there.recv_into(buffer, 4, socket.MSG_TRUNC), bytes(buffer)))
        told.append((there.recvfrom_into(buffer)[0], bytes(buffer)))


def timeouts_and_blocking(told: Told) -> None:
    here, there, _address = pair()
    with here, there:
        told.append((there.gettimeout(), there.getblocking(), there.timeout))
        there.settimeout(0.02)
        told.append((error_of(there.recv, 10), there.gettimeout(), there.getblocking()))
        told.append(error_of(there.recv, 10, socket.MSG_DONTWAIT))
        there.setblocking(False)
        told.append((error_of(there.recvfrom, 10), there.gettimeout()))
        told.append(error_of(there.settimeout, -1))


def names_of_both_ends(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        told.append((here.getsockname(), error_of(here.getpeername), there.fileno() >= 0))
        here.connect(address)
        told.append((here.getpeername() == address, here.getsockname()[0], here.getsockname()[1] > 0))
        told.append((here.send(b"by send"), there.recv(20)))
        stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        stranger.sendto(b"not for a connected socket", here.getsockname())
        told.append(error_of(here.recv, 10, socket.MSG_DONTWAIT))
        there.sendto(b"answer", here.getsockname())
        told.append(here.recv(20))
        stranger.close()


def mistakes(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        told.append(error_of(here.send, b"nowhere"))
        told.append(error_of(here.sendto, b"x" * 65_508, address))
        told.append(error_of(here.sendto, b"x", (HOST, 0)))
        told.append(error_of(here.sendto, b"x", (HOST, 70_000)))
        told.append(error_of(here.sendto, b"x", HOST))
        told.append(error_of(here.sendto, "text", address))
        told.append(error_of(here.bind, address))
        told.append(error_of(there.bind, (HOST, 0)))
        told.append(error_of(here.bind, ("203.0.113.9", 0)))
        told.append(error_of(here.sendto, b"x", ("255.255.255.255", 9)))
        told.append(error_of(here.recv, -1))
        told.append(error_of(here.shutdown, socket.SHUT_RDWR))
    told.append(error_of(here.recv, 10))
    told.append((here.fileno(), error_of(here.sendto, b"x", address)))


def one_port_for_several_sockets(told: Told) -> None:
    first, second = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    with first, second:
        for one in (first, second):
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        told.append(first.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR))
        first.bind((HOST, 0))
        told.append(error_of(second.bind, first.getsockname()))


def options(told: Told) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 10_000)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        told.append([one.getsockopt(socket.SOL_SOCKET, option) for option in (
            socket.SO_RCVBUF, socket.SO_BROADCAST, socket.SO_TYPE, socket.SO_ERROR)])
        told.append((isinstance(one, socket.socket), one.family, one.type, one.proto))
        told.append(error_of(one.setsockopt, socket.SOL_SOCKET, socket.SO_RCVBUF, "much"))


def select_waits(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        told.append(select.select([there], [], [], 0.01))
        here.sendto(b"x", address)
        told.append(select.select([there, here.fileno()], [here], [], 1.0) == ([there], [here], []))
        told.append(select.select([there.fileno()], [], [])[0] == [there.fileno()])
        told.append(select.select([], [], [], 0.01))
        told.append((error_of(select.select, [-1], [], [], 0), error_of(select.select, [], [], [], -1)))
        poll = select.poll()
        poll.register(there, select.POLLIN)
        told.append(poll.poll(10) == [(there.fileno(), select.POLLIN)])
        there.recv(10)
        told.append(poll.poll(10))
        with selectors.DefaultSelector() as selector:
            selector.register(there, selectors.EVENT_READ, "data")
            told.append(selector.select(0.01))
            here.sendto(b"x", address)
            told.append([(key.data, events) for key, events in selector.select(1.0)])


def a_thread_that_receives(told: Told) -> None:
    here, there, address = pair()
    with here, there:
        def receive() -> None:
            while (data := there.recv(100)) != b"end":
                told.append(data)

        thread = threading.Thread(target=receive)
        thread.start()
        for k in range(3):
            here.sendto(b"%d" % k, address)
        here.sendto(b"end", address)
        thread.join()


def a_pair_of_sockets(told: Told) -> None:
    here, there = socket.socketpair()
    with here, there:
        here.sendall(b"abc")
        here.sendall(b"def")
        told.append((there.recv(2), there.recv(100)))
        there.setblocking(False)
        told.append(error_of(there.recv, 10))
        here.shutdown(socket.SHUT_WR)
        told.append((there.recv(10), there.send(b"back"), here.recv(10)))
    told.append(error_of(here.send, b"x"))
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with here, there:
        here.send(b"abc")
        here.send(b"def")
        told.append((there.recv(2), there.recv(100)))


def host_names(told: Told) -> None:
    told.append(socket.getaddrinfo("127.0.0.1", 80, socket.AF_INET, socket.SOCK_DGRAM))
    told.append((socket.gethostbyname("127.0.0.1"), socket.gethostbyname("localhost")))
    told.append(error_of(socket.getaddrinfo, "127.0.0.1", "no such service"))


def asyncio_of_all_kinds(told: Told) -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        queue: asyncio.Queue[tuple[bytes, str]] = asyncio.Queue()

        class Echo(asyncio.DatagramProtocol):
            def connection_made(self, transport: Any) -> None:
                self.transport = transport

            def datagram_received(self, data: bytes, addr: Any) -> None:
                self.transport.sendto(data.upper(), addr)

        class Hear(asyncio.DatagramProtocol):
            def datagram_received(self, data: bytes, addr: Any) -> None:
                queue.put_nowait((data, addr[0]))

        server, _ = await loop.create_datagram_endpoint(Echo, local_addr=(HOST, 0))
        client, _ = await loop.create_datagram_endpoint(Hear, remote_addr=server.get_extra_info("sockname"))
        client.sendto(b"hello")
        told.append(await asyncio.wait_for(queue.get(), 5.0))
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(queue.get(), 0.02)
            told.append("never")
        told.append(await loop.run_in_executor(None, lambda: time.sleep(0.01) or "from a thread"))
        told.append(await asyncio.to_thread(lambda: threading.current_thread() is threading.main_thread()))
        done = asyncio.Event()
        threading.Timer(0.01, loop.call_soon_threadsafe, (done.set,)).start()
        await done.wait()
        order: list[int] = []
        await asyncio.gather(*(asyncio.sleep(delay, order.append(delay)) for delay in (0.02, 0.01, 0)))
        loop.call_later(0.02, order.append, 3)
        loop.call_later(0.01, order.append, 2)
        await asyncio.sleep(0.03)
        told.append(order)
        raw, there, address = pair()
        with raw, there:
            there.setblocking(False)
            raw.sendto(b"raw", address)
            told.append(await loop.sock_recv(there, 100))
        told.append([isinstance(each, Exception) for each in await asyncio.gather(
            asyncio.sleep(0), loop.create_datagram_endpoint(Hear, local_addr=("203.0.113.9", 0)),
            return_exceptions=True)])
        client.close()
        server.close()

    asyncio.run(main())
    loop = asyncio.new_event_loop()
    told.append(loop.run_until_complete(asyncio.sleep(0.001, "own loop")))
    loop.close()


SCRIPTS = [datagrams_keep_their_borders, a_long_datagram_is_cut_and_its_rest_is_gone, timeouts_and_blocking,
           names_of_both_ends, mistakes, one_port_for_several_sockets, options, select_waits, a_thread_that_receives,
           a_pair_of_sockets, host_names, asyncio_of_all_kinds]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.__name__)
def test_a_script_tells_the_same_in_virtual_time(begin, script):
    really: Told = []
    virtually: Told = []

    thread = threading.Thread(target=script, args=(really,))       # this thread belongs to no program
    thread.start()
    thread.join(20)
    run(begin(lambda: script(virtually), LAN))

    assert really
    assert virtually == really


def test_a_full_buffer_drops_the_newest_and_counts_it(begin):
    received: list[bytes] = []

    def main() -> None:
        here, there, address = pair()
        there.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 5_000)    # Linux doubles it: 10 000 bytes
        for k in range(20):
            here.sendto(bytes([k]) * 168, address)                      # 1000 bytes each with its overhead
        there.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                received.append(there.recv(2000))

    run(begin(main, LAN))

    assert [data[0] for data in received] == list(range(10))
