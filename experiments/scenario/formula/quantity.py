"""Units of numbers in a formula, and of the signals that it names: a factor to SI units and a dimension.

A dimension is the exponents of the SI base units and rad, as `fmus.units` has them. Beside the symbols there, a number
may have prefixes (ms, km, mrad), `deg` and `%`. A signal whose unit is none of these counts as a plain number.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from fractions import Fraction
from math import pi
from typing import Final

from fmus.units import BASE, DERIVED, SYMBOLS, base_units
from netem.core.nearest import nearest

Dimension = tuple[tuple[str, int], ...]     # (base unit, exponent not 0), in the order of BASE

NO_DIMENSION: Final[Dimension] = ()
TIME: Final[Dimension] = (("s", 1),)
PREFIXES: Final[Mapping[str, Fraction]] = {
    "n": Fraction(1, 10**9), "u": Fraction(1, 10**6), "m": Fraction(1, 1000), "c": Fraction(1, 100),
    "d": Fraction(1, 10), "k": Fraction(1000), "M": Fraction(10**6), "G": Fraction(10**9)}
OTHERS: Final[Mapping[str, tuple[Fraction, str]]] = {
    "deg": (Fraction(pi) / 180, "rad"), "%": (Fraction(1, 100), "1"), "g": (Fraction(1, 1000), "kg")}
_FACTOR: Final = re.compile(r"(1|[A-Za-z%]+)(-?[1-9]\d?)?")


def unit_of(text: str) -> tuple[Fraction, Dimension]:
    """Return the factor to SI units and the dimension of a unit; ValueError with the nearest unit if it is none."""
    scale, total = Fraction(1), Counter[str]()
    before, _, after = text.partition("/")
    if after.startswith("(") and after.endswith(")"):
        after = after[1:-1]
    for product, sign in ((before, 1), (after or "1", -1)):
        for written in product.split("."):
            factor = _FACTOR.fullmatch(written)
            if factor is None:
                raise ValueError(f"{text!r} is no unit")
            size, symbol = _symbol(factor[1])
            exponent = sign * int(factor[2] or 1)
            scale *= size**exponent
            for base, power in base_units(symbol).items():
                total[base] += power * exponent
    return scale, tuple((base, total[base]) for base in BASE if total[base])


def of_signal(text: str) -> tuple[float, Dimension]:
    """Return the factor to SI units and the dimension of a signal's unit; (1, none) for text that is no unit."""
    try:
        scale, dimension = unit_of(text)
    except ValueError:
        return 1.0, NO_DIMENSION
    return float(scale), dimension


def times(one: Dimension, other: Dimension, power: int = 1) -> Dimension:
    """Return the dimension of one * other^power."""
    total = Counter(dict(one))
    for base, exponent in other:
        total[base] += power * exponent
    return tuple((base, total[base]) for base in BASE if total[base])


def symbol_of(dimension: Dimension) -> str:
    """Return a unit of this dimension: "m/s2", "J"; "" for a plain number."""
    exponents = dict(dimension)
    for symbol, of in DERIVED.items():
        if of == exponents and symbol != "Hz":
            return symbol
    above = [f"{base}{power if power > 1 else ''}" for base, power in dimension if power > 0]
    below = [f"{base}{-power if power < -1 else ''}" for base, power in dimension if power < 0]
    under = f"/({'.'.join(below)})" if len(below) > 1 else f"/{below[0]}" if below else ""
    return ".".join(above or (["1"] if below else [])) + under


def _symbol(written: str) -> tuple[Fraction, str]:
    """Return the factor and the symbol of `fmus.units` for a symbol that may have a prefix."""
    if written in SYMBOLS:
        return Fraction(1), written
    if written in OTHERS:
        return OTHERS[written]
    prefix, symbol = written[:1], written[1:]
    if prefix in PREFIXES and symbol in SYMBOLS and symbol not in ("1", "kg"):
        return PREFIXES[prefix], symbol
    if prefix in PREFIXES and symbol == "g":
        return PREFIXES[prefix] / 1000, "kg"
    near = nearest(written, [*SYMBOLS, *OTHERS, "ms", "us", "ns", "mm", "cm", "km", "mrad"])
    raise ValueError(f"{written!r} is no unit; " + (f"did you mean {near}?" if near else
                                                    f"there are {', '.join([*SYMBOLS, *OTHERS])}, with prefixes"))
