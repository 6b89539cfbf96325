"""Measures what the emulated Cortex-M4 costs in processor time: `python -m benchmarks.cortex_m`.

Instructions and wake-ups of one machine for each second of processor time, the size of the firmware's images, and the
processor time of output_sync_reference with robots in Python and on the chip, inline; computing takes no time.
"""

from __future__ import annotations

import time

from benchmarks.firmware import IN_C, once
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


def machine(parameters: list[list[float]]) -> Machine:
    made = Machine(read_image(build_image("speed", {"speed.c": SOURCE})), 100_000_000, 0.0, [], parameters, [0] * 4)
    made.reset(0)
    made.run(budget=1_000)
    return made


def main() -> None:
    busy, sleeping = machine([[1.0]]), machine([])
    begin = time.process_time()
    busy.run(budget=busy.count + INSTRUCTIONS)
    busy_s = time.process_time() - begin
    begin = time.process_time()
    for _ in range(WAKE_UPS):
        sleeping.ring(0)
        sleeping.run()
    asleep_s = time.process_time() - begin
    print(f"{INSTRUCTIONS / busy_s / 1e6:.0f} million instructions a second, {WAKE_UPS / asleep_s / 1e3:.0f} thousand "
          "wake-ups a second")
    for name in own_firmware():
        image = read_image(build_for_cortex_m4(FIRMWARE / name))
        print(f"{name}: {image.flash_bytes} bytes of flash, {image.ram_bytes} of RAM with a stack of 4096")
    on_chip = [*IN_C, *(row.split(".firmware")[0] + '.target="cortex_m4"' for row in IN_C)]
    runs = {where: [once("output_sync_reference", overrides, SECONDS) for _ in range(RUNS)]
            for where, overrides in (("Python", []), ("chip", on_chip))}
    python_s, chip_s = (min(processor_s for processor_s, _ in runs[where]) for where in ("Python", "chip"))
    hashes = {ledger for times in runs.values() for _, ledger in times}
    print(f"output_sync_reference, {SECONDS:g} s: Python {python_s:.2f} s, chip {chip_s:.2f} s of processor time, "
          f"ratio {chip_s / python_s:.1f}, {len(hashes)} ledger hash")


if __name__ == "__main__":
    main()
