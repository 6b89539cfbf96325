"""A check starts no threads that it does not need, and leaves a process that is not its own as it is."""

import gc
import os
import subprocess
import sys

from click.testing import CliRunner

from marconet.command_line import app

CHECK = """
import gc, os, sys
from marconet.command_line import main
sys.argv = ["marconet", "check", "--quiet", "output_sync"]
try:
    main()
except SystemExit as end:
    print(end.code, "numpy" in sys.modules, len(os.listdir("/proc/self/task")), gc.get_threshold()[0] >= 10_000)
"""


def test_a_check_with_numpy_has_one_thread_and_collects_seldom() -> None:
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}

    ended = subprocess.run([sys.executable, "-c", CHECK], env=environment, capture_output=True, text=True, check=True)

    assert ended.stdout.split() == ["0", "True", "1", "True"]


def test_a_check_within_another_program_leaves_its_settings() -> None:
    before = gc.get_threshold(), os.environ.get("OPENBLAS_NUM_THREADS")

    result = CliRunner().invoke(app, ["check", "--quiet", "output_sync"])

    assert result.exit_code == 0
    assert (gc.get_threshold(), os.environ.get("OPENBLAS_NUM_THREADS")) == before
