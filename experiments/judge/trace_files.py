"""Trace files made of a run: a CSV for each link, as the impairment `trace` reads it, and the lines that use them.

    radio-r1-r2.csv         time_s, delay_ms, lost: one row for each frame of the link, in the order of its numbers
    traces.toml             one [[impairments]] of kind "trace" for each link

A frame counts as lost whatever its fate was, so the lines replace all impairments, and the medium should lose none. The
delay is what the link added to the shortest time that any frame of it took from its end to the node.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from experiments.judge.recorded_fates import recorded_fates
from netem.core.link_name import LinkName
from netem.media.replayed_links import RecordedFrame

By = Literal["frame", "time"]


def write_traces(run_folder: Path, into: Path, by: By = "frame") -> list[Path]:
    """Write the trace files of the run in `run_folder` into the folder `into`, and return their paths.

    Raises OSError for a folder without a ledger.
    """
    links = recorded_fates(run_folder)
    into.mkdir(parents=True, exist_ok=True)
    written = []
    lines = [f"# Made of {run_folder} by marconet export: what became of the frames of each link."]
    for link, frames in links.items():
        path = into / f"{_plain('-'.join(link))}.csv"
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([["time_s", "delay_ms", "lost"], *_rows(frames, by)])
        written.append(path)
        lines += ["", "[[impairments]]", f'on = "{_selector(link)}"', 'kind = "trace"', f'file = "{path.name}"',
                  f'by = "{by}"', *(["start_s = 0.0"] if by == "time" else []), 'at_end = "hold"']
    toml = into / "traces.toml"
    toml.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [*written, toml]


def _rows(frames: Sequence[RecordedFrame], by: By) -> Iterable[list[str]]:
    shortest_ns = min((copy.delay_ns for frame in frames for copy in frame.copies if copy.fate.arrived), default=0)
    last_ns, number = -1, 0
    for frame in frames:
        while by == "frame" and number < frame.number:      # a frame that was not for this receiver
            yield ["", "", "1"]
            number += 1
        number += 1
        if by == "time" and frame.offered_ns <= last_ns:
            continue                                        # a time stands once
        last_ns = frame.offered_ns
        first = frame.copies[0]
        time_s = f"{frame.offered_ns / 1e9:.9f}" if by == "frame" or number > 1 else "0.0"
        yield [time_s, f"{(first.delay_ns - shortest_ns) / 1e6:.6f}", "0"] if first.fate.arrived else [time_s, "", "1"]


def _selector(link: LinkName) -> str:
    medium, sender, receiver = link
    return f"{medium}: {sender} -> {receiver}"


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)
