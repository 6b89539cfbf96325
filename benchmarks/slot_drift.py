"""Redraws docs/models/local_clock.svg: drift between slot clocks of +-50 ppm, alone, with steps, with steps and trim.

    python -m benchmarks.slot_drift
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.slot_drift import collision_free_until
from firmware_sim.slot_sync import SlotSync

SLOT_NS, GUARD_NS, PPM = 1_000_000, 20_000, 50.0
AIRTIME_NS = SLOT_NS - 2 * GUARD_NS
ROUND_NS = 2 * SLOT_NS
UNTIL_NS = 600_000_000
FIGURE = Path(__file__).parents[1] / "docs" / "models" / "local_clock.svg"
CURVES = [("alone", None, "#c0392b"), ("steps", SlotSync(5_000), "#2471a3"),
          ("steps and trim", SlotSync(5_000, rate_gain=0.1), "#1e8449")]


def leads(sync: SlotSync | None) -> Iterator[tuple[int, int]]:
    """Yield (true time, lead of the fast clock) before and after each round's correction.

    Both nodes receive each other's frame at the end of a round.
    """
    now_ns = 0
    slow, fast = (LocalClock(ClockSettings(drift_ppm=ppm), lambda: now_ns) for ppm in (-PPM, PPM))
    for now_ns in range(0, UNTIL_NS, ROUND_NS):
        lead_ns = fast.now_ns() - slow.now_ns()
        yield now_ns, lead_ns
        if sync is None:
            continue
        for clock, error_ns in ((slow, -lead_ns), (fast, lead_ns)):
            sync.heard("other", 0, error_ns, airtime_ns=0)
            correction = sync.close_round(ROUND_NS)
            clock.adjust(correction.step_ns)
            clock.trim(correction.trim_ppm)
        yield now_ns, fast.now_ns() - slow.now_ns()


def main() -> None:
    slack_us = (SLOT_NS - AIRTIME_NS) / 1e3
    clean_ms = collision_free_until(-PPM, PPM, SLOT_NS, AIRTIME_NS) / 1e6

    def at(time_ms: float, lead_us: float) -> str:
        return f"{60 + time_ms * 640e6 / UNTIL_NS:.1f} {330 - lead_us * 5:.1f}"

    lines = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 390" font-family="sans-serif" font-size="13">'
             '<rect width="720" height="390" fill="white"/>']
    for lead_us in range(0, 61, 10):
        x, y = at(0, lead_us).split()
        lines.append(f'<path d="M{x} {y}H700" stroke="#ddd"/>'
                     f'<text x="52" y="{y}" dy="4" text-anchor="end">{lead_us}</text>')
    for time_ms in range(0, 601, 100):
        x, y = at(time_ms, 0).split()
        lines.append(f'<text x="{x}" y="{y}" dy="18" text-anchor="middle">{time_ms}</text>')
    lines.append('<text x="380" y="372" text-anchor="middle">true time [ms]</text>'
                 '<text x="60" y="20">lead of the fast clock [us]; slots of 1 ms, guard 20 us, +-50 ppm</text>')
    lines.append(f'<path d="M{at(0, slack_us)}H700" stroke="black" stroke-dasharray="6 4"/>'
                 f'<path d="M{at(clean_ms, 0)}L{at(clean_ms, 60)}" stroke="black" stroke-dasharray="2 3"/>'
                 f'<text x="70" y="{at(0, slack_us).split()[1]}" dy="-6">two guards: frames touch</text>'
                 f'<text x="{at(clean_ms, 0).split()[0]}" y="40" dx="-6" text-anchor="end">'
                 f't* = {clean_ms:.2f} ms by hand</text>')
    for row, (name, sync, colour) in enumerate(CURVES):
        points = " ".join(at(time_ns / 1e6, lead_ns / 1e3) for time_ns, lead_ns in leads(sync))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
                     f'<text x="80" y="{160 + 20 * row}" fill="{colour}">{name}</text>')
    FIGURE.write_text("\n".join(lines) + "\n</svg>\n", encoding="utf-8")
    print(FIGURE)


if __name__ == "__main__":
    main()
