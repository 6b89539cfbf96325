"""Share of the tracks through a field of view that a camera misses because it sees at exposures only.

A target crosses a disc of radius r along a chord of length L = 2 sqrt(r^2 - h^2), h uniform in [0, r), and is exposed
every s metres of its way, with a uniform phase. It is missed with probability max(0, 1 - L / s), so

    share = 1 - h0 / r - (2 / (r s)) integral from h0 to r of sqrt(r^2 - h^2) dh,   h0 = sqrt(max(0, r^2 - s^2 / 4))

Differs from the dissertation: "continuous" detection (section 2.1) has exposures here; the share says what that costs.
"""

from __future__ import annotations

from math import asin, isfinite, pi, sqrt


def missed_share(radius_m: float, speed_mps: float, exposure_s: float) -> float:
    """Return the share, 0 to 1, of chords without an exposure for a target of constant speed and heading."""
    for name, value in (("radius_m", radius_m), ("speed_mps", speed_mps), ("exposure_s", exposure_s)):
        if not (isfinite(value) and value > 0):
            raise ValueError(f"{name}={value}: expected more than 0")
    r, s = radius_m, speed_mps * exposure_s
    h0 = sqrt(max(0.0, r * r - 0.25 * s * s))
    if h0 == r:                     # s^2 vanishes beside r^2
        return 0.0
    cap = 0.5 * (0.5 * pi * r * r - h0 * sqrt(r * r - h0 * h0) - r * r * asin(h0 / r))
    return min(1.0, max(0.0, 1.0 - h0 / r - 2.0 * cap / (r * s)))
