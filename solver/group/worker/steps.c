/* steps.c: one V-cycle, and conjugate gradients with it in double precision, for what rough.c can't do.
 *
 * On the finest level each process sweeps once forwards over its own rows from 0, S = (D' + L)^-1, L the strict lower
 * triangle among them, and once backwards, S', after the coarse correction. With D' = D + sum_j |o_ij| over the entries
 * o_ij that couple processes, D' + L + L' - A = diag(sum |o_ij|) - O is positive semidefinite by Gershgorin, whatever
 * the number of processes, and also where there is one level only (l1 smoothers: Baker, Falgout, Kolev, Yang, SIAM J.
 * Sci. Comput. 33 (2011)). So
 *
 *     S + S' - S'A S = S'(D' + (D' + L + L' - A)) S >= S'D'S > 0:   the cycle M^-1 is symmetric positive definite,
 *     M <= (D' + L) D'^-1 (D' + L'),                                which bounds lambda_max(diag(K)^-1 M).
 *
 * Coarser levels each process has whole: right-hand sides are summed, and all find the same correction, for which the
 * sweeps on the next level are divided (shared.c). */
#include "worker.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef float four __attribute__((vector_size(16), aligned(4), may_alias));

/* Rows of blocks are read four numbers at a time; what the next one begins with goes to the surplus number. */
UZ_INLINE void take_from_ghosts(const spread_system *s, float *brim, const float *ghosts, int b, int lanes)
{
    const uz_blocks *A = &s->level.A;
    const int64_t here = s->near.here;
    const float *block = s->level.off + A->ptr[here] * b * b;
    const int32_t *rim = s->rim;
    for (int64_t g = 0; g < s->near.ghosts; g++)
        for (int64_t e = A->ptr[here + g]; e < A->ptr[here + g + 1]; e++, block += (int64_t)b * b, rim++)
            for (int l = 0; l < lanes; l++) {
                const float *value = ghosts + 4 * (g * lanes + l);
                four *at = (four *)(brim + 4 * ((int64_t)*rim * lanes + l)), sum = *at;
                for (int r = 0; r < b; r++)
                    sum -= *(const four *)(block + r * b) * value[r];
                *at = sum;
            }
}

void find_outside(const spread_system *s, float *brim, const float *x, const float *ghosts)
{
    const int b = s->b, lanes = s->lanes, width = 4 * lanes;
    memset(brim, 0, (size_t)(s->faces * width) * sizeof *brim);
    if (b == 3)
        take_from_ghosts(s, brim, ghosts, 3, lanes);
    else
        take_from_ghosts(s, brim, ghosts, b, lanes);
    for (int64_t f = 0; f < s->faces; f++)
        for (int q = 0; q < width; q++) {
            const int c = q % 4;
            float *sum = &brim[width * f + q];
            *sum = c < b ? *sum + s->outside[s->face[f] * b + c] * x[width * (int64_t)s->face[f] + q] : 0.0F;
        }
}

void meet_ghosts(spread_system *s, const float *x)
{
    neighbours_fetch(&s->near, s->ghosts, x, 4 * (size_t)s->lanes * sizeof *x);
}

void add_to_faces(const spread_system *s, float *to, const float *brim)
{
    const int width = 4 * s->lanes;
    for (int64_t f = 0; f < s->faces; f++)
        for (int q = 0; q < width; q++)
            to[width * (int64_t)s->face[f] + q] += brim[width * f + q];
}

/* Where each process does it alone; lane by lane. */
static void correct_alone(spread_system *s, const variant *v)
{
    const int k = s->k, width = uz_width(k);
    uz_error err = {0};
    for (int l = 0; l < s->lanes; l++) {
        for (int64_t a = 0; a < s->next.nodes; a++)
            for (int c = 0; c < k; c++)
                s->coarse_r[a * k + c] = (double)s->coarse[(a * s->lanes + l) * width + c];
        if (uz_multigrid_apply(v->base, NULL, v->room, s->coarse_z, s->coarse_r, &err) != UZ_OK)
            end_group(err.message);
        for (int64_t a = 0; a < s->next.nodes; a++)
            for (int c = 0; c < width; c++)
                s->coarse[(a * s->lanes + l) * width + c] = c < k ? (float)s->coarse_z[a * k + c] : 0.0F;
    }
}

void system_correct(spread_system *s, const variant *v, const uz_level_step *step)
{
    uz_level_take_step(step, UZ_STEP_RESTRICT);
    combine_all(s->coarse, (int)(s->next.nodes * s->lanes * uz_width(s->k)), MPI_FLOAT, MPI_SUM);
    if (v->shared.divided)
        shared_apply(&v->shared, v->base, v->room, s->coarse, s->lanes);
    else
        correct_alone(s, v);
}

/* Vectors are fours of numbers, one for each node and lane; how many there are here, and the lane of one. */
static int64_t fours(const spread_system *s)
{
    return s->lanes * s->near.here;
}

static int lane_of(const spread_system *s, int64_t of)
{
    return (int)(of & (s->lanes - 1));
}

/* The power of two above the largest of each lane: times that, single precision holds a residual, and those that are
 * some 30 orders smaller, as they become before a solve is begun again. 0: there is nothing to solve for. */
static void find_units(const spread_system *s, double unit[LANES], const double *r)
{
    memset(unit, 0, LANES * sizeof *unit);
    for (int64_t i = 0; i < fours(s); i++) {
        double *largest = &unit[lane_of(s, i)];
        for (int64_t q = 4 * i; q < 4 * i + 4; q++)
            *largest = fmax(*largest, fabs(r[q]));
    }
    combine_all(unit, LANES, MPI_DOUBLE, MPI_MAX);
    for (int l = 0; l < LANES; l++)
        if (unit[l] > 0.0 && !isinf(unit[l])) {
            int exponent;
            (void)frexp(unit[l], &exponent);
            unit[l] = ldexp(1.0, exponent);
        }
}

void system_scale(const spread_system *s, float *to, const double *r, const double unit[LANES])
{
    for (int64_t i = 0; i < fours(s); i++) {
        const double by = unit[lane_of(s, i)], inverse = by > 0.0 && !isinf(by) ? 1.0 / by : 0.0; /* powers of two */
        for (int64_t q = 4 * i; q < 4 * i + 4; q++)
            to[q] = inverse > 0.0 ? (float)(r[q] * inverse) : 0.0F;
    }
}

static void add_outside(spread_system *s, float *to)
{
    meet_ghosts(s, s->x);
    find_outside(s, s->brim, s->x, s->ghosts);
    add_to_faces(s, to, s->brim);
}

static void cycle(spread_system *s, int which, double *z, const double *r, const double unit[LANES])
{
    const variant *v = &s->variant[which];
    uz_level own = s->level;
    own.A.nodes = s->near.here;
    system_scale(s, s->rhs, r, unit);
    const uz_level_step step = {.level = &own,
                                .inverse = v->inverse,
                                .b = s->rhs,
                                .x = s->x,
                                .t = s->t,
                                .coarse = s->coarse,
                                .k = s->k,
                                .lanes = s->lanes};
    uz_level_take_step(&step, UZ_STEP_SWEEP_DOWN);
    add_outside(s, s->t);
    if (v->base) {
        system_correct(s, v, &step);
        uz_level_take_step(&step, UZ_STEP_PROLONG);
        add_outside(s, s->rhs);
    } else {
        add_to_faces(s, s->rhs, s->brim);
    }
    uz_level_take_step(&step, UZ_STEP_SWEEP_UP);
    for (int64_t i = 0; i < fours(s); i++) {
        const double by = isinf(unit[lane_of(s, i)]) ? NAN : unit[lane_of(s, i)];
        for (int64_t q = 4 * i; q < 4 * i + 4; q++)
            z[q] = (double)s->x[q] * by;
    }
}

void system_precondition(spread_system *s, int which, double *z, const double *r)
{
    double unit[LANES];
    s->lanes = 1;
    s->rough = false;
    find_units(s, unit, r);
    cycle(s, which, z, r, unit);
}

static void dot(const spread_system *s, double sum[LANES], const double *x, const double *y)
{
    memset(sum, 0, LANES * sizeof *sum);
    for (int64_t i = 0; i < fours(s); i++) {
        const double *a = x + 4 * i, *b = y + 4 * i;
        sum[lane_of(s, i)] += (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]);
    }
    combine_all(sum, LANES, MPI_DOUBLE, MPI_SUM);
}

/* y = K x, or K_FF x. */
static void multiply(spread_system *s, int which, double *y, double *x)
{
    const int64_t here = s->near.here;
    const int width = 4 * s->lanes;
    const float *inverse = s->variant[which].inverse;
    neighbours_fetch(&s->near, x + width * here, x, (size_t)width * sizeof *x);
    uz_level_multiply_parts(y, &s->level, x, s->lanes);
    for (int64_t i = 0; i < here; i++)
        for (int q = 0; q < width; q++)
            if (q % 4 >= s->b || !(inverse[i * s->b + q % 4] > 0.0F))
                y[width * i + q] = 0.0;
}

void system_residual(spread_system *s, int which, bool u_is_zero)
{
    if (!u_is_zero)
        multiply(s, which, s->q, s->u);
    for (int64_t i = 0; i < 4 * fours(s); i++)
        s->r[i] = s->f[i] - (u_is_zero ? 0.0 : s->q[i]);
}

/* z = M^-1 r, p = z, in double precision. */
static void begin_in_double(spread_system *s, int which)
{
    s->rough = false;
    cycle(s, which, s->z, s->r, s->unit);
    memcpy(s->p, s->z, 4 * (size_t)fours(s) * sizeof *s->p);
    dot(s, s->square, s->r, s->z);
}

void system_begin(spread_system *s, int which, bool u_is_zero)
{
    system_residual(s, which, u_is_zero);
    find_units(s, s->unit, s->r);
    if (s->single)
        rough_begin(s, which);
    else
        begin_in_double(s, which);
}

double system_square(const spread_system *s)
{
    return s->lanes == 1 || s->square[0] > s->square[1] || isnan(s->square[0]) ? s->square[0] : s->square[1];
}

/* *moves: the next step is one; not where rounding has nothing more to gain. */
static void find_lengths(const spread_system *s, double alpha[LANES], bool *moves, bool *flat)
{
    double curvature[LANES];
    dot(s, curvature, s->p, s->q);
    *moves = *flat = false;
    for (int l = 0; l < s->lanes; l++) {
        const bool gains = !(fabs(curvature[l]) < DBL_MIN); /* underflow */
        *flat = *flat || (gains && !(curvature[l] > 0.0));
        *moves = *moves || gains;
        alpha[l] = gains ? s->square[l] / curvature[l] : 0.0;
    }
}

static int make_steps(spread_system *s, int which, bool *flat, int most, double goal2)
{
    int made = 0;
    while (made < most && system_square(s) > goal2) {
        double alpha[LANES], beta[LANES] = {0};
        bool moves;
        multiply(s, which, s->q, s->p);
        find_lengths(s, alpha, &moves, flat);
        if (*flat || !moves)
            break;
        for (int64_t i = 0; i < fours(s); i++) {
            const double length = alpha[lane_of(s, i)];
            for (int64_t q = 4 * i; q < 4 * i + 4; q++) {
                s->u[q] += length * s->p[q];
                s->r[q] -= length * s->q[q];
            }
        }
        for (int l = 0; l < s->lanes; l++)
            beta[l] = s->square[l];
        cycle(s, which, s->z, s->r, s->unit);
        dot(s, s->square, s->r, s->z);
        for (int l = 0; l < s->lanes; l++)
            beta[l] = beta[l] > 0.0 ? s->square[l] / beta[l] : 0.0;
        for (int64_t i = 0; i < fours(s); i++) {
            const double kept = beta[lane_of(s, i)];
            for (int64_t q = 4 * i; q < 4 * i + 4; q++)
                s->p[q] = s->z[q] + kept * s->p[q];
        }
        made++;
    }
    return made;
}

int system_steps(spread_system *s, int which, bool *flat, int most, double goal2, double believed)
{
    int made = 0;
    *flat = false;
    if (s->rough) {
        bool stuck;
        made = rough_steps(s, which, &stuck, most, goal2, believed);
        if (!stuck)
            return made;
        s->single = false; /* K is too ill-conditioned for it, and was no better before */
        system_residual(s, which, false);
        find_units(s, s->unit, s->r);
        begin_in_double(s, which);
    }
    return made + make_steps(s, which, flat, most - made, goal2);
}
