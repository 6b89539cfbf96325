"""Settings of all tests.

- They run on the sources, or with MARCONET_COMPILED=1 on the compiled modules.
- Property tests have no deadline, so that they pass on a busy machine; `make test-all` lets them try more examples
  (examples.py).
- Workers collect one behind the other, so that a fresh clone is compiled once (collecting.py), and the fork servers of
  runs are forked from one process of each worker (warm_fork_server.py).
- NumPy computes in one thread, since the tests of all cores would wait for each other's threads.
- Programs under test do not ignore the signals that a background job ignores (Ctrl-C after `&`, hang-up after `nohup`).
- With `--fail-on-skip` (`make test-all`) a test that lacks a tool fails instead of being skipped.
"""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Generator, Iterator

import pytest
from hypothesis import settings

os.environ.setdefault("MARCONET_COMPILED", "0")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import experiments  # reads the variable
from tests import collecting
from tests.examples import PROFILE
from tests.warm_fork_server import warm_fork_server

collect_ignore = ["cases"]      # scenarios that are to fail: the tests of their faults run them

if os.environ["MARCONET_COMPILED"] == "1":
    assert experiments.CODE == "compiled", experiments.CODE

# A process inherits its parent's ignored signals; a signal that the parent handles has its default again after `exec`.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)       # the tests themselves go on

settings.load_profile(PROFILE)


def pytest_configure(config: pytest.Config) -> None:
    collecting.register(config)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--fail-on-skip", action="store_true", help="a skipped test fails, and says why")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect no garbage while thousands of tests are found: it takes an eighth of that time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]):
    report = yield
    if report.skipped and not hasattr(report, "wasxfail") and item.config.getoption("--fail-on-skip"):
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid}: skipped, and --fail-on-skip is given: {call.excinfo.value}"
    return report


@pytest.fixture(scope="session", autouse=True)
def warm() -> Iterator[None]:
    with warm_fork_server():
        yield
