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

/* ---- what a comparison hides */

/* Of quadratic triangles, tetrahedra and wedges the average over the few elements at a node takes a part of the error
 * with it: eta is 0.68 to 0.82 of the error of smooth fields, and eta^2 is taken for this much of it where it is told.
 */
#define HIDDEN (16. / 9)
/* A tetrahedron alone at its nodes differs from no mean. */
#define LEAST_LEFT 0.25
/* ... but for what volumes by two rules differ in, of elements with bent edges. */
#define ALONE 1e-2

/* The mean over the elements at a node has a part of what it is compared with: of N that err alike and by chance, the
 * squares of the differences sum up to N - 1 of N parts (Bessel's correction). Tetrahedra are irregular, and a coarse
 * solid has most of its nodes at the surface, with few of them. */
UZ_INLINE void take_own_part(uz_lanes *times, const uz_strain_group *g, const uz_lanes *around, int nodes)
{
    uz_lanes volume = {0}, left = {0};
    for (int p = 0; p < g->rule.asked; p++)
        volume += g->shape.volume[p];
    for (int a = 0; a < nodes; a++) {
        const uz_lanes others = 1 - volume / around[a];
        left += (uz_lanes)((lane_bits)others & (lane_bits)(others > 0));
    }
    left /= nodes;
    const uz_lanes one = 1 + (uz_lanes){0}, least = LEAST_LEFT + (uz_lanes){0};
    const lane_bits some = (lane_bits)(left > ALONE), /* else it is compared with none of its own (nodal_strains.c) */
        less = some & (lane_bits)(left < LEAST_LEFT);
    *times /= (uz_lanes)((~some & (lane_bits)one) | (less & (lane_bits)least) | (some & ~less & (lane_bits)left));
}

/* around: the volumes at the nodes. */
UZ_INLINE void find_whole(uz_lanes *times, const uz_strain_group *g, const uz_lanes *around, int nodes)
{
    const uz_element_kind kind = g->rule.kind;
    *times = (uz_lanes){0} + 1;
    if (kind == UZ_TET4 || kind == UZ_TET10)
        take_own_part(times, g, around, nodes);
    if (kind == UZ_TRI6 || kind == UZ_TET10 || kind == UZ_WEDGE15)
        *times *= HIDDEN;
}

void uz_whole_difference(uz_lanes *times, const double *rows, int size, const uz_strain_group *group,
                         const int64_t *const place[UZ_STRAIN_LANES])
{
    uz_lanes around[NODES];
    for (int a = 0; a < group->rule.nodes; a++)
        for (int l = 0; l < LANES; l++)
            around[a][l] = rows[place[l][a] * size + group->rule.stresses];
    find_whole(times, group, around, group->rule.nodes);
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
UZ_INLINE void gather_rows(uz_lanes nodal[NODES][MOST_ROW], const double *rows, const int64_t *const place[LANES],
                           int nodes, int size)
{
    for (int a = 0; a < nodes; a++)
        for (int part = 0; part < size; part += LANES) {
            uz_lanes row[LANES];
            for (int l = 0; l < LANES; l++)
                row[l] = *(const uz_lanes *)(rows + place[l][a] * size + part);
            transpose(nodal[a] + part, row);
        }
}

/* s' C^-1 s of the isotropic material: deviator and trace apart, so that a large lambda cancels nothing. With n direct
 * components and t = trace(s) it is t^2 / (n (n lambda + 2 mu)) + (s_dev . s_dev) / (2 mu). */
UZ_INLINE void add_work(uz_lanes *to, const uz_lanes *s, const uz_lanes *per_bulk, const uz_lanes *per_twice_mu, int n,
                        int direct)
{
    uz_lanes sum = {0}, deviator = {0};
    for (int c = 0; c < direct; c++)
        sum += s[c];
    for (int c = 0; c < direct; c++)
        deviator += (s[c] - sum / direct) * (s[c] - sum / direct);
    for (int c = direct; c < n; c++)
        deviator += 2 * s[c] * s[c];
    *to += sum * sum * *per_bulk + deviator * *per_twice_mu;
}

/* strain' C strain at a point: of the strain that makes stress, and of the whole, which without a free strain is the
 * same. */
UZ_INLINE void add_energies(uz_lanes energy[2], const uz_strain_group *g, int p, int n, int direct, int size)
{
    const uz_lanes *strain = g->strain[p];
    uz_lanes shear_work = {0};
    for (int c = direct; c < n; c++)
        shear_work += strain[c] * strain[c];
    for (int whole = 0; whole < (size > n + 1 ? 2 : 1); whole++) {
        uz_lanes trace = {0}, work = {0};
        for (int c = 0; c < direct; c++) {
            const uz_lanes here = whole ? strain[c] : strain[c] - g->thermal;
            trace += here;
            work += here * here;
        }
        energy[whole] += g->shape.volume[p] *
                         (g->material.lambda * trace * trace + 2 * g->material.mu * work + g->material.mu * shear_work);
    }
}

/* Displacements and places against those of the first node. */
UZ_INLINE void find_steepest(uz_lanes *steep2, const uz_strain_group *g, int nodes, int dim)
{
    for (int a = 1; a < nodes; a++) {
        uz_lanes u2 = {0}, x2 = {0};
        for (int c = 0; c < dim; c++) {
            const uz_lanes u = g->u[a * dim + c] - g->u[c], x = g->x[a * dim + c] - g->x[c];
            u2 += u * u;
            x2 += x * x;
        }
        const uz_lanes slope2 = u2 / x2;
        const lane_bits more = (lane_bits)(slope2 > *steep2);
        *steep2 = (uz_lanes)((more & (lane_bits)slope2) | (~more & (lane_bits)*steep2));
    }
}

/* The difference is linear: with d_a at the nodes of a simplex of volume V in k dimensions, its integral is
 * V / ((k + 1) (k + 2)) times the sum of those of d_a and of that of the sum of d_a. */
UZ_INLINE void compare_simplex(uz_lanes *eta, uz_lanes energy[2], uz_lanes nodal[NODES][MOST_ROW],
                               const uz_strain_group *g, const uz_lanes *per_bulk, const uz_lanes *per_twice_mu, int n,
                               int direct, int size)
{
    const int nodes = n == 6 ? 4 : 3;
    uz_lanes stress[UZ_ELEMENT_STRESSES], all[UZ_ELEMENT_STRESSES] = {{0}};
    stress_of(stress, g, g->strain[0], n, direct);
    for (int a = 0; a < nodes; a++) {
        uz_lanes jump[UZ_ELEMENT_STRESSES];
        for (int c = 0; c < n; c++) {
            jump[c] = nodal[a][c] - stress[c];
            all[c] += jump[c];
        }
        add_work(eta, jump, per_bulk, per_twice_mu, n, direct);
    }
    add_work(eta, all, per_bulk, per_twice_mu, n, direct);
    *eta *= g->shape.volume[0] / (nodes * (nodes + 1));
    add_energies(energy, g, 0, n, direct, size);
}

/* The difference at Gauss points. */
UZ_INLINE void compare_points(uz_lanes *eta, uz_lanes energy[2], uz_lanes nodal[NODES][MOST_ROW],
                              const uz_strain_group *g, const uz_lanes *per_bulk, const uz_lanes *per_twice_mu, int n,
                              int direct, int size)
{
    for (int p = 0; p < g->rule.asked; p++) {
        uz_lanes jump[UZ_ELEMENT_STRESSES], work = {0};
        stress_of(jump, g, g->strain[p], n, direct);
        for (int c = 0; c < n; c++) {
            jump[c] = -jump[c];
            for (int a = 0; a < g->rule.nodes; a++)
                jump[c] += g->rule.N[p][a] * nodal[a][c];
        }
        add_work(&work, jump, per_bulk, per_twice_mu, n, direct);
        *eta += g->shape.volume[p] * work;
        add_energies(energy, g, p, n, direct, size);
    }
}

/* simplex: whether they are. */
UZ_INLINE void compare(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                       const int64_t *const place[LANES], int n, int direct, int size, bool simplex)
{
    const int nodes = !simplex ? g->rule.nodes : n == 6 ? 4 : 3;
    uz_lanes nodal[NODES][MOST_ROW], eta = {0}, energy[2] = {{0}};
    const uz_lanes twice_mu = 2 * g->material.mu, per_twice_mu = 1 / twice_mu,
                   per_bulk = 1 / (direct * (direct * g->material.lambda + twice_mu));
    gather_rows(nodal, rows, place, nodes, size);
    if (simplex)
        compare_simplex(&eta, energy, nodal, g, &per_bulk, &per_twice_mu, n, direct, size);
    else
        compare_points(&eta, energy, nodal, g, &per_bulk, &per_twice_mu, n, direct, size);
    if (sums->steepness)
        find_steepest(&sums->steep2, g, nodes, n == 6 ? 3 : 2);
    if (sums->hidden) {
        uz_lanes times, around[NODES];
        for (int a = 0; a < nodes; a++)
            around[a] = nodal[a][n];
        find_whole(&times, g, around, nodes);
        eta *= times;
    }
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

/* Of a material with directions, what the difference at a point comes to, or its mean over a simplex. */
static double work_of_jump(const double *rows, const uz_strain_group *g, const int64_t *place, int lane, int p,
                           const double *stress, int size)
{
    const int n = g->rule.stresses, nodes = g->rule.nodes;
    double all[UZ_ELEMENT_STRESSES], sum = 0;
    for (int c = 0; c < n; c++) {
        all[c] = g->rule.simplex ? -nodes * stress[c] : -stress[c];
        for (int a = 0; a < nodes; a++)
            all[c] += (g->rule.simplex ? 1 : g->rule.N[p][a]) * rows[place[a] * size + c];
    }
    for (int a = 0; a < nodes && g->rule.simplex; a++) {
        double jump[UZ_ELEMENT_STRESSES];
        for (int c = 0; c < n; c++)
            jump[c] = rows[place[a] * size + c] - stress[c];
        sum += uz_stress_work(g->rule.model, *g->lame[lane], jump);
    }
    sum += uz_stress_work(g->rule.model, *g->lame[lane], all);
    return g->rule.simplex ? sum / (nodes * (nodes + 1)) : sum;
}

/* ... one element after the other: what compare() sums up. */
static void compare_each(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                         const int64_t *const place[LANES], int size)
{
    const int n = g->rule.stresses;
    uz_lanes times = (uz_lanes){0} + 1;
    if (sums->hidden)
        uz_whole_difference(&times, rows, size, g, place);
    if (sums->steepness)
        find_steepest(&sums->steep2, g, g->rule.nodes, g->rule.dim);
    for (int l = 0; l < g->count; l++) {
        double eta = 0, energy[2] = {0};
        double thermal[UZ_ELEMENT_STRESSES];
        uz_thermal_strain(thermal, g->rule.model, *g->lame[l], g->free_strain[l]);
        for (int p = 0; p < g->rule.asked; p++) {
            double strain[2][UZ_ELEMENT_STRESSES], stress[2][UZ_ELEMENT_STRESSES];
            for (int c = 0; c < n; c++) {
                strain[1][c] = g->strain[p][c][l];
                strain[0][c] = strain[1][c] - thermal[c];
            }
            for (int whole = 0; whole < 2; whole++)
                uz_elastic_stress(stress[whole], g->rule.model, *g->lame[l], strain[whole]);
            eta += g->shape.volume[p][l] * work_of_jump(rows, g, place[l], l, p, stress[0], size);
            for (int whole = 0; whole < 2; whole++)
                for (int c = 0; c < n; c++)
                    energy[whole] += g->shape.volume[p][l] * stress[whole][c] * strain[whole][c];
        }
        eta *= times[l];
        sums->eta2 += eta;
        if (sums->eta2_of)
            sums->eta2_of[g->element[l]] = eta;
        sums->stress += energy[0];
        sums->whole += energy[1];
    }
}

UZ_INLINE void compare_in_space(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                                const int64_t *const place[LANES], int size, bool simplex)
{
    if (size == LANES)
        compare(sums, rows, g, place, 3, 2, LANES, simplex);
    else if (g->rule.stresses == 3)
        compare(sums, rows, g, place, 3, 2, MOST_ROW, simplex);
    else
        compare(sums, rows, g, place, 6, 3, MOST_ROW, simplex);
}

UZ_INLINE void compare_of_model(uz_stress_sums *sums, const double *rows, const uz_strain_group *g,
                                const int64_t *const place[LANES], int size)
{
    if (g->rule.stresses == 4)
        compare(sums, rows, g, place, 4, 3, MOST_ROW, false);
    else if (g->rule.simplex)
        compare_in_space(sums, rows, g, place, size, true);
    else
        compare_in_space(sums, rows, g, place, size, false);
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
    sums->others = sums->others || !group->rule.simplex;
    if (group->general)
        compare_each(sums, rows, group, place, size);
    else
        (uz_cpu_has_avx2_fma() ? compare_fused : compare_of_model)(sums, rows, group, place, size);
}
