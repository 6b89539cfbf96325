"""One run owns its folder, and a run that is there is not overwritten by accident."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.judge.run_files import LOCK, SUMMARY
from experiments.run.run_folder import FolderTaken, RunFolder, owner

HOLD = """
import sys
from pathlib import Path
from experiments.run.run_folder import RunFolder
folder = RunFolder.claim(Path(sys.argv[1]))
print("claimed", flush=True)
sys.stdin.read()
"""


def test_a_folder_in_use_is_refused_with_the_process_that_has_it(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "run")], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()

        with pytest.raises(FolderTaken, match=rf"process {other.pid} on .* runs a scenario into it: wait for its end"):
            RunFolder.claim(tmp_path / "run", overwrite=True)
        named = owner(tmp_path / "run")
        other.kill()

    assert named.startswith(f"process {other.pid} on ")
    assert owner(tmp_path / "run") == ""
    RunFolder.claim(tmp_path / "run").release()         # the lock ended with its process


def test_two_runs_of_one_process_do_not_share_a_folder(tmp_path: Path) -> None:
    first = RunFolder.claim(tmp_path)

    with pytest.raises(FolderTaken, match=f"process {os.getpid()}"):
        RunFolder.claim(tmp_path)

    first.release()
    RunFolder.claim(tmp_path).release()


@pytest.mark.parametrize(("left", "named"), [
    (["scenario.json", "summary.json"], "holds the records of a finished run: name another folder, or say --overwrite"),
    (["scenario.json"], "holds the records of a run that was killed: `marconet report .*` makes them readable")])
def test_a_run_that_is_there_is_refused_unless_it_may_be_replaced(tmp_path: Path, left: list[str], named: str) -> None:
    for name in left:
        (tmp_path / name).write_text('{"media": {"can": {}}}')
    for name in ("report.html", "can.log", "can.blf", "signals.mcap.part", "notes.txt"):
        (tmp_path / name).write_text("old")

    with pytest.raises(FolderTaken, match=named):
        RunFolder.claim(tmp_path)
    untouched = {file.name for file in tmp_path.iterdir()}
    RunFolder.claim(tmp_path, overwrite=True).release()

    assert untouched == {*left, "report.html", "can.log", "can.blf", "signals.mcap.part", "notes.txt"}
    assert {file.name for file in tmp_path.iterdir()} == {"notes.txt", "summary.json.part", "run.json.part"}


def test_a_run_that_cannot_begin_leaves_no_folder(tmp_path: Path) -> None:
    RunFolder.claim(tmp_path / "run").abandon()

    assert list(tmp_path.iterdir()) == []


def test_the_space_of_the_summary_is_taken_at_the_start(tmp_path: Path) -> None:
    folder = RunFolder.claim(tmp_path)
    reserved_bytes = (tmp_path / "summary.json.part").stat().st_blocks * 512

    SUMMARY.write(tmp_path, {})
    folder.release()

    assert reserved_bytes >= 1 << 16
    assert (tmp_path / "summary.json").read_bytes() == b"{}"
    assert not (tmp_path / LOCK).exists()


def test_a_lock_file_that_a_dead_process_left_says_nothing(tmp_path: Path) -> None:
    (tmp_path / LOCK).write_text("process 1 on moon, since yesterday,")

    folder = RunFolder.claim(tmp_path)

    assert re.match(rf"process {os.getpid()} on ", (tmp_path / LOCK).read_text())
    folder.release()
