"""A plant is where its time is: what a program sets and reads, and what is recorded, belongs to the present instant."""

from __future__ import annotations

from functools import cache
from math import sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from experiments.judge.run_data import load_run
from experiments.run.node_build import NodeSpecification, PlantSpecification, build_node
from experiments.run.runner import run
from experiments.scenario import load
from firmware_sim.clock_settings import ClockSettings
from fmus.build import build_model, model_folder
from fmus.describe import read_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from netem.core.random_streams import stream
from netem.node.node import Node
from netem.wire.messages import Grant
from tests.examples import examples

CASES = Path(__file__).parents[1] / "cases"
MS = 1_000_000
A, B, C = [[-0.6, -1.0], [1.0, 0.0]], [[1.0], [0.0]], [[0.0, 2.0]]
PROGRAMS = '''
from dataclasses import dataclass
from math import sin


class Steps:
    """Sets and reads without a word of where the plant is; by names, or by groups."""

    @dataclass
    class Settings:
        groups: bool = False
        named: bool = False

    def __init__(self, board, settings):
        self.board, self.k = board, 0
        write, read = board.actuators(["u[1]"]).write, board.sensors(["y[1]"]).read
        self.set = (lambda u: write([u])) if settings.groups else (lambda u: board.actuate("u[1]", u))
        self.get = (lambda: read()[0]) if settings.groups else (lambda: board.sense("y[1]"))
        if settings.named:
            board.record("y[1]", "m", lambda: -1.0)
        board.every(50_000_000, self.step)

    def step(self):
        self.board.event("y", repr(self.get()))
        self.set(sin(0.7 * self.k))
        self.k += 1


class Looks(Steps):
    """Records what a read gives while a sample is taken."""

    def __init__(self, board, settings):
        super().__init__(board, settings)
        board.record("seen", "1", self.get)
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("present")
    (where / "programs_at_present.py").write_text(PROGRAMS)
    return where


def node(folder: Path, sample_period_ns: int, program: str = "Steps", **parameters: object) -> Node:
    start = {"A": A, "B": B, "C": C}
    idle = read_model(model_folder("linear_system") / "variables.toml").idle_outputs(start)
    plant = PlantSpecification(describe(build_model("linear_system")), start, idle_outputs=idle)
    return build_node(NodeSpecification("p", f"programs_at_present:{program}", dict(parameters), {}, ClockSettings(),
                                        plant, {}, sample_period_ns, 1, str(folder)))


@cache
def closed_form() -> list[float]:
    """y at k 50 ms before u changes: the exact step for a held input, by the exponential of the augmented matrix."""
    step = expm(np.block([[np.array(A), np.array(B)], [np.zeros((1, 3))]]) * 0.05)
    x, ys = np.zeros(2), []
    for k in range(41):
        ys.append(float((np.array(C) @ x)[0]))
        x = step[:2, :2] @ x + step[:2, 2] * sin(0.7 * k)
    return ys


@settings(max_examples=examples(40))
@given(sample_period_ns=st.sampled_from([0, MS, 10 * MS, 50 * MS, 100 * MS]) | st.integers(MS // 2, 300 * MS),
       groups=st.booleans())
def test_how_often_a_signal_is_recorded_never_changes_the_physics(sample_period_ns: int, groups: bool, folder: Path,
                                                                  ) -> None:
    report = node(folder, sample_period_ns, groups=groups).advance(Grant(1, 2_000 * MS + 1, False, True, []))

    found = [float(detail) for _, _, detail, _ in report.events]
    assert found == pytest.approx(closed_form(), rel=1e-12, abs=1e-12)


def test_outputs_are_recorded_though_no_program_names_them(folder: Path) -> None:
    subject = node(folder, 50 * MS)

    report = subject.advance(Grant(1, 2_000 * MS + 1, False, True, []))

    assert subject.hello().signals == [("y[1]", "1"), ("x[1]", "1"), ("x[2]", "1")]     # the others stay 0 for good
    assert [values[0] for _, values in report.samples] == pytest.approx(closed_form(), rel=1e-12, abs=1e-12)
    assert all(values[0] == 2.0 * values[2] for _, values in report.samples)


@pytest.mark.parametrize("sample_period_ns", [3 * MS, 10 * MS, 50 * MS])
def test_what_a_program_reads_while_a_sample_is_taken_is_of_the_samples_instant(sample_period_ns: int, folder: Path,
                                                                                ) -> None:
    report = node(folder, sample_period_ns, "Looks", groups=True).advance(Grant(1, 500 * MS, False, True, []))

    seen, recorded = zip(*((values[0], values[1]) for _, values in report.samples), strict=True)
    assert len(set(recorded)) > 8
    assert seen == recorded


def test_a_signal_of_the_program_with_the_name_of_an_output_stands(folder: Path) -> None:
    subject = node(folder, 50 * MS, named=True)

    report = subject.advance(Grant(1, 100 * MS, False, True, []))

    assert subject.hello().signals == [("y[1]", "m"), ("x[1]", "1"), ("x[2]", "1")]
    assert {values[0] for _, values in report.samples} == {-1.0}


def test_ordinary_blocking_code_closes_the_loop(tmp_path: Path) -> None:
    """y(k) = 1 - 0.95^k."""
    (tmp_path / "ctl.py").write_bytes((CASES / "blocking_plant" / "ctl.py").read_bytes())
    (tmp_path / "ctl.toml").write_bytes((CASES / "blocking_plant" / "ctl.toml").read_bytes())

    result = run(load(tmp_path / "ctl.toml"), out=tmp_path / "out", report=False)

    log = next((result.folder / "logs").glob("p*")).read_text()
    assert [float(line.split()[-1]) for line in log.splitlines() if " y " in line] == pytest.approx(
        [1 - 0.95**k for k in (9, 19, 29, 39)], abs=1e-6)
    table = load_run(result.folder).signals["p"]
    at_s = [0.45, 0.95, 1.45, 1.95]
    found = [float(table.column("y[1]")[table.time_ns.tolist().index(round(t * 1e9))]) for t in at_s]
    assert found == pytest.approx([1 - 0.95**k for k in (9, 19, 29, 39)], rel=1e-12)


@pytest.mark.parametrize("host", ["inline", "process"])
def test_with_noise_the_physics_do_not_depend_on_the_recording_or_the_host(host: str, tmp_path: Path) -> None:
    noise = 'agents.p.plant.parameters.G=[[0.5], [0.0]]'

    def at_2_s(period_ms: int, *overrides: str) -> float:
        out = tmp_path / f"{period_ms}{len(overrides)}"
        run(load(CASES / "set_without_advance" / "held.toml", overrides=[f"sample_period_ms={period_ms}", *overrides]),
            host=host, out=out, report=False)
        table = load_run(out).signals["p"]
        return float(table.values[list(table.time_ns).index(2_000 * MS)][0])

    with_noise = [at_2_s(period_ms, noise) for period_ms in (1, 10, 50)]
    seed = int(stream(1, "agents.p.plant").random() * 2**31)
    with Plant(describe(build_model("linear_system")), "p", {"A": A, "B": B, "C": C, "G": [[0.5], [0.0]],
                                                             "noise_seed": seed}) as plant:
        for k in range(40):
            plant.advance_to(k * 50 * MS)
            plant.set("u[1]", sin(0.7 * k))
        plant.advance_to(2_000 * MS)
        alone = plant.get("y[1]")

    assert max(abs(each - alone) for each in with_noise) < 1e-12        # 2 000 steps, each rounds once
    assert abs(at_2_s(50) - with_noise[0]) > 1e-3
    assert abs(at_2_s(50, noise, "seed=2") - with_noise[0]) > 1e-3
