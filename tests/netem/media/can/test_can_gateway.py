"""A gateway to a bus of python-can: frames both ways, echoes, garbage, floods, a bus that is missing or lost."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from random import Random

import can
import pytest

from netem.gateways import FLOODED, GARBAGE, LOST, MISSING, SPEAKS, UNREAD
from netem.media.can.can_gateway import CanGateway, CanGatewaySettings
from netem.media.can.frame import CanFrame, pack, unpack
from tests.free_port import free_port
from tests.netem.gateways.pty_device import Device

PATIENCE_S = 10.0
GROUP = "239.74.163.2"


class Heard:
    """A gateway and its events."""

    def __init__(self, **settings: object) -> None:
        self.told: list[tuple[str, str]] = []
        self.gateway = CanGateway("bench", "can0", CanGatewaySettings(**settings),      # type: ignore[arg-type]
                                  event=lambda kind, detail, level: self.told.append((kind, detail)))
        self.found: list[CanFrame] = []

    @property
    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.told]

    def until(self, true: Callable[[], bool]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end_s, (self.told, self.found, self.gateway.counters())
            self.found += map(unpack, self.gateway.receive(100))
            time.sleep(0.001)


@pytest.fixture
def made() -> Iterator[Callable[..., Heard]]:
    found: list[Heard] = []

    def make(**settings: object) -> Heard:
        found.append(Heard(**settings))
        found[-1].until(lambda: found[-1].kinds != [])
        return found[-1]

    yield make
    for each in found:
        each.gateway.close()


@pytest.fixture
def port() -> int:
    return free_port(socket.SOCK_DGRAM)


FRAMES = [CanFrame(0x123, b"\x01\x02"), CanFrame(0x1ABCDEF0, bytes(8), extended=True),
          CanFrame(0x7FF, remote=True, dlc=3), CanFrame(0x55, b"", dlc=0)]
FD_FRAMES = [CanFrame(0x10, bytes(range(48)), fd=True, bit_rate_switch=True), CanFrame(0x11, bytes(12), fd=True)]


def with_dlc(frame: CanFrame) -> CanFrame:
    return unpack(pack(frame))


@pytest.mark.parametrize("interface", ["virtual", "udp_multicast"])
def test_every_format_passes_both_ways(made, port, interface):
    options = {"port": port, "hop_limit": 0} if interface == "udp_multicast" else {}
    channel = GROUP if interface == "udp_multicast" else f"channel {port}"
    heard = made(interface=interface, channel=channel, fd=True, options=options)
    frames = [*FRAMES, *FD_FRAMES, CanFrame(0x204, bytes((0, 0x20, 0, 0, 0, 0, 128, 0)), error=True)]
    with can.Bus(interface=interface, channel=channel, fd=True, **options) as outside:
        for frame in frames:
            heard.gateway.send(pack(frame))
        got = [outside.recv(PATIENCE_S) for _ in frames]
        for message in got:
            outside.send(message)
        heard.until(lambda: len(heard.found) == len(frames))

    assert heard.found == [with_dlc(frame) for frame in frames]
    assert got[-1].is_error_frame
    assert heard.kinds == [SPEAKS]


def test_its_own_frames_do_not_come_back(made, port):
    heard = made(interface="udp_multicast", channel=GROUP, options={"port": port, "hop_limit": 0})
    frame = CanFrame(0x123, b"same")
    with can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0) as outside:
        for _ in range(50):
            heard.gateway.send(pack(frame))
        for _ in range(50):
            assert outside.recv(PATIENCE_S) is not None
        time.sleep(0.1)
        heard.until(lambda: True)
        assert heard.found == []
        outside.send(can.Message(arbitration_id=0x123, data=b"same", is_extended_id=False))
        heard.until(lambda: len(heard.found) == 1)

    assert heard.found == [with_dlc(frame)]


def test_a_frame_that_the_interface_cannot_carry_is_dropped_and_counted(made, port):
    heard = made(interface="virtual", channel=f"channel {port}")
    heard.gateway.send(pack(FD_FRAMES[0]))
    heard.gateway.send(pack(FD_FRAMES[1]))

    assert heard.told[1:] == [(UNREAD, "gateways.bench drops CAN FD frames, as the bus outside was opened without CAN "
                               "FD: set fd = true")]
    assert heard.gateway.counters()["frames not sent"] == 2


def test_garbage_is_counted_and_told_once_and_frames_are_heard_on(made, port):
    heard = made(interface="udp_multicast", channel=GROUP, fd=True, options={"port": port, "hop_limit": 0})
    rng = Random(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for _ in range(200):
            here.sendto(rng.randbytes(rng.randrange(100)), (GROUP, port))
    heard.until(lambda: heard.gateway.counters()["no CAN frames"] >= 190)       # a few random bytes are msgpack
    with can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0) as outside:
        outside.send(can.Message(arbitration_id=0x123, data=b"fine", is_extended_id=False))
        heard.until(lambda: any(frame.data == b"fine" for frame in heard.found))

    assert heard.kinds == [SPEAKS, GARBAGE]


def test_a_flood_is_bounded_and_told_once(made, port):
    heard = made(interface="virtual", channel=f"channel {port}", most_per_s=100)
    with can.Bus(interface="virtual", channel=f"channel {port}") as outside:
        for k in range(500):
            outside.send(can.Message(arbitration_id=k, is_extended_id=False))
        heard.until(lambda: len(heard.found) + heard.gateway.flooded == 500)

    assert 100 <= len(heard.found) <= 150
    assert heard.kinds == [SPEAKS, FLOODED]


@pytest.fixture
def slcan(made, tmp_path) -> Callable[[], Heard]:
    return lambda: made(interface="slcan", channel=str(tmp_path / "adapter"), retry_ns=1_000_000,
                        retry_longest_ns=5_000_000, options={"sleep_after_open": 0.0})


def test_slcan_speaks_the_protocol_of_adapters(slcan, tmp_path):
    adapter = Device(tmp_path / "adapter")
    heard = slcan()
    heard.gateway.send(pack(CanFrame(0x123, b"\xAB\xCD")))
    heard.gateway.send(pack(CanFrame(0x004, bytes(8), error=True)))         # would leave as a data frame
    os.write(adapter.master, b"t1232AABB\rT1ABCDEF00\rr7FF3\r")
    heard.until(lambda: len(heard.found) == 3)

    assert adapter.said(len(b"O\rt1232ABCD\r")) == b"O\rt1232ABCD\r"
    assert heard.found == [CanFrame(0x123, b"\xAA\xBB", dlc=2), CanFrame(0x1ABCDEF0, extended=True, dlc=0),
                           CanFrame(0x7FF, remote=True, dlc=3)]
    assert heard.gateway.counters()["frames not sent"] == 1
    adapter.pull_out()


def test_slcan_finds_frames_behind_garbage(slcan, tmp_path):
    adapter = Device(tmp_path / "adapter")
    heard = slcan()
    rng = Random(2)
    for _ in range(50):
        os.write(adapter.master, rng.randbytes(40) + b"\r")
    os.write(adapter.master, b"\rtFFF1AA\r")                                # an identifier of 12 bits
    heard.until(lambda: heard.gateway.counters()["no CAN frames"] > 0)      # what waits behind it is dropped with it
    heard.until(lambda: os.write(adapter.master, b"t1231AA\r") > 0 and CanFrame(0x123, b"\xAA", dlc=1) in heard.found)

    assert heard.kinds == [SPEAKS, GARBAGE]
    adapter.pull_out()


def test_an_adapter_that_is_missing_or_pulled_out_is_told_of_and_opened_when_it_comes(slcan, tmp_path):
    heard = slcan()
    assert heard.kinds == [MISSING]
    heard.gateway.send(pack(FRAMES[0]))
    adapter = Device(tmp_path / "adapter")
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS])
    adapter.pull_out()
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS, LOST])
    heard.gateway.send(pack(FRAMES[0]))
    adapter.plug_in()
    heard.until(lambda: heard.kinds == [MISSING, SPEAKS, LOST, SPEAKS])
    heard.gateway.send(pack(FRAMES[0]))
    os.write(adapter.master, b"t1231AA\r")
    heard.until(lambda: heard.found != [])

    assert adapter.said(len(b"O\rt12320102\r")) == b"O\rt12320102\r"
    assert heard.told[1][1].endswith("again; 1 frames were lost meanwhile")
    assert heard.gateway.counters()["frames not sent"] == 2
    adapter.pull_out()


def test_a_device_that_takes_nothing_does_not_hold_up_the_run(slcan, tmp_path):
    adapter = Device(tmp_path / "adapter")
    heard = slcan()
    began_s = time.monotonic()
    for _ in range(30_000):
        heard.gateway.send(pack(FRAMES[0]))

    assert time.monotonic() - began_s < 5.0
    heard.until(lambda: UNREAD in heard.kinds)
    counters = heard.gateway.counters()
    assert 30_000 - (counters["frames not sent"] + counters["frames sent"]) in (0, 1)      # one is being sent
    adapter.pull_out()


@pytest.mark.parametrize(("settings", "says"), [
    ({"interface": "udp_multicats"}, 'no such interface of python-can; did you mean \'udp_multicast\'?'),
    ({"interface": "marconet"}, "is that of programs within a run; name one that leads outside"),
    ({"interface": "virtual", "options": {"fd": True}}, "options: fd is a key of the gateway; write it beside options"),
    ({"interface": "virtual", "most_per_s": 0}, "most_per_s=0: expected at least 1"),
])
def test_wrong_settings_are_told(settings, says):
    with pytest.raises(ValueError, match=says.replace("?", r"\?")):
        CanGatewaySettings(**settings)
