/* reachable_set.c: see reachable_set.h. */
#include "reachable_set.h"
#include <stdint.h>
#include "marconet_functions.h"

static const double HALF_PI = 1.5707963267948966, QUARTER_PI = 0.7853981633974483, SQRT_2 = 1.4142135623730951;

/* Return the largest |sin| on [middle - half, middle + half]. */
static double largest_sine(double middle, double half)
{
    const double turns = middle / MARCONET_PI;
    const double below = (double)((int64_t)turns - (turns < (double)(int64_t)turns ? 1 : 0));
    const double beyond = middle - below * MARCONET_PI;         /* in [0, pi) */
    const double away = magnitude(beyond - HALF_PI);            /* from the nearest angle at which |sin| is 1 */
    return away <= half ? 1.0 : cosine(away - half);
}

Extents extents_until(const Start *start, double tau)
{
    const double y1 = start->x.x1, y2 = start->x.x2, y3 = start->x.x3, noise = start->noise;
    const double v1 = start->command.v, omega1 = start->command.omega;
    const double v2 = start->limits.v, omega2 = start->limits.omega;
    const double slide = omega1 * y2 - v1, away = omega1 * y1;              /* c1'(0), -c2'(0) */
    const double circle = square_root(away * away + slide * slide);         /* |omega1| times the arc's radius */
    const double angle = omega1 * tau, turned = magnitude(angle);
    double m1, m2, spread;
    if (turned < HALF_PI) {
        double s, c, along = tau, across = tau * angle / 2.0;
        sine_cosine(angle, &s, &c);
        spread = turned < QUARTER_PI ? noise * (c + magnitude(s)) : noise * SQRT_2;
        if (turned > 1e-6) {
            along = s / omega1;
            across = s * s / ((1.0 + c) * omega1);
        }
        const double c1 = c * y1 + s * y2 - v1 * along;
        const double c2 = c * y2 - s * y1 + v1 * across;
        m1 = magnitude(c1) < magnitude(y1) ? magnitude(y1) : magnitude(c1);
        m2 = magnitude(c2) < magnitude(y2) ? magnitude(y2) : magnitude(c2);
        if (slide * (omega1 * c2 - v1) < 0.0) {                             /* c1 has its extreme within tau */
            m1 = circle / magnitude(omega1);
        } else if (y1 * c1 < 0.0 && omega1 != 0.0) {                        /* c2 has its extreme within tau */
            const double round_it = slide > 0.0 ? circle : -circle;
            const double extreme = v1 * round_it >= 0.0 ? magnitude((v1 + round_it) / omega1)
                : magnitude((2.0 * v1 * y2 - omega1 * (y1 * y1 + y2 * y2)) / (v1 - round_it));
            m2 = extreme > m2 ? extreme : m2;
        }
    } else {
        m1 = circle / magnitude(omega1);
        m2 = m1 + magnitude(v1 / omega1);
        spread = noise * SQRT_2;
    }
    const double way = v2 * tau, half = noise + omega2 * tau + turned / 2.0, middle = y3 - angle / 2.0;
    m1 += spread + way * largest_sine(middle + HALF_PI, half);
    m2 += spread + way * largest_sine(middle, half);
    const double left = omega2 - omega1, right = omega2 + omega1;
    const double high = left > 0.0 ? y3 + noise + left * tau : y3 + noise;
    const double low = right > 0.0 ? y3 - noise - right * tau : y3 - noise;
    const Extents extents = { m1, m2, high > -low ? high : -low };
    return extents;
}
