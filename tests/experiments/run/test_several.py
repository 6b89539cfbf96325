"""Several scenarios in one call, JSON, JUnit XML, quiet: what scripts and continuous integration rely on."""

from __future__ import annotations

import json
import os
import pty
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner

from marconet.command_line import app

GOOD = """\
# Question: does it hold?
seed = 3
length_s = 0.1
[agents.r1]
program = "beacon_of_these_tests:Beacon"
[agents.r2]
program = "beacon_of_these_tests:Beacon"
parameters = { offset_ms = 5 }
[media.radio]
kind = "broadcast_radio"
[expect]
"count.r2.heard" = { min = 5 }
"""
PROGRAM = """\
from dataclasses import dataclass


class Beacon:
    @dataclass
    class Settings:
        period_ns: int = 10_000_000
        offset_ns: int = 1_000_000

    def __init__(self, board, settings):
        self.board = board
        self.port = board.port("radio", lambda data: board.count("heard"))
        board.every(settings.period_ns, lambda: self.port.send(b"here"), offset_ns=settings.offset_ns)


class Fails(Beacon):
    def run(self):
        yield self.board.until(1_000)
        raise ValueError("no sensor")
"""


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beacon_of_these_tests.py").write_text(PROGRAM)
    (tmp_path / "good.toml").write_text(GOOD)
    (tmp_path / "weak.toml").write_text(GOOD.replace("min = 5", "min = 5000"))
    (tmp_path / "wrong.toml").write_text(GOOD.replace("seed = 3", "sed = 3"))
    (tmp_path / "fails.toml").write_text(GOOD.replace(":Beacon", ":Fails", 1))
    return tmp_path


def marconet(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def run(*arguments: str):
    return marconet("run", "--host", "inline", "--out", "out", *arguments)


@pytest.mark.parametrize(("scenarios", "code"), [
    (["good"], 0), (["good", "weak"], 1), (["weak", "wrong", "good"], 2), (["fails", "wrong", "weak", "good"], 3)])
def test_the_exit_code_is_that_of_the_worst_scenario(scenarios, code, here):
    assert run(*(f"{name}.toml" for name in scenarios)).exit_code == code


def test_several_scenarios_end_with_a_table_and_have_a_folder_each(here):
    result = run("good.toml", "weak.toml", "wrong.toml", "fails.toml")

    rows = [line.split() for line in result.stdout.splitlines()[-4:]]
    assert [row[:4] for row in rows] == [["good", "holds", rows[0][2], "s"], ["weak", "DOES", "NOT", "HOLD"],
                                         ["wrong", "refused", "-", "-"], ["fails", "a", "node", "failed"]]
    assert (here / "out/good/summary.json").is_file()
    assert (here / "out/weak/summary.json").is_file()
    assert any(line.startswith("weak: expect.count.r2.heard=") for line in result.stderr.splitlines())


def test_json_of_a_run_is_one_document_with_summary_folder_and_problems(here):
    result = run("good.toml", "wrong.toml", "--json")

    document = json.loads(result.stdout)
    good, wrong = document["runs"]
    assert document["exit_code"] == 2
    assert (good["scenario"], good["source"], good["exit_code"], good["problems"]) == ("good", "good.toml", 0, [])
    assert good["folder"] == "out/good"
    assert good["summary"] == json.loads((here / "out/good/summary.json").read_bytes())
    assert (wrong["exit_code"], wrong["folder"], wrong["summary"]) == (2, None, None)
    assert wrong["problems"] == ['wrong.toml: sed=3: unknown key; did you mean "seed"?']


def test_json_of_a_check_holds_the_scenario_with_every_default(here):
    document = json.loads(marconet("check", "good.toml", "--json", "--seed", "8").stdout)

    (check,) = document["checks"]
    assert check["resolved"]["seed"] == 8
    assert check["resolved"]["sample_period_ns"] == 10_000_000
    assert not (here / "runs").exists()


def test_json_of_the_list_names_every_scenario_with_question_and_path(here):
    listed = json.loads(marconet("list", "--json").stdout)["scenarios"]

    assert {"output_sync"} <= {entry["name"] for entry in listed}
    assert all(Path(entry["path"]).is_file() for entry in listed)


def test_quiet_prints_errors_only(here):
    assert run("good.toml", "--quiet").output == ""
    assert run("weak.toml", "--quiet", "--overwrite").stderr.startswith("expect.count.r2.heard=")


def test_what_does_not_hold_is_told_once_on_a_terminal_and_on_standard_error_for_scripts(here):
    mine, terminal = pty.openpty()
    command = [sys.executable, "-m", "marconet.command_line", "run", "weak.toml", "--host", "inline", "--no-report",
               "--overwrite", "--out", "out"]
    with open(mine, "rb", buffering=0) as screen:
        shown = subprocess.Popen(command, stdout=terminal, stderr=terminal, cwd=here,
                                 env={**os.environ, "COLUMNS": "200"})
        os.close(terminal)
        on_screen = b""
        with suppress(OSError):                         # EIO: all who wrote to the terminal are gone
            while part := screen.read(1 << 16):
                on_screen += part
    apart = subprocess.run(command, capture_output=True, text=True, cwd=here, timeout=60)

    assert (shown.wait(60), apart.returncode) == (1, 1)
    assert on_screen.count(b"below the least allowed") == 1
    assert apart.stdout.count("below the least allowed") == 1
    assert apart.stderr.startswith("expect.count.r2.heard=")


def test_junit_has_a_case_for_each_expectation_and_tells_failures_from_errors(here):
    run("good.toml", "weak.toml", "wrong.toml", "--junit", "deep/junit.xml")

    suites = ElementTree.parse(here / "deep/junit.xml").getroot().findall("testsuite")
    told = {suite.get("name"): [(case.get("name"), [part.tag for part in case]) for case in suite.iter("testcase")]
            for suite in suites}
    assert told == {"good": [("expect.count.r2.heard", [])], "weak": [("expect.count.r2.heard", ["failure"])],
                    "wrong": [("run", ["error"])]}
    assert [(suite.get("tests"), suite.get("failures"), suite.get("errors")) for suite in suites] == [
        ("1", "0", "0"), ("1", "1", "0"), ("1", "0", "1")]


def test_two_scenarios_of_one_name_have_a_folder_each(here):
    other = here / "other"
    other.mkdir()
    shutil.copy(here / "good.toml", other)
    shutil.copy(here / "beacon_of_these_tests.py", other)
    result = CliRunner().invoke(app, ["run", "good.toml", "other/good.toml", "--host", "inline", "--out", "both",
                                      "--no-report"])
    assert result.exit_code == 0, result.output
    assert sorted(path.parent.name for path in (here / "both").glob("*/summary.json")) == ["good", "good-2"]


def test_check_of_several_scenarios_tells_each(here):
    result = marconet("check", "good.toml", "wrong.toml")

    assert result.exit_code == 2
    assert [line.split()[:2] for line in result.stdout.splitlines()[-2:]] == [["good", "ok"], ["wrong", "refused"]]


# --- as a process of its own

def command(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "marconet.command_line", *arguments], capture_output=True,
                          text=True, check=False,
                          env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), **environment})


def test_version_is_that_of_the_package(here):
    assert command("--version").stdout.startswith("marconet 0.")


@pytest.mark.parametrize(("typed", "offered"), [
    ("marconet ru", "run"), ("marconet check output_syn", "output_sync_16"), ("marconet run x --host ", "inline"),
    ("marconet table ", "3.4"), ("marconet fmu info wheel", "wheel_motor")])
def test_the_shell_completes_commands_scenarios_plants_and_choices(typed, offered, here):
    shown = command(_MARCONET_COMPLETE="bash_complete", COMP_WORDS=typed, COMP_CWORD=str(typed.count(" ")))

    assert f"plain,{offered}" in shown.stdout.splitlines()


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash: `apt-get install bash`")
@pytest.mark.parametrize(("typed", "offered"), [
    ("run output_sync_fo", ["output_sync_formation"]),       # a name
    ("run output_sync_lo", ["output_sync_longer.toml", "output_sync_lossy"]),       # a name and a file
    ("run goo", ["good.toml"]),
    ("run good.toml output_sync_fo", ["output_sync_formation"]),
    ("fmu info wheel", ["wheel_motor", "wheel_of_mine"]),
    ("run ./goo", []),                                      # bash completes paths itself
    ("ch", ["check"])])
def test_bash_has_names_and_files_to_choose_from(typed, offered, here):
    (here / "output_sync_longer.toml").write_text(GOOD)
    (here / "wheel_of_mine").mkdir()
    (here / "wheel_of_mine" / "variables.toml").write_text("")
    marconet = here / "marconet"
    marconet.write_text(f"#!/bin/sh\nPYTHONPATH={Path(__file__).parents[3]} exec {sys.executable} -m "
                        'marconet.command_line "$@"\n')
    marconet.chmod(0o755)
    words = ["marconet", *typed.split()]
    asked = (f"{command('--show-completion', 'bash').stdout}\ncompopt() {{ :; }}\nCOMP_WORDS=({' '.join(words)})\n"
             f"COMP_CWORD={len(words) - 1}\n_marconet_completion {marconet}\nprintf '%s\\n' \"${{COMPREPLY[@]}}\"")

    shown = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=True)

    assert sorted(shown.stdout.split()) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_is_shown_and_installed_below_home(shell, here):
    shown = command("--show-completion", shell).stdout
    installed = command("--install-completion", shell, HOME=str(here))

    file = Path(installed.stdout.splitlines()[0].removeprefix("completion: "))
    assert "_MARCONET_COMPLETE" in shown
    assert here in file.parents
    assert file.read_text().strip() == shown.strip()


@pytest.mark.slow
def test_colours_are_asked_for_and_refused_by_the_environment(here):
    forced = command("check", "good.toml", FORCE_COLOR="1", NO_COLOR="")
    refused = command("run", "good.toml", "--host", "inline", "--out", "out", FORCE_COLOR="1", NO_COLOR="1",
                      TERM="xterm")

    colours = [f"\x1b[{number}m" for number in range(30, 48)]
    assert "\x1b[1m" in forced.stdout
    assert not any(colour in refused.stdout for colour in colours)
    assert "\x1b" not in command("check", "good.toml", FORCE_COLOR="").stdout


@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_scenario_whose_program_fails_says_where_its_records_are(here, host):
    told = json.loads(run("fails.toml", "good.toml", "--json", "--host", host).stdout)["runs"]

    assert [outcome["exit_code"] for outcome in told] == [3, 0]
    assert [(here / outcome["folder"] / "summary.json").is_file() for outcome in told] == [True, True]
