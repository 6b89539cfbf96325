"""Signals of the report on a flying pursuer, as in Figure 3.11: functions for `[derived.NAME]` of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:       # numpy is late: the check of a scenario looks for these functions and calls none
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def in_degrees(*angles: Floats) -> tuple[Floats, ...]:
    """Angles [rad] in degrees, without jumps by whole turns."""
    import numpy as np

    return tuple(np.rad2deg(np.unwrap(angle)) for angle in angles)


def side_by_side(*signals: Floats) -> tuple[Floats, ...]:
    """Signals of several nodes in one picture."""
    return signals


def heights(height: Floats, *downs: Floats) -> tuple[Floats, ...]:
    """What counts downwards beside a height, as heights."""
    return (height, *(-down for down in downs))


def distances(x: Floats, y: Floats, *others: Floats) -> tuple[Floats, ...]:
    """From (x, y) to each of the places x1, y1, x2, y2, ..."""
    import numpy as np

    return tuple(np.hypot(others[k] - x, others[k + 1] - y) for k in range(0, len(others), 2))
