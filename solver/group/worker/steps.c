/* steps.c: one V-cycle, and conjugate gradients with it.
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

/* to += (D' - D) x - O x: what the own sweeps, of which D' + L + L' is the matrix, see of the difference to A. */
static void add_outside(spread_system *s, float *to)
{
    neighbours *near = &s->near;
    const uz_blocks *A = &s->level.A;
    const int b = s->b;
    float *of_ghosts = s->x + 4 * near->here;
    if (near->size == 1)
        return;
    neighbours_fetch(near, of_ghosts, s->x, 4 * sizeof *s->x);
    for (int64_t f = 0; f < s->faces; f++)
        for (int c = 0; c < b; c++)
            to[4 * s->face[f] + c] += s->outside[s->face[f] * b + c] * s->x[4 * s->face[f] + c];
    for (int64_t g = 0; g < near->ghosts; g++)
        for (int64_t e = A->ptr[near->here + g]; e < A->ptr[near->here + g + 1]; e++)
            for (int r = 0; r < b; r++)
                for (int c = 0; c < b; c++)
                    to[4 * A->idx[e] + c] -= s->level.off[(e * b + r) * b + c] * of_ghosts[4 * g + r];
}

static void correct(spread_system *s, const variant *v, const uz_level_step *step)
{
    const int k = s->k, width = uz_width(k);
    const int64_t nodes = s->next.nodes;
    uz_error err = {0};
    uz_level_take_step(step, UZ_STEP_RESTRICT);
    MPI_Allreduce(MPI_IN_PLACE, s->coarse, (int)(nodes * width), MPI_FLOAT, MPI_SUM, MPI_COMM_WORLD);
    if (v->shared.divided) {
        shared_apply(&v->shared, v->base, v->room, s->coarse);
        uz_level_take_step(step, UZ_STEP_PROLONG);
        return;
    }
    for (int64_t a = 0; a < nodes; a++)
        for (int c = 0; c < k; c++)
            s->coarse_r[a * k + c] = (double)s->coarse[a * width + c];
    if (uz_multigrid_apply(v->base, NULL, v->room, s->coarse_z, s->coarse_r, &err) != UZ_OK)
        end_group(err.message);
    for (int64_t a = 0; a < nodes; a++)
        for (int c = 0; c < width; c++)
            s->coarse[a * width + c] = c < k ? (float)s->coarse_z[a * k + c] : 0.0F;
    uz_level_take_step(step, UZ_STEP_PROLONG);
}

/* The power of two above the largest: times that, single precision holds a residual, and those that are some 30 orders
 * smaller, as they become before a solve is begun again. 0: there is nothing to solve for. */
static double unit_of(const spread_system *s, const double *r)
{
    double largest = 0.0;
    int exponent;
    for (int64_t i = 0; i < 4 * s->near.here; i++)
        largest = fmax(largest, fabs(r[i]));
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    if (!(largest > 0.0) || isinf(largest))
        return largest;
    (void)frexp(largest, &exponent);
    return ldexp(1.0, exponent);
}

static void cycle(spread_system *s, int which, double *z, const double *r, double unit)
{
    const variant *v = &s->variant[which];
    const int64_t n = 4 * s->near.here;
    uz_level own = s->level;
    own.A.nodes = s->near.here;
    if (!(unit > 0.0) || isinf(unit)) {
        for (int64_t i = 0; i < n; i++)
            z[i] = unit > 0.0 ? NAN : 0.0;
        return;
    }
    for (int64_t i = 0; i < n; i++)
        s->rhs[i] = (float)(r[i] / unit);
    const uz_level_step step = {&own, v->inverse, s->rhs, s->x, s->t, s->coarse, s->k};
    uz_level_take_step(&step, UZ_STEP_SWEEP_DOWN);
    if (v->base) {
        add_outside(s, s->t);
        correct(s, v, &step);
    }
    add_outside(s, s->rhs);
    uz_level_take_step(&step, UZ_STEP_SWEEP_UP);
    for (int64_t i = 0; i < n; i++)
        z[i] = (double)s->x[i] * unit;
}

void system_precondition(spread_system *s, int which, double *z, const double *r)
{
    cycle(s, which, z, r, unit_of(s, r));
}

static double dot(const spread_system *s, const double *x, const double *y)
{
    double sum = 0.0;
    for (int64_t i = 0; i < 4 * s->near.here; i++)
        sum += x[i] * y[i];
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return sum;
}

/* y = K x, or K_FF x. */
static void multiply(spread_system *s, int which, double *y, double *x)
{
    const int64_t here = s->near.here;
    const float *inverse = s->variant[which].inverse;
    neighbours_fetch(&s->near, x + 4 * here, x, 4 * sizeof *x);
    uz_blocks_multiply(y, &s->level.A, x);
    for (int64_t i = 0; i < here; i++)
        for (int c = 0; c < 4; c++)
            if (c >= s->b || !(inverse[i * s->b + c] > 0.0F))
                y[4 * i + c] = 0.0;
}

double system_begin(spread_system *s, int which, bool u_is_zero)
{
    const int64_t n = 4 * s->near.here;
    if (!u_is_zero)
        multiply(s, which, s->q, s->u);
    for (int64_t i = 0; i < n; i++)
        s->r[i] = s->f[i] - (u_is_zero ? 0.0 : s->q[i]);
    s->unit = unit_of(s, s->r);
    cycle(s, which, s->z, s->r, s->unit);
    memcpy(s->p, s->z, (size_t)n * sizeof *s->p);
    return dot(s, s->r, s->z);
}

int system_steps(spread_system *s, int which, double *square, bool *flat, int most, double goal2)
{
    const int64_t n = 4 * s->near.here;
    int made = 0;
    *flat = false;
    while (made<most && * square> goal2) {
        multiply(s, which, s->q, s->p);
        const double curvature = dot(s, s->p, s->q), last = *square, alpha = last / curvature;
        if (fabs(curvature) < DBL_MIN) /* underflow: there is no more to gain */
            break;
        *flat = !(curvature > 0.0);
        if (*flat)
            break;
        for (int64_t i = 0; i < n; i++) {
            s->u[i] += alpha * s->p[i];
            s->r[i] -= alpha * s->q[i];
        }
        cycle(s, which, s->z, s->r, s->unit);
        *square = dot(s, s->r, s->z);
        for (int64_t i = 0; i < n; i++)
            s->p[i] = s->z[i] + *square / last * s->p[i];
        made++;
    }
    return made;
}
