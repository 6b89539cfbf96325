"""Who is near a camera, without a look at everybody: a k-d tree of the bodies' places at an exposure.

The search for the n bodies near a camera takes a time that grows as n + log(number of bodies).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf
from typing import Final

from scipy.spatial import cKDTree

from netem.media.sensing.sight import Body

ROUNDING: Final = 1e-9          # relative; the field of view decides about bodies at its very edge

InReach = Callable[[Body], Iterable[str]]


def neighbours_within(range_m: float) -> Callable[[Mapping[str, Body]], InReach]:
    """Return what makes, of the bodies at one exposure, a search for those within `range_m` of a camera.

    The search may return bodies that are farther by rounding, never fewer, in the order of their names."""
    def search_among(bodies: Mapping[str, Body]) -> InReach:
        names = sorted(bodies)
        if range_m == inf or not names:
            return lambda camera: names
        tree = cKDTree([bodies[name][:2] for name in names])
        return lambda camera: [names[place] for place in sorted(tree.query_ball_point(
            camera[:2], range_m * (1.0 + ROUNDING)))]

    return search_among
