/* error_bound.c: see error_bound.h. */
#include "error_bound.h"
#include <stdint.h>
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_functions.h"

enum { CELLS = 32, ROWS = 64 };         /* as in heading_slope.py */

static Gains k;
static double step, bump;               /* [m], [1]: of the table's chords */
static double at_node[CELLS];           /* k3 z of each column */
static int64_t row_read;                /* number of the row in `row` */
static double row[CELLS + 1];

void error_bound_init(const Gains *gains)
{
    k = *gains;
    board_parameter(PARAMETER_SLOPE_STEP_M, 0, &step);
    board_parameter(PARAMETER_SLOPE_BUMP, 0, &bump);
    for (uint32_t j = 0; j < CELLS; j++) {
        at_node[j] = k.k3 * (double)j * step;
    }
    row_read = -1;
}

static void read_row(double m3)
{
    const double place = m3 * (2.0 * ROWS / MARCONET_PI);
    const int64_t below = (int64_t)place;
    const int64_t up = place > (double)below ? below + 1 : below;
    const int64_t wanted = up < ROWS ? up : ROWS;
    if (wanted != row_read) {
        for (uint32_t j = 0; j <= CELLS; j++) {
            board_parameter(PARAMETER_SLOPE, (uint32_t)wanted * (CELLS + 1) + j, row + j);
        }
        row_read = wanted;
    }
}

static double a13(double v, double m2, double m3)
{
    const double place = m2 / step;
    double largest = k.k3 * m2;
    int64_t last = CELLS;
    read_row(m3);
    if (place < CELLS) {
        const int64_t n = (int64_t)place;
        const double share = (place * place - (double)(n * n)) / (double)(2 * n + 1);
        largest += v * (row[n] + (row[n + 1] - row[n]) * share);
        last = n + 1;
    }
    for (int64_t j = 0; j < last; j++) {
        const double here = at_node[j] + v * row[j];
        if (here > largest) {
            largest = here;
        }
    }
    const double chord = largest + v * bump, closed_form = v + k.k3 * m2;
    return closed_form < chord ? closed_form : chord;
}

/* Return the largest eigenvalue of a symmetric matrix (Smith 1961). */
static double largest_eigenvalue(double a11, double a22, double a33, double a12, double a13_, double a23)
{
    const double mean = (a11 + a22 + a33) / 3.0;
    const double b11 = a11 - mean, b22 = a22 - mean, b33 = a33 - mean;
    const double off = a12 * a12 + a13_ * a13_ + a23 * a23;
    const double size = square_root((b11 * b11 + b22 * b22 + b33 * b33 + 2.0 * off) / 6.0);
    const double cube = 2.0 * size * size * size;
    if (cube == 0.0) {
        return mean + 2.0 * size;
    }
    const double determinant = b11 * (b22 * b33 - a23 * a23) - a12 * (a12 * b33 - a23 * a13_)
                               + a13_ * (a12 * a23 - b22 * a13_);
    const double ratio = determinant / cube;
    if (ratio >= 1.0) {
        return mean + 2.0 * size;
    }
    return mean + 2.0 * size * cosine(arc_cosine(ratio > -1.0 ? ratio : -1.0) / 3.0);
}

double growth_per_s(double v, Extents extents)
{
    const double speed = magnitude(v), k2v = k.k2 * speed;
    const double a23 = k.k3 * extents.m1;
    return largest_eigenvalue(k.k1, k2v * extents.m1, k.k3, k2v * extents.m2, a13(speed, extents.m2, extents.m3),
                              a23 > k2v ? a23 : k2v);
}
