"""Images that a user may bring, each wrong in one way: one line says what is wrong and what to do."""

from __future__ import annotations

import re
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.run import runner
from experiments.scenario import ScenarioError, load
from firmware_sim.cortex_m.build import PORT, arm_compiler, build_image
from firmware_sim.cortex_m.errors import ImageError, MachineFault
from firmware_sim.cortex_m.image import parse_image
from netem.wire.level import Level
from netem.wire.messages import Grant
from tests.firmware_sim.cortex_m.boards import board_node
from tests.firmware_sim.firmware.test_mistakes import SENDS, STARTS, changed, failure

pytestmark = pytest.mark.usefixtures("image")
SLEEPS = "for (;;) { wait_for_interrupt(); }"
ON_CHIP = ('firmware = "."', 'firmware = "."\ntarget = "cortex_m4"')
WHERE = r"; last at main, \w+\.[ch]:\d+ \(0x\w+\)"


def program(main: str) -> Path:
    """Return the image of a program with this body of `main`."""
    code = f'#include "machine_registers.h"\nint main(void) {{ {main} {SLEEPS} }}\n'
    return build_image("bad", {"bad.c": code.encode()})


def linked(tmp_path: Path, before: str, after: str, variables: int) -> bytes:
    """Return the image of a program with so many bytes of variables, linked with a change of the linker script."""
    script = (PORT / "machine.ld").read_text()
    assert before in script
    (tmp_path / "bad.ld").write_text(script.replace(before, after))
    (tmp_path / "bad.c").write_text(f"volatile char big[{variables}]; int main(void) {{ return big[5]; }}\n")
    command, last = arm_compiler()
    subprocess.run([*command, "-ffreestanding", "-Wl,-T,bad.ld", "-Wl,--entry=reset_handler", "-o", "bad.elf", "bad.c",
                    str(PORT / "startup.c"), *last], cwd=tmp_path, check=True)
    return (tmp_path / "bad.elf").read_bytes()


def refusal(data: bytes) -> str:
    with pytest.raises(ImageError) as error:
        parse_image(data, "x.elf")
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(("before", "after", "variables", "says"), [
    ("ORIGIN = 0x00000000", "ORIGIN = 0x08000000", 8,       # the map of an STM32
     r"bytes at 0x08000000: expected all content between 0x00000000 and 0x00080000, the flash: use the linker script"),
    ("LENGTH = 128K", "LENGTH = 1M", 200_000,
     r"bytes without content at 0x2000\w+: expected them between 0x20000000 and 0x20020000, the RAM"),
    (". += stack_bytes; stack_top = .;", ". += stack_bytes + 4; stack_top = .;", 8,
     "stack pointer 0x20001004: expected a multiple of 8 from"),
    ("FLASH (rx) : ORIGIN = 0x00000000", "FLASH (rx) : ORIGIN = 0x00040000", 8,
     "no vector table: expected the initial stack pointer and the reset handler at address 0"),
])
def test_an_image_that_does_not_fit_the_map_is_refused(before: str, after: str, variables: int, says: str,
                                                       tmp_path: Path) -> None:
    assert re.search(says, refusal(linked(tmp_path, before, after, variables)))


@pytest.mark.parametrize(("tag", "value", "says"), [
    (6, 17, "is for another ARM core (Tag_CPU_arch 17): expected ARMv7E-M or an earlier one of profile M: build it "
            "with -mcpu=cortex-m4"),
    (7, ord("A"), "is for an ARM core of profile A: expected one of profile M: build it with -mcpu=cortex-m4"),
])
def test_an_image_for_another_core_is_refused(image: Callable[..., Path], tag: int, value: int, says: str) -> None:
    whole = bytearray(image("beacon").read_bytes())
    attributes = whole.index(b"aeabi\0")
    place = whole.index(bytes((6, 13, 7, ord("M"))), attributes) + 2 * (tag - 6)    # Tag_CPU_arch, its profile
    struct.pack_into("BB", whole, place, tag, value)

    assert says in refusal(bytes(whole))


@pytest.mark.parametrize("cost", [0.0, 1.0])
@pytest.mark.parametrize(("main", "kind", "says"), [
    ("", "sleeps for ever",
     f"SysTick is off, no port's interrupt is on, and no timer is armed: let one of them wake it{WHERE}"),
    ("TIMER_CHANNEL = 1; TIMER_ARM = 0;", "sleeps for ever",
     f"SysTick is off, no port's interrupt is on, and the interrupt of the timer is off: let one of them wake it"
     f"{WHERE}"),
    ("for (int i = 0; i < 600; i++) { PORT_TX_DATA(0) = 7; } PORT_TX_SEND(0) = 2400; NVIC_ENABLE = 256; "
     "PORT_CONTROL(0) = 1;", "frame not sent",
     "2400 bytes at port 'radio': its FIFO of 2048 bytes held fewer, or had overflowed: send less, or check "),
])
def test_what_ends_nothing_is_told_once(main: str, kind: str, says: str, cost: float) -> None:
    node = board_node(program(main), cycles_per_instruction=cost)
    events = node.advance(Grant(1, 50_000_000, False, False, [])).events

    assert [(found, level) for _, found, _, level in events] == [(kind, Level.ERROR)]
    assert re.match(says, events[0][2]), events[0][2]


def test_a_program_that_can_be_woken_is_not_told_of() -> None:
    for main in ("NVIC_ENABLE = 1; TIMER_HIGH = 1; TIMER_ARM = 0;", "NVIC_ENABLE = 256; PORT_CONTROL(0) = 1;",
                 "SYSTICK_RELOAD = 0xFFFFFF; SYSTICK_CONTROL = 7;", "WATCHDOG_FEED = 100;"):
        events = board_node(program(main)).advance(Grant(1, 1_000_000, False, False, [])).events

        assert events == [], main


@pytest.mark.parametrize("cost", [0.0, 1.0])
def test_a_program_that_spins_on_a_register_is_named_with_its_line(cost: float) -> None:
    node = board_node(program("while (!(TIMER_STATUS & 1u)) { }"), cycles_per_instruction=cost,
                      instruction_budget=50_000)
    with pytest.raises(MachineFault) as error:
        node.advance(Grant(1, 1_000_000_000, False, False, []))

    assert re.fullmatch(r"r1: endless loop: 50000 instructions without sleeping, the last at main, bad\.c:2 \(0x\w+\); "
                        r"a program waits with `wfi`, or set instruction_budget higher", str(error.value))


def test_a_firmware_on_the_chip_that_does_not_return_is_told_to(tmp_path: Path) -> None:
    scenario = changed(tmp_path, ON_CHIP, (SENDS, "volatile int on = 1; while (on) {} " + SENDS))

    assert re.search(r"a: endless loop: 20000000 instructions without sleeping, the last at board_timer, "
                     r"blinker\.c:\d+ \(0x\w+\).*; a function of the firmware has to return before that$",
                     failure(scenario, tmp_path / "out").reason)


def test_a_firmware_on_the_chip_that_sends_from_board_start_is_named(tmp_path: Path) -> None:
    scenario = changed(tmp_path, ON_CHIP, (STARTS, STARTS + " board_send(PORT_RADIO, (const uint8_t *)&value, 1);"))

    assert "a: blinker called board_send(0) within board_start: a board sends nothing before it runs; arm a timer" in \
        failure(scenario, tmp_path / "out").reason


@pytest.mark.parametrize("on", [(), (ON_CHIP,)])
def test_a_frame_that_no_fifo_holds_is_told_at_the_end_of_the_run(on: tuple[tuple[str, str], ...],
                                                                   tmp_path: Path) -> None:
    scenario = changed(tmp_path, *on, (SENDS, "static const uint8_t big[3000]; (void)frame; "
                                              "board_send(PORT_RADIO, big, sizeof big);"))

    summary = runner.run(load(scenario), host="inline", out=tmp_path / "out", report=False).summary

    assert summary.warnings == [
        f"{name}: frame not sent at 0 s, {times} times: 3000 bytes at port 'radio': its FIFO of 2048 bytes held fewer, "
        "or had overflowed: send less, or check what board_send returns, or TX_OVERFLOW"
        for name, times in (("a", 10), ("b", 15))]


def test_an_image_that_is_refused_is_named_with_its_robot(tmp_path: Path) -> None:
    (tmp_path / "x.elf").write_bytes(Path("/bin/true").read_bytes())
    (tmp_path / "s.toml").write_text('seed = 1\nlength_s = 1.0\n[agents.a]\nfirmware = "x.elf"\n[media.radio]\n'
                                     'kind = "broadcast_radio"\n')

    with pytest.raises(ScenarioError) as error:
        load(tmp_path / "s.toml")

    assert len(error.value.problems) == 1
    assert re.search(r"agents\.a\.firmware: .*x\.elf: is for another processor \(EM_\w+\): expected 32 bit ARM",
                     error.value.problems[0])
