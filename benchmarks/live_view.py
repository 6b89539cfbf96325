"""What a live view costs a run: output_sync inline with a page that reads everything, and without a view.

    python -m benchmarks.live_view [RUNS]

The two alternate, at full speed. The ratio is that of the medians of the wall time from the first grant to the last
report; the page sets the speed at its first message, so some 0.1 s at 1x are in it.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from websockets.sync.client import connect

DURATION_S = "60"
FULL_SPEED = json.dumps({"type": "command", "client": 0, "request": 1, "what": "speed", "speed": None})


def run(out: Path, *options: str) -> tuple[dict[str, object], int]:
    """Return the summary of a run, and the number of messages that its page got."""
    process = subprocess.Popen(
        [sys.executable, "-m", "marconet.command_line", "run", "output_sync", "--duration", DURATION_S, "--host",
         "inline", "--no-report", "--quiet", "--out", str(out), *options], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    messages = 0
    if options:
        url = process.stderr.readline().split()[1]
        with connect(url.replace("http:", "ws:").replace("/?", "/live?"), max_size=None) as page:
            page.send(FULL_SPEED)
            messages = sum(1 for _ in page)
    process.communicate()
    return json.loads((out / "summary.json").read_text()), messages


def main(runs: int) -> None:
    wall_s: dict[str, list[float]] = {"without": [], "with": []}
    hashes = set()
    for number in range(runs):
        for name, options in (("without", ()), ("with", ("--view",))):
            with tempfile.TemporaryDirectory() as folder:
                summary, messages = run(Path(folder) / "run", *options)
            wall_s[name].append(float(str(summary["wall_s"])))
            hashes.add(summary["ledger_hash"])
            print(f"run {number} {name:7}: {wall_s[name][-1]:.2f} s, {messages} messages", flush=True)
    ratio = statistics.median(wall_s["with"]) / statistics.median(wall_s["without"])
    print(f"with a view {ratio:.3f} of the time without, {len(hashes)} ledger hash")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 7)
