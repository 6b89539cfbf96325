"""Units of a model's variables, parsed to exponents of the SI base units and rad.

    unit = product [ "/" factor | "/(" product ")" ]
    product = factor { "." factor }         factor = symbol [ exponent ] | "1"

as in `N.m/A`, `kg.m2`, `1/s`, `J/(kg.K)`. Source: Modelica Language Specification 3.6, chapter 19 (unit expressions).
Not covered: prefixes (km, ms) and other factors (deg, min): a model computes in SI units; operators other than . and /.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

BASE: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
DERIVED: Final = {
    "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "C": {"A": 1, "s": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "T": {"kg": 1, "s": -2, "A": -1},
}
SYMBOLS: Final = {**{symbol: {symbol: 1} for symbol in BASE}, **DERIVED, "1": {}}

_PRODUCT: Final = r"[A-Za-z0-9-]+(?:\.[A-Za-z0-9-]+)*"
_UNIT: Final = re.compile(rf"({_PRODUCT})(?:/(?:\(({_PRODUCT})\)|([A-Za-z0-9-]+)))?")
_FACTOR: Final = re.compile(r"(1|[A-Za-z]+)(-?[1-9]\d?)?")


def base_units(unit: str) -> dict[str, int]:
    """Return the nonzero exponents of the base units, in the order of `BASE`; raises ValueError for no such unit."""
    parts = _UNIT.fullmatch(unit)
    if parts is None:
        raise ValueError("expected symbols with . and one /, as in N.m/A or J/(kg.K)")
    total: Counter[str] = Counter()
    for product, sign in ((parts[1], 1), (parts[2] or parts[3] or "1", -1)):
        for text in product.split("."):
            factor = _FACTOR.fullmatch(text)
            if factor is None or factor[1] not in SYMBOLS:
                raise ValueError(f"{text!r} is no unit; there are {', '.join(SYMBOLS)}")
            for base, exponent in SYMBOLS[factor[1]].items():
                total[base] += sign * exponent * int(factor[2] or 1)
    return {base: total[base] for base in BASE if total[base]}
