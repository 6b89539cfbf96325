"""P_R (2.4) of a sensor that stands: the probability that it detects a partially observed target; observation cells.

The target leaves its newest detection along a straight track whose heading is uniform within +-pi/2 of the track line.
A sensor at q detects it if the track meets the field of view at some t >= tau:

    P_R(q) = (width of the headings under which the field of view is seen) / pi

which is 2 asin(r / d) / pi at distance d ahead of the target. Cells with P_R above `threshold` are observation cells,
all other free cells are void cells; with a larger threshold there are fewer.

Differs from the dissertation: Definition 7 asks for Pr > epsilon at *all* t >= tau, which no fixed place can meet, and
prints B_i and T_i for B_i and T_j.
Not modelled: turns of the target after tau, the time that the sensor needs to get there.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.marco_polo.cells import Cells, Mask
from agents.marco_polo.sight import Floats, fields_of_view, seen
from agents.marco_polo.track_line import TrackLine
from agents.pursuit.law import Area


def detection_probability(area: Area, track: TrackLine, places_m: ArrayLike, radius_m: float) -> Floats:
    """Return P_R of a sensor of `radius_m` that stands at each of n places of shape (n, 2): shape (n,), 0 to 1.

    1 where the newest detection lies inside the field of view."""
    places, radii = fields_of_view(places_m, radius_m)
    low, high = seen(area, np.array([track.last]), np.array([track.heading_rad]), places, radii)
    return np.asarray((high[0] - low[0]) / pi)


def observation_cells(cells: Cells, free: Mask, track: TrackLine, radius_m: float,
                      threshold: float) -> NDArray[np.intp]:
    """Return the free cells in which a sensor would detect the target with a probability above `threshold`."""
    if not 0 <= threshold < 1:
        raise ValueError(f"detection_threshold={threshold}: expected a probability, 0 <= threshold < 1, as 0.3")
    return np.flatnonzero(free & (detection_probability(cells.area, track, cells.centroids_m, radius_m) > threshold))
