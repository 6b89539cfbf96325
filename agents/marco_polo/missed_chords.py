"""Share of the tracks through a field of view that a camera misses because it sees at exposures only.

A target crosses a disc of radius r along a chord of length L = 2 sqrt(r^2 - h^2), h uniform in [0, r), and is exposed
every s metres of its way, with a uniform phase. It is missed with probability max(0, 1 - L / s), so

    share = 1 - w - (asin(x) / x - w) / 2       with x = s / (2 r) <= 1, w = sqrt(1 - x^2)
    share = 1 - pi r / (2 s)                    with s >= 2 r: pi r / 2 is the mean chord

Differs from the dissertation: "continuous" detection (section 2.1) has exposures here; the share says what that costs.
"""

from __future__ import annotations

from math import asin, isfinite, pi, sqrt


def missed_share(radius_m: float, speed_mps: float, exposure_s: float) -> float:
    """Return the share, 0 to 1, of chords without an exposure for a target of constant speed and heading."""
    for name, value in (("radius_m", radius_m), ("speed_mps", speed_mps), ("exposure_s", exposure_s)):
        if not (isfinite(value) and value > 0):
            raise ValueError(f"{name}={value}: expected more than 0")
    x = speed_mps * exposure_s / (2.0 * radius_m)
    if x >= 1.0:
        return 1.0 - pi / (4.0 * x)
    w = sqrt(1.0 - x * x)
    return max(0.0, x * x / (1.0 + w) - 0.5 * (asin(x) / x - w))
