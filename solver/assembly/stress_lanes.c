#include "assembly/stress_lanes.h"

#include "core/cpu.h"

#include <string.h>

enum { LANES = UZ_STRAIN_LANES, NODES = UZ_ELEMENT_NODES, MOST_ROW = 8, LINEAR = 4 };

typedef int64_t lane_bits __attribute__((vector_size(8 * UZ_STRAIN_LANES), aligned(8)));

/* ---- sums at nodes */

UZ_INLINE void transpose(uz_lanes out[LANES], const uz_lanes in[LANES])
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

/* Adds one row for each lane at node a, or at all nodes where a < 0. */
UZ_INLINE void add_rows(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
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

/* What the samples give to each node, with the element's volume as weight. */
UZ_INLINE void add_shares(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                          const double share[][UZ_ELEMENT_SAMPLES], uz_lanes value[MOST_ROW], int n, int size)
{
    const int samples = g->rule.asked, different = samples == 1 ? 1 : g->rule.nodes;
    for (int a = 0; a < different; a++) {
        for (int c = 0; c < n; c++) {
            value[c] = share[a][0] * g->strain[0][c];
            for (int k = 1; k < samples; k++)
                value[c] += share[a][k] * g->strain[k][c];
            value[c] *= value[n];
        }
        add_rows(rows, g, place, value, samples == 1 ? -1 : a, size);
    }
}

/* A X = B by elimination with pivots on the diagonal: A is a Gram matrix. A: m x m, B: m x n. */
UZ_INLINE void solve_small(uz_lanes A[LINEAR][LINEAR], uz_lanes B[LINEAR][UZ_ELEMENT_STRESSES], int m, int n)
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

/* At each node, the linear function of the place that fits the samples best, with the element's volume as weight. */
UZ_INLINE void add_linear_fit(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                              uz_lanes value[MOST_ROW], int n, int dim, int size)
{
    const int m = dim + 1, nodes = g->rule.nodes;
    const lane_bits no_sign = (lane_bits){0} + INT64_MAX;
    uz_lanes A[LINEAR][LINEAR] = {{{0}}}, B[LINEAR][UZ_ELEMENT_STRESSES] = {{{0}}}, y[3 * NODES] = {{0}}, b[LINEAR];
    uz_lanes length = {0};
    for (int i = 0; i < nodes * dim; i++) { /* places from the first node on, over the element's size */
        y[i] = g->x[i] - g->x[i % dim];
        length += (uz_lanes)((lane_bits)y[i] & no_sign);
    }
    for (int i = 0; i < nodes * dim; i++)
        y[i] /= length;
    b[0] = 1 - (uz_lanes){0};
    for (int p = 0; p < g->rule.asked; p++) {
        for (int i = 1; i < m; i++) {
            b[i] = (uz_lanes){0};
            for (int a = 1; a < nodes; a++)
                b[i] += g->rule.N[p][a] * y[a * dim + i - 1];
        }
        for (int i = 0; i < m; i++) {
            const uz_lanes weighted = g->shape.volume[p] * b[i];
            for (int j = 0; j < m; j++)
                A[i][j] += weighted * b[j];
            for (int c = 0; c < n; c++)
                B[i][c] += weighted * g->strain[p][c];
        }
    }
    solve_small(A, B, m, n);
    for (int a = 0; a < nodes; a++) {
        for (int c = 0; c < n; c++) {
            value[c] = B[0][c];
            for (int i = 1; i < m; i++)
                value[c] += y[a * dim + i - 1] * B[i][c];
            value[c] *= value[n];
        }
        add_rows(rows, g, place, value, a, size);
    }
}

UZ_INLINE void add(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                   const double share[][UZ_ELEMENT_SAMPLES], int n, int dim, int size)
{
    uz_lanes value[MOST_ROW] = {{0}};
    for (int k = 0; k < g->rule.asked; k++)
        value[n] += g->shape.volume[k];
    if (n + 1 < size)
        value[n + 1] = value[n] * g->free_strain;
    if (share)
        add_shares(rows, g, place, share, value, n, size);
    else
        add_linear_fit(rows, g, place, value, n, dim, size);
}

/* ---- comparison */

/* Stress of the strains less the thermal strain. n: components, `direct` of them no shear. */
UZ_INLINE void stress_of(uz_lanes *stress, const uz_strain_group *g, const uz_lanes *strain, int n, int direct)
{
    uz_lanes trace = {0};
    for (int c = 0; c < direct; c++)
        trace += strain[c] - g->thermal;
    for (int c = 0; c < n; c++)
        stress[c] = c < direct ? g->material.lambda * trace + 2 * g->material.mu * (strain[c] - g->thermal)
                               : g->material.mu * strain[c];
}

/* nodal[a][c]: the averages at the nodes. */
UZ_INLINE void gather_rows(uz_lanes nodal[NODES][MOST_ROW], const double *rows, const uz_strain_group *g,
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

/* Deviator and trace apart, so that a large lambda cancels nothing: with n direct components and t = trace(s),
 * s' C^-1 s = t^2 / (n (n lambda + 2 mu)) + (s_dev . s_dev) / (2 mu). */
UZ_INLINE void compare(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                       const int64_t *const place[LANES], int n, int direct, int size)
{
    uz_lanes nodal[NODES][MOST_ROW], eta = {0}, energy[2] = {{0}};
    const uz_lanes twice_mu = 2 * g->material.mu, per_twice_mu = 1 / twice_mu,
                   per_bulk = 1 / (direct * (direct * g->material.lambda + twice_mu));
    gather_rows(nodal, rows, g, place, size);
    for (int p = 0; p < g->rule.asked; p++) {
        const uz_lanes *strain = g->strain[p];
        uz_lanes jump[UZ_ELEMENT_STRESSES], sum = {0}, deviator = {0}, shear_work = {0};
        stress_of(jump, g, strain, n, direct);
        for (int c = 0; c < n; c++) {
            jump[c] = -jump[c];
            for (int a = 0; a < g->rule.nodes; a++)
                jump[c] += g->rule.N[p][a] * nodal[a][c];
        }
        for (int c = 0; c < direct; c++)
            sum += jump[c];
        for (int c = 0; c < direct; c++)
            deviator += (jump[c] - sum / direct) * (jump[c] - sum / direct);
        for (int c = direct; c < n; c++) {
            deviator += 2 * jump[c] * jump[c];
            shear_work += strain[c] * strain[c];
        }
        eta += g->shape.volume[p] * (sum * sum * per_bulk + deviator * per_twice_mu);
        /* of the strain that makes stress, and of the whole: without a free strain they are the same */
        for (int whole = 0; whole < (size > n + 1 ? 2 : 1); whole++) {
            uz_lanes trace = {0}, work = {0};
            for (int c = 0; c < direct; c++) {
                const uz_lanes here = whole ? strain[c] : strain[c] - g->thermal;
                trace += here;
                work += here * here;
            }
            energy[whole] += g->shape.volume[p] *
                             (g->material.lambda * trace * trace + twice_mu * work + g->material.mu * shear_work);
        }
    }
    eta *= sums->times;
    for (int l = 0; l < g->count; l++) {
        sums->eta2 += eta[l];
        if (sums->eta2_of)
            sums->eta2_of[g->element[l]] = eta[l];
        sums->stress += energy[0][l];
        sums->whole += energy[size > n + 1][l];
    }
}

/* ---- for each model and kind of processor */

UZ_INLINE void add_of_model(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                            const double share[][UZ_ELEMENT_SAMPLES], int size)
{
    if (size == LANES)
        add(rows, g, place, share, 3, 2, LANES);
    else if (g->rule.stresses == 3)
        add(rows, g, place, share, 3, 2, MOST_ROW);
    else if (g->rule.stresses == 4)
        add(rows, g, place, share, 4, 2, MOST_ROW);
    else
        add(rows, g, place, share, 6, 3, MOST_ROW);
}

/* Of a material with directions, one element after the other: what compare() sums up. */
static void compare_each(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                         const int64_t *const place[LANES], int size)
{
    const int n = g->rule.stresses;
    for (int l = 0; l < g->count; l++) {
        double eta = 0, energy[2] = {0};
        double thermal[UZ_ELEMENT_STRESSES];
        uz_thermal_strain(thermal, g->rule.model, *g->lame[l], g->free_strain[l]);
        for (int p = 0; p < g->rule.asked; p++) {
            double strain[2][UZ_ELEMENT_STRESSES], stress[2][UZ_ELEMENT_STRESSES], jump[UZ_ELEMENT_STRESSES];
            for (int c = 0; c < n; c++) {
                strain[1][c] = g->strain[p][c][l];
                strain[0][c] = strain[1][c] - thermal[c];
            }
            for (int whole = 0; whole < 2; whole++)
                uz_elastic_stress(stress[whole], g->rule.model, *g->lame[l], strain[whole]);
            for (int c = 0; c < n; c++) {
                jump[c] = -stress[0][c];
                for (int a = 0; a < g->rule.nodes; a++)
                    jump[c] += g->rule.N[p][a] * rows[place[l][a] * size + c];
            }
            eta += g->shape.volume[p][l] * uz_stress_work(g->rule.model, *g->lame[l], jump);
            for (int whole = 0; whole < 2; whole++)
                for (int c = 0; c < n; c++)
                    energy[whole] += g->shape.volume[p][l] * stress[whole][c] * strain[whole][c];
        }
        eta *= sums->times[l];
        sums->eta2 += eta;
        if (sums->eta2_of)
            sums->eta2_of[g->element[l]] = eta;
        sums->stress += energy[0];
        sums->whole += energy[1];
    }
}

UZ_INLINE void compare_of_model(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                                const int64_t *const place[LANES], int size)
{
    if (size == LANES)
        compare(sums, rows, g, place, 3, 2, LANES);
    else if (g->rule.stresses == 3)
        compare(sums, rows, g, place, 3, 2, MOST_ROW);
    else if (g->rule.stresses == 4)
        compare(sums, rows, g, place, 4, 3, MOST_ROW);
    else
        compare(sums, rows, g, place, 6, 3, MOST_ROW);
}

UZ_AVX2_FMA static void add_fused(double *rows, const uz_strain_group *g, const int64_t *const place[LANES],
                                  const double share[][UZ_ELEMENT_SAMPLES], int size)
{
    add_of_model(rows, g, place, share, size);
}

UZ_AVX2_FMA static void compare_fused(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                                      const int64_t *const place[LANES], int size)
{
    compare_of_model(sums, rows, g, place, size);
}

void uz_strain_rows_add(double *rows, int size, const uz_strain_group *group,
                        const int64_t *const place[UZ_STRAIN_LANES], const double share[][UZ_ELEMENT_SAMPLES])
{
    (uz_cpu_has_avx2_fma() ? add_fused : add_of_model)(rows, group, place, share, size);
}

void uz_stress_rows_compare(uz_stress_sums *sums, const double *rows, int size, const uz_strain_group *group,
                            const int64_t *const place[UZ_STRAIN_LANES])
{
    if (group->general)
        compare_each(sums, rows, group, place, size);
    else
        (uz_cpu_has_avx2_fma() ? compare_fused : compare_of_model)(sums, rows, group, place, size);
}
