"""Writes the files of a recorder after the run, from the frames that it kept and its ledger.

    frames.parquet --taps--> candump, BLF, ASC, TRC, CSV           frames.parquet, ledger.parquet --> pcapng, tlog

The files are byte for byte those that the recorder would have written in the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from experiments.judge.run_files import SCENARIO, Json
from experiments.run.run_folder import FolderTaken, owner
from experiments.scenario.problems import near
from netem.core.frame import Frame
from netem.media.table import MEDIA
from netem.records import Carried, Feed, NoSuchFormat, Place
from netem.records.frames_file import frame_table, frames_of
from netem.records.table import RECORDERS


def export_frames(run: Path, kind: str, medium: str | None, out: Path) -> list[Path]:
    """Write the files of the recorder `kind` about `medium` (None: all that it fits) into `out`; return their paths.

    Raises NoFrames if the run in the folder `run` kept none, NoSuchFormat, FolderTaken during the run.
    """
    if who := owner(run):
        raise FolderTaken(f"{run}: {who} still runs a scenario into it: wait for its end")
    scenario = SCENARIO.left(run) or {}
    media = media_of(scenario)
    if medium is not None and medium not in media:
        raise NoSuchFormat(f"--medium {medium}: the run has no such medium; {near(medium, media)}")
    table = frame_table(run)
    recorder = RECORDERS[kind]
    asked = scenario.get("records", {}).get(kind)
    settings = None if asked is None else msgspec.convert(asked, recorder.Settings)
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=out, prefix=".export-") as draft:
        place = place_of(run, scenario, Path(draft))
        for each in recorder.afterwards(media, medium, settings):
            writing = recorder(each, place)
            feed = Feed({name: [] for name in media})
            writing.record(feed)
            if any(feed.frames.values()):
                _tell(feed, table)
            writing.finish()
        found = sorted(Path(draft).iterdir())
        if not found:
            raise NoSuchFormat(f"{run}: no frame{'' if medium is None else f' of {medium}'} holds what {kind} records; "
                               f"the run kept {table.num_rows} frames")
        return [path.replace(out / path.name) for path in found]


def place_of(run: Path, scenario: Json, folder: Path) -> Place:
    """Return where recorders write into `folder` what they take from the records of `run`."""
    names = {"scenario": str(scenario.get("name", "")), "seed": str(scenario.get("seed", ""))}
    return Place(folder, names, (run / SCENARIO.name).read_bytes(), int(scenario.get("length_ns") or 0),
                 media_of(scenario), run)


def media_of(scenario: Json) -> dict[str, Carried]:
    """Return what the frames of each medium are, by the kinds that a resolved scenario names."""
    media: Mapping[str, Any] = scenario.get("media", {})
    return {name: MEDIA[spec["kind"]].Settings for name, spec in media.items()}


def _tell(feed: Feed, table: Any) -> None:
    for kept in frames_of(table):
        taps = feed.frames.get(kept.medium, ())
        if not taps:
            continue
        if kept.sender:
            frame = Frame(kept.medium, kept.sender, kept.number, kept.offered_ns, kept.data, kept.on_air_ns,
                          kept.end_ns)
        for tap in taps:
            if kept.sender:
                tap.frame(frame, kept.seen_ns)
            else:
                tap.error_frame(kept.medium, kept.on_air_ns)
