"""Measures at which clocks robots on an emulated Cortex-M4 miss their slots, and which guard time keeps them.

    python -m benchmarks.guard_time [SECONDS]

For each clock: the worst execution time W, from the records of a run with slots of the certified length; then the share
of copies lost in slots as short as the guard time allows, with guard times of 20 us, W / 4, W / 2 and W. The functions
are those of docs/howto/computing_takes_time.md, whose table this is.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from math import ceil
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[1] / "docs" / "howto" / "computing_takes_time.md"
CLOCKS_MHZ = (100, 48, 24, 16, 12, 8, 6, 4)


def functions(length_s: float) -> dict[str, Any]:
    """Return what the cells of the page define, with runs of another length."""
    cells = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    defined: dict[str, Any] = {}
    exec(cells[0].replace("length_s=0.05", f"length_s={length_s}"), defined)
    exec(cells[1].split("\n\n\n")[0], defined)
    return defined


def main(length_s: float) -> None:
    page = functions(length_s)
    run, lost, worst_us, frame_us = page["run"], page["lost"], page["worst_us"], page["FRAME_US"]
    print("| clock | W | 20 us | W / 4 | W / 2 | W |\n|---|---|---|---|---|---|")
    for mhz in CLOCKS_MHZ:
        worst = worst_us(run(mhz, 20.0))
        shares = [lost(run(mhz, guard_us, round(frame_us + 2 * guard_us, 3)))
                  for guard_us in (20.0, *(ceil(worst / part * 10) / 10 for part in (4, 2, 1)))]
        print(f"| {mhz} MHz | {worst:.1f} us | " + " | ".join(f"{share} %" for share in shares) + " |", flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.1)
