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

/* From s and t = -L's: z in s->x, L'z in s->t, and r'z. E (s + c) stands in t when the sweep up begins, which takes it
 * from its right-hand side, and is taken from what it leaves there. */
static void precondition(spread_system *s, int which, const rough *v)
{
    const variant *of = &s->variant[which];
    const int width = 4 * s->lanes;
    float *of_s = s->brim, *of_x = s->brim + width * s->faces;
    double sum[LANES] = {0};
    uz_level all = s->level; /* ghosts, too */
    uz_level_step up = v->step, place = v->step;
    place.level = &all;
    up.product = sum;
    meet_ghosts(s, v->s);
    find_outside(s, of_s, v->s, s->ghosts);
    if (of->base) {
        add_to_faces(s, s->t, of_s);
        system_correct(s, of, &v->step);
        uz_level_take_step(&place, UZ_STEP_PLACE);
        find_outside(s, of_x, s->x, s->x + width * s->near.here);
    } else {
        memset(s->x, 0, (size_t)(width * s->near.here) * sizeof *s->x);
        memset(s->t, 0, (size_t)(width * s->near.here) * sizeof *s->t);
        memset(of_x, 0, (size_t)(width * s->faces) * sizeof *of_x);
    }
    for (int64_t q = 0; q < width * s->faces; q++)
        of_s[q] = -(of_s[q] + of_x[q]);
    add_to_faces(s, s->t, of_s);
    uz_level_take_step(&up, UZ_STEP_RISE);
    for (int64_t f = 0; f < s->faces; f++)
        for (int q = 0; q < width; q++) {
            const int64_t at = width * (int64_t)s->face[f] + q;
            s->t[at] -= of_s[width * f + q];
            sum[q / 4] -= (double)v->s[at] * (double)of_s[width * f + q];
        }
    combine_all(sum, LANES, MPI_DOUBLE, MPI_SUM);
    for (int l = 0; l < LANES; l++)
        s->square[l] = s->unit[l] * s->unit[l] * sum[l];
}

typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four __attribute__((vector_size(32)));

/* x takes the last step; the next direction, and of p'A p what the own sweeps see: p'(D'p + 2 w). */
static void turn_own(spread_system *s, const rough *v, double curvature[LANES])
{
    float beta[LANES];
    four sum[LANES] = {{0.0}};
    for (int l = 0; l < LANES; l++)
        beta[l] = s->before[l] > 0.0 ? (float)(s->square[l] / s->before[l]) : 0.0F;
    for (int64_t i = 0; i < v->count; i++) {
        const int l = (int)(i & v->mask);
        const four_floats d = *(const four_floats *)(s->diagonal + 4 * (i >> v->shift)),
                          z = *(const four_floats *)(s->x + 4 * i), t = *(const four_floats *)(s->t + 4 * i);
        four_floats *p = (four_floats *)(v->p + 4 * i), *w = (four_floats *)(v->w + 4 * i);
        *(four_floats *)(v->x + 4 * i) += s->length[l] * *p;
        const four_floats next = z + beta[l] * *p, image = t + beta[l] * *w;
        *p = next;
        *w = image;
        sum[l] += __builtin_convertvector(next, four) * __builtin_convertvector(d * next + 2.0F * image, four);
    }
    memset(s->length, 0, sizeof s->length);
    for (int l = 0; l < LANES; l++)
        curvature[l] = (sum[l][0] + sum[l][1]) + (sum[l][2] + sum[l][3]);
}

/* The next direction, p'A p, and w + E p in w, until that is restored from what the brim has kept of it. */
static void turn(spread_system *s, const rough *v, double curvature[LANES])
{
    const int width = 4 * s->lanes;
    float *outside = s->brim, *kept = s->brim + width * s->faces;
    turn_own(s, v, curvature);
    meet_ghosts(s, v->p);
    find_outside(s, outside, v->p, s->ghosts);
    for (int64_t f = 0; f < s->faces; f++)
        for (int q = 0; q < width; q++) {
            const int64_t at = width * (int64_t)s->face[f] + q;
            curvature[q / 4] -= (double)v->p[at] * (double)outside[width * f + q];
            kept[width * f + q] = v->w[at];
            v->w[at] -= outside[width * f + q];
        }
    combine_all(curvature, LANES, MPI_DOUBLE, MPI_SUM);
}

static void restore(const spread_system *s, const rough *v)
{
    const int width = 4 * s->lanes;
    for (int64_t f = 0; f < s->faces; f++)
        memcpy(v->w + width * (int64_t)s->face[f], s->brim + width * (s->faces + f), (size_t)width * sizeof *v->w);
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
    down.b = v->w;
    down.along = v->p;
    memcpy(down.share, s->length, sizeof down.share);
    uz_level_take_step(&down, UZ_STEP_REDUCE);
    restore(s, v);
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

/* Less than what single precision hides is not to be told: few steps may end a small system at once. */
static void tell_hidden(spread_system *s, double believed)
{
    for (int l = 0; l < s->lanes; l++)
        s->square[l] = fmax(s->square[l], UZ_HIDDEN * UZ_HIDDEN * believed * s->known[l]);
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
        if (system_square(s) <= goal2 && goal2 >= believed * worse(s, s->known)) {
            tell_hidden(s, believed);
            break;
        }
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
