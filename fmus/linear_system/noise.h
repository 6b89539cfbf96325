/* Process noise whose path depends on the seed alone, not on the instants at which anybody looks.
 *
 *     dx = (A x + B u) dt + G dw        w: independent standard Wiener processes
 *     n = integral of exp(A (end - s)) G dw(s) over a stretch               the noise of a stretch, seen at its end
 *     cov n = Q(h) = integral of exp(A s) G G' exp(A s)' ds over [0, h]     (Van Loan 1978)
 *
 * Time is cut into intervals of INTERVAL_NS, whose noises are independent. The noise of a stretch of length 2 h is
 * n = F n1 + n2, with F = exp(A h) and n1, n2 of its halves. Given n, that of the first half is normal:
 *
 *     mean = C n    C = Q F' (Q + F Q F')^-1    cov = Q - C F Q    Q = Q(h)
 *
 * Halving towards an instant (Levy 1948; a virtual Brownian tree: Li et al. 2020) reaches every nanosecond in at most
 * LEVELS draws. Each draw is numbered by interval and stretch, and a counter-based generator gives its numbers (Philox
 * 4x64-10: Salmon et al. 2011; the quantile of the normal distribution: Wichura 1988, AS 241).
 *
 * F and Q of 1 ns are series, and double: F(2 h) = F F, Q(2 h) = Q + F Q F'. */
#ifndef NOISE_H
#define NOISE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "discretization.h"

typedef double Square[STATES][STATES];

/* Upper 64 bits of a b. */
static uint64_t upper(uint64_t a, uint64_t b)
{
    const uint64_t a0 = (uint32_t)a, a1 = a >> 32, b0 = (uint32_t)b, b1 = b >> 32;
    const uint64_t low = a0 * b0, first = a1 * b0 + (low >> 32), second = a0 * b1 + (uint32_t)first;
    return a1 * b1 + (first >> 32) + (second >> 32);
}

static void philox(const uint64_t counter[4], uint64_t key, uint64_t out[4])
{
    const uint64_t m0 = 0xD2E7470EE14C6C93u, m1 = 0xCA5A826395121157u;
    uint64_t key0 = key, key1 = 0;
    memcpy(out, counter, 4 * sizeof out[0]);
    for (int round = 0; round < 10; round++) {
        const uint64_t high0 = upper(m0, out[0]), high1 = upper(m1, out[2]);
        const uint64_t next[4] = {high1 ^ out[1] ^ key0, m1 * out[2], high0 ^ out[3] ^ key1, m0 * out[0]};
        memcpy(out, next, sizeof next);
        key0 += 0x9E3779B97F4A7C15u;
        key1 += 0xBB67AE8584CAA73Bu;
    }
}

/* Polynomial with 8 coefficients, of the highest power first. */
static double polynomial(const double c[8], double r)
{
    double sum = c[0];
    for (int i = 1; i < 8; i++)
        sum = sum * r + c[i];
    return sum;
}

/* Quantile of the standard normal distribution, 0 < p < 1. */
static double normal_quantile(double p)
{
    static const double
        A[] = {2.5090809287301226727e+3, 3.3430575583588128105e+4, 6.7265770927008700853e+4, 4.5921953931549871457e+4,
               1.3731693765509461125e+4, 1.9715909503065514427e+3, 1.3314166789178437745e+2, 3.3871328727963666080e+0},
        B[] = {5.2264952788528545610e+3, 2.8729085735721942674e+4, 3.9307895800092710610e+4, 2.1213794301586595867e+4,
               5.3941960214247511077e+3, 6.8718700749205790830e+2, 4.2313330701600911252e+1, 1.0},
        C[] = {7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1,
               1.27045825245236838258e+0, 3.64784832476320460504e+0, 5.76949722146069140550e+0,
               4.63033784615654529590e+0, 1.42343711074968357734e+0},
        D[] = {1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2,
               1.48103976427480074590e-1, 6.89767334985100004550e-1, 1.67638483018380384940e+0,
               2.05319162663775882187e+0, 1.0},
        E[] = {2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3,
               2.65321895265761230930e-2, 2.96560571828504891230e-1, 1.78482653991729133580e+0,
               5.46378491116411436990e+0, 6.65790464350110377720e+0},
        F[] = {2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5,
               7.86869131145613259100e-4, 1.48753612908506148525e-2, 1.36929880922735805310e-1,
               5.99832206555887937690e-1, 1.0};
    const double q = p - 0.5;
    if (fabs(q) <= 0.425) {
        const double r = 0.180625 - q * q;
        return q * polynomial(A, r) / polynomial(B, r);
    }
    const double r = sqrt(-log(q < 0 ? p : 1 - p));
    const double x = r <= 5 ? polynomial(C, r - 1.6) / polynomial(D, r - 1.6)
                            : polynomial(E, r - 5) / polynomial(F, r - 5);
    return q < 0 ? -x : x;
}

/* Add factor z to out, with z the standard normal numbers of the draw (interval, stretch). */
static void add_draw(Noise *noise, double seed, uint64_t stretch, Square factor, double out[STATES])
{
    double z[STATES];
    for (int first = 0; first < noise->draws; first += 4) {
        const uint64_t counter[4] = {stretch, (uint64_t)noise->interval, (uint64_t)first / 4, 0};
        uint64_t bits[4];
        philox(counter, (uint64_t)seed, bits);
        for (int k = 0; k < 4; k++) /* the middles of 2^52 equal parts: 0 and 1 are none of them */
            z[first + k] = normal_quantile(((double)(bits[k] >> 12) + 0.5) * 0x1p-52);
    }
    for (int i = 0; i < noise->draws; i++)
        for (int k = 0; k < noise->draws; k++)
            out[i] += factor[i][k] * z[k];
}

/* out = a b, or a b' if `transposed` */
static void product(int n, Square a, Square b, int transposed, Square out)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += a[i][k] * (transposed ? b[j][k] : b[k][j]);
            out[i][j] = sum;
        }
}

/* Lower triangle l with l l' = s, for s that may be singular: a pivot that is rounding of `scale` counts as 0. */
static void cholesky(int n, Square s, Square scale, Square l)
{
    memset(l, 0, sizeof(Square));
    for (int j = 0; j < n; j++) {
        double pivot = s[j][j];
        for (int k = 0; k < j; k++)
            pivot -= l[j][k] * l[j][k];
        if (!(pivot > 1e-13 * scale[j][j]))
            continue;
        l[j][j] = sqrt(pivot);
        for (int i = j + 1; i < n; i++) {
            double sum = s[i][j];
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            l[i][j] = sum / l[j][j];
        }
    }
}

/* Each row of x becomes the row r with r l l' = x; where the pivot of l is 0, r is 0. */
static void divide(int n, Square l, Square x)
{
    for (int row = 0; row < n; row++) {
        double *r = x[row];
        for (int j = 0; j < n; j++) {
            for (int k = 0; k < j; k++)
                r[j] -= l[j][k] * r[k];
            r[j] = l[j][j] > 0 ? r[j] / l[j][j] : 0;
        }
        for (int j = n - 1; j >= 0; j--) {
            for (int k = j + 1; k < n; k++)
                r[j] -= l[k][j] * r[k];
            r[j] = l[j][j] > 0 ? r[j] / l[j][j] : 0;
        }
    }
}

/* F - I and Q of the step h, short enough that the norm of A h is at most 1/2, by their Taylor series. */
static void series(int n, Square a, Square g, double h, Square z, Square q)
{
    Square term, next;
    memset(z, 0, sizeof(Square));
    memset(term, 0, sizeof(Square));
    for (int i = 0; i < n; i++)
        term[i][i] = 1;
    for (int k = 1; k <= 20; k++) { /* (A h)^k / k! */
        product(n, a, term, 0, next);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                z[i][j] += term[i][j] = next[i][j] * h / k;
    }
    product(STATES, g, g, 1, term);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            q[i][j] = term[i][j] *= h;
    for (int k = 2; k <= 24; k++) { /* h^k / k! of L^(k-1) (G G'), with L(X) = A X + X A' */
        product(n, a, term, 0, next);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                term[i][j] = (next[i][j] + next[j][i]) * h / k;
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                q[i][j] += term[i][j];
    }
}

/* From F - I and Q of the step h to those of 2 h; `half`, if given, gets its matrices. */
static void twice(int n, Square z, Square q, Half *half)
{
    Square f, fq, q2, part;
    memcpy(f, z, sizeof(Square));
    for (int i = 0; i < n; i++)
        f[i][i] += 1;
    product(n, f, q, 0, fq);
    product(n, fq, f, 1, q2);
    product(n, z, z, 0, part);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            q2[i][j] += q[i][j];
            z[i][j] = 2 * z[i][j] + part[i][j];
        }
    if (half) {
        Square l;
        memset(half, 0, sizeof *half);
        memcpy(half->F, f, sizeof(Square));
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                half->gain[i][j] = fq[j][i]; /* Q F', as Q is symmetric */
        cholesky(n, q2, q2, l);
        divide(n, l, half->gain);
        product(n, half->gain, fq, 0, part);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                part[i][j] = q[i][j] - part[i][j];
        cholesky(n, part, q, half->spread);
    }
    memcpy(q, q2, sizeof(Square));
}

/* out += a x */
static void add_product(int n, Square a, const double x[STATES], double out[STATES])
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            out[i] += a[i][j] * x[j];
}

static void draw_whole(Noise *noise, double seed)
{
    memset(noise->whole, 0, sizeof noise->whole);
    add_draw(noise, seed, 0, noise->spread, noise->whole);
}

/* Matrices for n states; `finer` halvings of 1 ns bring the norm of A h to at most 1/2. */
static void noise_start(Noise *noise, int n, int finer, Square a, Square g, double seed)
{
    Square z, q;
    noise->draws = n;
    series(n, a, g, ldexp(1e-9, -finer), z, q);
    for (int k = 0; k < finer; k++)
        twice(n, z, q, NULL);
    for (int level = LEVELS - 1; level >= 0; level--)
        twice(n, z, q, &noise->of[level]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            noise->F[i][j] = z[i][j] + (i == j);
    cholesky(n, q, q, noise->spread);
    draw_whole(noise, seed);
}

/* Go on to the next interval. */
static void next_interval(Noise *noise, double seed)
{
    double before[STATES];
    memcpy(before, noise->whole, sizeof before);
    add_product(noise->draws, noise->F, noise->before, before);
    memcpy(noise->before, before, sizeof before);
    noise->interval++;
    draw_whole(noise, seed);
}

/* Noise from the start of the span to the instant `at_ns` after the start of the interval, 0 <= at_ns < INTERVAL_NS. */
static void noise_at(Noise *noise, double seed, long long at_ns, double out[STATES])
{
    const int n = noise->draws;
    double whole[STATES];
    uint64_t stretch = 1; /* the halves of stretch s are 2 s and 2 s + 1 */
    memcpy(out, noise->before, sizeof noise->before);
    memcpy(whole, noise->whole, sizeof whole);
    for (int level = 0; at_ns; level++) { /* `out` is the noise at the start of the stretch, at_ns before the instant */
        Half *half = &noise->of[level];
        const long long half_ns = INTERVAL_NS >> (level + 1);
        double first[STATES] = {0};
        add_product(n, half->gain, whole, first);
        add_draw(noise, seed, stretch, half->spread, first);
        const int later = at_ns >= half_ns;
        if (later) {
            double middle[STATES], through[STATES] = {0};
            memcpy(middle, first, sizeof middle);
            add_product(n, half->F, out, middle);
            memcpy(out, middle, sizeof middle);
            add_product(n, half->F, first, through);
            for (int i = 0; i < n; i++)
                whole[i] -= through[i];
            at_ns -= half_ns;
        } else {
            memcpy(whole, first, sizeof first);
        }
        stretch = 2 * stretch + (uint64_t)later;
    }
}

#endif
