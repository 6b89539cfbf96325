"""Exceptions as ARMv7-M has them: every word of an image's log is that of QEMU, and a kernel switches tasks."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_sim.cortex_m.image import RAM, read_image
from firmware_sim.cortex_m.machine import Machine, Stop
from tests.firmware_sim.cortex_m.boards import board_node, offers

QEMU, GDB = "qemu-system-arm", "gdb-multiarch"
RECORDED = Path(__file__).parent / "semantics_qemu.txt"       # the words of QEMU 7.2, machine mps2-an386
SECTIONS = 22


def notes(built: Path) -> list[int]:
    """Return the words that the image notes on our machine."""
    from elftools.elf.elffile import ELFFile

    image = read_image(built)
    symbols = ELFFile(io.BytesIO(image.data)).get_section_by_name(".symtab")
    at = {name: symbols.get_symbol_by_name(name)[0]["st_value"] - RAM.start for name in ("notes", "noted", "done")}
    machine = Machine(image, 100_000_000, 0.0, [], [], [0, 0, 0, 0])
    machine.reset(0)
    stop = machine.run(budget=1_000_000)
    ram = machine.ram()
    machine.close()
    assert stop == Stop.SLEEPS
    assert ram[at["done"]] == 1
    (count,) = struct.unpack_from("<I", ram, at["noted"])
    return list(struct.unpack_from(f"<{count}I", ram, at["notes"]))


def by_section(words: list[int]) -> dict[int, list[str]]:
    found: dict[int, list[str]] = {}
    for word in words:
        if word >> 16 == 0x5EC7:
            found[word & 0xFFFF] = []
        else:
            found[max(found)].append(f"{word:08x}")
    return found


def test_every_word_is_that_which_qemu_was_recorded_with(image: Callable[..., Path]):
    ours = by_section(notes(image("semantics")))

    assert list(ours) == list(range(1, SECTIONS + 1))
    assert ours == by_section([int(word, 16) for word in RECORDED.read_text().split()])


@pytest.mark.skipif(not (shutil.which(QEMU) and shutil.which(GDB)),
                    reason=f"needs {QEMU} and {GDB}: apt-get install qemu-system-arm gdb-multiarch")
def test_every_word_is_that_of_qemu(image: Callable[..., Path], tmp_path: Path):
    built, dump = image("semantics"), tmp_path / "notes.bin"
    machine = f"{QEMU} -M mps2-an386 -display none -monitor none -serial none -S -gdb stdio -kernel {built}"
    commands = ["set architecture arm", f"target remote | {machine}", "hbreak finished", "continue",
                f"dump binary value {dump} notes", "kill"]

    done = subprocess.run([GDB, "-q", "-batch", "-nx", *(word for line in commands for word in ("-ex", line)), built],
                          capture_output=True, text=True, timeout=60)
    ours = notes(built)

    assert dump.exists(), done.stdout + done.stderr
    assert by_section(ours) == by_section(list(struct.unpack_from(f"<{len(ours)}I", dump.read_bytes())))


def expected(task: int) -> tuple[float, float]:
    """Return the results of a task of kernel.c, computed with single and double precision on the host."""
    import numpy as np

    a, b, c = np.float32(1 + task), np.float32(0.5), 1.0 + task
    for i in range(1, 20_001):
        a = a * np.float32(1.0001) + b / np.float32(i)
        b = b * np.float32(0.9999) + np.float32(0.25)
        if i % 16 == 0:
            c = c * 1.0001 + 1.0 / i
    return float(a + b), c


def test_a_kernel_switches_tasks_and_their_fpu_registers(image: Callable[..., Path]):
    runs = [offers(board_node(image("kernel"), cycles_per_instruction=1.0), 1_000_000_000) for _ in range(5)]

    assert all(run == runs[0] for run in runs)
    ((_, _, frame),) = runs[0]
    single0, real0, single1, real1, switches = struct.unpack("<fdfdI", frame)
    assert (single0, real0) == expected(0)
    assert (single1, real1) == expected(1)
    assert switches > 500
