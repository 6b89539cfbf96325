"""A serial device, or a pseudo-terminal that the gateway makes, as a gateway: what is read at once is one message.

    device = "/dev/ttyUSB0"         opened with pyserial, for this run alone; tried again if it is missing, busy or lost
    pty = "modem"                   a symbolic link to a new pseudo-terminal, which any program opens like a device

The bytes of a real device take their time on its wire; those of a pseudo-terminal take none. In both cases the medium
then adds its own delay, so a `serial_line` behind a device should be much faster than the device.

The gateway knows by polling, every POLL_NS, whether a program has the pseudo-terminal open. While none has, frames are
dropped and counted, so that a program does not begin with old bytes.

Not modelled: parity, flow control, modem lines and break of a device.
"""

from __future__ import annotations

import errno
import os
import select
import termios
import time
import tty
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final

from netem.gateways import GONE, LOST, MISSING, SPEAKS, Datagrams, GatewaySettings, Tell, tell_nobody
from netem.gateways.reconnection import Reconnection, wrong_times
from netem.gateways.stream import StreamGateway, StreamPeer
from netem.gateways.tcp import NO_CAN
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

ONE_OF: Final = "expected one of device = \"/dev/ttyUSB0\" and pty = \"path of the link to make\""
POLL_NS: Final = 20_000_000


@dataclass(frozen=True)
class SerialSettings(GatewaySettings):
    """One of `device` and `pty`."""

    device: Path | None = None
    pty: Path | None = None             # a symbolic link that the gateway makes, and removes at the end
    baud_bps: int = 115_200             # of a device
    retry_ns: int = 500_000_000         # from a lost device to the first attempt to open it again
    retry_longest_ns: int = 5_000_000_000
    most_bytes_per_s: int = 10_000_000

    def __post_init__(self) -> None:
        wrong = []
        if (self.device is None) is (self.pty is None):
            wrong.append(ONE_OF)
        if self.baud_bps < 1:
            wrong.append(f"baud_bps={self.baud_bps}: expected at least 1")
        if self.most_bytes_per_s < 1:
            wrong.append(f"most_bytes_per_s={self.most_bytes_per_s}: expected at least 1")
        wrong += wrong_times(self.retry_ns, self.retry_longest_ns)
        if wrong:
            raise ValueError("\n".join(wrong))

    def occupies(self) -> Collection[str]:
        return (f"the device {self.device}",) if self.device is not None else (f"the link {self.pty}",)

    def refusal(self, *, carries_can_frames: bool, datagrams: Datagrams | None) -> str:
        return NO_CAN if carries_can_frames else ""


class DescriptorChannel:
    """The descriptor of a terminal."""

    def __init__(self, descriptor: int, close: Callable[[], None]) -> None:
        self._descriptor, self._close = descriptor, close

    def fileno(self) -> int:
        return self._descriptor

    def read(self, most: int) -> bytes | None:
        try:
            return os.read(self._descriptor, most)
        except BlockingIOError:
            return None

    def write(self, data: bytes) -> int:
        try:
            return os.write(self._descriptor, data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._close()


class PseudoTerminal:
    """A pseudo-terminal without echo or line editing, and a symbolic link to it."""

    def __init__(self, link: Path) -> None:
        """Raises OSError with the reason and a remedy if the link cannot be made."""
        self.link = link
        self.master, slave = os.openpty()
        self.path = os.ttyname(slave)
        try:
            tty.setraw(slave)               # stays in force while the master is open, whoever opens the slave
            os.set_blocking(self.master, False)
            if link.is_symlink() and not link.exists():
                link.unlink()               # left by a run that was killed
            link.symlink_to(self.path)
        except OSError as error:
            os.close(self.master)
            remedy = ("remove it, or end the run that has it" if isinstance(error, FileExistsError)
                      else "name a folder that is there and may be written")
            raise OSError(f"{error.strerror}; {remedy}") from error
        finally:
            os.close(slave)
        self._poll = select.poll()
        self._poll.register(self.master, select.POLLIN)

    def is_used(self) -> bool:
        """Return whether a program has the slave open, or has left bytes to read."""
        events = sum(found for _, found in self._poll.poll(0))
        return not events & select.POLLHUP or bool(events & select.POLLIN)

    def forget(self) -> None:
        """Drop the bytes that a program has left unread, so that the next one does not begin with them."""
        slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            termios.tcflush(slave, termios.TCIFLUSH)
        finally:
            os.close(slave)

    def close(self) -> None:
        os.close(self.master)
        with suppress(OSError):
            if os.readlink(self.link) == self.path:
                self.link.unlink()


class SerialGateway(StreamGateway):
    Settings: ClassVar = SerialSettings
    settings: SerialSettings

    def __init__(self, name: str, medium: str, settings: SerialSettings, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Make the pseudo-terminal, if it is to; raises OSError, with the link and a remedy, if that fails."""
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        self._reconnection = Reconnection(settings.retry_ns, settings.retry_longest_ns)
        self._lost_with = 0                 # messages not sent when the device was lost
        self._poll_ns = 0
        self.terminal: PseudoTerminal | None = None
        if settings.pty is not None:
            try:
                self.terminal = PseudoTerminal(settings.pty)
            except OSError as error:
                self.close()
                raise OSError(f"gateways.{name}: cannot make the link {settings.pty}: {error}") from error

    def next_ns(self) -> int:
        if self.terminal is None:
            return self._reconnection.due_ns
        return NEVER_NS if self._peers else self._poll_ns

    def attend(self, now_ns: int) -> None:
        if self.terminal is not None:
            if not self._peers and self._poll_ns <= now_ns:
                self._poll_ns = now_ns + POLL_NS
                if self.terminal.is_used():
                    self.add(str(self.settings.pty), DescriptorChannel(self.terminal.master, lambda: None),
                             self.settings.most_bytes_per_s)
                    self.tell(SPEAKS, f"speaks with a program that has opened {self.settings.pty}", Level.INFO)
        elif self._reconnection.due_ns <= now_ns:
            self._open(now_ns)

    def lost(self, peer: StreamPeer, why: str) -> None:
        if self.terminal is not None:
            self.terminal.forget()
            self.tell(GONE, f"speaks no longer with the program that had {self.settings.pty} open", Level.INFO)
            return
        self.tell(LOST, f"has lost {self.settings.device}: {why}; {self._reconnection.in_words()}")
        self._lost_with = self.messages_unsent
        self._reconnection.failed(self._clock_ns())

    def close(self) -> None:
        super().close()
        if self.terminal is not None:
            self.terminal.close()

    def _open(self, now_ns: int) -> None:
        import serial  # here, since few scenarios have a serial device

        device = self.settings.device
        try:
            port = serial.Serial(str(device), self.settings.baud_bps, timeout=0, exclusive=True)
        except (OSError, ValueError, termios.error) as error:
            if self._reconnection.failed(now_ns):
                self.tell(MISSING, f"cannot open {device}: {_why(error)}; {self._reconnection.in_words()}")
            return
        again = f" again; {self.messages_unsent - self._lost_with} frames were lost meanwhile" if (
            self.connections or self._reconnection.told) else ""
        self._reconnection.succeeded()
        self.add(str(device), DescriptorChannel(port.fileno(), port.close), self.settings.most_bytes_per_s)
        self.tell(SPEAKS, f"speaks with {device} at {self.settings.baud_bps} baud{again}", Level.INFO)


def _why(error: Exception) -> str:
    """Return why a device cannot be opened, and the remedy."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return "there is no such device; plug it in, or correct device"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has it open; end that program"
    if number == errno.EACCES:
        return "permission denied; join the group that owns the device (dialout, uucp)"
    return str(error)
