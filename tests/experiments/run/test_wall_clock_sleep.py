"""`time.sleep` is replaced in authors' modules, those included that were imported since the last look, and put back."""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from experiments.run.wall_clock_sleep import SleepRefused, sleep_refused

SOURCE = "from time import sleep\n\n\ndef nap():\n    sleep(0.0)\n"


def imported(name: str, folder: Path) -> ModuleType:
    (folder / f"{name}.py").write_text(SOURCE)
    spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_a_module_that_was_imported_after_the_last_run_may_not_sleep_either(tmp_path: Path) -> None:
    real, first = time.sleep, imported("naps_first", tmp_path)
    try:
        for _ in range(2):
            with sleep_refused(), pytest.raises(SleepRefused, match="would hold up the emulator"):
                first.nap()
        second = imported("naps_second", tmp_path)
        with sleep_refused():
            for module in (first, second):
                with pytest.raises(SleepRefused, match="would hold up the emulator"):
                    module.nap()
        assert first.sleep is second.sleep is time.sleep is real
    finally:
        for name in ("naps_first", "naps_second"):
            sys.modules.pop(name, None)
