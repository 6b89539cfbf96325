"""The devices of the emulated Cortex-M: CAN with filters, UART, SysTick, watchdog, random numbers, records."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from firmware_sim.cortex_m.machine import Machine
from firmware_sim.cortex_m.program import unique_id
from netem.media.can.frame import CanFrame, pack, unpack
from netem.wire.messages import Grant
from tests.firmware_sim.cortex_m.boards import board_node

PORTS = ("radio", "bus", "line")
RADIO, CAN, SERIAL = range(3)
MS = 1_000_000


@pytest.mark.parametrize(("cost", "by_blocks"), [(0.0, True), (0.0, False), (1.0, False)])
def test_each_device_does_what_its_registers_say(image: Callable[..., Path], cost: float, by_blocks: bool,
                                                 monkeypatch: pytest.MonkeyPatch):
    if not by_blocks:
        monkeypatch.setattr(Machine, "run_by_blocks", lambda machine, answer: False)
    node = board_node(image("devices"), PORTS, counters=["seven"], events=["greeting"], cycles_per_instruction=cost)
    let_in, kept_out = CanFrame(0x125, b"\x01\x02\x03\x04\x05"), CanFrame(0x135, b"\x09")

    report = node.advance(Grant(1, 30 * MS, False, True, [
        (10 * MS, CAN, pack(kept_out)), (11 * MS, CAN, pack(let_in)), (12 * MS, SERIAL, b"abc")]))

    radio = [(time_ns, data) for time_ns, port, data in report.offers if port == RADIO]
    words = [struct.unpack(f"<{len(data) // 4}I", data) for _, data in radio]
    late = [time_ns % MS for time_ns, _ in radio]
    random = Random(1)
    boot = (0x344D434D, unique_id("r1")[0], 1 << 16 | 2 << 8 | 3)
    assert words[0][:6] == (0, *boot, random.getrandbits(32), random.getrandbits(32))
    assert 500 <= words[0][6] < 500 + (1 if cost == 0 else 5_000)
    assert [word[0] for word in words[1:4]] == [1, 2, 3]
    assert [time_ns // MS for time_ns, _ in radio[1:4]] == [1, 2, 3]
    assert words[4] == (0x125, 5, 0x04030201)
    assert [unpack(data) for _, port, data in report.offers if port == CAN] == [CanFrame(0x321, let_in.data, dlc=5)]
    assert [data for _, port, data in report.offers if port == SERIAL] == [b"b", b"c", b"d"]
    assert [word[0] for word in words[5:7]] == [1, 2]                   # reset by the watchdog, then by software
    assert [time_ns // MS for time_ns, _ in radio[5:]] == [20, 20, 21, 22, 23]
    assert (max(late) == 0) == (cost == 0)
    assert report.counters["watchdog resets"] == 1
    assert report.counters["seven"] == 7 * 3
    assert [detail for _, kind, detail, _ in report.events if kind == "greeting"] == ["hello"] * 3
    assert [kind for _, kind, _, _ in report.events if kind != "greeting"] == ["frame not sent"] * 3
