"""Serial devices and pseudo-terminals: opened by other programs, missing, busy, pulled out in the run."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from netem.gateways import GONE, LOST, MISSING, SPEAKS
from netem.gateways.serial_port import SerialGateway, SerialSettings
from tests.netem.gateways.pty_device import Device

PATIENCE_S = 10.0
ECHO = """
import serial, sys
port = serial.Serial(sys.argv[1], 57_600, timeout=10, exclusive=True)
print("open", flush=True)
while (data := port.read_until(b"\\n")) != b"bye\\n":
    port.write(b"you said " + data)
"""


class Heard:
    """A gateway and its events."""

    def __init__(self, **settings: object) -> None:
        self.told: list[tuple[str, str]] = []
        self.gateway = SerialGateway("modem", "line", SerialSettings(**settings),       # type: ignore[arg-type]
                                     event=lambda kind, detail, level: self.told.append((kind, detail)))
        self.found = b""

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.told]

    def until(self, true: Callable[[], bool]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end_s, (self.told, self.found)
            self.found += b"".join(self.gateway.receive(100))
            time.sleep(0.001)


@pytest.fixture
def made() -> Iterator[Callable[..., Heard]]:
    found: list[Heard] = []

    def make(**settings: object) -> Heard:
        found.append(Heard(**settings))
        return found[-1]

    yield make
    for each in found:
        each.gateway.close()


def test_a_program_opens_the_pseudo_terminal_like_a_device(made, tmp_path):
    heard = made(pty=tmp_path / "modem")
    heard.gateway.send(b"before anybody came\n")
    with subprocess.Popen([sys.executable, "-c", ECHO, str(tmp_path / "modem")], stdout=subprocess.PIPE) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == b"open\n"
        heard.until(lambda: heard.kinds == [SPEAKS])
        heard.gateway.send(bytes(range(1, 10)) + b"\r\x03\x13\xff\n")
        heard.until(lambda: heard.found.endswith(b"\n"))
        heard.gateway.send(b"bye\n")
        assert program.wait(PATIENCE_S) == 0
    heard.until(lambda: heard.kinds == [SPEAKS, GONE])

    assert heard.found == b"you said " + bytes(range(1, 10)) + b"\r\x03\x13\xff\n"     # no echo, no line editing
    assert heard.gateway.messages_unsent == 1
    assert heard.gateway.messages_sent == 2


def test_what_one_program_left_unread_is_not_for_the_next(made, tmp_path):
    link = tmp_path / "modem"
    heard = made(pty=link)
    first = os.open(link, os.O_RDWR | os.O_NOCTTY)
    heard.until(lambda: heard.kinds == [SPEAKS])
    heard.gateway.send(b"unread")
    os.write(first, b"last word")
    os.close(first)
    heard.until(lambda: heard.kinds == [SPEAKS, GONE])
    second = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    heard.until(lambda: heard.kinds == [SPEAKS, GONE, SPEAKS])
    heard.gateway.send(b"for you")

    assert heard.found == b"last word"
    assert os.read(second, 100) == b"for you"
    os.close(second)


def test_the_link_goes_with_the_gateway_and_one_left_behind_is_replaced(tmp_path):
    link = tmp_path / "modem"
    link.symlink_to(tmp_path / "of a run that was killed")

    gateway = SerialGateway("modem", "line", SerialSettings(pty=link))
    assert os.readlink(link).startswith("/dev/pts/")
    with pytest.raises(OSError, match=r"gateways.other: cannot make the link .*modem: File exists; remove it, or end"):
        SerialGateway("other", "line", SerialSettings(pty=link))
    gateway.close()

    assert not link.is_symlink()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OSError, match=r"cannot make the link .*/none/modem: No such file or directory; name a folder"):
        SerialGateway("modem", "line", SerialSettings(pty=tmp_path / "none" / "modem"))


def test_a_device_that_is_missing_is_told_once_and_opened_when_it_comes(made, tmp_path):
    heard = made(device=tmp_path / "ttyUSB0", retry_ns=1_000_000, retry_longest_ns=5_000_000)
    heard.until(lambda: heard.kinds == [MISSING])
    for _ in range(4):
        heard.gateway.send(b"lost")
        heard.until(lambda: True)
    device = Device(tmp_path / "ttyUSB0")
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS])
    heard.gateway.send(b"hello")
    os.write(device.master, b"world")
    heard.until(lambda: heard.found == b"world")

    assert os.read(device.master, 100) == b"hello"
    assert "there is no such device; plug it in, or correct device" in heard.told[0][1]
    assert heard.told[1][1] == (f"gateways.modem speaks with {device.path} at 115200 baud again; 4 frames were lost "
                                "meanwhile")
    device.pull_out()


def test_a_device_that_is_pulled_out_is_told_and_opened_again(made, tmp_path):
    device = Device(tmp_path / "ttyUSB0")
    heard = made(device=device.path, retry_ns=1_000_000, retry_longest_ns=5_000_000)
    heard.until(lambda: heard.kinds == [SPEAKS])
    device.pull_out()
    heard.until(lambda: heard.kinds == [SPEAKS, LOST])
    for _ in range(7):
        heard.gateway.send(b"lost")
    device.plug_in()
    heard.until(lambda: heard.kinds == [SPEAKS, LOST, SPEAKS])
    heard.gateway.send(b"here again")

    assert os.read(device.master, 100) == b"here again"
    assert heard.told[-1][1].endswith("again; 7 frames were lost meanwhile")
    device.pull_out()


def test_a_device_that_another_program_has_is_busy(made, tmp_path):
    device = Device(tmp_path / "ttyUSB0")
    with subprocess.Popen([sys.executable, "-c", ECHO, str(device.path)], stdout=subprocess.PIPE) as program:
        assert program.stdout is not None
        program.stdout.readline()
        heard = made(device=device.path, retry_ns=1_000_000, retry_longest_ns=5_000_000)
        heard.until(lambda: heard.kinds == [MISSING])
        os.write(device.master, b"bye\n")
        program.wait(PATIENCE_S)
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS])

    assert "another program has it open; end that program" in heard.told[0][1]
    device.pull_out()


def test_a_file_is_no_device(made, tmp_path):
    (tmp_path / "file").write_text("no terminal")
    heard = made(device=tmp_path / "file")
    heard.until(lambda: heard.kinds == [MISSING])

    assert "Could not configure port" in heard.told[0][1]


@pytest.mark.skipif(shutil.which("socat") is None, reason="needs socat")
def test_socat_joins_the_pseudo_terminal_with_its_standard_streams(made, tmp_path):
    heard = made(pty=tmp_path / "modem")
    with subprocess.Popen(["socat", "-", f"{tmp_path / 'modem'},raw,echo=0"], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, bufsize=0) as program:
        assert program.stdin is not None
        assert program.stdout is not None
        heard.until(lambda: heard.kinds == [SPEAKS])
        program.stdin.write(bytes(range(256)))
        heard.until(lambda: heard.found == bytes(range(256)))
        heard.gateway.send(bytes(range(255, -1, -1)))
        found = b""
        while len(found) < 256:
            found += program.stdout.read(256 - len(found))
        program.stdin.close()
        program.wait(PATIENCE_S)

    assert found == bytes(range(255, -1, -1))
