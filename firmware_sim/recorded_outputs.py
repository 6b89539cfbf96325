"""Records the outputs of a plant as signals of its node, whether or not its program names them.

Every output that is a number, a boolean or an item of an enumeration becomes a signal with the output's name and unit,
each element of an array a signal of its own (`a[1]`, `m[2,1]`): at most `MOST_RECORDED` of a plant, in the order of its
description. An output with the name of a signal that the program declares is left to the program.

Not recorded: text, binary values, clocks.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import nan
from typing import Final

from fmus.description import Variable, element_names
from fmus.plant import Plant
from fmus.start_values import RANGES, REALS
from netem.node.node import Node

MOST_RECORDED: Final = 64
NUMBERS: Final = frozenset({*REALS, *RANGES, "Boolean", "Enumeration"})


def record_outputs(node: Node, plant: Plant, idle: Collection[str] = (),
                   among: Collection[tuple[str, str]] | None = None) -> None:
    """Declare the signals, after the program has declared its own; leave out `idle` outputs, which are always 0.

    With `among`, pairs (name, unit), only these are declared.
    """
    taken = node.signal_names
    chosen: list[Variable] = []
    signals: list[tuple[str, str]] = []
    left_out = 0
    for variable in plant.description.variables.values():
        if variable.causality != "output" or variable.type not in NUMBERS \
                or variable.name in idle:
            continue
        names = element_names(variable.name, variable.shape)
        if not taken.isdisjoint(names):
            continue
        if among is not None and not {(name, variable.unit or "1") for name in names} <= set(map(tuple, among)):
            continue
        if len(signals) + len(names) > MOST_RECORDED:
            left_out += len(names)
            continue
        chosen.append(variable)
        signals += [(name, variable.unit or "1") for name in names]
    if left_out:
        node.event("outputs not recorded", f"{left_out} of {left_out + len(signals)} numbers: at most {MOST_RECORDED} "
                                           "of a plant are; a program can record others with board.record")
    if not signals:
        return
    if all(variable.is_float64 for variable in chosen):
        node.signals(signals, plant.output_group([variable.name for variable in chosen], finite=False).read_for_record)
    else:
        node.signals(signals, _Reading(plant, chosen).read)


class _Reading:
    """Reads outputs of any type: 64-bit floating point scalars as a group, all others one by one."""

    def __init__(self, plant: Plant, variables: Sequence[Variable]) -> None:
        self._plant = plant
        floats = [variable.name for variable in variables if variable.is_float64]
        self._group = plant.output_group(floats, finite=False) if floats else None
        self._variables = variables

    def read(self) -> Sequence[float]:
        """Return the outputs at a sample; all nan once the plant has stopped."""
        plant = self._plant
        if plant.stopped is not None:
            return [nan] * sum(variable.elements for variable in self._variables)
        plant.come_to_present()
        together = iter(self._group.read() if self._group is not None else ())
        values: list[float] = []
        for variable in self._variables:
            if variable.is_float64:
                values.append(next(together))
            else:
                found = plant.get(variable.name)
                values += map(float, found) if variable.shape else (float(found),)
        return values
