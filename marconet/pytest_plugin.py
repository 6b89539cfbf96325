"""pytest plugin: scenario files as tests, and a fixture that runs a scenario with changes in a line.

    pytest scenarios/                     every scenario there is a test: its [expect] has to hold
    pytest scenarios/ --seeds 1,2,3       each with these seeds instead of its own
    def test_x(marconet): assert marconet("door.toml", set={"media.radio.preset": "xbee_s2c"}).holds
    @pytest.mark.marconet(real_time=True)     of a test with a device: the fixture runs at the pace of the wall clock

A scenario file is collected if the command line or the ini option `marconet_scenarios` names it or a folder above it.
A test with the marker `@pytest.mark.seeds(1, 2, 3)` runs once with each seed, which the fixture uses unless the call
names one; in a test with `@pytest.mark.marconet(real_time=True)`, or `rate=0.5`, the fixture runs in real time, unless
the call says otherwise.
"""

from __future__ import annotations

import tomllib
from argparse import ArgumentTypeError
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import pytest

if TYPE_CHECKING:                       # at run time the functions import them, as pytest always loads this file
    from marconet.running import Run
    from marconet.scenario import Scenario


class RunIt(Protocol):
    """Signature of the fixture `marconet`."""

    def __call__(self, scenario: Scenario | str | PurePath, *, set: dict[str, Any] | None = None,
                 seed: int | None = None, length_s: float | None = None,
                 host: Literal["inline", "process"] = "process", real_time: bool | None = None,
                 rate: float | None = None) -> Run: ...


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("marconet")
    group.addoption("--seeds", metavar="N,N,...", type=_seeds, default=(),
                    help="run each scenario file with these seeds")
    group.addoption("--marconet-host", choices=("inline", "process"), default="process",
                    help="a process for each robot (default), or all in one")
    parser.addini("marconet_scenarios", "folders or files whose scenarios are tests", type="paths", default=[])


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "seeds(*numbers): run the test once with each seed of the fixture `marconet`")
    config.addinivalue_line("markers", "marconet(real_time=False, rate=None): pace of the fixture `marconet`")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.suffix != ".toml" or not _asked_for(file_path, parent.config) or not _is_scenario(file_path):
        return None
    return ScenarioFile.from_parent(parent, path=file_path)


class ScenarioFile(pytest.File):
    def collect(self) -> Iterator[pytest.Item]:
        for seed in self.config.getoption("--seeds") or (None,):
            name = self.path.stem if seed is None else f"{self.path.stem}[seed {seed}]"
            yield ScenarioItem.from_parent(self, name=name, seed=seed)


class ScenarioItem(pytest.Item):
    def __init__(self, *, seed: int | None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.seed = seed

    def runtest(self) -> None:
        from marconet import load
        from marconet import run as run_scenario

        out = self.config._tmp_path_factory.mktemp(self.path.stem)  # type: ignore[attr-defined]  # for items: no fixtures
        run = run_scenario(load(self.path, seed=self.seed), host=self.config.getoption("--marconet-host"), out=out,
                           overwrite=True)
        if not run.holds:
            raise Violated(run)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> str:
        if isinstance(excinfo.value, Violated):
            return told(excinfo.value.run)
        return f"{type(excinfo.value).__name__}: {excinfo.value}"

    def reportinfo(self) -> tuple[Path, int, str]:
        return self.path, 0, f"scenario {self.name}"


class Violated(Exception):
    """An expectation of a run does not hold."""

    def __init__(self, run: Run) -> None:
        super().__init__(told(run))
        self.run = run


@pytest.fixture
def marconet(request: pytest.FixtureRequest, tmp_path: Path) -> RunIt:
    """Function that runs a scenario, given by path, name or `marconet.Scenario`, with its records in `tmp_path`."""
    from marconet import Scenario, load
    from marconet import run as run_scenario

    number, usual = 0, _pace(request.node.get_closest_marker("marconet"))

    def run_it(scenario: Scenario | str | PurePath, *, set: dict[str, Any] | None = None,
               seed: int | None = None, length_s: float | None = None,
               host: Literal["inline", "process"] = "process", real_time: bool | None = None,
               rate: float | None = None) -> Run:
        nonlocal number
        number += 1
        if isinstance(scenario, Scenario):
            if set or seed is not None or length_s is not None:
                raise ValueError(f"{scenario.name}: changes are made to a scenario file: give its path")
        else:
            if seed is None and hasattr(request.node, "callspec"):
                seed = request.node.callspec.params.get("marconet_seed")
            scenario = load(scenario, set=set, seed=seed, length_s=length_s)
        if real_time is None:
            real_time = usual.real_time or rate is not None
        return run_scenario(scenario, host=host, out=tmp_path / f"{scenario.name}-{number}", real_time=real_time,
                            rate=(rate if rate is not None else usual.rate) if real_time else None)

    return run_it


class Pace(NamedTuple):
    """How the fixture runs scenarios: in real time, and at how many virtual seconds per second (None: the file's)."""

    real_time: bool = False
    rate: float | None = None


def _pace(marker: pytest.Mark | None) -> Pace:
    """Return what the marker `marconet` says; raises ValueError for an argument that it does not have."""
    if marker is None:
        return Pace()
    wrong = [*map(repr, marker.args), *(key for key in marker.kwargs if key not in Pace._fields)]
    if wrong:
        raise ValueError(f"@pytest.mark.marconet: {', '.join(wrong)}: expected real_time=True, rate=0.5 or both")
    pace = Pace(**marker.kwargs)
    return pace._replace(real_time=pace.real_time or pace.rate is not None)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    marker = metafunc.definition.get_closest_marker("seeds")
    if marker is not None and "marconet" in metafunc.fixturenames:
        metafunc.fixturenames.append("marconet_seed")
        metafunc.parametrize("marconet_seed", marker.args, ids=[f"seed {seed}" for seed in marker.args])


def told(run: Run) -> str:
    """Describe a failed run: its first violated expectation with the instant, its folder, the command to repeat it."""
    return f"{run.first_violation()}\nrecords: {run.folder}\nrepeat:  {run.repeat()}"


def _asked_for(file: Path, config: pytest.Config) -> bool:
    named = [config.invocation_params.dir / argument.partition("::")[0] for argument in config.args]
    by_hand = config.args_source is pytest.Config.ArgsSource.ARGS
    places = [*(named if by_hand else []), *config.getini("marconet_scenarios")]
    return any(place == file or place in file.parents for place in places)


def _is_scenario(file: Path) -> bool:
    """Whether the file has the tables of a scenario; true for one that is no TOML, so that the test shows its error."""
    try:
        return "agents" in tomllib.loads(file.read_text("utf-8", errors="replace"))
    except tomllib.TOMLDecodeError:
        return True


def _seeds(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise ArgumentTypeError(f"{text!r}: expected whole numbers with commas between them, as 1,2,3") from None
