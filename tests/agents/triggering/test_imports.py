"""What a robot process loads: trigger and tracking loop, but not SciPy, which would cost it half of its memory."""

import subprocess
import sys

import pytest

FOR_ROBOTS = ("agents.tracking.controller", "agents.tracking.error_system", "agents.tracking.closed_loop",
              "agents.tracking.section_4_6", "agents.triggering.assumptions", "agents.triggering.policies.table",
              "agents.triggering.l2_gain")


@pytest.mark.parametrize("heavy", ["scipy", "networkx", "pydantic"])
def test_deciding_does_not_load_a_heavy_library(heavy):
    program = "\n".join([
        "import sys",
        *(f"import {name}" for name in FOR_ROBOTS),
        "from agents.tracking.error_system import TrackingErrorSystem",
        "from agents.tracking.section_4_6 import GAINS",
        "agents.triggering.policies.table.build_policy('individual_gains', TrackingErrorSystem(), GAINS)",
        f"print({heavy!r} in sys.modules)",
    ])

    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)

    assert done.stdout.strip() == "False"
