"""Units against the definitions of the SI brochure (9th edition, table 4), written here as identities between units."""

from __future__ import annotations

import pytest

from fmus.units import DERIVED, base_units


@pytest.mark.parametrize(("unit", "same"), [
    ("N", "kg.m/s2"), ("Pa", "N/m2"), ("J", "N.m"), ("W", "J/s"), ("C", "A.s"), ("V", "W/A"), ("F", "C/V"),
    ("Ohm", "V/A"), ("Wb", "V.s"), ("T", "Wb/m2"), ("H", "Wb/A"), ("Hz", "1/s"),
])
def test_derived_units_are_those_of_the_si(unit, same):
    assert base_units(unit) == base_units(same) == DERIVED[unit]


@pytest.mark.parametrize(("unit", "exponents"), [
    ("1", {}), ("m/m", {}), ("kg.m2", {"kg": 1, "m": 2}), ("s-1", {"s": -1}), ("rad/s", {"s": -1, "rad": 1}),
    ("N.s/m", {"kg": 1, "s": -1}), ("J/(kg.K)", {"m": 2, "s": -2, "K": -1}), ("m10", {"m": 10}),
])
def test_expressions_are_products_of_powers(unit, exponents):
    assert base_units(unit) == exponents


@pytest.mark.parametrize("unit", ["", "furlong", "km", "m/", "/s", "m..s", "m/s/s", "m*s", "m^2", "m 2", "m0", "m/(s",
                                  "m/s)", "None", "m\n", "m/kg.s"])
def test_what_is_no_unit_is_refused(unit):
    with pytest.raises(ValueError, match=r"no unit; there are kg|expected symbols"):
        base_units(unit)
