/* Linear time-invariant system with held inputs, in continuous time or, with a sample time dt > 0, in discrete time,
 * with or without process noise.
 *
 *     dx/dt = A x + B u          y = C x + D u          u constant over a step
 *     x(t + h) = x + Z x + G u   Z = exp(A h) - I   G = Phi B   Phi = integral of exp(A s) ds over [0, h]
 *
 * Exact for any h up to rounding. Phi(h / 2^s) comes from its Taylor series, Phi(2 h) = (2 I + Z) Phi and
 * Z(2 h) = 2 Z + Z^2 double it back (Higham 2008, Functions of Matrices, section 10.3, with Phi as in section 10.7.4).
 * Z rather than exp(A h) is kept because a short step then loses no digits of A h against I.
 *
 * In discrete time x(k + 1) = A x(k) + B u(k) at t = k dt, dt rounded to a nanosecond; u(k) is the input set last at
 * k dt, and y is C x(k) + D u(k) until (k + 1) dt.
 *
 * A trailing state whose rows of A and B and whose start are zero stays zero for ever, so leaving it out changes no
 * result; the same holds for trailing inputs with zero columns and outputs with zero rows.
 *
 * With G, dx = (A x + B u) dt + G dw. `noise.h` gives the noise since the start of a span of SPAN_NS, which is added to
 * the states computed from there without it; the next span starts with the sum. In discrete time G z(k) is added, with
 * independent standard normal z(k).
 *
 * Not modelled: matrices that vary with time, saturation. */
#include <math.h>
#include <string.h>

#include "noise.h"
#include "variables.h"

#define TERMS 16 /* remainder of the series of Phi, relative: 0.5^16 / 17! = 4e-20 */

static int filled(int rows, const int used[])
{
    while (rows > 0 && !used[rows - 1])
        rows--;
    return rows;
}

/* Doublings that bring the largest column sum of |A| h to at most 1/2. */
static int doublings(const Values *v, double h)
{
    double norm = 0;
    for (int j = 0; j < v->memory.n; j++) {
        double sum = 0;
        for (int i = 0; i < v->memory.n; i++)
            sum += fabs(v->A[i][j]);
        norm = fmax(norm, sum * h);
    }
    int exponent = 0;
    if (isfinite(norm))
        frexp(norm, &exponent); /* norm < 2^exponent */
    return exponent + 1 > 0 ? exponent + 1 : 0;
}

void model_start(Values *v)
{
    int states[STATES] = {0}, inputs[INPUTS] = {0}, outputs[OUTPUTS] = {0}, noisy = 0;
    for (int i = 0; i < STATES; i++) {
        states[i] = v->x0[i] != 0;
        for (int j = 0; j < STATES; j++) {
            states[i] |= v->A[i][j] != 0 || v->G[i][j] != 0;
            noisy |= v->G[i][j] != 0;
        }
        for (int j = 0; j < INPUTS; j++) {
            states[i] |= v->B[i][j] != 0;
            inputs[j] |= v->B[i][j] != 0;
        }
    }
    for (int i = 0; i < OUTPUTS; i++) {
        for (int j = 0; j < STATES; j++)
            outputs[i] |= v->C[i][j] != 0;
        for (int j = 0; j < INPUTS; j++) {
            outputs[i] |= v->D[i][j] != 0;
            inputs[j] |= v->D[i][j] != 0;
        }
    }
    memset(&v->memory, 0, sizeof v->memory);
    v->memory.n = filled(STATES, states);
    v->memory.m = filled(INPUTS, inputs);
    v->memory.p = filled(OUTPUTS, outputs);
    memcpy(v->x, v->x0, sizeof v->x);
    if (noisy && v->dt > 0) {
        v->memory.noise.draws = STATES; /* as G may have more columns than states in use */
    } else if (noisy) {
        memcpy(v->memory.noise.without, v->x0, sizeof v->x0);
        noise_start(&v->memory.noise, v->memory.n, doublings(v, 1e-9), v->A, v->G, v->noise_seed);
    }
}

/* out = a b, all n x n */
static void multiply(int n, double a[STATES][STATES], double b[STATES][STATES], double out[STATES][STATES])
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += a[i][k] * b[k][j];
            out[i][j] = sum;
        }
}

static void discretize(Values *v, double h, Discretization *d)
{
    const int n = v->memory.n, s = doublings(v, h);
    const double part = ldexp(h, -s);
    double phi[STATES][STATES] = {{0}}, product[STATES][STATES];

    for (int term = TERMS; term >= 1; term--) { /* Horner: phi = part (I + A phi_of_the_higher_terms / term) */
        multiply(n, v->A, phi, product);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                phi[i][j] = part / term * ((i == j) + product[i][j]);
    }
    multiply(n, v->A, phi, d->Z);
    for (int k = 0; k < s; k++) {
        multiply(n, d->Z, phi, product);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                phi[i][j] = 2 * phi[i][j] + product[i][j];
        multiply(n, d->Z, d->Z, product);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                d->Z[i][j] = 2 * d->Z[i][j] + product[i][j];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < v->memory.m; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += phi[i][k] * v->B[k][j];
            d->G[i][j] = sum;
        }
}

static const Discretization *discretization(Values *v, double h)
{
    Memory *memory = &v->memory;
    for (int slot = 0; slot < KEPT; slot++)
        if (memory->h[slot] == h)
            return &memory->of[slot];
    const int slot = memory->next;
    memory->next = (slot + 1) % KEPT;
    memory->h[slot] = h;
    discretize(v, h, &memory->of[slot]);
    return &memory->of[slot];
}

/* Advance the states by one sample: x = A x + B held + G z. */
static void next_sample(Values *v)
{
    double x[STATES] = {0};
    for (int i = 0; i < v->memory.n; i++) {
        for (int j = 0; j < v->memory.n; j++)
            x[i] += v->A[i][j] * v->x[j];
        for (int j = 0; j < v->memory.m; j++)
            x[i] += v->B[i][j] * v->memory.held[j];
    }
    Noise *noise = &v->memory.noise;
    if (noise->draws) {
        add_draw(noise, v->noise_seed, 0, v->G, x);
        noise->interval++;
    }
    memcpy(v->x, x, (size_t)v->memory.n * sizeof x[0]);
}

static void step_in_discrete_time(Values *v, double h)
{
    Memory *memory = &v->memory;
    const long long sample_ns = v->dt > 1e-9 ? llround(v->dt * 1e9) : 1;
    if (memory->since_ns == 0)
        memcpy(memory->held, v->u, sizeof memory->held);
    memory->since_ns += llround(h * 1e9);
    while (memory->since_ns >= sample_ns) {
        next_sample(v);
        memory->since_ns -= sample_ns;
        if (memory->since_ns > 0)
            memcpy(memory->held, v->u, sizeof memory->held);
    }
}

/* Advance the states x by h, without noise. */
static void advance(Values *v, double h, double x[STATES])
{
    const Discretization *d = discretization(v, h);
    double change[STATES];
    for (int i = 0; i < v->memory.n; i++) {
        change[i] = 0;
        for (int j = 0; j < v->memory.n; j++)
            change[i] += d->Z[i][j] * x[j];
        for (int j = 0; j < v->memory.m; j++)
            change[i] += d->G[i][j] * v->u[j];
    }
    for (int i = 0; i < v->memory.n; i++)
        x[i] += change[i];
}

/* Advance by h, less than what is left of the span, or by all that is left of it. */
static void step_within_span(Values *v, double h, long long h_ns)
{
    Memory *memory = &v->memory;
    Noise *noise = &memory->noise;
    advance(v, h, noise->without);
    const long long passed = memory->since_ns / INTERVAL_NS;
    memory->since_ns += h_ns;
    for (long long k = memory->since_ns / INTERVAL_NS; k > passed; k--)
        next_interval(noise, v->noise_seed);
    noise_at(noise, v->noise_seed, memory->since_ns % INTERVAL_NS, v->x);
    for (int i = 0; i < memory->n; i++)
        v->x[i] += noise->without[i];
    if (memory->since_ns == SPAN_NS) {
        memcpy(noise->without, v->x, sizeof noise->without);
        memset(noise->before, 0, sizeof noise->before);
        memory->since_ns = 0;
    }
}

static void step_with_noise(Values *v, double h)
{
    long long left_ns = llround(h * 1e9), span_ns = SPAN_NS - v->memory.since_ns;
    if (left_ns < span_ns) {
        step_within_span(v, h, left_ns);
        return;
    }
    for (; left_ns >= span_ns; span_ns = SPAN_NS) {
        step_within_span(v, (double)span_ns / 1e9, span_ns);
        left_ns -= span_ns;
    }
    if (left_ns > 0)
        step_within_span(v, (double)left_ns / 1e9, left_ns);
}

void model_step(Values *v, double h /* [s] */)
{
    if (v->dt > 0) {
        step_in_discrete_time(v, h);
        return;
    }
    if (v->memory.noise.draws)
        step_with_noise(v, h);
    else
        advance(v, h, v->x);
}

void model_outputs(Values *v)
{
    const double *u = v->dt > 0 && v->memory.since_ns > 0 ? v->memory.held : v->u;
    for (int i = 0; i < v->memory.p; i++) {
        v->y[i] = 0;
        for (int j = 0; j < v->memory.n; j++)
            v->y[i] += v->C[i][j] * v->x[j];
        for (int j = 0; j < v->memory.m; j++)
            v->y[i] += v->D[i][j] * u[j];
    }
}
