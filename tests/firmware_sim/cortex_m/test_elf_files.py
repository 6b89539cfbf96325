"""An .elf file as a robot's firmware, the compilers that build one, and what is said about it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from firmware_sim.firmware.build import own_firmware
from firmware_sim.firmware.new_folder import write_new
from marconet.command_line import app
from tests.firmware_sim.cortex_m.test_firmware_on_the_chip import ALL, hash_of

GCC = "arm-none-eabi-gcc"
pytestmark = pytest.mark.usefixtures("image")
needs_gcc = pytest.mark.skipif(shutil.which(GCC) is None, reason=f"needs {GCC}: apt-get install gcc-arm-none-eabi")


def marconet(*words: str) -> str:
    done = CliRunner().invoke(app, list(words))
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """Two robots with `firmware = "build/blinker.elf"` and its table beside it."""
    write_new(tmp_path / "blinker")
    path = tmp_path / "blinker" / "two_robots.toml"
    marconet("firmware", "build", str(path.parent), "--target", "cortex_m4", "--out", str(path.parent / "build"))
    shutil.copy(path.parent / "firmware.toml", path.parent / "build")
    path.write_text(path.read_text().replace('firmware = "."', 'firmware = "build/blinker.elf"'))
    return path


def ledger_hash(scenario: Path, out: Path, *overrides: str) -> str:
    return run(load(scenario, overrides=overrides), host="inline", out=out, report=False).summary.ledger_hash


def problem(scenario: Path, *overrides: str) -> str:
    with pytest.raises(ScenarioError) as error:
        load(scenario, overrides=overrides)
    return "\n".join(error.value.problems)


def test_an_elf_file_with_its_table_is_the_firmware_that_it_was_built_from(scenario: Path, tmp_path: Path) -> None:
    of_folder = ledger_hash(scenario, tmp_path / "folder", 'agents_defaults.firmware="."')

    assert ledger_hash(scenario, tmp_path / "elf") == of_folder
    assert ledger_hash(scenario, tmp_path / "other", "agents.b.parameters.period_ms=30") != of_folder


def test_without_a_table_the_values_have_numbers(scenario: Path, tmp_path: Path) -> None:
    named = ledger_hash(scenario, tmp_path / "named")
    (scenario.parent / "build" / "firmware.toml").unlink()
    scenario.write_text(scenario.read_text().replace("period_ms = 70", "values = [[7e7]]").replace(
        "[agents.a]", '[agents.a]\nparameters = { values = [[1e8]] }'))
    lists = 'agents_defaults.parameters={ counters = ["frames heard"], signals = ["sent"] }'

    assert ledger_hash(scenario, tmp_path / "numbered", lists) == named
    assert "unknown key" in problem(scenario, "agents.a.parameters.clock_hz=1_000_000")


@pytest.mark.parametrize(("override", "says"), [
    ('agents_defaults.target="host"', 'an .elf file is for the emulated processor: expected "cortex_m4", or leave it'),
    ('agents_defaults.firmware="other.elf"', "other.elf: no such file: `marconet firmware build FOLDER --target"),
    ('agents_defaults.firmware="build/text.elf"', "text.elf: no .elf file that can be read"),
    ("agents_defaults.clock_hz=1", "clock_hz=1: expected 1000 to 1000000000"),
])
@pytest.mark.parametrize("table", [True, False])
def test_what_cannot_run_is_refused_before_the_run(scenario: Path, override: str, says: str, table: bool) -> None:
    (scenario.parent / "build" / "text.elf").write_text("no image")
    if not table:
        (scenario.parent / "build" / "firmware.toml").unlink()
        scenario.write_text(scenario.read_text().replace("period_ms = 70", ""))

    said = problem(scenario, override)

    assert says in said
    assert "\n" not in said


@needs_gcc
@pytest.mark.parametrize("name", ["output_sync_reference", "output_sync"])
def test_both_compilers_images_hand_out_the_same_frames(name: str, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ARM_CC", raising=False)
    by_zig = hash_of(name, tmp_path / "zig", ALL, 0.25)

    monkeypatch.setenv("ARM_CC", GCC)

    assert hash_of(name, tmp_path / "gcc", ALL, 0.25) == by_zig
    marconet("firmware", "build", "synchronizing_robot", "--target", "cortex_m4", "--out", str(tmp_path))
    assert b"GCC: (" in (tmp_path / "synchronizing_robot.elf").read_bytes()


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("name", own_firmware())
def test_gcc_builds_each_firmware_of_ours_without_a_warning(name: str, tmp_path: Path,
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARM_CC", GCC)

    told = marconet("firmware", "build", name, "--target", "cortex_m4", "--out", str(tmp_path))

    assert told == f"{name}: {tmp_path / name}.elf\n"


@needs_gcc
def test_a_compiler_that_is_named_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARM_CC", "no-such-gcc")
    done = CliRunner().invoke(app, ["firmware", "build", "beacon", "--target", "cortex_m4"])

    assert done.exit_code == 2
    assert done.output == ("no-such-gcc: cannot run the compiler (No such file or directory): set ARM_CC to a GCC for "
                           "arm-none-eabi, or unset it\n")


@pytest.mark.parametrize("compiler", ["", pytest.param(GCC, marks=needs_gcc)])
def test_the_synchronizing_robot_is_small(compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARM_CC", compiler)
    of_folder = marconet("firmware", "info", "synchronizing_robot", "--target", "cortex_m4")
    marconet("firmware", "build", "synchronizing_robot", "--target", "cortex_m4", "--out", str(tmp_path))

    said = marconet("firmware", "info", str(tmp_path / "synchronizing_robot.elf"))

    assert said.partition("\n")[2] == of_folder.rpartition("image ")[2].partition("\n")[2]
    assert int(re.search(r"flash +(\d+) of 524288 bytes", said)[1]) <= 64 * 1024
    assert int(re.search(r"RAM +(\d+) of 131072 bytes", said)[1]) <= 16 * 1024
    assert "stack  4096 of them, down from 0x20001000" in said
    assert re.search(r"entry  reset_handler, startup.c:\d+ \(0x\w+\)", said)
    assert re.search(r"\.bss +RAM +0x2000100[08] +\d+", said)
