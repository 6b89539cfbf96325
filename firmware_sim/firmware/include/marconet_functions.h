/* marconet_functions.h: elementary functions that robots in C and in Python share, bit for bit.
 *
 * The operations of firmware_sim/shared_functions.py in the same order: + - * /, comparisons and conversions. Functions of
 * C libraries differ in their last bits from one platform to the next, so an equation that decides what a robot sends or
 * actuates calls these. `square_root` and `remainder_of` are those of IEEE 754, to the last bit. A header of plain C; it
 * needs no board and no library.
 *
 * Source: coefficients and reductions of fdlibm 5.3, Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.
 * Permission to use, copy, modify, and distribute this software is freely granted, provided that this notice is
 * preserved. */
#ifndef MARCONET_FUNCTIONS_H
#define MARCONET_FUNCTIONS_H

#include <stdint.h>
#include <string.h>

#define MARCONET_PI 3.141592653589793
#define MARCONET_FRACTION 0x000FFFFFFFFFFFFFu   /* bits of a double below its exponent */

static inline double magnitude(double value) { return value < 0.0 ? -value : value; }

static inline uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline double from_bits(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Return 2^exponent; -1022 <= exponent <= 1023. */
static inline double power_of_two(int32_t exponent) { return from_bits((uint64_t)(exponent + 1023) << 52); }

/* Return the square root of a value of 0 or more that is not subnormal, rounded to nearest. */
static inline double square_root(double value)
{
    const uint64_t bits = bits_of(value);
    int32_t exponent = (int32_t)(bits >> 52) - 1023;
    uint64_t radicand = (bits & MARCONET_FRACTION) | (uint64_t)1 << 52;
    uint64_t root = 0, rest = 0;
    if (!(value > 0.0) || exponent > 1023) {
        return value;
    }
    if (exponent & 1) {
        radicand <<= 1;
        exponent--;
    }
    for (uint32_t k = 0; k < 54; k++) {         /* two bits of the radicand for each of the root, then zeros */
        rest = rest << 2 | (k < 27 ? radicand >> (52 - 2 * k) & 3u : 0u);
        root <<= 1;
        if (rest >= (root << 1 | 1u)) {
            rest -= root << 1 | 1u;
            root |= 1u;
        }
    }
    return (double)((root >> 1) + (root & 1u)) * power_of_two(exponent / 2 - 52);
}

/* Return value - n * by for the whole number n nearest to value / by, of two the even one; both normal, by > 0. */
static inline double remainder_of(double value, double by)
{
    const uint64_t divisor = (bits_of(by) & MARCONET_FRACTION) | (uint64_t)1 << 52;
    const int32_t lowest = (int32_t)(bits_of(by) >> 52);
    const double size = magnitude(value);
    const int32_t highest = (int32_t)(bits_of(size) >> 52);
    uint64_t rest = (bits_of(size) & MARCONET_FRACTION) | (uint64_t)1 << 52;
    uint32_t odd = 0;
    double left = size;
    if (highest >= lowest) {                    /* long division, a bit of the quotient at a time */
        for (int32_t at = highest;; at--) {
            odd = rest >= divisor;
            rest -= odd ? divisor : 0u;
            if (at == lowest) {
                break;
            }
            rest <<= 1;
        }
        left = (double)rest * power_of_two(lowest - 1075);
    }
    if (left > by - left || (left == by - left && odd)) {
        left -= by;
    }
    return value < 0.0 ? -left : left;
}

static inline void sine_cosine(double angle /* [rad] */, double *sine_out, double *cosine_out)
{
    int64_t quarters = 0;
    double x = angle, tail = 0.0;
    if (!(-0.7853981633974483 <= angle && angle <= 0.7853981633974483)) {
        if (!(-1e6 < angle && angle < 1e6)) {
            angle = remainder_of(angle, 2.0 * MARCONET_PI);
        }
        quarters = (int64_t)(angle * 0.6366197723675814 + (angle > 0.0 ? 0.5 : -0.5));
        const double above = angle - (double)quarters * 1.57079632673412561417;
        const double below = (double)quarters * 6.07710050650619224932e-11;
        x = above - below;
        tail = (above - x) - below;
    }
    const double z = x * x, cube = z * x;
    const double sine = x - ((z * (0.5 * tail - cube * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04
        + z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))))
        - tail) - cube * -1.66666666666666324348e-01);
    const double half = 0.5 * z, rest = 1.0 - half;
    const double cosine = rest + (((1.0 - rest) - half) + (z * (z * (4.16666666666666019037e-02 + z * (
        -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (
            2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))))) - x * tail));
    switch (quarters & 3) {
    case 0:
        *sine_out = sine, *cosine_out = cosine;
        break;
    case 1:
        *sine_out = cosine, *cosine_out = -sine;
        break;
    case 2:
        *sine_out = -sine, *cosine_out = -cosine;
        break;
    default:
        *sine_out = -cosine, *cosine_out = sine;
        break;
    }
}

static inline double cosine(double angle /* [rad], 0 to pi/2 */)
{
    if (angle > 0.7853981633974483) {
        const double x = 1.5707963267948966 - angle, z = x * x;
        return x + z * x * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
            -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
                -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    }
    const double z = angle * angle, half = 0.5 * z, rest = 1.0 - half;
    return rest + (((1.0 - rest) - half) + z * (z * (
        4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * (
            -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))))));
}

/* Return asin(s) / s - 1 for z = s^2 <= 1/4. */
static inline double marconet_arc(double z)
{
    return z * (1.66666666666666657415e-01 + z * (-3.25565818622400915405e-01 + z * (2.01212532134862925881e-01 + z * (
        -4.00555345006794114027e-02 + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05))))) / (
        1.0 + z * (-2.40339491173441421878e+00 + z * (2.02094576023350569471e+00 + z * (
            -6.88283971605453293030e-01 + z * 7.70381505559019352791e-02))));
}

/* Return the angle [rad] in [0, pi] whose cosine is `value`, -1 <= value <= 1. */
static inline double arc_cosine(double value)
{
    if (-0.5 < value && value < 0.5) {
        return 1.5707963267948966 - (value - (6.12323399573676603587e-17 - value * marconet_arc(value * value)));
    }
    if (value < 0.0) {
        const double z = (1.0 + value) * 0.5, s = square_root(z);
        return 2.0 * (1.5707963267948966 - (s + (marconet_arc(z) * s - 6.12323399573676603587e-17)));
    }
    const double z = (1.0 - value) * 0.5, s = square_root(z);
    return 2.0 * (s + marconet_arc(z) * s);
}

/* Return ln(1 + value) for a finite value of 0 or more. */
static inline double log_1p(double value)
{
    int32_t exponent = 0;
    double f = value, lost = 0.0;
    if (!(value < 0.41421356)) {
        const double total = 1.0 + value;
        exponent = (int32_t)(bits_of(total) >> 52) - 1022;
        f = total * power_of_two(-exponent);
        if (f < 0.7071067811865476) {
            f += f;
            exponent--;
        }
        f -= 1.0;
        lost = (exponent > 1 ? 1.0 - (total - value) : value - (total - 1.0)) / total;
    }
    const double half = 0.5 * f * f, s = f / (2.0 + f), z = s * s;
    const double rest = z * (6.666666666666735130e-01 + z * (3.999999999940941908e-01 + z * (2.857142874366239149e-01
        + z * (2.222219843214978396e-01 + z * (1.818357216161805012e-01 + z * (
            1.531383769920937332e-01 + z * 1.479819860510658591e-01))))));
    return s * (half + rest) + ((double)exponent * 1.90821492927058770002e-10 + lost) - half + f
           + (double)exponent * 6.93147180369123816490e-01;
}

/* Return exp(value) - 1 for 0 <= value <= 700. */
static inline double exp_m1(double value)
{
    int32_t twos = 0;
    double lost = 0.0;
    if (value > 0.34657359027997264) {
        twos = (int32_t)(1.44269504088896338700e+00 * value + 0.5);
        const double above = value - (double)twos * 6.93147180369123816490e-01;
        const double below = (double)twos * 1.90821492927058770002e-10;
        value = above - below;
        lost = (above - value) - below;
    }
    const double half = 0.5 * value, square = value * half;
    const double r = 1.0 + square * (-3.33333333333331316428e-02 + square * (1.58730158725481460165e-03 + square * (
        -7.93650757867487942473e-05 + square * (4.00821782732936239552e-06 + square * -2.01099218183624371326e-07))));
    const double t = 3.0 - r * half;
    double e = square * ((r - t) / (6.0 - value * t));
    if (twos == 0) {
        return value - (value * e - square);
    }
    e = value * (e - lost) - lost - square;
    if (twos < 20) {
        return ((1.0 - power_of_two(-twos)) - (e - value)) * power_of_two(twos);
    }
    return (value - (e + power_of_two(-twos)) + 1.0) * power_of_two(twos);
}

#endif
