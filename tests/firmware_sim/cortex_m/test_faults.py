"""A program that cannot go on ends its node with cause, function, line and registers; no image harms the host."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

import marconet
from firmware_sim.cortex_m.build import build_image
from firmware_sim.cortex_m.errors import ImageError, MachineFault
from firmware_sim.cortex_m.fault import describe
from firmware_sim.cortex_m.image import Image, parse_image, read_image
from firmware_sim.cortex_m.machine import Ask, Fault, Machine, Stop
from netem.wire.messages import Grant
from tests.firmware_sim.cortex_m.boards import board_node, offers

LINE_OF = {1: "keep = *(", 2: "0x50000000u", 3: "0x00000100u", 4: ".inst.n", 7: "0x40001044u"}
SOURCE = Path(__file__).parent / "images" / "mistakes.c"


@pytest.mark.parametrize(("mistake", "words"), [
    (1, "bus fault: read of 0x30000000, where nothing is"),
    (2, "bus fault: write to 0x50000000, where nothing is"),
    (3, "write to the flash at 0x00000100"),
    (4, "undefined instruction"),
    (5, "stack overflow: access to 0x1ff"),
    (6, "endless loop: 100000 instructions without sleeping"),
    (7, "0x40001044 is no register"),
    (8, "bus fault: instruction fetch at 0x20000000, where no program is"),
    (9, "ended the run with code 77"),
    (10, "uses number 3 of `actuators`, which has 0 names"),
    (11, "unprivileged access to the register 0xe000e100"),
    (12, "svc where its priority allows none"),
])
@pytest.mark.parametrize("cost", [0.0, 1.0])
def test_a_program_that_cannot_go_on_ends_its_node(image: Callable[..., Path], mistake: int, words: str, cost: float):
    built = image("mistakes")

    with pytest.raises(MachineFault, match=r"^r1: ") as error:
        offers(board_node(built, values=[[mistake]], instruction_budget=100_000, cycles_per_instruction=cost),
               1_000_000_000)

    message = str(error.value)
    assert words in message
    assert "\n" not in message
    if mistake in LINE_OF:
        line = next(number for number, text in enumerate(SOURCE.read_text().splitlines(), 1)
                    if LINE_OF[mistake] in text)
        assert f"at blunder, mistakes.c:{line} (0x" in message
        assert "called from main, " in message
        assert "r0=0x" in message


def test_a_function_that_called_another_one_is_not_named_as_its_own_caller(image: Callable[..., Path]):
    built = read_image(image("mistakes"))
    with pytest.raises(MachineFault) as error:
        offers(board_node(image("mistakes"), values=[[4]]), 1_000_000_000)
    pc, lr = (int(re.findall(pattern, str(error.value))[0], 16) for pattern in (r"pc=0x(\w+)", r"lr=0x(\w+)"))

    def described(link: int) -> str:
        return describe(Fault(5, pc, 0, (*[0] * 14, link, pc, 0)), built)

    assert "called from main, " in described(lr)
    assert "called from" not in described(pc | 1)


def test_the_records_of_a_run_hold_what_was_before_the_fault(image: Callable[..., Path], tmp_path: Path):
    scenario = tmp_path / "three.toml"
    scenario.write_text(f"""
seed = 1
length_s = 0.1
[agents_defaults]
program = "firmware_sim.cortex_m.program:CortexM"
[agents.a]
parameters = {{ image = "{image("beacon")}", values = [[5e6], [1e6], [0]] }}
[agents.b]
parameters = {{ image = "{image("beacon")}", values = [[5e6], [3e6], [0]] }}
[agents.c]
parameters = {{ image = "{image("mistakes")}", values = [[0.0]], instruction_budget = 1 }}
[media.radio]
kind = "broadcast_radio"
bit_rate_bps = 250_000
""")

    with pytest.raises(Exception, match="c: endless loop: 1 instructions without sleeping"):
        marconet.run(scenario, host="inline", out=tmp_path / "run")

    assert (tmp_path / "run" / "ledger.parquet").exists()


@pytest.mark.parametrize(("name", "patch", "words"), [
    ("another core", (18, b"\x3e\x00"), "is for another processor (EM_X86_64): expected 32 bit ARM"),
    ("no file", (0, b"oops"), "no .elf file that can be read"),
])
def test_an_elf_file_of_another_kind_is_refused(image: Callable[..., Path], name: str, patch: tuple[int, bytes],
                                                words: str):
    place, data = patch
    whole = bytearray(image("beacon").read_bytes())
    whole[place:place + len(data)] = data

    with pytest.raises(ImageError) as error:
        parse_image(bytes(whole), "x.elf")

    assert words in str(error.value)


@pytest.mark.parametrize(("word", "value", "words"), [
    (0, 0x2000_2004, "the vector table begins with the stack pointer 0x20002004: expected a multiple of 8"),
    (0, 0x1000_0000, "the vector table begins with the stack pointer 0x10000000"),
    (1, 0x0000_0200, "the reset handler is 0x00000200: expected an odd address"),
    (1, 0x0007_0001, "the reset handler is 0x00070001"),
])
def test_a_wrong_vector_table_is_refused(image: Callable[..., Path], word: int, value: int, words: str):
    whole = bytearray(image("beacon").read_bytes())
    table = next(place for place, _ in segments(bytes(whole)))
    struct.pack_into("<I", whole, table + 4 * word, value)

    with pytest.raises(ImageError) as error:
        parse_image(bytes(whole), "x.elf")

    assert words in str(error.value)


def test_content_outside_the_flash_is_refused(image: Callable[..., Path]):
    whole = bytearray(image("beacon").read_bytes())
    (first,) = struct.unpack_from("<I", whole, 28)          # of the program headers
    struct.pack_into("<I", whole, first + 12, 0x0800_0000)  # p_paddr

    with pytest.raises(ImageError, match="bytes at 0x08000000: expected all content between 0x00000000 and 0x00080000"):
        parse_image(bytes(whole), "x.elf")


def segments(data: bytes) -> list[tuple[int, int]]:
    """Return (place in the file, address) of the segments that are loaded."""
    first, size, count = (*struct.unpack_from("<I", data, 28), *struct.unpack_from("<HH", data, 42))
    rows = [struct.unpack_from("<IIII", data, first + k * size) for k in range(count)]
    return [(offset, address) for kind, offset, _, address in rows if kind == 1]


def mutated(image: Image, random: Random) -> Image:
    """Return the image with some bytes of its code, constants or vectors changed."""
    changed = []
    for address, content in image.segments:
        data = bytearray(content)
        for _ in range(random.choice((1, 3, 20))):
            place = random.randrange(len(data))
            if address + place >= 8:                        # stack pointer and reset handler are checked before
                data[place] = random.randrange(256)
        changed.append((address, bytes(data)))
    return replace(image, segments=tuple(changed))


def survive(image: Image, seed: int) -> None:
    """Run a mutated image through timers, frames, snapshots and its end."""
    random = Random(seed)
    cost = random.choice((0.0, 1.0))
    machine = Machine(mutated(image, random), 100_000_000, cost, [1, 2], [[5e6], [1e6], [20.0]], [0, 0, 0, 0])
    if cost == 0 and seed % 2:
        def answer(*asked: Any) -> float:
            list(machine.commands())
            return 1.0

        machine.run_by_blocks(answer)
    machine.reset(0)
    for step in range(1, 30):
        machine.at(step * 1_000_000, step * 1_000_000)
        if step % 3:
            machine.ring(3)
        else:
            machine.receive(step % 2, random.randbytes(random.choice((0, 3, 16, 2048))))
        if step % 5 == 0:
            machine.save()
            machine.run(budget=machine.count + 1_000)
            machine.restore()
        for _ in range(20):
            stop = machine.run(budget=machine.count + 2_000)
            for ask, _, length, place, _ in machine.commands():
                if ask == Ask.SEND and length >= 0:
                    assert len(machine.bytes[place:place + length]) == length <= 2048
            if stop != Stop.HAS_COMMANDS:
                break
    machine.close()


def test_mutated_images_leave_the_host_alive(image: Callable[..., Path]):
    for built in ("beacon", "kernel", "semantics"):
        for seed in range(10):
            survive(read_image(image(built)), seed)


BURST = b"""
#include "machine_registers.h"
#define FOUR RECORD_COUNTER = 0; RECORD_COUNTER = 0; RECORD_COUNTER = 0; RECORD_COUNTER = 0;
#define MANY FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR FOUR
#define FRAME PORT_TX_DATA(0) = 7; PORT_TX_SEND(0) = 4;
int main(void)
{
    RECORD_LOW = 1;
    MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY MANY
    FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME FRAME
    for (;;) {
        wait_for_interrupt();
    }
}
"""


@pytest.mark.usefixtures("image")
@pytest.mark.parametrize("cost", [0.0, 1.0])
def test_more_commands_than_there_is_room_for_are_carried_out_all_the_same(cost: float):
    node = board_node(build_image("burst", {"burst.c": BURST}), counters=["many"], cycles_per_instruction=cost)

    report = node.advance(Grant(1, 100_000_000, False, True, []))

    assert report.counters["many"] == 16 * 64
    assert [data for _, _, data in report.offers] == [bytes([7, 0, 0, 0])] * 16


@pytest.mark.slow
def test_a_thousand_mutated_images_leave_the_host_alive(image: Callable[..., Path]):
    for seed in range(1_000):
        survive(read_image(image(("beacon", "kernel", "semantics")[seed % 3])), 100 + seed)
