"""Which signals of a node say where it is, or where it believes something to be.

A position is a pair `x` and `y` in metres, perhaps with a heading in rad, `theta`, `psi`, `yaw` or `heading`. Any other
pair, such as `estimate_x` and `estimate_y` or `x_hat` and `y_hat`, is an estimate of its node.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

HEADINGS = ("theta", "psi", "yaw", "heading")
X = re.compile(r"(?:(?P<before>\w+)_)?x(?:_(?P<after>\w+))?")


def places(names: Sequence[str], units: Sequence[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield (name, columns of x, y and perhaps heading); the name of the body itself is "", others are estimates."""
    for name, unit in zip(names, units, strict=True):
        found = X.fullmatch(name)
        if found is None or unit != "m":
            continue
        before, after = found["before"], found["after"]
        other = "_".join(part for part in (before, "y", after) if part)
        if other not in names:
            continue
        what = " ".join(part for part in (before, after) if part)
        heading = next((one for one in HEADINGS if one in names), None) if not what else None
        yield what, (name, other) if heading is None else (name, other, heading)
