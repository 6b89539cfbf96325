"""The pages on CAN, drive, reference and guarantees: their fragments make one scenario that runs; no key is missing."""

from __future__ import annotations

import re
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import can
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from agents.tracking.reference_robot import ReferenceRobot
from agents.tracking.tracking_robot import TrackingRobot
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from firmware_sim.babbling_idiot import BabblingIdiot
from firmware_sim.drive_controller.drive_controller import DriveController
from firmware_sim.drive_controller.drive_messages import DriveMessages, DriveState, Mode, Setpoint, WheelSpeeds
from netem.media.can.frame import CanFrame
from netem.media.can.messages import CanMessage
from netem.media.can.settings import CanSettings
from tests.firmware_sim.board_bench import BoardBench

DOCS = Path(__file__).parents[2] / "docs"
MS = 1_000_000

COMPANION = '''
from firmware_sim.drive_controller.drive_messages import DriveMessages, Mode, Setpoint

MESSAGES = DriveMessages()


class Companion:
    """A setpoint every 10 ms, as the page declares it; tells a gain product, as the page on guarantees has it."""

    def __init__(self, board):
        self.board, self.can, self.k = board, board.port("can"), 0
        board.every(10_000_000, self.command, offset_ns=10_000_000)

    def command(self):
        self.k += 1
        self.can.send(MESSAGES.pack(Setpoint(2.0, 2.0, Mode.RUN, self.k % 256)))
        self.board.event("gain product", "0.93")
'''
FRAME = """# A drive, a companion and a reference.
# Question: do the pages fit together?
seed = 1
length_s = 0.5

[team.reference]
from_s = [0.0, 2.26, 9.25]

[agents.companion]
program = "companion_of_the_pages:Companion"
media = ["radio", "can"]

[agents.reference]
program = "agents.tracking.reference_robot:ReferenceRobot"
media = ["radio"]
PLANT

[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
"""


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def scenario_text() -> str:
    """The derived signals and guarantees of scenario.md name nodes of other runs: only names are replaced in them."""
    plant, = blocks("models/virtual_reference.md", "toml")
    derived, guarantees = (text for text in blocks("scenario.md", "toml")
                           if text.startswith(("[derived", "[guarantees")))
    guarantees = guarantees[:guarantees.index("expected =")].replace("robot", "companion").replace(
        "radio: companion", "can: companion").replace("at_least_ms = 17", "at_least_ms = 10")
    return "\n".join([FRAME.replace("PLANT", plant), blocks("models/can_bus.md", "toml")[0],
                      *blocks("models/drive_controller.md", "toml"), derived, guarantees])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    (folder / "companion_of_the_pages.py").write_text(COMPANION)
    (folder / "pages.toml").write_text(scenario_text())
    scenario = load(folder / "pages.toml", overrides=['media.can.log=["candump","blf"]', 'record="frames"'])
    result = run(scenario, host="inline", out=folder / "runs" / "my_run")
    assert [verdict.key for verdict in result.summary.verdicts if not verdict.holds] == []
    return folder


def test_the_fragments_of_the_pages_make_a_run_in_which_the_drive_turns_its_wheels(folder: Path) -> None:
    messages = DriveMessages()

    logged = list(can.CanutilsLogReader(folder / "runs" / "my_run" / "can.log"))

    read = [messages.unpack(CanFrame(message.arbitration_id, bytes(message.data))) for message in logged]
    assert sum(isinstance(message, Setpoint) and message.mode == Mode.RUN for message in read) == 49
    speeds = [message for message in read if isinstance(message, WheelSpeeds)]
    assert speeds[-1].state == DriveState.RUNNING
    assert 0.0 < speeds[-1].left_radps < 2.0            # a P3-AT's ramp of 2.7 rad/s2: 1.3 rad/s after 0.49 s


def test_both_logs_of_a_run_hold_every_frame_that_got_through(folder: Path) -> None:
    run_folder = folder / "runs" / "my_run"

    candump, blf = ([(message.arbitration_id, bytes(message.data)) for message in reader] for reader in (
        can.LogReader(run_folder / "can.log"), can.LogReader(run_folder / "can.blf")))

    assert candump == blf
    ledger = pq.read_table(run_folder / "ledger.parquet").filter(pc.field("medium") == "can")
    assert ledger["fate"].unique().to_pylist() == ["delivered"]
    assert len(candump) == ledger.num_rows                # two nodes: each frame has one receiver


def test_the_python_of_the_records_page_reads_that_run(folder: Path, monkeypatch: pytest.MonkeyPatch,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(folder)
    bench = BoardBench()

    for text in blocks("records.md", "python"):
        exec(text.replace('["r1"]', '["drive"]').replace('"y"', '"x"'), {"board": bench.board()})

    printed = capsys.readouterr().out
    assert "delivered" in printed
    assert [kind for _, kind, _, _ in bench.until(1).events] == ["detection", "bid", "C-target", "C-target over"]
    assert f"{490 * MS}" in printed                     # the last sample


def test_the_pingers_of_the_can_page_go_bus_off_on_a_bad_cable_and_come_back(tmp_path: Path,
                                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "pinger", raising=False)
    (tmp_path / "pinger.py").write_text(*blocks("models/can_bus.md", "python"))
    (tmp_path / "cable.toml").write_text(blocks("models/can_bus.md", "toml")[1])

    result = run(load(tmp_path / "cable.toml"), host="inline", out=tmp_path / "run")

    assert [verdict.key for verdict in result.summary.verdicts if not verdict.holds] == []
    counters = load_run(result.folder).counters
    assert counters["a"]["can.bus_off"] > 1
    assert counters["a"]["missed"] > 50


@pytest.mark.parametrize("cls", [CanSettings, CanMessage], ids=lambda cls: cls.__name__)
def test_every_key_of_a_can_bus_is_on_its_page(cls: type) -> None:
    page = (DOCS / "models/can_bus.md").read_text(encoding="utf-8")

    for field in fields(cls):
        name = re.sub("_ns$", "_s", field.name)
        assert f"`{name}`" in page, name


@pytest.mark.parametrize(("page", "cls"), [
    ("drive_controller", DriveController), ("tracking", TrackingRobot), ("tracking", ReferenceRobot),
    ("tracking", BabblingIdiot)])
def test_every_parameter_of_a_program_is_on_its_page(page: str, cls: Any) -> None:
    text = (DOCS / f"models/{page}.md").read_text(encoding="utf-8")

    for field in fields(cls.Settings):
        name = re.sub("_ns$", "_s", field.name)
        assert f"`{name}`" in text, name
