"""Derived signals that no robot knows: the true tracking error, and the difference of a held measurement from it.

Functions for `[derived.NAME]` of a scenario; arguments and results are arrays of samples at the same instants.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:       # numpy is late: the check of a scenario looks for these functions and calls none
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def in_the_frame_of(x: Floats, y: Floats, theta: Floats, x_ref: Floats, y_ref: Floats,
                    theta_ref: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return x_p of (4.2) [m, m, rad] in the frame of the robot at (x, y, theta), and its norm."""
    import numpy as np

    cosine, sine = np.cos(theta), np.sin(theta)
    east, north = x_ref - x, y_ref - y
    ahead, left, heading = cosine * east + sine * north, cosine * north - sine * east, theta_ref - theta
    return ahead, left, heading, np.sqrt(ahead**2 + left**2 + heading**2)


def norm_with_held(x1: Floats, x2: Floats, x3: Floats, held1: Floats, held2: Floats,
                   held3: Floats) -> tuple[Floats, Floats]:
    """Return |e| with e = held - x (4.44), and |(x, e)|, the norm of Figures 4.5(b) and 4.6(b)."""
    import numpy as np

    error_sq = (held1 - x1) ** 2 + (held2 - x2) ** 2 + (held3 - x3) ** 2
    return np.sqrt(error_sq), np.sqrt(x1**2 + x2**2 + x3**2 + error_sq)
