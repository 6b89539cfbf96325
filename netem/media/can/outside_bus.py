"""A bus of python-can outside the run, served by two threads, as its calls may block.

    reader: open --failed--> wait, open again         writer: messages to send --> bus.send
             |--recv--> messages, a byte to wake the caller                failed: counted
             |--OSError--> lost, open again

Interfaces differ in what can be waited for: some have a descriptor, some none, and `slcan` reads byte by byte and waits
two seconds after opening a device. The threads hide that. `ECHOES` names the interfaces that return what one sends.
"""

from __future__ import annotations

import socket
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from contextlib import suppress
from queue import Empty, Full, Queue
from typing import Any, Final

from netem.gateways import GARBAGE, LOST, MISSING, SPEAKS, UNREAD
from netem.gateways.reconnection import Reconnection
from netem.media.can.frame import CanFrame, MalformedFrame, pack
from netem.wire.level import Level

ECHOES: Final = ("udp_multicast",)
CARRY_ERRORS: Final = ("socketcan", "udp_multicast", "virtual")     # others would send an error as a data frame
LOOK_S: Final = 0.1                 # longest wait of a thread until it sees that it is to end
END_WITHIN_S: Final = 2.0
MOST_WAITING: Final = 10_000        # messages in either direction
GARBAGE_AT_ONCE: Final = 100        # then the reader pauses, so that a flood of garbage leaves time for the run


class OutsideBus:
    def __init__(self, arguments: Mapping[str, Any], reconnection: Reconnection) -> None:
        """`arguments` are those of `can.Bus`."""
        self.arguments = dict(arguments)
        self.heard: deque[bytes] = deque()                      # structs for a port, oldest first
        self.notes: deque[tuple[str, str, Level]] = deque()     # events, whose text follows the gateway's name
        self.garbage = self.overflowed = self.sent = self.unsent = 0
        self.connections = 0
        self.interface = str(arguments["interface"])
        self._reconnection = reconnection
        self._bus: Any = None
        self._sending: Queue[CanFrame] = Queue(MOST_WAITING)
        self._echoes: Counter[bytes] = Counter()
        self._lock = threading.Lock()                           # of `_echoes` and the counters of sent messages
        self._told: set[str] = set()
        self._lost_with = 0
        self._stopping = threading.Event()
        self._mine, self._theirs = socket.socketpair()
        for end in (self._mine, self._theirs):
            end.setblocking(False)
        self._threads = [threading.Thread(target=work, daemon=True, name=f"{self.interface} {work.__name__}")
                         for work in (self._read, self._write)]
        self._open()

    def fileno(self) -> int:
        """Return a descriptor that can be read when there is a message or a note."""
        return self._mine.fileno()

    @property
    def waiting(self) -> int:
        """Number of frames that the writer has not sent yet."""
        return self._sending.qsize()

    def start(self) -> None:
        for thread in self._threads:
            thread.start()

    def take(self) -> None:
        """Make the descriptor silent until there is something new."""
        with suppress(BlockingIOError):
            while self._mine.recv(4096):
                pass

    def wake(self) -> None:
        with suppress(BlockingIOError):         # full, so the other end will wake
            self._theirs.send(b"!")

    def send(self, frame: CanFrame) -> None:
        """Have the writer send a frame; it is counted as not sent if that fails, or if too many wait."""
        if self._bus is None:
            self.unsent += 1
            return
        try:
            self._sending.put_nowait(frame)
        except Full:
            self.unsent += 1
            self._note_once(UNREAD, f"has {MOST_WAITING} frames for {self._in_words()}, which does not take them: "
                            "further ones are dropped and counted until it does")

    def close(self) -> None:
        """End the threads and the bus; a thread that hangs in a call of its interface ends with the process."""
        self._stopping.set()
        end_s = time.monotonic() + END_WITHIN_S
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(max(0.0, end_s - time.monotonic()))
        if self._threads[0].ident is None:
            self._shut_down()
        if not any(thread.is_alive() for thread in self._threads):
            self._mine.close()
            self._theirs.close()

    # --- the reader

    def _open(self) -> None:
        import can

        try:
            self._bus = can.Bus(**self.arguments)
        except Exception as error:          # interfaces raise what their drivers and libraries raise
            if self._reconnection.failed(time.monotonic_ns()):
                self._note(MISSING, f"cannot open {self._in_words()}: {_why(error)}; correct interface, channel or "
                           f"options, or plug it in; {self._reconnection.in_words()}")
            return
        again = f" again; {self.unsent - self._lost_with} frames were lost meanwhile" if (
            self.connections or self._reconnection.told) else ""
        self._reconnection.succeeded()
        self.connections += 1
        self._note(SPEAKS, f"speaks with {self._in_words()}{again}", Level.INFO)

    def _read(self) -> None:
        garbage = 0
        while not self._stopping.is_set():
            if self._bus is None:
                wait_ns = self._reconnection.due_ns - time.monotonic_ns()
                if not self._stopping.wait(max(0.0, min(wait_ns * 1e-9, LOOK_S))) and wait_ns <= 0:
                    self._open()
                continue
            try:
                message = self._bus.recv(LOOK_S)
                if message is None:
                    continue
                data = packed(message)
            except Exception as error:
                if _caused_by(error, OSError):      # the system has failed, not what came in
                    self._lose(error)
                    continue
                self._count_garbage(error)
                garbage += 1
                if garbage % GARBAGE_AT_ONCE == 0:
                    self._stopping.wait(0.001)
                continue
            if self._is_echo(data):
                continue
            if len(self.heard) >= MOST_WAITING:
                self.overflowed += 1
            else:
                self.heard.append(data)
                self.wake()
        self._shut_down()

    def _lose(self, error: Exception) -> None:
        self._shut_down()
        self._note(LOST, f"has lost {self._in_words()}: {_why(error)}; {self._reconnection.in_words()}")
        self._reconnection.failed(time.monotonic_ns())
        self._lost_with = self.unsent
        with self._lock:
            self._echoes.clear()

    def _count_garbage(self, error: Exception) -> None:
        self.garbage += 1
        if _caused_by(error, UnicodeDecodeError) and hasattr(self._bus, "flush"):
            with suppress(Exception):
                self._bus.flush()           # slcan keeps what it could not decode
        self._note_once(GARBAGE, f"gets what is no CAN frame from {self._in_words()}: {_why(error)}; it is dropped and "
                        "counted")

    def _is_echo(self, data: bytes) -> bool:
        if self.interface not in ECHOES:
            return False
        with self._lock:
            if not self._echoes[data]:
                del self._echoes[data]
                return False
            self._echoes[data] -= 1
            return True

    def _shut_down(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            with suppress(Exception):
                bus.shutdown()

    # --- the writer

    def _write(self) -> None:
        while not self._stopping.is_set():
            try:
                frame = self._sending.get(timeout=LOOK_S)
            except Empty:
                continue
            bus = self._bus
            if bus is None:
                self.unsent += 1
                continue
            message = message_of(frame)
            with self._lock:
                if self.interface in ECHOES:
                    self._echoes[pack(frame)] += 1
            try:
                bus.send(message, timeout=LOOK_S)
            except Exception as error:
                with self._lock:
                    self._echoes.pop(pack(frame), None)
                self.unsent += 1
                self._note_once(UNREAD, f"cannot send to {self._in_words()}: {_why(error)}; such frames are dropped "
                                "and counted")
            else:
                self.sent += 1

    # --- notes

    def _note(self, kind: str, text: str, level: Level = Level.WARNING) -> None:
        self.notes.append((kind, text, level))
        self.wake()

    def _note_once(self, kind: str, text: str) -> None:
        if kind not in self._told:
            self._told.add(kind)
            self._note(kind, text)

    def _in_words(self) -> str:
        channel = self.arguments.get("channel")
        return self.interface if channel is None else f"{self.interface} {channel}"


def interfaces() -> frozenset[str]:
    """Return the names of the interfaces of python-can, with those of plug-ins."""
    from can.interfaces import VALID_INTERFACES

    return frozenset(VALID_INTERFACES)


def message_of(frame: CanFrame) -> Any:
    """Return python-can's message with the content of `frame`."""
    import can

    return can.Message(
        arbitration_id=frame.can_id, is_extended_id=frame.extended, is_remote_frame=frame.remote,
        is_error_frame=frame.error, is_fd=frame.fd, bitrate_switch=frame.bit_rate_switch,
        error_state_indicator=frame.error_state, dlc=len(frame.data) if frame.fd or not frame.remote else frame.dlc,
        data=frame.data)


def packed(message: Any) -> bytes:
    """Return the struct for a port. Raises MalformedFrame if `message` is no frame that a bus can carry."""
    try:
        return pack(CanFrame(message.arbitration_id, bytes(message.data), bool(message.is_extended_id),
                             bool(message.is_remote_frame), bool(message.is_fd), bool(message.bitrate_switch),
                             bool(message.error_state_indicator), -1 if message.is_fd else message.dlc,
                             bool(message.is_error_frame)))
    except (TypeError, ValueError, AttributeError) as error:
        raise MalformedFrame(str(error)) from error


def _caused_by(error: BaseException | None, kind: type[Exception]) -> bool:
    while error is not None:
        if isinstance(error, kind):
            return True
        error = error.__cause__
    return False


def _why(error: BaseException) -> str:
    text = str(error) or type(error).__name__
    return " ".join(text.split())[:200]
