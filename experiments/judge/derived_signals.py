"""Signals that are worked out from recorded ones after the run, such as the error between two robots.

A function gets one array for each signal named in `of`, samples at the same instants, and the parameters; it gives one
array for each of its own signals. What cannot be worked out is named, not raised: the run itself is whole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.scenario.own_modules import function_for
from netem.records.signal_table import SignalTable

Json = Mapping[str, Any]
Floats = NDArray[np.float64]


class NotDerivable(Exception):
    """Why a derived signal cannot be worked out."""


def derive(declared: Mapping[str, Json], recorded: Mapping[str, SignalTable], folder: Path,
           missing: list[str]) -> dict[str, SignalTable]:
    """The recorded tables and one more for each of `declared`, in order: a later one may use an earlier one.

    Raises nothing; a line in `missing` names what could not be worked out.
    """
    tables = dict(recorded)
    for name, table in declared.items():
        try:
            tables[name] = _derived(name, table, tables, folder)
        except NotDerivable as error:
            missing.append(f"derived.{name}: {error}")
        except Exception as error:
            missing.append(f"derived.{name}: {table['function']} failed: {type(error).__name__}: {error}")
    return tables


def _derived(name: str, table: Json, tables: Mapping[str, SignalTable], folder: Path) -> SignalTable:
    columns = [_column(place, tables) for place in table["of"]]
    time_ns = reduce(np.intersect1d, [instants for instants, _ in columns])
    arrays = [values[np.searchsorted(instants, time_ns)] for instants, values in columns]
    found = function_for(table["function"], folder)(*arrays, **table["parameters"])
    signals: Mapping[str, str] = table["signals"]
    results = [np.asarray(found, dtype=np.float64)] if len(signals) == 1 and np.ndim(found) == 1 else [
        np.asarray(result, dtype=np.float64) for result in found]
    if len(results) != len(signals) or any(result.shape != time_ns.shape for result in results):
        raise NotDerivable(f"{table['function']} gave arrays of the shapes {[result.shape for result in results]} for "
                           f"the signals {', '.join(signals)}: expected one of shape {time_ns.shape} for each")
    return SignalTable(name, tuple(signals), tuple(signals.values()), time_ns, np.column_stack(results))


def _column(place: str, tables: Mapping[str, SignalTable]) -> tuple[NDArray[np.int64], Floats]:
    node, _, signal = place.partition(".")
    if node not in tables:
        raise NotDerivable(f"{place}: no signals of {node} are on record")
    table = tables[node]
    if signal not in table.names:
        raise NotDerivable(f"{place}: {node} has no signal {signal!r}; it has {_listed(table.names)}")
    return table.time_ns, table.column(signal)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
