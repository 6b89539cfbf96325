"""marconet from Python: load or build a scenario, run it, and read the records of the run.

    run = marconet.run(marconet.load("two_beacons.toml", set={"length_s": 5.0}))
    run.holds, run.expectations, run.ledger, run.signals["r1"], run.events, run.report()

The names in `__all__` stay as docs/python.md documents them; everything else may change.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from experiments.scenario.problems import ScenarioError
    from marconet.running import Run, fault, run
    from marconet.scenario import Scenario, load
    from marconet.searching import Smallest, Worst, break_scenario, shrink
    from marconet.sweeping import Sweep, sweep
    from netem.wire.errors import NodeFailure

__all__ = ["NodeFailure", "Run", "Scenario", "ScenarioError", "Smallest", "Sweep", "Worst", "break_scenario", "fault",
           "load", "run", "shrink", "sweep"]

# Imported at their first use, as the command line needs none of them.
_WHERE: Final = {
    "NodeFailure": "netem.wire.errors", "Run": "marconet.running", "Scenario": "marconet.scenario",
    "ScenarioError": "experiments.scenario.problems", "Smallest": "marconet.searching", "Sweep": "marconet.sweeping",
    "Worst": "marconet.searching", "break_scenario": "marconet.searching", "fault": "marconet.running",
    "load": "marconet.scenario", "run": "marconet.running", "shrink": "marconet.searching",
    "sweep": "marconet.sweeping"}


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module 'marconet' has no attribute {name!r}; it has {', '.join(__all__)}")
    found = globals()[name] = getattr(import_module(_WHERE[name]), name)
    return found
