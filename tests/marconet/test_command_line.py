"""The command as a user meets it: help, exit codes, what is printed where. The runner is a stub, called so."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

from experiments.judge.run_result import Progress, RunResult, Summary, Verdict
from marconet.command_line import app
from netem.wire.errors import InstantLoop, NodeFailure

SCENARIO = """\
# Question: does the command work?
seed = 3
length_s = 2.0
[agents.r1]
program = "talker_of_the_command_tests:Talker"
[agents.r2]
program = "talker_of_the_command_tests:Talker"
[media.radio]
kind = "broadcast_radio"
[[impairments]]
on = "radio: r1 -> r2"
kind = "bernoulli_loss"
loss_ratio = 0.1
[expect]
frames_lost_on_link = { min = 50 }
"""
COMMANDS = [[], ["list"], ["check"], ["run"], ["report"], ["schema"], ["table"], ["compile"], ["fmu"], ["fmu", "list"],
            ["fmu", "info"], ["fmu", "build"], ["firmware"], ["firmware", "new"], ["firmware", "build"],
            ["firmware", "info"], ["sweep"], ["compare"], ["export"], ["fault"], ["break"],
            ["shrink"], ["certificates"], ["certificates", "new"], ["certificates", "show"], ["certificates", "check"]]


class StubRunner:
    """Stands for experiments.run.runner: tells some progress and ends as it is told to."""

    def __init__(self) -> None:
        self.verdicts = [Verdict("frames_lost_on_link", 60.0, 50.0, None, True)]
        self.error: BaseException | None = None
        self.calls: list[tuple[object, str, Path]] = []

    def run(self, scenario, *, host, out, progress, report=True, **options):
        self.calls.append((scenario, host, out))
        self.reports = report
        out.mkdir(parents=True)
        (out / "scenario.json").write_text("{}")
        progress(Progress(0, scenario.length_ns, 0.0, 0, {}))
        if self.error is not None:
            raise self.error
        progress(Progress(scenario.length_ns, scenario.length_ns, 0.5, 9, {"delivered": 540, "lost": 60}))
        (out / "report.html").write_text("")
        frames = {"delivered": 540, "lost": 60}
        return RunResult(out, Summary(scenario.name, scenario.question, scenario.seed, host, scenario.length_ns, 0.5,
                                      0.2, 4.0, 9, 18, "abcd", frames, self.verdicts, "report.html"))


@pytest.fixture
def stub(monkeypatch) -> StubRunner:
    stub = StubRunner()
    module = ModuleType("experiments.run.runner")
    module.run = stub.run
    monkeypatch.setitem(sys.modules, "experiments.run.runner", module)
    monkeypatch.setattr("experiments.run.runner", module, raising=False)
    return stub


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "talker_of_the_command_tests.py").write_text(
        "class Talker:\n    def __init__(self, board): pass\n")
    (tmp_path / "talk.toml").write_text(SCENARIO)
    return tmp_path


def marconet(*arguments: str):
    return CliRunner().invoke(app, list(arguments), env={"COLUMNS": "200"})


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_help_of_every_command_has_an_example_of_it(command):
    result = marconet(*command, "--help")

    assert result.exit_code == 0
    assert f"Example: marconet {' '.join(command)}".rstrip() in " ".join(result.stdout.split())


def test_no_summary_in_a_list_of_commands_is_cut_and_no_help_shows_a_range_of_click():
    for command in COMMANDS:
        words = marconet(*command, "--help").stdout
        assert [sign for sign in ("x>=", "<=x") if sign in words] == [], command
    for group in ((), ("fmu",), ("firmware",), ("certificates",)):
        told = CliRunner().invoke(app, [*group, "--help"], env={"COLUMNS": "80"}).stdout
        assert "..." not in told.split("Commands:")[1], group


def test_no_command_is_missing_from_the_help_tests():
    groups = ("fmu", "firmware", "certificates")
    of_groups = {(group, name) for group in groups for name in app.commands[group].commands}

    assert of_groups | {(name,) for name in app.commands} | {()} == set(map(tuple, COMMANDS))


def test_the_examples_of_run_and_check_can_be_run(stub, here):
    assert marconet("check", "output_sync", "--set", "impairments[0].loss_ratio=0.3").exit_code == 0
    assert marconet("run", "output_sync", "--seed", "3", "--set", "impairments[0].loss_ratio=0.3",
                    "--out", "runs/third").exit_code == 0


def test_help_needs_no_heavy_module():
    code = ("import sys, marconet.command_line\n"
            "print([m for m in ('pydantic', 'rich', 'msgspec', 'zenoh', "
            "'numpy', 'pyarrow', 'fmpy', 'scipy', 'cryptography') if m in sys.modules])")

    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


# --- run

def test_a_run_whose_expectations_hold_exits_with_0_and_shows_figures_and_report(stub, here):
    result = marconet("run", "talk.toml", "--out", "runs/one")

    assert result.exit_code == 0
    assert "540 delivered, 60 lost on link" in result.stdout
    assert "4.0 x real time" in result.stdout
    assert "holds" in result.stdout
    assert result.stdout.splitlines()[-1] == "report: runs/one/report.html"


def test_a_broken_expectation_exits_with_1_and_says_which_and_by_how_much(stub, here):
    stub.verdicts = [Verdict("frames_lost_on_link", 38.0, 50.0, None, False),
                     Verdict("*.y.last_abs", 0.25, None, 0.125, False),
                     Verdict("r1.z.last", None, 0.0, 1.0, False), Verdict("frames_offered", 1.0, None, 2.0, True)]

    result = marconet("run", "talk.toml")

    assert result.exit_code == 1
    assert result.stderr.splitlines() == [
        "expect.frames_lost_on_link=38.0: 12 below the least allowed, 50",
        "expect.*.y.last_abs=0.25: 0.125 above the most allowed, 0.125",
        "expect.r1.z.last: the run has no such figure"]


def test_options_reach_the_runner(stub, here):
    marconet("run", "talk.toml", "--seed", "11", "--duration", "0.5", "--host", "inline",
             "--set", "impairments[0].loss_ratio=0.9", "--set", "node_timeout_s=2")

    ((scenario, host, folder),) = stub.calls
    assert (scenario.seed, scenario.length_ns, host, scenario.node_timeout_s) == (11, 500_000_000, "inline", 2.0)
    assert scenario.impairments[0].fields == {"loss_ratio": 0.9}
    assert folder.parent == Path("runs")
    assert folder.name.startswith("talk-")
    assert stub.reports


def test_a_run_can_do_without_its_report(stub, here):
    assert marconet("run", "talk.toml", "--no-report").exit_code == 0

    assert not stub.reports


def test_bad_input_exits_with_2_and_all_problems_and_no_traceback(stub, here):
    (here / "talk.toml").write_text(SCENARIO.replace("seed = 3", "sed = 3").replace("0.1", "1.1"))

    result = marconet("run", "talk.toml")

    assert result.exit_code == 2
    assert result.stderr.splitlines() == ['talk.toml: sed=3: unknown key; did you mean "seed"?',
                                          "talk.toml: impairments[0].loss_ratio=1.1: expected 0 <= loss_ratio <= 1"]
    assert stub.calls == []


@pytest.mark.parametrize("arguments", [
    "run nothing.toml", "run nothing", "run", "run talk.toml --host cloud", "run talk.toml --duration -1",
    "run talk.toml --duration x", "run talk.toml --set a", "run talk.toml --out talk.toml", "run talk.toml --out .",
    "report nowhere", "table 3.6", "table", "table 3.1 --runs 1", "table 3.2 --figures .",
    "table 3.2 --figures talk.toml/page.html", "fmu info nothing.fmu", "fmu build nothing", "fmu build --fmi 1.0",
    "walk"])
def test_bad_arguments_exit_with_2(arguments, stub, here):
    result = marconet(*arguments.split())

    assert result.exit_code == 2
    assert result.stderr.strip()
    assert "Traceback" not in result.stderr
    assert stub.calls == []


@pytest.mark.parametrize("out", ["talk.toml/run", "talk.toml/a/b"])
def test_a_folder_below_a_file_is_refused_by_the_name_that_was_given(out, stub, here):
    result = marconet("run", "talk.toml", "--out", out)

    assert result.exit_code == 2
    assert result.stderr.splitlines() == [f"--out {out}: talk.toml is a file: expected a folder of a run or a path "
                                          "where one can be made; name another"]
    assert stub.calls == []


@pytest.mark.parametrize("error", [NodeFailure("r1", "exited with code 9", last_report="12 ns"),
                                   InstantLoop(5, ["r1", "r2"], 100)])
def test_a_failed_node_exits_with_3_and_says_where_the_records_are(error, stub, here):
    stub.error = error

    result = marconet("run", "talk.toml", "--out", "runs/one")

    assert result.exit_code == 3
    assert result.stderr.splitlines() == [str(error), "what was recorded: runs/one"]


def test_ctrl_c_exits_with_130_and_says_where_the_records_are(stub, here):
    stub.error = KeyboardInterrupt()

    result = marconet("run", "talk.toml", "--out", "runs/one")

    assert result.exit_code == 130
    assert result.stderr.splitlines() == ["interrupted (SIGINT)", "what was recorded: runs/one"]


def test_a_defect_exits_with_4_and_says_how_to_see_more(stub, here):
    stub.error = AssertionError("a copy was counted twice")

    result = marconet("run", "talk.toml")

    assert result.exit_code == 4
    assert result.stderr.startswith("AssertionError: a copy was counted twice\nthis is a defect of marconet")
    assert "Traceback" not in result.stderr


def test_traceback_shows_where_an_error_came_from(stub, here):
    stub.error = AssertionError("a copy was counted twice")

    assert "Traceback" in marconet("run", "talk.toml", "--traceback").stderr
    assert "Traceback" in marconet("check", "nothing", "--traceback").stderr


# --- the other commands

def test_check_prints_what_would_run_and_runs_nothing(stub, here):
    result = marconet("check", "talk.toml", "--duration", "1.5")

    assert result.exit_code == 0
    assert "talk: does the command work?" in result.stdout
    for word in ("1.5 s", "r1", "talker_of_the_command_tests:Talker", "bernoulli_loss", "radio: r1 -> r2",
                 "frames_lost_on_link"):
        assert word in result.stdout
    assert stub.calls == []


def test_check_calls_an_impairment_by_its_name_as_the_ledger_does(here):
    (here / "talk.toml").write_text(SCENARIO.replace("[[impairments]]\n", '[[impairments]]\nname = "steel_door"\n'))

    result = marconet("check", "talk.toml")

    assert "steel_door" in result.stdout
    assert "impairments[0]" not in result.stdout


def test_list_names_scenarios_with_their_questions(here):
    (here / "scenarios").mkdir()
    (here / "scenarios" / "talk.toml").write_text(SCENARIO)

    result = marconet("list")

    assert result.exit_code == 0
    assert any(line.split(maxsplit=1) == ["talk", "does the command work?"]
               for line in map(str.strip, result.stdout.splitlines()))
    assert "output_sync" in result.stdout


@pytest.mark.parametrize("verb", ["info", "build"])
def test_an_unknown_plant_is_refused_with_the_nearest(verb, here):
    (here / "cart").mkdir()
    (here / "cart" / "variables.toml").write_text("")

    own, beside = marconet("fmu", verb, "linear_sistem"), marconet("fmu", verb, "kart")

    assert (own.exit_code, own.stderr) == (2, 'linear_sistem: no such plant; did you mean "linear_system"?\n')
    assert (beside.exit_code, beside.stderr) == (2, 'kart: no such plant; did you mean "cart"?\n')


def test_a_report_of_no_run_is_refused_with_the_newest_run_below(here):
    for name, changed_s in (("old", 1), ("new", 2)):
        (here / "runs" / name).mkdir(parents=True)
        (here / "runs" / name / "scenario.json").write_text("{}")
        os.utime(here / "runs" / name, (changed_s, changed_s))

    above, file, nowhere = (marconet("report", path) for path in ("runs", "runs/old/scenario.json", "rums"))

    assert above.stderr == ("runs: no run was recorded there: it has no scenario.json; the newest run in it is "
                            "runs/new\n")
    assert file.stderr.endswith("no run was recorded there: give the folder of a run\n")
    assert nowhere.stderr == "rums: no run was recorded there: there is no such folder\n"
    assert {above.exit_code, file.exit_code, nowhere.exit_code} == {2}


def test_plants_are_listed_described_and_built():
    assert "wheel_motor" in marconet("fmu", "list").stdout
    described = marconet("fmu", "info", "wheel_motor").stdout
    built = marconet("fmu", "build", "wheel_motor", "--fmi", "2.0").stdout

    assert "terminal voltage" in described
    assert "rad/s" in described
    assert Path(built.removeprefix("wheel_motor: ").strip()).is_file()
