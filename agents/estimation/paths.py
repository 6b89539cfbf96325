"""The two paths on which section 3.4 compares filters, as NUMBERS fixes them, at instants T_s = 0.07 s apart.

    circular   one turn in 55 s: v = 0.55 (1 + 0.05 sin(2 pi t / 11)),  omega = 2 pi / 55 (1 + 0.05 cos(2 pi t / 7))
    zig-zag    legs of 3.4 s at v = 0.7, then 1.5 s at v = -0.4 with omega = +-1.5 alternating; inputs are means over
               the last 0.35 s, since a robot does not change its speed at once

Differs from the dissertation, which prints neither path: these were fitted to its tables.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

STEP_NS = 70_000_000
INSTANTS = 786
LEG_S, BACK_S, SMOOTHED_S = 3.4, 1.5, 0.35
SUBSTEPS = 50                   # midpoint arcs per T_s


class Path(NamedTuple):
    """Each of shape (786,): pose [m, m, rad] and inputs [m/s, rad/s] at k T_s."""

    x: Floats
    y: Floats
    theta: Floats
    v: Floats
    omega: Floats


def circular() -> Path:
    def inputs(t: Floats) -> tuple[Floats, Floats]:
        return (0.55 * (1 + 0.05 * np.sin(2 * np.pi * t / 11)),
                2 * np.pi / 55 * (1 + 0.05 * np.cos(2 * np.pi * t / 7)))

    return _driven(inputs)


def zig_zag() -> Path:
    step_s = STEP_NS * 1e-9 / SUBSTEPS
    width = round(SMOOTHED_S / step_s)
    t = (np.arange(-width, INSTANTS * SUBSTEPS) + 0.5) * step_s
    period, into = np.divmod(np.maximum(t, 0.0), LEG_S + BACK_S)
    straight = into < LEG_S
    raw = np.where(straight, 0.7, -0.4), np.where(straight, 0.0, np.where(period % 2 == 0, 1.5, -1.5))
    sums = [np.concatenate([[0.0], np.cumsum(values)]) for values in raw]
    smooth = [(total[width:] - total[:-width]) / width for total in sums]

    def inputs(t: Floats) -> tuple[Floats, Floats]:
        at = np.floor(t / step_s + 1e-6).astype(np.int64)
        return smooth[0][at], smooth[1][at]

    return _driven(inputs)


def _driven(inputs: Callable[[Floats], tuple[Floats, Floats]]) -> Path:
    step_s = STEP_NS * 1e-9 / SUBSTEPS
    fine: Floats = (np.arange((INSTANTS - 1) * SUBSTEPS, dtype=np.float64) + 0.5) * step_s
    v, omega = inputs(fine)
    theta = np.concatenate([[0.0], np.cumsum(omega * step_s)])
    middle = (theta[:-1] + theta[1:]) / 2
    x, y = (np.concatenate([[0.0], np.cumsum(v * f(middle) * step_s)]) for f in (np.cos, np.sin))
    coarse: Floats = np.arange(INSTANTS, dtype=np.float64) * (STEP_NS * 1e-9)
    return Path(x[::SUBSTEPS], y[::SUBSTEPS], theta[::SUBSTEPS], *inputs(coarse))


PATHS = {"circle": circular, "zig-zag": zig_zag}
