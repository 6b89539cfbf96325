"""Measures what the emulated Cortex-M4 costs: `python -m benchmarks.cortex_m [speed | teams | memory | idle]`.

    speed     instructions and wake-ups of one machine for each second of processor time; size of the firmware's images
    teams     processor time of 5 and of 16 robots in Python and on the chip, inline; computing takes no time
    memory    resident memory of 16 boards inline, more than that of 16 robots in Python, for each board
    idle      processor time of 12 h with one board that sleeps, and of an hour of output_sync
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import marconet
from benchmarks.firmware import once
from experiments.run.runner import run
from firmware_sim.cortex_m.build import build_image
from firmware_sim.cortex_m.firmware import build_for_cortex_m4
from firmware_sim.cortex_m.image import read_image
from firmware_sim.cortex_m.machine import Machine
from firmware_sim.firmware.build import FIRMWARE, own_firmware

SOURCE = b"""
#include "machine_registers.h"
volatile uint32_t word;
void interrupt0_handler(void) { TIMER_STATUS = 1; }
int main(void)
{
    VALUES_PARAMETER = 0;
    if (VALUES_LENGTH == 1u) {
        for (uint32_t x = 1;; x = x * 1664525u + 1013904223u) {
            word = x;
        }
    }
    NVIC_ENABLE = 1;
    interrupts_on();
    for (;;) {
        wait_for_interrupt();
    }
}
"""
INSTRUCTIONS, WAKE_UPS, RUNS, SECONDS = 50_000_000, 50_000, 3, 4.0
TEAMS = {"output_sync_reference": 5, "output_sync_16": 16}


def machine(parameters: list[list[float]]) -> Machine:
    return Machine(read_image(build_image("speed", {"speed.c": SOURCE})), 100_000_000, 0.0, [], parameters, [0] * 4)


def speed() -> None:
    busy, sleeping = machine([[1.0]]), machine([])
    sleeping.run_by_blocks(lambda *asked: 0.0)
    for each in (busy, sleeping):
        each.reset(0)
        each.run(budget=1_000)
    begin = time.process_time()
    busy.run(budget=busy.count + INSTRUCTIONS)
    busy_s = time.process_time() - begin
    begin = time.process_time()
    for _ in range(WAKE_UPS):
        sleeping.run_ring(0, 0, 1_000, 0)
    asleep_s = time.process_time() - begin
    print(f"{INSTRUCTIONS / busy_s / 1e6:.0f} million instructions a second, stopping at exact ones; "
          f"{WAKE_UPS / asleep_s / 1e3:.0f} thousand wake-ups a second")
    for name in own_firmware():
        image = read_image(build_for_cortex_m4(FIRMWARE / name))
        print(f"{name}: {image.flash_bytes} bytes of flash, {image.ram_bytes} of RAM with a stack of 4096")


def on_chip(robots: int, *more: str) -> list[str]:
    return [f"agents.r{number}.{key}" for number in range(1, robots + 1)
            for key in ('firmware="synchronizing_robot"', 'target="cortex_m4"', *more)]


def teams() -> None:
    for name, robots in TEAMS.items():
        found: dict[str, list[tuple[float, str]]] = {"Python": [], "chip": []}
        for _ in range(RUNS):
            for where, overrides in (("Python", []), ("chip", on_chip(robots))):
                found[where].append(once(name, overrides, SECONDS))
        python_s, chip_s = (min(processor_s for processor_s, _ in found[where]) for where in ("Python", "chip"))
        hashes = {ledger for times in found.values() for _, ledger in times}
        print(f"{name}, {SECONDS:g} s: Python {python_s:.2f} s, {robots} on the chip {chip_s:.2f} s of processor time, "
              f"ratio {chip_s / python_s:.1f}, {len(hashes)} ledger hash")


def peak(kind: str) -> None:
    """Print the greatest resident memory [bytes] of a run with 16 robots of this kind."""
    overrides = {"python": [], "chip": on_chip(16), "timed": on_chip(16, "cycles_per_instruction=1.0")}[kind]
    once("output_sync_16", overrides, 1.0)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)


def memory() -> None:
    peaks = {kind: int(subprocess.run([sys.executable, "-m", "benchmarks.cortex_m", "peak", kind], check=True,
                                      capture_output=True, text=True).stdout) for kind in ("python", "chip", "timed")}
    for kind, words in (("chip", "computing takes no time"), ("timed", "computing takes time")):
        print(f"{(peaks[kind] - peaks['python']) / 16 / 1e6:.1f} MB resident for each of 16 boards, {words}")


def idle() -> None:
    with tempfile.TemporaryDirectory() as folder:
        scenario = marconet.Scenario(
            "idle", folder=folder, seed=1, length_s=12 * 3600.0, sample_period_s=3600.0,
            agents={"a": {"program": "firmware_sim.cortex_m.program:CortexM",
                          "parameters": {"image": str(build_image("speed", {"speed.c": SOURCE}))}}},
            media={"radio": {"kind": "broadcast_radio"}})
        sleeping_s = run(scenario.checked, host="inline", out=Path(folder) / "run", report=False).summary.processor_s
    hour_s = once("output_sync", [], SECONDS)[0] * 3600 / SECONDS
    print(f"12 h with one board that sleeps: {sleeping_s * 1e3:.1f} ms of processor time; an hour of output_sync "
          f"{hour_s:.0f} s, {hour_s / sleeping_s:.0f} times as long")


PARTS: dict[str, Callable[[], None]] = {"speed": speed, "teams": teams, "memory": memory, "idle": idle}


if __name__ == "__main__":
    if sys.argv[1:2] == ["peak"]:
        peak(sys.argv[2])
    else:
        for part in sys.argv[1:] or PARTS:
            PARTS[part]()
