"""In how many parts a team is whose sensors hear each other up to a range, for `[derived.NAME]` of a scenario.

Two sensors are in one part if messages can go from one to the other over any number of hops (a connected component of
the graph of who hears whom).
Not modelled: zones, shadowing, and all else by which a range is not a circle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:       # numpy is late: the check of a scenario looks for this function and does not call it
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def team_parts(*signals: Floats, range_m: float) -> tuple[Floats]:
    """Return the number of parts; `signals` are x and y [m] of each sensor in turn, nan of one that is dead.

    A sensor that is dead is in no part.
    """
    import networkx as nx
    import numpy as np

    places = np.stack([np.column_stack((x, y)) for x, y in zip(signals[::2], signals[1::2], strict=True)], axis=1)
    apart_m = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)       # instant x sensor x sensor; nan: dead
    return (np.array([nx.number_connected_components(nx.from_numpy_array(hears[np.ix_(alive, alive)]))
                      for hears in apart_m <= range_m for alive in [np.diagonal(hears)]], dtype=np.float64),)
