"""The lockstep benchmark runs, and voids what was not done as defined. Speeds are measured elsewhere, not tested."""

import json
import subprocess
import sys
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WINDOWS = 8


def load_ring():
    spec = spec_from_file_location("lockstep_ring_under_test", ROOT / "benchmarks" / "lockstep" / "ring.py")
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


ring = load_ring()


def play(folder, *, nodes=3, spoil=lambda window, index, received: received, stamp=None):
    """All members in this process, one window after the other; `spoil` changes what a member receives."""
    task = ring.Task(nodes, WINDOWS, 1)
    members = [ring.Member(index, task) for index in range(nodes)]
    handed_out = [[] for _ in members]
    for window in range(WINDOWS):
        received = [handed_out[index - 1] for index in range(nodes)]
        handed_out = []
        for index, member in enumerate(members):
            handed_out.append([member.turn(spoil(window, index, received[index]))])
            member.finished()
    for member in members:
        if stamp:
            member.starts_ns, member.ends_ns = stamp(member.index)
        member.save(folder)
    return task


def test_a_message_has_40_bytes():
    assert len(ring.message(63, 999_999)) == ring.MESSAGE_BYTES == 40


def test_the_rate_counts_windows_between_the_last_nodes_to_begin(tmp_path):
    def stamp(index):                                       # node i begins window k at 10 k + i ms
        starts = [10_000_000 * window + 1_000_000 * index for window in range(WINDOWS)]
        return starts, [start + 1 for start in starts]
    task = play(tmp_path, stamp=stamp)

    figure = ring.judge("paper", task, tmp_path, "")

    assert figure.windows_per_s == pytest.approx(100, rel=1e-12)
    assert figure.grants_per_s == pytest.approx(300, rel=1e-12)
    assert figure.lead_windows == 0


def test_a_node_that_runs_ahead_shows_as_lead(tmp_path):
    def stamp(index):                                       # node 0 begins each window 25 ms early
        starts = [10_000_000 * window + (0 if index == 0 else 25_000_000) for window in range(WINDOWS)]
        return starts, [start + 1 for start in starts]
    task = play(tmp_path, stamp=stamp)

    assert ring.judge("paper", task, tmp_path, "").lead_windows == 2       # 25 ms are two whole windows


@pytest.mark.parametrize(("what", "spoil"), [
    ("missing", lambda messages: []),
    ("doubled", lambda messages: messages * 2),
    ("late", lambda messages: [ring.message(1, 3)]),
    ("from another", lambda messages: [ring.message(0, 4)]),
])
def test_a_wrong_message_voids_the_figure(tmp_path, what, spoil):
    task = play(tmp_path, spoil=lambda window, index, received:
                spoil(received) if (window, index) == (5, 2) else received)

    with pytest.raises(ring.VoidFigure, match="node 2, window 5"):
        ring.judge("paper", task, tmp_path, "")


def test_a_message_in_the_first_window_voids_the_figure(tmp_path):
    task = play(tmp_path, spoil=lambda window, index, received:
                [ring.message(0, 0)] if (window, index) == (0, 1) else received if window else [])

    with pytest.raises(ring.VoidFigure, match="node 1, window 0"):
        ring.judge("paper", task, tmp_path, "")


def test_a_node_without_a_record_voids_the_figure(tmp_path):
    task = play(tmp_path)
    (tmp_path / "1.json").unlink()

    with pytest.raises(ring.VoidFigure, match="node 1 of 3 left no record"):
        ring.judge("paper", task, tmp_path, "")


def test_a_turn_too_few_voids_the_figure(tmp_path):
    task = play(tmp_path, stamp=lambda index: (list(range(WINDOWS - index)), list(range(WINDOWS - index))))

    with pytest.raises(ring.VoidFigure, match="node 1 had 7 turns and finished 7, expected 8"):
        ring.judge("paper", task, tmp_path, "")


@pytest.mark.parametrize(("driver", "package"), [
    ("marconet_ring", "zenoh"), ("helics_ring", "helics"), ("mosaik_ring", "mosaik")])
def test_two_nodes_do_the_work(driver, package):
    if find_spec(package) is None:
        pytest.skip(f"needs {package}: pip install -e '.[peers]'")

    out = subprocess.run([sys.executable, "-m", f"benchmarks.lockstep.{driver}", "--nodes", "2", "--windows", "20",
                          "--warm-up", "2", "--limit-s", "30"], cwd=ROOT, capture_output=True, text=True, timeout=90)

    assert out.returncode == 0, out.stderr
    figure = json.loads(out.stdout.splitlines()[-1])
    assert figure["nodes"] == 2
    assert figure["windows_per_s"] > 0
    assert figure["lead_windows"] >= 0
