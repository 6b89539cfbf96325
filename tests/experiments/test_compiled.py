"""The compiled modules give what their sources give, and are used exactly when they were made from them.

The whole suite runs on the compiled modules with MARCONET_COMPILED=1 (`make test-all` does that). Tests that compile
are slow: after a change of a source that takes minutes.
"""

from __future__ import annotations

import ast
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from experiments.compiled import build, finder, modules
from experiments.compiled.build import CannotCompile, compile_modules
from experiments.compiled.modules import MODULES, ROOT, compiled_folder, file_of

SHORT = ("--duration", "0.3", "--host")
SCENARIOS = ("output_sync", "output_sync_lossy", "tracking_individual", "p3at_chases_p3at")
MARCONET = "from marconet.command_line import main; main()"
WHICH = "import experiments, netem.node.node; print(experiments.CODE); print(netem.node.node.__file__)"


@pytest.fixture(scope="module")
def compiled() -> Path:
    return compile_modules()


def python(*arguments: str, **environment: str) -> str:
    done = subprocess.run([sys.executable, *arguments], cwd=ROOT, env=os.environ | environment, text=True,
                          capture_output=True, check=False)
    assert done.returncode in (0, 1), done.stderr       # 1: a run that was cut short does not hold what it promises
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_run_leaves_the_same_ledger_compiled_or_not(compiled: Path, tmp_path: Path, scenario: str) -> None:
    summaries = []
    for compiled_or_not, host in (("0", "inline"), ("1", "process")):
        folder = tmp_path / f"{compiled_or_not}{host}"
        python("-c", MARCONET, "run", scenario, *SHORT, host, "--out", str(folder), MARCONET_COMPILED=compiled_or_not)
        summaries.append(msgspec.json.decode((folder / "summary.json").read_bytes()))

    assert [summary["code"] for summary in summaries] == ["interpreted: MARCONET_COMPILED=0", "compiled"]
    assert len({summary["ledger_hash"] for summary in summaries}) == 1
    assert sum(summaries[0]["frames"].values()) > 0


@pytest.mark.slow
def test_what_is_imported_is_the_compiled_module(compiled: Path) -> None:
    code, file = python("-c", WHICH, MARCONET_COMPILED="1").splitlines()

    assert code == "compiled"
    assert compiled in Path(file).parents


@pytest.mark.slow
def test_it_can_be_turned_off(compiled: Path) -> None:
    code, file = python("-c", WHICH, MARCONET_COMPILED="0").splitlines()

    assert code == "interpreted: MARCONET_COMPILED=0"
    assert file == str(ROOT / "netem" / "node" / "node.py")


@pytest.mark.slow
def test_all_of_the_modules_are_used_or_none(compiled: Path) -> None:
    code, file = python("-c", f"import firmware_sim.local_clock, {WHICH.removeprefix('import ')}",
                        MARCONET_COMPILED="1").splitlines()

    assert code == "interpreted: firmware_sim.local_clock was imported before experiments"
    assert file == str(ROOT / "netem" / "node" / "node.py")


def test_a_changed_source_of_any_package_is_not_what_was_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                  ) -> None:
    for package in modules.PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    before = compiled_folder()
    monkeypatch.setattr(modules, "ROOT", tmp_path)
    copied = compiled_folder()
    found = [copied]
    for package in modules.PACKAGES:
        source = next((tmp_path / package).rglob("*.py"))
        source.write_text(source.read_text() + "\n# changed\n")
        found.append(compiled_folder())
    (tmp_path / "netem" / "new.py").write_text("")
    found.append(compiled_folder())

    assert copied == before
    assert len(set(found)) == 2 + len(modules.PACKAGES)


def test_what_an_editor_leaves_beside_a_source_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in modules.PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(modules, "ROOT", tmp_path)
    before = compiled_folder()
    (tmp_path / "netem" / ".#node.py").symlink_to("nowhere.py")

    assert compiled_folder() == before


def test_a_source_that_cannot_be_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modules, "ROOT", tmp_path)
    monkeypatch.setattr(finder, "MODULES", ("not.imported.yet",))
    monkeypatch.delenv("MARCONET_COMPILED")

    assert finder.use_compiled().startswith("interpreted: ")
    assert str(tmp_path) in finder.use_compiled()


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["netem/node", "__mypyc", "empty"])
def test_a_result_that_is_not_whole_is_not_used_and_made_again(compiled: Path, tmp_path: Path,
                                                               monkeypatch: pytest.MonkeyPatch, damage: str) -> None:
    result = tmp_path / "result"
    shutil.copytree(compiled, result)
    assert modules.found_in(result)
    for file in result.rglob("*.so"):
        if damage == "empty" and "agenda" in file.name:
            file.write_bytes(b"")
        elif damage in str(file):
            file.unlink()
    monkeypatch.setattr(finder, "MODULES", ("not.imported.yet",))
    monkeypatch.setattr(finder, "compiled_folder", lambda: result)
    monkeypatch.setattr(build, "compiled_folder", lambda: result)
    monkeypatch.setattr(build, "_compile",
                        lambda draft, asked_for: shutil.copytree(compiled, draft, dirs_exist_ok=True))
    monkeypatch.delenv("MARCONET_COMPILED")

    state = finder.use_compiled()
    mended = modules.found_in(compile_modules())

    assert state.startswith("interpreted: ")
    assert mended.keys() == modules.found_in(compiled).keys()


def test_a_source_that_changes_meanwhile_leaves_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = iter([tmp_path / "before", tmp_path / "after"])
    monkeypatch.setattr(build, "compiled_folder", lambda: next(names))
    monkeypatch.setattr(sys, "executable", shutil.which("true"))

    with pytest.raises(CannotCompile, match="a source was changed meanwhile"):
        compile_modules()

    assert list(tmp_path.iterdir()) == []


def test_without_a_result_for_these_sources_the_sources_are_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                 ) -> None:
    monkeypatch.setattr(finder, "compiled_folder", lambda: tmp_path / "nothing")
    monkeypatch.setattr(finder, "MODULES", ("not.imported.yet",))
    monkeypatch.delenv("MARCONET_COMPILED")

    assert finder.use_compiled() == "interpreted: `marconet compile` was not called, or a source has changed since"


@pytest.mark.parametrize(("missing", "message"), [
    ("mypyc", "mypyc missing in this Python: pip install 'mypy>=2.0' setuptools"),
    ("Python.h", "Python.h: no such file: install the headers of this Python"),
    ("a translation", "compiling failed \\(exit code 1\\)"),
])
def test_what_compiling_takes_is_named_if_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str,
                                                        message: str) -> None:
    monkeypatch.setattr(build, "compiled_folder", lambda: tmp_path / "result")
    if missing == "mypyc":
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "mypyc" else name)
    elif missing == "Python.h":
        monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path))
    else:
        monkeypatch.setattr(sys, "executable", shutil.which("false"))

    with pytest.raises(CannotCompile, match=message):
        compile_modules()

    assert list(tmp_path.iterdir()) == []


def test_a_translation_that_fails_tells_its_errors_and_not_the_end_of_a_traceback(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fails = tmp_path / "fails"
    fails.write_text(f"#!/bin/sh\necho 'ld: cannot find -lm'\necho 'collect2: error: ld returned 1'\n"
                     f"for line in $(seq {build.MOST_CHARACTERS}); do echo '  File translate.py'; done\nexit 1\n")
    fails.chmod(0o755)
    monkeypatch.setattr(build, "compiled_folder", lambda: tmp_path / "result")
    monkeypatch.setattr(sys, "executable", str(fails))

    with pytest.raises(CannotCompile) as failed:
        compile_modules()

    assert str(failed.value) == "compiling failed (exit code 1):\nld: cannot find -lm\ncollect2: error: ld returned 1"


def test_a_class_that_is_named_in_annotations_is_there_when_they_are_checked() -> None:
    """A compiled module checks what it is given against the type itself: imported for type checkers only, it would be
    no type, and the process would crash."""
    wrong = []
    for module in MODULES:
        for node in ast.walk(ast.parse((ROOT / file_of(module)).read_text(encoding="utf-8"))):
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                wrong += [f"{module} imports {found.module}" for found in ast.walk(node)
                          if isinstance(found, ast.ImportFrom) and found.module in MODULES]

    assert wrong == []
