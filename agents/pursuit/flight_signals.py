"""Derived signals of a flying pursuer, as in Figure 3.11: functions for `[derived.NAME]` of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:       # numpy is late: the check of a scenario looks for these functions and calls none
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def in_degrees(*angles: Floats) -> tuple[Floats, ...]:
    """Return angles [rad] in degrees, unwrapped."""
    import numpy as np

    return tuple(np.rad2deg(np.unwrap(angle)) for angle in angles)


def side_by_side(*signals: Floats) -> tuple[Floats, ...]:
    """Return the signals unchanged, so that those of several nodes appear in one figure."""
    return signals


def heights(height: Floats, *downs: Floats) -> tuple[Floats, ...]:
    """Return `height` and the negated `downs` (MAVLink's z is positive downwards), all positive upwards [m]."""
    return (height, *(-down for down in downs))


def distances(x: Floats, y: Floats, *others: Floats) -> tuple[Floats, ...]:
    """Return the distance [m] from (x, y) to each of the places given as x1, y1, x2, y2, ..."""
    import numpy as np

    return tuple(np.hypot(others[k] - x, others[k + 1] - y) for k in range(0, len(others), 2))
