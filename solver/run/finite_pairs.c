/* finite_pairs.c: steps of two bodies that touch, and of others whose tangent is not symmetric.
 *
 * Rows of two surfaces are those where the bodies are, with forces N(u)' r that turn and go over from node to node as
 * they slide (assembly/row_turn.h). With T the derivative of these forces and E what the gaps' own derivative is off -N
 * a step is the contact problem
 *
 *     (K - T) v = f + N' r,   h - N (u + v) + E v >= 0,   r <= 0,
 *
 * which is not that of an energy, as T is not symmetric. A contact problem on the symmetric part of K - T, with what
 * the skew part and E make of some v, tells which rows press. With these as equations the whole is linear, and solved
 * by GMRES (Y. Saad and M. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869), preconditioned by the symmetric part
 * with the same rows: a solve with the factor that there is for each of its few steps, as what is left is that of
 * contact alone, and small beside the bodies' stiffness. Where a row then pulls, or one is penetrated, the next contact
 * problem is that with what this v adds. The operator has the entries of T and E; what v adds is told by the rows a
 * little further along v, so that the whole derivative counts whatever row_turn.h leaves out of its entries. The skew
 * part of pressures that follow the body (finite/follower.h) is added like that of T. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "dual/dual.h"
#include "linalg/blas.h"
#include "run/setup_cache.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Contact problems of a step beside its first, vectors of GMRES and how often it begins anew with what the rows say,
 * and what may be left of a step: no more than a part of what Newton's method leaves of it, which is about what the
 * step before was in the energy's norm (S. Eisenstat and H. Walker, "Choosing the forcing terms in an inexact Newton
 * method", SIAM J. Sci. Comput. 17 (1996) 16-32). */
enum { MOST_CORRECTIONS = 6, DIRECTIONS = 10, RESTARTS = 4 };
#define CORRECTED 1e-3
#define ROUGHLY   0.1
#define PART_LEFT 0.3
/* What GMRES leaves, and one solve on the way, of what may be left. */
#define OF_LEFT 0.3
#define SOLVED  0.01
/* A step of more than this in the energy's norm is far from the answer: it stays that of the symmetric part, which goes
 * down, where the whole tangent would make it more than so many times as long. */
#define FAR    0.1
#define LONGER 2.0
/* A reaction below this part of the largest, or a gap below this part of the body's extent, has no sign. */
#define NO_FORCE 1e-10
#define NO_GAP   1e-11
/* What rounding may change, in parts of the displacement. */
#define ROUNDING 1e-12

uz_status uz_finite_widen(uz_finite_run *run, bool hold, uz_error *err)
{
    const bool known = run->n_r == run->at.rows.m;
    uz_csc_clear(&run->wide);
    run->K = &run->wide;
    return uz_widen_by_rows(&run->wide, &run->tangent.K, &run->at.rows.N, hold && known ? run->r : NULL, 0, &run->turn,
                            err);
}

uz_status uz_finite_carry_reactions(uz_finite_run *run, const uz_body_model *from, uz_error *err)
{
    const uz_body_model *to = &run->at.rows;
    int64_t next = 0;
    double *r = uz_alloc_zero(to->m, sizeof *r);
    if (!r)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)to->m);
    for (int64_t i = 0; i < to->m; i++) {
        const int64_t row = uz_next_row(&next, from, to->info.contact_of[i], to->row_place[i]);
        if (row >= 0)
            r[i] = run->r[row];
    }
    free(run->r);
    run->r = r;
    run->n_r = to->m;
    return UZ_OK;
}

/* ---- the step */

void uz_finite_add_skew(uz_finite_run *run, double times, const double *v, double *nodal)
{
    if (!run->skew.ptr)
        return;
    double *f = nodal + run->n;
    memset(f, 0, (size_t)run->n * sizeof *f);
    uz_recover_nodal(nodal, &run->at.turned, v, NULL);
    uz_csc_gaxpy(f, &run->skew, times, nodal);
    uz_gather_nodal(nodal, &run->at.turned, f);
    uz_axpy(run->d, 1, nodal, run->p);
}

/* What the derivatives of rows along v add to what the matrix has of them; where they cannot be told those that the
 * matrix was made with. */
static uz_status add_turn(uz_finite_run *run, const double *v, uz_error *err)
{
    const uz_row_turn *turn = &run->turn;
    bool known = false;
    if (turn->force.n == 0)
        return UZ_OK;
    const uz_status status =
        uz_row_turn_along(&known, run->p, run->at.h, &run->base, &run->at.rows, &run->scene, run->r, v, err);
    uz_add_entries(run->p, &turn->force, v, true);
    if (!known)
        uz_add_entries(run->at.h, &turn->gap, v, false);
    for (int64_t k = 0; k < turn->force.n && known; k++)
        run->p[turn->force.row[k]] -= turn->force.val[k] * v[turn->force.col[k]];
    return status;
}

/* Stiffness along rows that pressed is about where these are closed: the load has it where their gaps change. */
static void add_hold(const uz_finite_run *run, double *p, const double *gap, const double *before)
{
    const uz_csc *N = &run->at.rows.N;
    for (int64_t j = 0; j < run->d && run->hold > 0 && run->n_r == run->at.rows.m; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
            const int64_t i = N->idx[q];
            if (run->r[i] < 0)
                p[j] += run->hold * run->stiffest * N->val[q] * (gap[i] - (before ? before[i] : 0));
        }
}

/* A step that is being corrected. d- and m-vectors, but where they say more. */
typedef struct {
    uz_finite_run *run;
    const uz_dual *dual;     /* of run->K and the rows */
    double *p, *h;           /* the contact problem to which nothing is added, */
    double *p_last, *h_last; /* and that of run->last */
    double *from, *came;     /* free dofs of run->at; the step of run->last */
    double *v, *next;        /* what adds, and the step that comes of it while rows that press are held */
    double *off, *basis;     /* next - v; DIRECTIONS + 1 vectors */
    double *dp, *dh, *dr;
    double *g, *nodal; /* nodal: 2 n */
    bool *pressing, *held;
    double left; /* of a step, relative */
    bool far;    /* is it more than FAR? */
} correction;

/* run->p and at.h: with what v adds. */
static uz_status add_all(correction *x, const double *v, uz_error *err)
{
    uz_finite_run *run = x->run;
    memcpy(run->p, x->p, (size_t)run->d * sizeof *run->p);
    if (run->at.rows.m > 0)
        memcpy(run->at.h, x->h, (size_t)run->at.rows.m * sizeof *run->at.h);
    const uz_status status = add_turn(run, v, err);
    uz_finite_add_skew(run, 1, v, x->nodal);
    add_hold(run, run->p, run->at.h, x->h);
    return status;
}

/* *solved: y and x->dr are what x->dp and x->dh make, with the rows that press as equations. */
static uz_status solve_held(bool *solved, correction *x, double *y, uz_error *err)
{
    const uz_dual *dual = x->dual;
    const uz_stop stop = {&x->run->hooks, x->run->deadline};
    uz_active_end end = UZ_ACTIVE_UNSOLVED;
    uz_dual_load *load = NULL;
    for (int64_t i = 0; i < dual->m; i++)
        x->held[i] = x->pressing[i];
    uz_status status = uz_dual_load_create(&load, dual, x->run->K, x->dp, x->dh, err);
    if (status == UZ_OK)
        load->equations = true; /* they bear a correction, which may pull */
    if (status == UZ_OK)
        status = uz_dual_load_aim(load, SOLVED * x->left, &stop, err);
    if (status == UZ_OK)
        status = uz_dual_load_solve_active(load, &end, x->dr, x->g, x->held, err);
    *solved = status == UZ_OK && end == UZ_ACTIVE_SOLVED;
    if (*solved)
        status = uz_dual_load_recover(load, y, x->dr, false, err);
    for (int64_t i = 0; i < dual->m && *solved; i++)
        x->dr[i] *= dual->row_scale[i];
    uz_dual_load_free(load);
    return status;
}

/* y: what comes of what v adds by the entries of its derivatives. */
static uz_status follow(bool *solved, correction *x, double *y, const double *v, uz_error *err)
{
    uz_finite_run *run = x->run;
    memset(run->p, 0, (size_t)run->d * sizeof *run->p);
    uz_finite_add_skew(run, 1, v, x->nodal);
    memcpy(x->dp, run->p, (size_t)run->d * sizeof *x->dp);
    for (int64_t i = 0; i < run->at.rows.m; i++)
        x->dh[i] = 0;
    uz_add_entries(x->dp, &run->turn.force, v, true);
    uz_add_entries(x->dh, &run->turn.gap, v, false);
    add_hold(run, x->dp, x->dh, NULL);
    return solve_held(solved, x, y, err);
}

/* A rotation that takes the last entry of a column of the Hessenberg matrix, after those before. */
static void rotate(double column[], double cosine[], double sine[], double rest[], int k)
{
    for (int i = 0; i < k; i++) {
        const double upper = cosine[i] * column[i] + sine[i] * column[i + 1];
        column[i + 1] = -sine[i] * column[i] + cosine[i] * column[i + 1];
        column[i] = upper;
    }
    const double length = hypot(column[k], column[k + 1]);
    cosine[k] = column[k] / length;
    sine[k] = column[k + 1] / length;
    column[k] = length;
    rest[k + 1] = -sine[k] * rest[k];
    rest[k] *= cosine[k];
}

/* GMRES: x->v += y with y less what comes of what y adds = x->off, to `enough`. *solved: as of solve_held. */
static uz_status correct_by_directions(bool *solved, correction *x, double enough, uz_error *err)
{
    const int64_t d = x->run->d;
    double H[DIRECTIONS][DIRECTIONS + 1], cosine[DIRECTIONS], sine[DIRECTIONS], rest[DIRECTIONS + 1];
    int k = 0;
    rest[0] = uz_norm(d, x->off);
    for (int64_t j = 0; j < d; j++)
        x->basis[j] = x->off[j] / rest[0];
    for (*solved = true; k < DIRECTIONS && fabs(rest[k]) > enough; k++) {
        double *q = x->basis + k * d, *next = q + d;
        const uz_status status = follow(solved, x, next, q, err);
        if (status != UZ_OK || !*solved)
            return status;
        for (int64_t j = 0; j < d; j++)
            next[j] = q[j] - next[j];
        for (int i = 0; i <= k; i++) {
            H[k][i] = uz_dot(d, next, x->basis + i * d);
            uz_axpy(d, -H[k][i], x->basis + i * d, next);
        }
        const double length = H[k][k + 1] = uz_norm(d, next);
        for (int64_t j = 0; j < d && length > 0; j++)
            next[j] /= length;
        rotate(H[k], cosine, sine, rest, k);
        if (!(H[k][k] > 0)) /* the derivative is singular */
            break;
    }
    for (int i = k - 1; i >= 0; i--) {
        for (int j = i + 1; j < k; j++)
            rest[i] -= H[j][i] * rest[j];
        rest[i] /= H[i][i];
        uz_axpy(d, rest[i], x->basis + i * d, x->v);
    }
    return UZ_OK;
}

/* Of x->next with x->dr: does none of the rows that press pull, and none of the others penetrate? */
static bool has_its_rows(correction *x)
{
    uz_finite_run *run = x->run;
    const int64_t m = run->at.rows.m;
    double most = 0;
    bool has = true;
    for (int64_t j = 0; j < run->d; j++)
        x->dp[j] = x->from[j] + x->next[j];
    for (int64_t i = 0; i < m; i++) {
        x->g[i] = run->at.h[i];
        most = fmax(most, fabs(run->last->r[i]));
    }
    uz_csc_gaxpy(x->g, &run->at.rows.N, -1, x->dp);
    for (int64_t i = 0; i < m && has; i++)
        has =
            x->pressing[i] ? run->last->r[i] + x->dr[i] <= NO_FORCE * most : x->g[i] >= -NO_GAP * run->base.mesh.extent;
    return has;
}

/* x->v becomes the step in which the rows that press in run->last do so; *done: it is that of the whole tangent, and
 * the answer of run->last, or that is to stay. */
static uz_status settle_rows(bool *done, correction *x, uz_error *err)
{
    uz_finite_run *run = x->run;
    const int64_t d = run->d, m = run->at.rows.m;
    bool solved = true, enough = false;
    double before = INFINITY;
    memcpy(x->v, x->came, (size_t)d * sizeof *x->v);
    for (int64_t i = 0; i < m; i++)
        x->pressing[i] = run->last->r[i] < 0;
    for (int k = 0; k < RESTARTS && !enough; k++) {
        uz_status status = add_all(x, x->v, err);
        for (int64_t j = 0; j < d; j++)
            x->dp[j] = run->p[j] - x->p_last[j];
        for (int64_t i = 0; i < m; i++)
            x->dh[i] = run->at.h[i] - x->h_last[i];
        if (status == UZ_OK)
            status = solve_held(&solved, x, x->next, err);
        if (status != UZ_OK || !solved)
            return status;
        for (int64_t j = 0; j < d; j++) {
            x->next[j] += x->came[j];
            x->off[j] = x->next[j] - x->v[j];
        }
        const double off = uz_norm(d, x->off), length = uz_norm(d, x->next), least = x->left * length;
        *done = x->far && !(length <= LONGER * uz_norm(d, x->came));
        if (*done)
            return UZ_OK;
        enough = off <= fmax(least, ROUNDING * uz_norm(d, run->last->u));
        if (!isfinite(off)) /* the whole tangent is singular with these rows */
            memcpy(x->v, x->came, (size_t)d * sizeof *x->v);
        if (enough || !(off < before))
            break;
        before = off;
        status = correct_by_directions(&solved, x, OF_LEFT * least, err);
        if (status != UZ_OK || !solved)
            return status;
    }
    if (!enough || !has_its_rows(x))
        return UZ_OK;
    *done = true;
    memcpy(run->last->u, x->dp, (size_t)d * sizeof *x->dp);
    for (int64_t i = 0; i < m; i++)
        run->last->r[i] = x->pressing[i] ? fmin(0, run->last->r[i] + x->dr[i]) : 0;
    return UZ_OK;
}

/* From the contact problem of x->p and x->h. */
static uz_status iterate(correction *x, uz_error *err)
{
    uz_finite_run *run = x->run;
    const int64_t d = run->d, m = run->at.rows.m;
    uz_status status = UZ_OK;
    for (int k = 0; status == UZ_OK && uz_finite_is_solved(run->last); k++) {
        double off = 0;
        for (int64_t j = 0; j < d; j++) {
            x->came[j] = run->last->u[j] - x->from[j];
            off = hypot(off, x->came[j] - x->v[j]);
        }
        bool done = k > 0 && off <= fmax(x->left * uz_norm(d, x->came), ROUNDING * uz_norm(d, run->last->u));
        memcpy(x->p_last, run->p, (size_t)d * sizeof *run->p);
        for (int64_t i = 0; i < m; i++)
            x->h_last[i] = run->at.h[i];
        const double start = uz_seconds();
        if (!done)
            status = settle_rows(&done, x, err);
        run->spent.iterate += uz_seconds() - start;
        if (status != UZ_OK || done || k == MOST_CORRECTIONS)
            break;
        status = add_all(x, x->v, err);
        if (status == UZ_OK)
            status = uz_finite_solve_qp(run, err);
    }
    for (int64_t i = 0; i < m; i++)
        run->at.h[i] = x->h[i];
    return status;
}

uz_status uz_finite_correct(uz_finite_run *run, uz_error *err)
{
    const int64_t d = run->d, m = run->at.rows.m;
    uz_setup *setup = NULL;
    double *room = uz_alloc_zero((DIRECTIONS + 9) * d + 5 * m + 2 * run->n, sizeof *room);
    bool *marks = uz_alloc(2 * m, sizeof *marks);
    uz_status status = room && marks
                           ? uz_finite_acquire(&setup, run, &run->at, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a step of %lld dofs", (long long)d);
    if (status == UZ_OK) {
        /* of the first step the norm is infinite, or not known; nor more than the answer is asked for, as far as this
         * step goes */
        const double now = uz_finite_step_norm(run), enough = now > 0 ? PART_LEFT * run->requested / now : ROUGHLY;
        correction x = {.run = run, .dual = setup->dual, .p = room, .pressing = marks, .held = marks + m};
        double **vectors[] = {&x.p_last, &x.from, &x.came, &x.v, &x.next, &x.off, &x.dp, &x.basis};
        double **at_rows[] = {&x.h, &x.h_last, &x.dh, &x.dr, &x.g};
        for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++)
            *vectors[k] = room + (int64_t)(k + 1) * d;
        for (size_t k = 0; k < sizeof at_rows / sizeof *at_rows; k++)
            *at_rows[k] = x.basis + (DIRECTIONS + 1) * d + (int64_t)k * m;
        x.nodal = x.g + m;
        x.left = run->norm > 0 ? fmin(ROUGHLY, fmax(fmax(CORRECTED, enough), PART_LEFT * run->norm)) : ROUGHLY;
        x.far = now > FAR;
        memcpy(x.p, run->p, (size_t)d * sizeof *x.p);
        for (int64_t i = 0; i < m; i++)
            x.h[i] = run->at.h[i];
        uz_finite_restrict(x.from, &run->at);
        status = iterate(&x, err);
    }
    uz_setup_release(run->cache, setup);
    uz_free_all(room, marks);
    return status;
}
