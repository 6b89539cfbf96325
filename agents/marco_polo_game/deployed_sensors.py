"""How many sensors are deployed for each target of the Marco Polo game, for `[derived.NAME]` of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:       # numpy is late: the check of a scenario looks for this function and does not call it
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def deployed_sensors(*signals: Floats, mode: int, targets: int) -> tuple[Floats, ...]:
    """Return for each target how many sensors are in `mode` (2: pursuing) for it.

    `signals` are `mode` and `target` of each sensor in turn; those of a sensor that is dead are nan, and it counts
    for no target.
    """
    import numpy as np

    return tuple(np.sum([(own == mode) & (of == target) for own, of in zip(signals[::2], signals[1::2], strict=True)],
                        axis=0, dtype=np.float64) for target in range(targets))
