/* rough.c: conjugate gradients in single precision, as amg/rough.c has them, over the processes of a group: they read
 * the matrix no more often than the cycle does, in half as many bytes.
 *
 * Sweeps are of D' + L and D' + L' (steps.c), so that A = D' + L + L' + E with E = O - (D' - D). Of the residual r is
 * kept s = (D' + L)^-1 r. With w = L'p a step along p takes from s
 *
 *     (D' + L)^-1 A p = p + (D' + L)^-1 (w + E p),   and   p'A p = p'(D'p + 2 w + E p).
 *
 * The coarse correction c is of r - A s = -L's - E s, the sweep up makes z = (D' + L')^-1 (D's - L c - E (s + c)), and
 * r'z = s'(D'z + L'z).
 *
 * Rounding leads these steps away from the true residual. So that is computed in double precision each time that they
 * have reduced it by CARRIED, and where they meet a goal below what rounding may hide, and the direction goes on from
 * there (van der Vorst, Ye, SIAM J. Sci. Comput. 22 (2000)). Where it is not as small as they have it, or it takes more
 * than STEPS_MOST of them, K is too ill-conditioned for them. */
#include "worker.h"

#include <math.h>
#include <string.h>

/* Of sqrt(r'M^-1 r). */
#define CARRIED 1e-4
/* The true one over what the steps have it for, which may be less than they can carry. */
#define FAIR 1.5
/* Steps to the next look at the true one, at most: rounding may keep these from ever coming so far. */
enum { STEPS_MOST = 20 };

/* Vectors as those of steps.c, in single precision and in their room. */
typedef struct {
    float *p, *w, *s, *x; /* x: of u, since the last true residual */
    int64_t count;        /* fours of numbers in each */
    int mask, shift;      /* lane of one, and what makes the place of its node of it */
    uz_level own;
    uz_level_step step;
} rough;

static void enter(rough *v, const spread_system *s, int which)
{
    const int64_t size = 4 * LANES * s->level.A.nodes;
    *v = (rough){.p = (float *)(void *)s->p,
                 .w = (float *)(void *)s->p + size,
                 .s = (float *)(void *)s->z,
                 .x = (float *)(void *)s->z + size,
                 .count = s->lanes * s->near.here,
                 .mask = s->lanes - 1,
                 .shift = s->lanes - 1,
                 .own = s->level};
    v->own.A.nodes = s->near.here;
    v->step = (uz_level_step){.level = &v->own,
                              .inverse = s->variant[which].inverse,
                              .b = s->rhs,
                              .x = s->x,
                              .t = s->t,
                              .coarse = s->coarse,
                              .k = s->k,
                              .lanes = s->lanes,
                              .swept = v->s};
}

static void find_diagonal(spread_system *s, int which)
{
    const int b = s->b;
    const float *inverse = s->variant[which].inverse;
    for (int64_t i = 0; i < s->near.here; i++)
        for (int r = 0; r < b; r++)
            s->diagonal[4 * i + r] = inverse[i * b + r] > 0.0F ? s->level.diag[(i * b + r) * b + r] : 0.0F;
}

/* From s and t = -L's: z in s->x, L'z in s->t, and r'z. */
static void precondition(spread_system *s, int which, const rough *v)
{
    const variant *of = &s->variant[which];
    double sum[LANES] = {0};
    for (int64_t i = 0; i < v->count; i++)
        for (int c = 0; c < 4; c++)
            s->rhs[4 * i + c] = s->diagonal[4 * (i >> v->shift) + c] * v->s[4 * i + c];
    memset(s->x, 0, 4 * (size_t)v->count * sizeof *s->x);
    add_outside(s, s->rhs, v->s, 1.0F);
    if (of->base) {
        add_known_outside(s, s->t, v->s, 1.0F);
        system_correct(s, of, &v->step);
        add_outside(s, s->rhs, s->x, 1.0F);
    }
    uz_level_take_step(&v->step, UZ_STEP_SWEEP_UP);
    for (int64_t i = 0; i < v->count; i++) {
        const float *d = s->diagonal + 4 * (i >> v->shift);
        float part = 0.0F;
        for (int64_t c = 0; c < 4; c++)
            part += v->s[4 * i + c] * (d[c] * s->x[4 * i + c] + s->t[4 * i + c]);
        sum[i & v->mask] += (double)part;
    }
    combine_all(sum, LANES, MPI_DOUBLE, MPI_SUM);
    for (int l = 0; l < LANES; l++)
        s->square[l] = s->unit[l] * s->unit[l] * sum[l];
}

/* x takes the last step; the next direction, w + E p in s->rhs, and p'A p. */
static void turn(spread_system *s, const rough *v, double curvature[LANES])
{
    float beta[LANES], last[LANES];
    memset(curvature, 0, LANES * sizeof *curvature);
    memcpy(last, s->length, sizeof last);
    memset(s->length, 0, sizeof s->length);
    for (int l = 0; l < LANES; l++)
        beta[l] = s->before[l] > 0.0 ? (float)(s->square[l] / s->before[l]) : 0.0F;
    for (int64_t i = 0; i < v->count; i++) {
        const float along = beta[i & v->mask], length = last[i & v->mask];
        for (int64_t c = 4 * i; c < 4 * i + 4; c++) {
            v->x[c] += length * v->p[c];
            v->p[c] = s->x[c] + along * v->p[c];
            s->rhs[c] = v->w[c] = s->t[c] + along * v->w[c];
        }
    }
    add_outside(s, s->rhs, v->p, -1.0F);
    for (int64_t i = 0; i < v->count; i++) {
        const float *d = s->diagonal + 4 * (i >> v->shift);
        float part = 0.0F;
        for (int64_t c = 0; c < 4; c++)
            part += v->p[4 * i + c] * (d[c] * v->p[4 * i + c] + (v->w[4 * i + c] + s->rhs[4 * i + c]));
        curvature[i & v->mask] += (double)part;
    }
    combine_all(curvature, LANES, MPI_DOUBLE, MPI_SUM);
}

/* False: none can be made, as where K is not definite, or rounding has all. */
static bool take_step(spread_system *s, int which, rough *v)
{
    double curvature[LANES];
    bool moves = false;
    turn(s, v, curvature);
    for (int l = 0; l < s->lanes; l++) {
        const double square = s->square[l] / (s->unit[l] * s->unit[l]),
                     length = curvature[l] > 0.0 ? square / curvature[l] : 0.0;
        s->length[l] = length > 0.0 && length < (double)HUGE_VALF ? (float)length : 0.0F;
        moves = moves || s->length[l] > 0.0F;
    }
    if (!moves)
        return false;
    memcpy(s->before, s->square, sizeof s->before);
    uz_level_step down = v->step;
    down.along = v->p;
    memcpy(down.share, s->length, sizeof down.share);
    uz_level_take_step(&down, UZ_STEP_REDUCE);
    precondition(s, which, v);
    return true;
}

/* From s->r, in units of the lanes. */
static void read_residual(spread_system *s, int which, rough *v)
{
    system_scale(s, s->rhs, s->r, s->unit);
    uz_level_take_step(&v->step, UZ_STEP_SWEEP_DOWN);
    memcpy(v->s, s->x, 4 * (size_t)v->count * sizeof *v->s);
    memset(v->x, 0, 4 * (size_t)v->count * sizeof *v->x);
    precondition(s, which, v);
    memcpy(s->known, s->square, sizeof s->known);
    s->rough = true;
    s->since = 0;
}

void rough_begin(spread_system *s, int which)
{
    rough v;
    enter(&v, s, which);
    find_diagonal(s, which);
    memset(v.p, 0, 4 * (size_t)v.count * sizeof *v.p);
    memset(v.w, 0, 4 * (size_t)v.count * sizeof *v.w);
    memset(s->length, 0, sizeof s->length);
    memset(s->before, 0, sizeof s->before);
    read_residual(s, which, &v);
}

void system_settle(spread_system *s)
{
    rough v;
    if (!s->rough)
        return;
    enter(&v, s, VARIANT_WHOLE);
    for (int64_t i = 0; i < v.count; i++) {
        const float length = s->length[i & v.mask];
        for (int64_t c = 4 * i; c < 4 * i + 4; c++)
            s->u[c] += s->unit[i & v.mask] * (double)(v.x[c] + length * v.p[c]);
    }
    memset(s->length, 0, sizeof s->length);
    s->rough = false;
}

static double worse(const spread_system *s, const double square[LANES])
{
    return s->lanes == 1 ? square[0] : fmax(square[0], square[1]);
}

static bool is_far(const spread_system *s)
{
    bool far = false;
    for (int l = 0; l < s->lanes; l++)
        far = far || s->square[l] < CARRIED * CARRIED * s->known[l];
    return far;
}

int rough_steps(spread_system *s, int which, bool *stuck, int most, double goal2, double believed)
{
    rough v;
    int made = 0;
    enter(&v, s, which);
    *stuck = false;
    while (made < most && !*stuck && system_square(s) > goal2) {
        *stuck = !take_step(s, which, &v);
        made += !*stuck;
        if (*stuck)
            break;
        if (system_square(s) <= goal2 && goal2 >= believed * worse(s, s->known))
            break;
        if (is_far(s) || system_square(s) <= goal2) {
            const double told = fmax(system_square(s), CARRIED * CARRIED * worse(s, s->known));
            system_settle(s);
            system_residual(s, which, false);
            read_residual(s, which, &v);
            *stuck = !(system_square(s) <= FAIR * FAIR * told);
        } else {
            *stuck = ++s->since >= STEPS_MOST;
        }
    }
    if (*stuck)
        system_settle(s);
    return made;
}
