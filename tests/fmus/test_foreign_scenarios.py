"""FMUs as tools export them, in whole scenarios: what `check` refuses, what runs, and what ends a run."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pyarrow.parquet import read_table

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from tests.fmus.foreign_fmus import stair, steps, types_fmi3

CASES = Path(__file__).parents[1] / "cases"
PROBE = '''
from dataclasses import dataclass, field


class Probe:
    """Steps, reads and sets its plant by its own clock; a truth of its own goes into the record."""

    @dataclass
    class Settings:
        period_ns: int
        inputs: list = field(default_factory=list)

    def __init__(self, board, settings):
        for k, value in enumerate(settings.inputs):
            board.at(k * settings.period_ns, lambda value=value: board.actuate("u", value))


class Quiet:
    def __init__(self, board):
        pass
'''
Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Iterator[Write]:
    import sys

    name = "probes_of_foreign_plants"
    (tmp_path / f"{name}.py").write_text(PROBE)
    sys.modules.pop(name, None)

    def scenario(text: str) -> Path:
        (tmp_path / "case.toml").write_text(f"# A case.\n# Question: does it run?\nseed = 1\n{text}")
        return tmp_path / "case.toml"

    yield scenario
    sys.modules.pop(name, None)


def one(plant: str, program: str = "Probe", parameters: str = "{ period_ms = 10 }", length: str = "0.1",
        rest: str = "") -> str:
    return (f'length_s = {length}\n{rest}\n[agents.a]\nprogram = "probes_of_foreign_plants:{program}"\n'
            + (f"parameters = {parameters}\n" if program == "Probe" else "")
            + f'plant = {plant}\n[media.radio]\nkind = "broadcast_radio"\npreset = "ideal"\n')


def test_every_start_value_goes_from_the_scenario_into_the_plant_on_both_hosts(write: Write, tmp_path: Path) -> None:
    types_fmi3(tmp_path)
    scenario = load(write(one('{ fmu = "types3.fmu", parameters = { rows = 1, columns = 2, matrix = [[1.5, 2]], '
                              'u64 = 18446744073709551615, i8 = -128, mode = "slow", blob = "00ff", vector = 7, '
                              'flag = true, text = "b.txt", texts = ["x", "y"] } }', "Quiet")))

    for host in ("inline", "process"):
        result = run(scenario, host=host, out=tmp_path / host, report=False)      # type: ignore[arg-type]
        table = load_run(result.folder).signals["a"]
        assert table.names == ("vector[1]", "vector[2]", "sum")
        assert set(table.column("sum")) == {3.5}
        assert set(table.column("vector[2]")) == {7.0}


@pytest.mark.parametrize(("parameters", "line"), [
    ("i8 = 128", "i8=128: expected -128 to 127, the range of Int8"),
    ('mode = "fast"', 'mode="fast": expected the number or name of an item: off (1), slow (2), far (-7000000000)'),
    ("matrix = [[1]]", "matrix=[[1]]: expected a number for all elements, or nested lists of 2 x 3"),
    ('blob = "0g"', 'blob="0g": expected hexadecimal digits in quotes, two a byte: "00ff"'),
    ("sum = 1", "sum=1: is an output: it has no start value to set"),
    ("matrix = [[1, 2, 3]], rows = 0", "rows=0: expected at least 1: it is the size of an array"),
])
def test_what_no_plant_would_take_is_refused_by_check(parameters: str, line: str, write: Write, tmp_path: Path) -> None:
    types_fmi3(tmp_path)

    with pytest.raises(ScenarioError) as error:
        load(write(one(f'{{ fmu = "types3.fmu", parameters = {{ {parameters} }} }}')))

    assert f"case.toml: agents.a.plant.parameters.{line}" in error.value.problems


@pytest.mark.parametrize(("named", "step", "line"), [
    (False, "", "step_ms: is missing: the FMU takes only steps of one size (canHandleVariableCommunicationStepSize is "
                "not true) and its description names none; give the step that it was exported with"),
    (True, ", step_us = 5000", "step_us=5000: the FMU's description says a step of 4 ms; leave the key out"),
    (False, ", step_ms = 0", "step_ms=0: expected a step above 0"),
])
def test_a_step_that_is_missing_or_differs_is_refused_by_check(named: bool, step: str, line: str, write: Write,
                                                               tmp_path: Path) -> None:
    steps(tmp_path, 0.004, named=named)

    with pytest.raises(ScenarioError) as error:
        load(write(one(f'{{ fmu = "steps.fmu"{step} }}')))

    assert error.value.problems == [f"case.toml: agents.a.plant.{line}"]


def test_fixed_steps_go_with_clocks_that_drift_and_cameras_that_look(write: Write, tmp_path: Path) -> None:
    """Oracle: the k-th setting comes when the clock reads k 10 ms, and acts from the next multiple of 4 ms on."""
    steps(tmp_path, 0.004, named=False)
    text = one('{ fmu = "steps.fmu", step_ms = 4 }', parameters="{ period_ms = 10, inputs = [3, 1, -2, 5, 4, 0] }",
               rest="sample_period_ms = 7") + (
        '[media.eyes]\nkind = "sensing"\nexposure_period_ms = 13\nlatency_ms = 5\n'
        'bodies = { a = ["x", "y", "heading"] }\n')
    text = text.replace('plant = {', 'clock = { drift_ppm = 3000.0, offset_us = 100 }\nplant = {')

    result = run(load(write(text)), host="inline", out=tmp_path / "out", report=False)

    settings = [(0.0, 3), *(((k * 10e-3 - 100e-6) / 1.003, u) for k, u in enumerate((1, -2, 5, 4, 0), start=1))]
    x, points = 0.0, [0.0]
    for k in range(30):
        x += 0.004 * [u for at_s, u in settings if at_s <= k * 0.004 + 1e-12][-1]
        points.append(x)
    table = load_run(result.folder).signals["a"]
    assert list(table.column("x")) == pytest.approx([points[t_ns // 4_000_000] for t_ns in table.time_ns.tolist()])


@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_model_that_ends_by_itself_ends_its_run_which_says_so(host: str, write: Write, tmp_path: Path) -> None:
    stair(tmp_path)
    path = write(one('{ fmu = "stair.fmu" }', "Quiet", length="2.0", rest="sample_period_ms = 50") + (
        '[expect]\n"a.level.max" = { max = 4, min = 4 }\n'))

    result = run(load(path), host=host, out=tmp_path / "out")      # type: ignore[arg-type]

    data = load_run(result.folder)
    assert result.summary.holds
    assert result.summary.ended.startswith("at 0.5 s, by node a: ")
    assert result.summary.ended.endswith("stair.fmu: a: the model ended the simulation by itself at t=0.5 s")
    assert data.length_ns == 500_000_000
    assert data.signals["a"].time_ns.tolist() == [k * 50_000_000 for k in range(10)]
    assert [(event.kind, event.time_ns) for event in data.events] == [("run ended", 500_000_000)]
    assert "The run ended at 0.5 s" in (result.folder / "report.html").read_text(encoding="utf-8")


def test_a_run_that_ends_early_ends_for_everybody_at_one_instant(write: Write, tmp_path: Path) -> None:
    steps(tmp_path, stop_s=0.055)
    path = write(one('{ fmu = "steps.fmu" }', length="1.0")
                 + '[agents.b]\nprogram = "beacons_of_foreign_plants:Beacon"\n')
    (tmp_path / "beacons_of_foreign_plants.py").write_text('''
class Beacon:
    def __init__(self, board):
        board.record("k", "1", lambda: board.now_ns / 1e6)
        board.every(3_000_000, lambda: board.port("radio").send(b"x"))
''')

    results = [run(load(path), host=host, out=tmp_path / host, report=False) for host in ("inline", "process")]

    assert len({result.summary.ledger_hash for result in results}) == 1
    for result in results:
        data = load_run(result.folder)
        offered_ns = read_table(result.folder / "ledger.parquet", columns=["offered_ns"])["offered_ns"].to_pylist()
        assert 60_000_000 <= data.length_ns < 70_000_000        # `a` is looked at every 10 ms
        assert data.signals["b"].time_ns.max() <= data.length_ns
        assert max(offered_ns) < data.length_ns


@pytest.mark.parametrize("case", ["fmu_backslashes", "fmu_dot_slash", "fmu_enum_start", "fmu_integer_start",
                                  "fmu_fixed_step", "fmu_discard"])
def test_the_cases_that_users_brought_run(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    shutil.copytree(CASES / case, tmp_path / case)
    for file in sorted((tmp_path / case).glob("*.toml")):
        monkeypatch.setattr(sys, "path", [*sys.path])
        sys.modules.pop("probe", None)
        result = run(load(file), host="inline", out=tmp_path / file.stem, report=False)

        assert bool(result.summary.ended) == (case == "fmu_discard")
    sys.modules.pop("probe", None)
