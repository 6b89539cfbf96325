"""Computes signals from recorded ones after the run, such as the error between two robots.

A function gets an array for each signal that `of` names, sampled at the same instants, and its parameters; it returns
an array for each of its own signals. A signal that cannot be computed is listed as missing and raises nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.programs.own_modules import function_for
from netem.records.signal_table import SignalTable

Json = Mapping[str, Any]
Floats = NDArray[np.float64]


class NotDerivable(Exception):
    """A derived signal cannot be computed; the message has the reason."""


def derive(declared: Mapping[str, Json], recorded: Mapping[str, SignalTable], folder: Path,
           missing: list[str]) -> dict[str, SignalTable]:
    """Return the recorded tables and one for each of `declared`, in order, so that later ones may use earlier ones.

    Raises nothing; a line is added to `missing` for each table that cannot be computed.
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
