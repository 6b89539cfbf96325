"""Elementary functions that robots in Python and in C share, bit for bit.

    sine_cosine, cosine, arc_cosine, log1p, expm1      in + - * /, comparisons, square roots and conversions

`firmware/include/marconet_functions.h` has the same operations in the same order. The functions of C libraries differ
in their last bits from one platform to the next, so an equation that decides what a robot sends or actuates calls the
functions of this file. IEEE 754 defines the result of `math.sqrt` and `math.remainder` to the last bit.

The absolute error of `sine_cosine` and `cosine` is below 2e-16, the relative error of the others below 6e-16.
Source: coefficients and reductions of fdlibm 5.3, Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.
Permission to use, copy, modify, and distribute this software is freely granted, provided that this notice is preserved.
"""

from __future__ import annotations

from math import frexp, ldexp, pi, remainder, sqrt

QUARTER_PI = 0.7853981633974483
HALF_PI = 1.5707963267948966
WIDEST_RAD = 1e6                # larger angles are first brought to [-pi, pi]


def sine_cosine(angle_rad: float) -> tuple[float, float]:
    """Return sine and cosine of a finite angle; ValueError if it is not finite."""
    if -QUARTER_PI <= angle_rad <= QUARTER_PI:
        quarters, x, tail = 0, angle_rad, 0.0
    else:
        if not -WIDEST_RAD < angle_rad < WIDEST_RAD:
            angle_rad = remainder(angle_rad, 2.0 * pi)
        quarters = int(angle_rad * 0.6366197723675814 + (0.5 if angle_rad > 0.0 else -0.5))
        above = angle_rad - quarters * 1.57079632673412561417       # 33 bits of pi/2: the product is exact
        below = quarters * 6.07710050650619224932e-11
        x = above - below
        tail = (above - x) - below
    z = x * x
    cube = z * x
    sine = x - ((z * (0.5 * tail - cube * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * (
        2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))))
        - tail) - cube * -1.66666666666666324348e-01)
    half = 0.5 * z
    rest = 1.0 - half
    cosine = rest + (((1.0 - rest) - half) + (z * (z * (4.16666666666666019037e-02 + z * (
        -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (
            2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))))) - x * tail))
    quarters &= 3
    if quarters == 0:
        return sine, cosine
    if quarters == 1:
        return cosine, -sine
    return (-sine, -cosine) if quarters == 2 else (-cosine, sine)


def cosine(angle_rad: float) -> float:
    """Return the cosine of an angle in [0, pi/2]."""
    if angle_rad > QUARTER_PI:
        x = HALF_PI - angle_rad
        z = x * x
        return x + z * x * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
            -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
                -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))))
    z = angle_rad * angle_rad
    half = 0.5 * z
    rest = 1.0 - half
    return rest + (((1.0 - rest) - half) + z * (z * (
        4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * (
            -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))))))


def arc_cosine(value: float) -> float:
    """Return the angle in [0, pi] whose cosine is `value`, -1 <= value <= 1."""
    if -0.5 < value < 0.5:
        return HALF_PI - (value - (6.12323399573676603587e-17 - value * _arc(value * value)))
    if value < 0.0:
        z = (1.0 + value) * 0.5
        s = sqrt(z)
        return 2.0 * (HALF_PI - (s + (_arc(z) * s - 6.12323399573676603587e-17)))
    z = (1.0 - value) * 0.5
    s = sqrt(z)
    return 2.0 * (s + _arc(z) * s)


def _arc(z: float) -> float:
    """Return asin(s) / s - 1 for z = s^2 <= 1/4."""
    return z * (1.66666666666666657415e-01 + z * (-3.25565818622400915405e-01 + z * (2.01212532134862925881e-01 + z * (
        -4.00555345006794114027e-02 + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05))))) / (
        1.0 + z * (-2.40339491173441421878e+00 + z * (2.02094576023350569471e+00 + z * (
            -6.88283971605453293030e-01 + z * 7.70381505559019352791e-02))))


def log1p(value: float) -> float:
    """Return ln(1 + value) for a finite value of 0 or more."""
    if value < 0.41421356:
        exponent, f, lost = 0, value, 0.0
    else:
        total = 1.0 + value
        f, exponent = frexp(total)
        if f < 0.7071067811865476:
            f += f
            exponent -= 1
        f -= 1.0
        lost = (1.0 - (total - value) if exponent > 1 else value - (total - 1.0)) / total      # by rounding the total
    half = 0.5 * f * f
    s = f / (2.0 + f)
    z = s * s
    rest = z * (6.666666666666735130e-01 + z * (3.999999999940941908e-01 + z * (2.857142874366239149e-01 + z * (
        2.222219843214978396e-01 + z * (1.818357216161805012e-01 + z * (
            1.531383769920937332e-01 + z * 1.479819860510658591e-01))))))
    return s * (half + rest) + (exponent * 1.90821492927058770002e-10 + lost) - half + f \
        + exponent * 6.93147180369123816490e-01


def expm1(value: float) -> float:
    """Return exp(value) - 1 for 0 <= value <= 700."""
    twos, lost = 0, 0.0
    if value > 0.34657359027997264:         # ln 2 / 2
        twos = int(1.44269504088896338700e+00 * value + 0.5)
        above = value - twos * 6.93147180369123816490e-01
        below = twos * 1.90821492927058770002e-10
        value = above - below
        lost = (above - value) - below
    half = 0.5 * value
    square = value * half
    r = 1.0 + square * (-3.33333333333331316428e-02 + square * (1.58730158725481460165e-03 + square * (
        -7.93650757867487942473e-05 + square * (4.00821782732936239552e-06 + square * -2.01099218183624371326e-07))))
    t = 3.0 - r * half
    e = square * ((r - t) / (6.0 - value * t))
    if twos == 0:
        return value - (value * e - square)
    e = value * (e - lost) - lost - square
    if twos < 20:
        return ((1.0 - ldexp(1.0, -twos)) - (e - value)) * ldexp(1.0, twos)
    return (value - (e + ldexp(1.0, -twos)) + 1.0) * ldexp(1.0, twos)
