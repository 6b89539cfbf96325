"""The links to the records: those that are there, and what opens them."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

from experiments.show.report.records_list import KINDS, OTHER, record_files


def test_each_file_is_told_with_what_opens_it(tmp_path: Path) -> None:
    for name in ("signals.mcap", "ledger.parquet", "can.log", "can.blf", "radio.pcapng", "logs/r1.log",
                 "notes 100%.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"12345")

    found = {file.name: file for file in record_files(tmp_path)}

    assert "Foxglove" in found["signals.mcap"].opens
    assert "Wireshark" in found["radio.pcapng"].opens
    assert "candump" in found["can.log"].holds
    assert found["logs/r1.log"].holds == "what a node's process printed"
    assert found["notes 100%.txt"].holds == OTHER.holds
    assert all((tmp_path / unquote(file.href)).is_file() and file.size_bytes == 5 for file in found.values())
    assert len(found) == 7


def test_what_is_still_being_written_and_the_report_itself_are_left_out(tmp_path: Path) -> None:
    for name in ("report.html", ".report.html.part", "ledger.parquet.part", ".lock", "run.lock"):
        (tmp_path / name).touch()

    assert record_files(tmp_path) == []


def test_every_kind_says_what_it_holds_and_what_opens_it() -> None:
    assert all(kind.holds and kind.opens and kind.opens.count("`") % 2 == 0 for kind in KINDS)
