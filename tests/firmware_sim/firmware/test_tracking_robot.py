"""The tracking robot in C sends, bit for bit, what the one in Python sends, whatever arrives on its radio and its bus."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from agents.tracking.tracking_robot import COUNTERS
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.problems import ScenarioError
from marconet.running import Run

ROOT = Path(__file__).parents[3]
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
COMPANION = 'program = "agents.tracking.tracking_robot:TrackingRobot"', 'firmware = "tracking_robot"'
DRIVE = 'program = "firmware_sim.drive_controller.drive_controller:DriveController"', 'firmware = "drive"'
POLICY = 'policy = "individual_gains"'
UNIFIED, PERIODIC = 'policy = "unified_gain"', 'policy = "periodic", certified_radius = 4.0'
WHOLE = ["faults_tracking", "tracking_busload", "tracking_individual", "tracking_lossy", "tracking_unified"]

NOISE = '''
from struct import pack

from netem.media.can.frame import CanFrame, pack as pack_can


class Noise:
    """Sends answers and messages of the drive, many of them wrong in a way that a radio and a bus can carry."""

    def __init__(self, board):
        self.board, self.radio, self.can = board, board.port("radio"), board.port("can")
        board.every(7_000_000, self.say)
        board.every(5_300_000, self.tell)

    def say(self):
        rng = self.board.rng
        numbers = [rng.uniform(-3, 3) for _ in range(5)]
        numbers[rng.randrange(5)] = rng.choice([2e2, -1e300, float("nan"), 0.0])
        if rng.random() < 0.4:
            numbers = [rng.uniform(-3, 3) for _ in range(3)] + rng.choice([[1.0, 1.0], [0.6, 0.15], [1.5, 1.0], [4.0, 1.0]])
        look = rng.choice([0xFFFF, 0xFFFF, rng.randrange(100), 0])
        self.radio.send(pack("<BH5d", rng.choice([0xA6, 0xA6, 0xA6, 0xA5]), look, *numbers)[:rng.choice([43, 43, 43, 42])])

    def tell(self):
        rng = self.board.rng
        identifier = rng.choice([0x110, 0x190, 0x190, 0x1A0, 0x710, 0x111])
        data = bytearray(rng.randbytes(rng.choice([8, 8, 8, 8, 7])))
        if len(data) == 8 and rng.random() < 0.8:
            data[2], data[5], data[6] = rng.choice([0, 1, 255]), rng.choice([0, 1, 255, 128]), rng.choice([0, 1, 1, 2])
        self.can.send(pack_can(CanFrame(identifier, bytes(data), extended=rng.random() < 0.1)))
'''
NOISY = '''
[agents.noise]
program = "noise:Noise"
media = ["radio", "can"]

[[impairments]]
on = "radio: reference -> companion"
during_s = [0.4, 0.6]
kind = "bernoulli_loss"
loss_ratio = 0.9

[[faults]]
kind = "clock_step"
name = "back"
on = "companion"
at_s = 0.8
by_ms = -20.3

[[faults]]
kind = "link_down"
name = "loose_plug"
on = "can: drive -> companion"
during_s = [0.2, 0.25]
'''


def tracked(text: str, folder: Path, *, in_c: tuple[tuple[str, str], ...] = (), target: str = "host",
            duration_s: float | None = None, host: HostName = "inline") -> Run:
    for program, firmware in in_c:
        assert program in text
        text = text.replace(program, f'{firmware}\ntarget = "{target}"')
    folder.mkdir(exist_ok=True)
    path = folder / f"{target}{len(in_c)}.toml"
    path.write_text(text)
    result = run(load(path, duration_s=duration_s), host=host, out=folder / path.stem, report=False)
    return Run(result.folder, result.summary)


def scenario(name: str) -> str:
    return (ROOT / f"scenarios/{name}.toml").read_text()


def without_expectations(text: str) -> str:
    return text[:text.index("[media.can.messages]")] + text[text.index("[derived.error]"):text.index("[guarantees")]


@pytest.mark.parametrize(("policy", "duration_s"), [(POLICY, 2.4), (UNIFIED, 0.5), (PERIODIC, 0.5)],
                         ids=["individual", "unified", "periodic"])
def test_a_robot_in_c_leaves_the_ledger_of_one_in_python(policy: str, duration_s: float, tmp_path: Path) -> None:
    text = scenario("tracking_individual").replace(POLICY, policy)

    python = tracked(text, tmp_path, duration_s=duration_s)
    c = tracked(text, tmp_path, in_c=(COMPANION, DRIVE), duration_s=duration_s)

    assert c.ledger_hash == python.ledger_hash
    assert c.counters == python.counters
    assert c.counters["companion"]["measurements"] > 50


def test_a_robot_in_c_does_the_same_with_wrong_frames_lost_answers_and_a_clock_that_steps(tmp_path: Path) -> None:
    text = without_expectations(scenario("tracking_individual")) + NOISY
    (tmp_path / "noise.py").write_text(NOISE)

    python = tracked(text, tmp_path, duration_s=1.2)
    c = tracked(text, tmp_path, in_c=(COMPANION,), duration_s=1.2)

    assert c.ledger_hash == python.ledger_hash
    assert c.counters == python.counters
    assert c.events.drop("wall_clock", strict=False).equals(python.events.drop("wall_clock", strict=False))
    signals = ["held1", "held2", "held3", "tau"]
    assert c.signals["companion"].select(signals).equals(python.signals["companion"].select(signals))
    assert [name for name in COUNTERS if not python.counters["companion"][name]] == []


def test_a_robot_in_c_leaves_the_same_ledger_from_a_process_of_its_own(tmp_path: Path) -> None:
    inline = tracked(scenario("tracking_individual"), tmp_path / "inline", duration_s=0.2)

    process = tracked(scenario("tracking_individual"), tmp_path / "process", in_c=(COMPANION, DRIVE), duration_s=0.2,
                      host="process")

    assert process.ledger_hash == inline.ledger_hash


def test_a_wrong_policy_and_a_start_of_two_numbers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    text = scenario("tracking_individual").replace(*COMPANION)

    path.write_text(text.replace(POLICY, 'policy = "event_triggered"'))
    with pytest.raises(ScenarioError) as policy:
        load(path)
    path.write_text(text.replace(POLICY, "start = [0.0, 1.0]"))
    with pytest.raises(ScenarioError) as start:
        load(path)

    assert "agents.companion.parameters.policy" in str(policy.value)
    assert "agents.companion.parameters.start: 2 numbers: expected x, y and heading" in str(start.value)


@pytest.mark.slow
@pytest.mark.parametrize("in_c", [(COMPANION,), (COMPANION, DRIVE)], ids=["companion", "both"])
@pytest.mark.parametrize("name", WHOLE)
def test_a_robot_in_c_leaves_the_recorded_ledger_of_the_whole_scenario(
        name: str, in_c: tuple[tuple[str, str], ...], tmp_path: Path) -> None:
    assert tracked(scenario(name), tmp_path, in_c=in_c).ledger_hash == HASHES[name]
