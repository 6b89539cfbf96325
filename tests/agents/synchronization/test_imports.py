"""What a robot process loads: NumPy, but not SciPy, which would cost it half of its memory."""

import subprocess
import sys

import pytest

FOR_ROBOTS = ("check", "closed_loop", "common_lyapunov", "delayed_loop", "discovery", "dwell_time", "exact_loop",
              "gains", "graph", "model_hold", "model_loop", "observer", "partition", "robot", "round_plan",
              "slot_length", "starving")


@pytest.mark.parametrize("heavy", ["scipy", "networkx"])
def test_planning_a_round_does_not_load_a_heavy_library(heavy):
    program = "\n".join([
        "import sys",
        *(f"import agents.synchronization.{name}" for name in FOR_ROBOTS),
        "from agents.synchronization.closed_loop import LinearAgent",
        "team = [LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[0.5]])] * 2",
        "agents.synchronization.round_plan.plan_round(team, [[1.0, -1.0], [-1.0, 1.0]])",
        f"print({heavy!r} in sys.modules)",
    ])

    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)

    assert done.stdout.strip() == "False"
