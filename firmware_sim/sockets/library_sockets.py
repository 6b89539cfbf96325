"""The standard library's sockets, selectors and event loops in threads of a blocking program.

    socket     socket: UDP over IPv4 if the scenario names a medium for it; socketpair; names of nodes as hosts
    select     select, poll; epoll is refused by name       selectors   every selector is a `VirtualSelector`
    asyncio    the event loop of the library with such a selector; signals; starting child processes is refused

An event loop needs no class of its own: it makes its selector by `selectors.DefaultSelector`, wakes itself by a pair of
sockets and reads `time.monotonic`. The class `socket.socket` stays what it is, so that names kept before and
`isinstance` are right: its constructor chooses by the thread that calls it.
"""

from __future__ import annotations

import asyncio
import select
import selectors
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ipaddress import AddressValueError, IPv4Address
from typing import Any, Final, NoReturn

from firmware_sim.blocking.here import running
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.replacing import Replacement, Replacements
from firmware_sim.sockets.pair_socket import PairSocket
from firmware_sim.sockets.readiness import VirtualPoll, VirtualSelector, select_virtually
from firmware_sim.sockets.stack import stack_of
from firmware_sim.sockets.udp_socket import UdpSocket
from firmware_sim.sockets.virtual_files import refuse
from netem.node.outside_guard import refuse_socket

_new_socket = socket.socket.__new__
_new_selector = selectors.BaseSelector.__new__
_getaddrinfo, _gethostbyname, _gethostname = socket.getaddrinfo, socket.gethostbyname, socket.gethostname
_gethostbyname_ex, _gethostbyaddr, _socketpair = socket.gethostbyname_ex, socket.gethostbyaddr, socket.socketpair
_poll = select.poll
NO_MEDIUM: Final = ('say in the scenario which medium carries its datagrams, [agents.NAME] sockets = { MEDIUM = "ip" '
                    "}, or run it with --real-time")
NO_TCP: Final = "there is no TCP in virtual time: use UDP, or run the scenario with --real-time"
NO_CHILD: Final = "its pipes would wait for the operating system; use asyncio.to_thread with subprocess.run"
SELECTORS: Final = tuple(getattr(selectors, name) for name in ("SelectSelector", "PollSelector", "EpollSelector",
                                                               "DevpollSelector") if hasattr(selectors, name))
Loop: Final = asyncio.SelectorEventLoop


class OutsideSocket(socket.socket):
    """An IP socket of a blocking program that leads to no medium: in virtual time it is refused when it is used."""

    def bind(self, address: Any) -> None:
        self._refuse("binding", address)
        super().bind(address)

    def connect(self, address: Any) -> None:
        self._refuse("connecting", address)
        super().connect(address)

    def connect_ex(self, address: Any) -> int:
        self._refuse("connecting", address)
        return super().connect_ex(address)

    def sendto(self, data: Any, *flags_and_address: Any) -> int:
        self._refuse("sending on", flags_and_address[-1] if flags_and_address else None)
        return super().sendto(data, *flags_and_address)

    def sendmsg(self, *args: Any) -> int:
        self._refuse("sending on", args[3] if len(args) > 3 else None)
        return super().sendmsg(*args)

    def listen(self, *args: Any) -> None:
        self._refuse("listening on", None)
        super().listen(*args)

    def _refuse(self, verb: str, address: Any) -> None:
        refuse_socket(verb, self.family, address, NO_TCP if self.type == socket.SOCK_STREAM else NO_MEDIUM)


def _socket(cls: type[socket.socket], *args: Any, **kwargs: Any) -> socket.socket:
    """Replace `socket.socket.__new__`."""
    program = running()
    if program is None or cls is not socket.socket:
        return _new_socket(cls)
    made = _make(program, *args, **kwargs)
    return _new_socket(cls) if made is None else made


def _make(program: BlockingProgram, family: int = -1, type: int = -1, proto: int = -1,
          fileno: int | None = None) -> socket.socket | None:
    """Return a socket of another class than the library's, not initialized; None for a plain one."""
    family = socket.AF_INET if family == -1 else family
    if fileno is not None or family not in (socket.AF_INET, socket.AF_INET6):
        return None
    kind = (socket.SOCK_STREAM if type == -1 else type) & 0xF
    if family == socket.AF_INET and kind == socket.SOCK_DGRAM and proto in (-1, 0, socket.IPPROTO_UDP) \
            and program.interfaces:
        return _new_socket(UdpSocket)
    outside = _new_socket(OutsideSocket)
    program.files.add(outside)
    return outside


def _selector(cls: type[selectors.BaseSelector], *args: Any, **kwargs: Any) -> Any:
    """Replace `__new__` of the library's selectors."""
    if cls in SELECTORS and running() is not None:
        return VirtualSelector()
    return _new_selector(cls)


def _pair(program: BlockingProgram, family: int | None = None, type: int = socket.SOCK_STREAM,
          proto: int = 0) -> tuple[socket.socket, socket.socket]:
    if family not in (None, socket.AF_UNIX):
        return _socketpair(family, type, proto)         # raises what it always did
    return PairSocket.pair(program, type)


def _select(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    return select_virtually(program, *args, **kwargs)


def _make_poll(program: BlockingProgram) -> VirtualPoll:
    return VirtualPoll()


def _epoll(program: BlockingProgram, *args: Any, **kwargs: Any) -> NoReturn:
    refuse("select.epoll", "use select.poll, select.select or selectors.DefaultSelector")


# --- names

def _known(program: BlockingProgram, host: Any) -> Any:
    """Return the number of a node's name; anything else as it is."""
    name = host.decode(errors="replace") if isinstance(host, bytes | bytearray) else host
    if not program.interfaces or not isinstance(name, str):
        return host
    found = stack_of(program).hosts.get(name)
    return host if found is None else str(found)


def _addresses(program: BlockingProgram, host: Any, *args: Any, **kwargs: Any) -> Any:
    return _getaddrinfo(_known(program, host), *args, **kwargs)


def _by_name(program: BlockingProgram, name: str) -> str:
    return _gethostbyname(_known(program, name))


def _by_name_ex(program: BlockingProgram, name: str) -> tuple[str, list[str], list[str]]:
    number = _known(program, name)
    return _gethostbyname_ex(name) if number == name else (name, [], [number])


def _by_address(program: BlockingProgram, address: str) -> tuple[str, list[str], list[str]]:
    number = _known(program, address)
    try:
        name = stack_of(program).name_of(IPv4Address(number)) if program.interfaces else None
    except AddressValueError:
        name = None
    return _gethostbyaddr(address) if name is None else (name, [], [number])


def _own_name(program: BlockingProgram) -> str:
    return program.node.name if program.interfaces else _gethostname()


# --- asyncio

def _add_signal_handler(program: BlockingProgram, loop: asyncio.AbstractEventLoop, number: int,
                        callback: Callable[..., object], *args: Any) -> None:
    program.handlers[number] = lambda number, frame: loop.call_soon_threadsafe(callback, *args)


def _remove_signal_handler(program: BlockingProgram, loop: asyncio.AbstractEventLoop, number: int) -> bool:
    return program.handlers.pop(number, None) is not None


def _getsignal(program: BlockingProgram, number: int) -> Any:
    return program.handlers.get(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)


def _no_child(program: BlockingProgram, loop: asyncio.AbstractEventLoop, *args: Any, **kwargs: Any) -> NoReturn:
    refuse("starting a child process in asyncio", NO_CHILD)


SOCKETS: Final[list[Replacement]] = [
    (socket, "socketpair", _pair),
    (socket, "getaddrinfo", _addresses),
    (socket, "gethostbyname", _by_name),
    (socket, "gethostbyname_ex", _by_name_ex),
    (socket, "gethostbyaddr", _by_address),
    (socket, "gethostname", _own_name),
    (select, "select", _select),
    (select, "poll", _make_poll),
    (select, "epoll", _epoll),
    (signal, "getsignal", _getsignal),
    (Loop, "add_signal_handler", _add_signal_handler),
    (Loop, "remove_signal_handler", _remove_signal_handler),
    (asyncio.BaseEventLoop, "subprocess_exec", _no_child),
    (asyncio.BaseEventLoop, "subprocess_shell", _no_child),
]
CONSTRUCTORS: Final[list[tuple[type, Callable[..., Any]]]] = [
    (socket.socket, _socket),
    (selectors._BaseSelectorImpl, _selector),
]
_replacements: Final = Replacements(SOCKETS, CONSTRUCTORS)


@contextmanager
def sockets_in_virtual_time(*, everywhere: bool = False) -> Iterator[None]:
    """Within this context threads of blocking programs get these sockets; `everywhere`: see `Replacements.in_place`."""
    with _replacements.in_place(everywhere=everywhere):
        yield
