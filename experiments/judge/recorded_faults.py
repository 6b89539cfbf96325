"""Reads the faults of a run from its resolved scenario, those that came from outside included."""

from __future__ import annotations

from typing import Any

import msgspec

from experiments.scenario.model import FaultSpec
from netem.faults.table import FAULTS


def recorded_faults(scenario: dict[str, Any]) -> list[FaultSpec]:
    """Return the faults in the content of `scenario.json`.

    Raises KeyError or msgspec.ValidationError for one that this version does not know.
    """
    return [msgspec.convert(table | {"settings": msgspec.convert(table["settings"], FAULTS[table["kind"]])}, FaultSpec)
            for table in scenario.get("faults") or ()]
