"""Lists the files of a run folder with their content and programs that open them, for the links in the report."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import quote

from experiments.judge.run_files import CHARTS, GUARANTEES, LEDGER, LOCK, RUN, SCENARIO, SUMMARY
from netem.records import events_file, frames_file, signals

PYTHON: Final = "`pyarrow.parquet.read_table(...)` in Python, DuckDB, or any other reader of Parquet"


class Kind(NamedTuple):
    pattern: str            # shell pattern of the path below the run folder
    holds: str              # content
    opens: str              # programs that show the file; words between backticks are code


KINDS: Final = (
    Kind(SUMMARY.name, "verdicts, guarantees in short, speed, hash, frames by fate", "any editor, or `jq .verdicts`"),
    Kind(SCENARIO.name, "the scenario as it was run, every default filled in", "any editor, or `jq`"),
    Kind(CHARTS.name, "what programs made before the start, to be drawn", "any editor, or `jq '.[].title'`"),
    Kind(RUN.name, "how far the run came, switching instants, counters, versions", "any editor, or `jq .counters`"),
    Kind(GUARANTEES.name, "every violation of every guarantee, with its cause", "any editor, or `jq`"),
    Kind(LEDGER, "every frame copy with its times and its fate", PYTHON),
    Kind(events_file.FILE, "every event that is no frame copy", PYTHON),
    Kind(signals.FILE, "signals and events over time", "Foxglove (Open local file), or the Python package `mcap`"),
    Kind("outputs.svg", "the outputs as one picture", "any browser"),
    Kind("logs/*", "what a node's process printed", "any editor"),
    Kind("*.blf", "frames of a CAN bus, Vector's format", "CANalyzer, or `can.BLFReader` of python-can"),
    Kind("*.log", "frames of a CAN bus, candump's format",
         "`canplayer -I FILE` of can-utils, or `can.CanutilsLogReader`"),
    Kind("*.asc", "frames of a CAN bus, Vector's text format", "CANalyzer, SavvyCAN, or `can.ASCReader` of python-can"),
    Kind("*.trc", "frames of a CAN bus, PEAK's format", "PCAN-View, SavvyCAN, or `can.TRCReader` of python-can"),
    Kind("*.csv", "frames of a CAN bus", "`can.CSVReader` of python-can, or a spreadsheet"),
    Kind(frames_file.FILE, "the bytes of every frame on the air", PYTHON),
    Kind("*.pcapng", "frames as they were on the air, with sender and fates",
         "Wireshark, as `wireshark -X lua_script:marconet.lua FILE`, or tshark"),
    Kind("*.lua", "dissector of the capture for Wireshark", "any editor"),
    Kind("*.tlog", "MAVLink frames with their times", "QGroundControl, MAVProxy, or `mavlogdump.py` of pymavlink"),
)
OTHER: Final = Kind("*", "not a record that marconet knows", "")


class RecordFile(NamedTuple):
    name: str               # below the run folder
    href: str
    size_bytes: int
    holds: str
    opens: str


def record_files(run_dir: Path) -> list[RecordFile]:
    """Return the files of the folder in the order of `KINDS`, without the report, the lock and unfinished files."""
    found = []
    for path in sorted([*run_dir.glob("*"), *run_dir.glob("logs/*")]):
        name = path.relative_to(run_dir).as_posix()
        if name in ("report.html", LOCK) or name.startswith(".") or name.endswith(".part") or not path.is_file():
            continue
        kind = kind_of(name)
        found.append((KINDS.index(kind) if kind in KINDS else len(KINDS),
                      RecordFile(name, quote(name), path.stat().st_size, kind.holds, kind.opens)))
    return [file for _, file in sorted(found)]


def kind_of(name: str) -> Kind:
    return next((kind for kind in KINDS if fnmatchcase(name, kind.pattern)), OTHER)
