"""Refuses, in virtual time, every way for a program to communicate other than the ports of its node.

    socket: connect, bind, sendto, sendmsg, look-up of a name --audit event--> _hear  --+
    Zenoh: open, scout (`entrances`) ------------------------replaced--------> _refuse --> OutsideGuard.refuse

A message that bypasses the emulator takes no emulated time and is in no record, so the run's result would not be that
of the emulated network. Sockets of the families in `SOCKETS` are refused, but not a pair of connected Unix sockets, as
asyncio makes one for itself: it leads back to the program.

Invariants:
- Python cannot remove an audit hook, and replaced functions are not restored: both do nothing if `_on_duty`, the guards
  of the runs in progress in this process, is empty;
- a guard watches threads of programs only: all threads of a node's process, or in the host `inline` the thread that
  calls the nodes, during the call, and the threads that are started from there;
- `refusal` keeps the first refusal, so that the host ends the run even if the program has caught the exception.

Not detected: connections that a library in C or Rust opens by itself (gRPC, ZeroMQ), child processes, files, pipes and
serial devices.
Differs from the house rule against module-level state: Python has one list of audit hooks for each process.
"""

from __future__ import annotations

import _thread
import os
import socket
import sys
import sysconfig
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial, wraps
from ipaddress import ip_address
from operator import itemgetter
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, Final, NoReturn
from weakref import WeakSet

from netem.node.turn import Turn

RULE: Final = "in virtual time a program reaches others through the ports of its node only"
REMEDY: Final = "send through a port, or run the scenario with --real-time"
CAN_REMEDY: Final = ('use can.Bus(interface="marconet", channel="...") in a function that is the program, or run the '
                     "scenario with --real-time")
KINDS_OF_SOCKET: Final = {"AF_INET": "an IP socket", "AF_INET6": "an IP socket", "AF_CAN": "a CAN socket",
                          "AF_UNIX": "a Unix socket", "AF_PACKET": "a packet socket",
                          "AF_BLUETOOTH": "a Bluetooth socket", "AF_VSOCK": "a socket of virtual machines"}
SOCKETS: Final = {int(getattr(socket, family)): kind for family, kind in KINDS_OF_SOCKET.items()
                  if hasattr(socket, family)}
VERBS: Final = {"socket.connect": "connecting", "socket.bind": "binding", "socket.sendto": "sending on",
                "socket.sendmsg": "sending on"}
LOOK_UPS: Final = frozenset({"socket.getaddrinfo", "socket.gethostbyname", "socket.gethostbyaddr"})
HEARD: Final = frozenset({*VERBS, *LOOK_UPS})
OWN_PACKAGES: Final = ("agents", "experiments", "firmware_sim", "fmus", "marconet", "netem")

Entrance = tuple[ModuleType, str, str]      # (module, name of a function, what calling it does)


class OutsideRefused(BaseException):
    """A program tried to bypass the emulator. Not an `Exception`, so that a program that retries on errors ends."""


class OutsideGuard(Turn):
    """Watches a run from `begin` to `end`.

    With `whole_process` it watches every thread, as in the process of a node; otherwise the host `inline` sets
    `program_runs` while it calls nodes. `entrances` are functions to refuse, besides sockets.
    """

    def __init__(self, entrances: Sequence[Entrance] = (), *, whole_process: bool = False) -> None:
        super().__init__()
        self._whole_process = whole_process
        self._thread = threading.get_ident()
        self._started: WeakSet[threading.Thread] = WeakSet()
        self._plain: set[int] = set()       # identifiers of threads that were started without `threading.Thread`
        self._entrances = entrances

    def begin(self) -> None:
        """Start to watch; for the host `inline`, the calling thread."""
        self._thread = threading.get_ident()
        post_guards(self._entrances)
        _on_duty.append(self)

    def end(self) -> None:
        if self in _on_duty:
            _on_duty.remove(self)

    def watches(self) -> bool:
        """Return whether the calling thread is running a program."""
        if self._whole_process:
            return True
        if threading.get_ident() == self._thread:
            return self.program_runs
        return threading.get_ident() in self._plain or threading.current_thread() in self._started

    def check(self) -> None:
        """Raise the refusal again if there was one, as the program may have caught it."""
        if self.refusal is not None:
            raise self.refusal

    def with_refusal(self, error: str) -> str:
        """Return the text of a program's error, with the refusal as its last line if there was one."""
        return error if self.refusal is None else f"{error}{self.refusal}"

    def adopt(self, thread: threading.Thread) -> None:
        """Watch `thread` as well if the calling thread, which starts it, runs a program."""
        if self.watches():
            self._started.add(thread)

    @contextmanager
    def watching_this_thread(self) -> Iterator[None]:
        """Watch the calling thread within the `with` block."""
        self._plain.add(threading.get_ident())
        try:
            yield
        finally:
            self._plain.discard(threading.get_ident())

    def refuse(self, doing: str, remedy: str = REMEDY) -> NoReturn:
        """Raise `OutsideRefused` with the program's line, `doing` ("connecting an IP socket") and the remedy."""
        refusal = OutsideRefused(f"{_place()}: {doing} goes past the emulator: {RULE}; {remedy}")
        self.refusal = self.refusal or refusal
        raise refusal


_on_duty: list[OutsideGuard] = []
_hooked: list[bool] = []
_excused: set[int] = set()          # identifiers of threads that are in `excused`


@contextmanager
def excused() -> Iterator[None]:
    """Let the calling thread communicate outside within the `with` block.

    This is for the sockets of a guest whose time the node holds (`firmware_sim/guests`): what passes there takes no
    virtual time because neither side has any meanwhile.
    """
    _excused.add(threading.get_ident())
    try:
        yield
    finally:
        _excused.discard(threading.get_ident())


def post_guards(entrances: Sequence[Entrance]) -> None:
    """Install the audit hook and replace the functions that ask the guards on duty; a second call does nothing.

    The fork server calls it once for all nodes: the search through every module changes reference counts, so a node
    that made it would get its own copy of 7 MB of shared pages.
    """
    if not _hooked:
        _hooked.append(True)
        sys.addaudithook(_hear)
    for module, name, doing in entrances:
        _replace(module, name, partial(_refuse, doing))
    _replace(threading.Thread, "start", _adopt)
    _replace(socket.socket, "listen", _refuse_to_listen)
    _watch_plain_threads()


def refuse_socket(verb: str, family: int, address: Any, remedy: str) -> None:
    """Refuse what the calling thread is about to do with a socket, if it runs a program in virtual time."""
    for guard in _on_duty:
        if guard.watches():
            to = "" if address is None else f" to {_in_words(address)}"
            guard.refuse(f"{verb} {SOCKETS.get(family, 'a socket')}{to}", remedy)


def guarded() -> bool:
    """Return whether a run in virtual time is in progress in this process."""
    return bool(_on_duty)


def _hear(event: str, args: tuple[Any, ...]) -> None:
    if not _on_duty or event not in HEARD or threading.get_ident() in _excused:
        return
    for guard in _on_duty:
        if guard.watches() and (doing := _doing(event, args)):
            guard.refuse(doing, CAN_REMEDY if "a CAN socket" in doing else REMEDY)


def _doing(event: str, args: tuple[Any, ...]) -> str:
    """Describe the action of an audit event; "" if it does not communicate with another process."""
    if event in LOOK_UPS:
        return "" if _is_local(args[0]) else f"looking up the host {args[0]!r}"
    kind = SOCKETS.get(args[0].family)
    address = args[1]
    if kind is None or (address is None and args[0].family == socket.AF_UNIX):
        return ""
    return f"{VERBS[event]} {kind}" + ("" if address is None else f" to {_in_words(address)}")


def _in_words(address: Any) -> str:
    if isinstance(address, tuple) and len(address) in (2, 4):       # (host, port, ...) of an IP socket
        return f"{address[0]}:{address[1]}"
    return str(address[0]) if isinstance(address, tuple) and len(address) == 1 else repr(address)


def _is_local(host: Any) -> bool:
    """Return whether the address of `host` is found without asking another machine."""
    name = host.decode(errors="replace") if isinstance(host, bytes | bytearray) else host
    if name in (None, "", "localhost", "<broadcast>", socket.gethostname()):
        return True
    try:
        ip_address(str(name).partition("%")[0])
    except ValueError:
        return False
    return True


def _refuse(doing: str, *args: Any) -> None:
    if threading.get_ident() in _excused:
        return
    for guard in _on_duty:
        if guard.watches():
            guard.refuse(doing)


def _adopt(thread: threading.Thread) -> None:
    for guard in _on_duty:
        guard.adopt(thread)


def _refuse_to_listen(listener: socket.socket, *args: Any) -> None:
    """Refuse `listen`, which binds a socket that is not bound yet and raises no audit event."""
    _refuse(f"listening on {SOCKETS.get(listener.family, 'a socket')}")


def _watch_plain_threads() -> None:
    """Watch the threads that a program starts with `_thread.start_new_thread`."""
    real = _thread.start_new_thread
    if hasattr(real, "asks_guards"):
        return

    @wraps(real)
    def _start(function: Callable[..., object], *args: Any) -> int:
        watching = [guard for guard in _on_duty if guard.watches()]
        return real(partial(_run_watched, watching, function) if watching else function, *args)

    vars(_start)["asks_guards"] = True
    _thread.start_new_thread = _start


def _run_watched(guards: Sequence[OutsideGuard], function: Callable[..., object], *args: Any, **kwargs: Any) -> None:
    with ExitStack() as stack:
        for guard in guards:
            stack.enter_context(guard.watching_this_thread())
        function(*args, **kwargs)


def _replace(place: Any, name: str, before: Callable[..., None]) -> None:
    """Make `place.name` call `before` first, also in modules that have imported it by a name of their own."""
    real: Callable[..., Any] = getattr(place, name)
    if hasattr(real, "asks_guards"):
        return

    @wraps(real)
    def _wrapped(*args: Any, **kwargs: Any) -> Any:
        before(*args)
        return real(*args, **kwargs)

    vars(_wrapped)["asks_guards"] = True
    setattr(place, name, _wrapped)
    if not isinstance(place, ModuleType):
        return

    for holder in list(sys.modules.values()):
        for known, value in list(getattr(holder, "__dict__", {}).items()):
            if value is real:
                setattr(holder, known, _wrapped)


def _place() -> str:
    """Return file and line of the innermost frame of the author's code, else of an installed or another library."""
    libraries = _folders(sysconfig.get_path(name) for name in ("stdlib", "platstdlib"))
    installed = _folders(sysconfig.get_path(name) for name in ("purelib", "platlib"))
    ours = _folders(str(Path(__file__).parents[2] / package) for package in OWN_PACKAGES)
    frame: FrameType | None = sys._getframe(1)
    found: list[tuple[int, str]] = []
    while frame is not None:
        file = frame.f_code.co_filename
        if not file.startswith("<"):
            rank = (1 if file.startswith(installed) else 3 if file.startswith(libraries) else
                    2 if file.startswith(ours) else 0)
            found.append((rank, f"{_short(file)}:{frame.f_lineno}"))
        frame = frame.f_back
    return min(found, key=itemgetter(0))[1]


def _folders(paths: Iterable[str | None]) -> tuple[str, ...]:
    return tuple(f"{path}{os.sep}" for path in paths)


def _short(file: str) -> str:
    """Return the path of `file`, relative to the current folder if that contains it."""
    here = f"{os.getcwd()}{os.sep}"
    return file.removeprefix(here)
