/* marconet_numbers.h: whole-number arithmetic as in the equations, for firmware that wants it: quotients rounded down,
 * remainders not negative, halves rounded to even. A header of plain C; it needs no board. */
#ifndef MARCONET_NUMBERS_H
#define MARCONET_NUMBERS_H

#include <stdint.h>

static inline int64_t floor_div(int64_t value, int64_t by)     /* by > 0 */
{
    const int64_t quotient = value / by;
    return value % by < 0 ? quotient - 1 : quotient;
}

static inline int64_t floor_mod(int64_t value, int64_t by)     /* 0 <= result < by */
{
    const int64_t rest = value % by;
    return rest < 0 ? rest + by : rest;
}

static inline int64_t larger(int64_t a, int64_t b) { return a > b ? a : b; }

/* Round to the nearest whole number, halves to the even one; |value| < 2^62. */
static inline int64_t rounded(double value)
{
    const int64_t below = (int64_t)value - (value < (double)(int64_t)value ? 1 : 0);
    const double rest = value - (double)below;
    if (rest > 0.5 || (rest == 0.5 && below % 2 != 0)) {
        return below + 1;
    }
    return below;
}

#endif
