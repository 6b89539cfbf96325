"""Runs a script as `python NAME ARGUMENTS` does, started `after_s` later."""

import runpy
import sys
import time
from pathlib import Path


def main(name, arguments="", after_s=0.0):
    time.sleep(after_s)
    sys.argv = [name, *arguments.split()]
    sys.path.insert(0, str(Path(__file__).parent))
    runpy.run_path(str(Path(__file__).with_name(name)), run_name="__main__")
