#include "assembly/stress_lanes.h"

#include "core/cpu.h"

#include <string.h>

#define INLINE static inline __attribute__((always_inline))

enum { LANES = UZ_STRAIN_LANES, NODES = UZ_ELEMENT_NODES, MOST_ROW = 8, LINEAR = 4 };

typedef int64_t lane_bits __attribute__((vector_size(8 * UZ_STRAIN_LANES), aligned(8)));

int uz_stress_row_size(uz_model model)
{
    return uz_stress_count(model) < LANES ? LANES : MOST_ROW;
}

/* ---- sums at nodes */

INLINE void transpose(uz_lanes out[LANES], const uz_lanes in[LANES])
{
    const uz_lanes low = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6),
                   high = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7),
                   low2 = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6),
                   high2 = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);
    out[0] = __builtin_shufflevector(low, low2, 0, 1, 4, 5);
    out[1] = __builtin_shufflevector(high, high2, 0, 1, 4, 5);
    out[2] = __builtin_shufflevector(low, low2, 2, 3, 6, 7);
    out[3] = __builtin_shufflevector(high, high2, 2, 3, 6, 7);
}

/* Stress of the strains less the thermal strain. n: components, `direct` of them no shear. */
INLINE void stress_of(uz_lanes *stress, const uz_strain_group *g, const uz_lanes *strain, int n, int direct)
{
    uz_lanes trace = {0};
    for (int c = 0; c < direct; c++)
        trace += strain[c] - g->thermal;
    for (int c = 0; c < n; c++)
        stress[c] = c < direct ? g->material.lambda * trace + 2 * g->material.mu * (strain[c] - g->thermal)
                               : g->material.mu * strain[c];
}

/* Adds one row for each lane at node a, or at all nodes where a < 0. */
INLINE void add_rows(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                     const uz_lanes value[MOST_ROW], int a, int size)
{
    const int from = a < 0 ? 0 : a, to = a < 0 ? g->rule.nodes : a + 1;
    for (int part = 0; part < size; part += LANES) {
        uz_lanes row[LANES];
        transpose(row, value + part);
        for (int l = 0; l < g->count; l++)
            for (int k = from; k < to; k++)
                *(uz_lanes *)(rows + place[l][k] * size + part) += row[l];
    }
}

/* The element's mean stress with its volume as weight. The mean is the stress at the centre, where that of a linear
 * element is most accurate; stresses continued to the corners would bring the solution's own error back into the
 * average and hide a third of it. */
INLINE void add_mean(double *rows, const uz_strain_group *g, const int64_t *const place[LANES], int n, int direct)
{
    uz_lanes mean[UZ_ELEMENT_STRESSES] = {{0}}, value[MOST_ROW] = {{0}}, volume = {0};
    for (int p = 0; p < g->rule.points; p++) {
        volume += g->shape.volume[p];
        for (int c = 0; c < n; c++)
            mean[c] += g->shape.volume[p] * g->strain[p][c];
    }
    for (int c = 0; c < n; c++)
        mean[c] /= volume;
    stress_of(value, g, mean, n, direct);
    for (int c = 0; c < n; c++)
        value[c] *= volume;
    value[n] = volume;
    add_rows(rows, g, place, value, -1, n < LANES ? LANES : MOST_ROW);
}

/* A X = B by elimination with pivots on the diagonal: A is a Gram matrix. A: m x m, B: m x n. */
INLINE void solve_small(uz_lanes A[LINEAR][LINEAR], uz_lanes B[LINEAR][UZ_ELEMENT_STRESSES], int m, int n)
{
    for (int k = 0; k < m; k++) {
        const uz_lanes pivot = 1 / A[k][k];
        for (int j = 0; j < n; j++)
            B[k][j] *= pivot;
        for (int j = k + 1; j < m; j++)
            A[k][j] *= pivot;
        for (int i = 0; i < m; i++) {
            const uz_lanes factor = A[i][k];
            if (i == k)
                continue;
            for (int j = k + 1; j < m; j++)
                A[i][j] -= factor * A[k][j];
            for (int j = 0; j < n; j++)
                B[i][j] -= factor * B[k][j];
        }
    }
}

/* y[a * dim + c]: places of the nodes from the first one on, over the element's size. */
INLINE void scale_places(uz_lanes *y, const uz_strain_group *g, int dim)
{
    const int count = g->rule.nodes * dim;
    const lane_bits no_sign = (lane_bits){0} + INT64_MAX;
    uz_lanes size = {0};
    for (int i = 0; i < count; i++) {
        y[i] = g->x[i] - g->x[i % dim];
        size += (uz_lanes)((lane_bits)y[i] & no_sign);
    }
    for (int i = 0; i < count; i++)
        y[i] /= size;
}

/* At each node, the linear function that fits the stresses of the Gauss points best: that of a quadratic element is
 * most accurate there. */
INLINE void add_linear_fit(double *rows, const uz_strain_group *g, const int64_t *const place[LANES], int n, int direct,
                           int dim)
{
    const int m = dim + 1, nodes = g->rule.nodes;
    uz_lanes A[LINEAR][LINEAR] = {{{0}}}, B[LINEAR][UZ_ELEMENT_STRESSES] = {{{0}}}, y[3 * NODES], b[LINEAR];
    uz_lanes stress[UZ_ELEMENT_STRESSES], value[MOST_ROW] = {{0}}, volume = {0};
    scale_places(y, g, dim);
    b[0] = 1 - (uz_lanes){0};
    for (int p = 0; p < g->rule.points; p++) {
        for (int i = 1; i < m; i++) {
            b[i] = (uz_lanes){0};
            for (int a = 1; a < nodes; a++)
                b[i] += g->rule.N[p][a] * y[a * dim + i - 1];
        }
        stress_of(stress, g, g->strain[p], n, direct);
        volume += g->shape.volume[p];
        for (int i = 0; i < m; i++) {
            const uz_lanes weighted = g->shape.volume[p] * b[i];
            for (int j = 0; j < m; j++)
                A[i][j] += weighted * b[j];
            for (int c = 0; c < n; c++)
                B[i][c] += weighted * stress[c];
        }
    }
    solve_small(A, B, m, n);
    value[n] = volume;
    for (int a = 0; a < nodes; a++) {
        for (int c = 0; c < n; c++) {
            value[c] = B[0][c];
            for (int i = 1; i < m; i++)
                value[c] += y[a * dim + i - 1] * B[i][c];
            value[c] *= volume;
        }
        add_rows(rows, g, place, value, a, n < LANES ? LANES : MOST_ROW);
    }
}

INLINE void add(double *rows, const uz_strain_group *g, const int64_t *const place[LANES], int n, int direct, int dim)
{
    if (g->rule.quadratic)
        add_linear_fit(rows, g, place, n, direct, dim);
    else
        add_mean(rows, g, place, n, direct);
}

/* ---- comparison */

/* nodal[a][c]: the averages at the nodes. */
INLINE void gather_rows(uz_lanes nodal[NODES][MOST_ROW], const double *rows, const uz_strain_group *g,
                        const int64_t *const place[LANES], int size)
{
    for (int a = 0; a < g->rule.nodes; a++)
        for (int part = 0; part < size; part += LANES) {
            uz_lanes row[LANES];
            for (int l = 0; l < LANES; l++)
                row[l] = *(const uz_lanes *)(rows + place[l][a] * size + part);
            transpose(nodal[a] + part, row);
        }
}

/* Deviator and trace apart, as in uz_complementary. */
INLINE void compare(double *eta2, double *energy2, const double *rows, const uz_strain_group *g,
                    const int64_t *const place[LANES], int n, int direct)
{
    uz_lanes nodal[NODES][MOST_ROW], eta = {0}, energy = {0};
    const uz_lanes twice_mu = 2 * g->material.mu, per_twice_mu = 1 / twice_mu,
                   per_bulk = 1 / (direct * (direct * g->material.lambda + twice_mu));
    gather_rows(nodal, rows, g, place, n < LANES ? LANES : MOST_ROW);
    for (int p = 0; p < g->rule.points; p++) {
        const uz_lanes *strain = g->strain[p];
        uz_lanes jump[UZ_ELEMENT_STRESSES], trace = {0}, sum = {0}, deviator = {0}, direct_work = {0}, shear_work = {0};
        stress_of(jump, g, strain, n, direct);
        for (int c = 0; c < n; c++) {
            jump[c] = -jump[c];
            for (int a = 0; a < g->rule.nodes; a++)
                jump[c] += g->rule.N[p][a] * nodal[a][c];
        }
        for (int c = 0; c < direct; c++) {
            sum += jump[c];
            trace += strain[c];
            direct_work += strain[c] * strain[c];
        }
        for (int c = 0; c < direct; c++)
            deviator += (jump[c] - sum / direct) * (jump[c] - sum / direct);
        for (int c = direct; c < n; c++) {
            deviator += 2 * jump[c] * jump[c];
            shear_work += strain[c] * strain[c];
        }
        eta += g->shape.volume[p] * (sum * sum * per_bulk + deviator * per_twice_mu);
        /* of the whole strain: ||u_h|| knows no temperature */
        energy += g->shape.volume[p] *
                  (g->material.lambda * trace * trace + twice_mu * direct_work + g->material.mu * shear_work);
    }
    for (int l = 0; l < g->count; l++) {
        *eta2 += eta[l];
        *energy2 += energy[l];
    }
}

/* ---- for each model and kind of processor */

INLINE void add_of_model(double *rows, const uz_strain_group *g, const int64_t *const place[LANES])
{
    if (g->rule.stresses == 3)
        add(rows, g, place, 3, 2, 2);
    else if (g->rule.stresses == 4)
        add(rows, g, place, 4, 3, 2);
    else
        add(rows, g, place, 6, 3, 3);
}

INLINE void compare_of_model(double *eta2, double *energy2, const double *rows, const uz_strain_group *g,
                             const int64_t *const place[LANES])
{
    if (g->rule.stresses == 3)
        compare(eta2, energy2, rows, g, place, 3, 2);
    else if (g->rule.stresses == 4)
        compare(eta2, energy2, rows, g, place, 4, 3);
    else
        compare(eta2, energy2, rows, g, place, 6, 3);
}

UZ_AVX2_FMA static void add_fused(double *rows, const uz_strain_group *g, const int64_t *const place[LANES])
{
    add_of_model(rows, g, place);
}

UZ_AVX2_FMA static void compare_fused(double *eta2, double *energy2, const double *rows, const uz_strain_group *g,
                                      const int64_t *const place[LANES])
{
    compare_of_model(eta2, energy2, rows, g, place);
}

void uz_stress_rows_add(double *rows, const uz_strain_group *group, const int64_t *const place[UZ_STRAIN_LANES])
{
    (uz_cpu_has_avx2_fma() ? add_fused : add_of_model)(rows, group, place);
}

void uz_stress_rows_compare(double *eta2, double *energy2, const double *rows, const uz_strain_group *group,
                            const int64_t *const place[UZ_STRAIN_LANES])
{
    (uz_cpu_has_avx2_fma() ? compare_fused : compare_of_model)(eta2, energy2, rows, group, place);
}
