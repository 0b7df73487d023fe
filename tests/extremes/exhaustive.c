/* exhaustive.c: problems of at most ten rows against every active set there is, in quadruple precision: the reference
 * of the reference. */
#include "extremes.h"

#include "generated.h"

/* r with D_AA r_A = g0_A for the rows in the bits of `set`; false where they depend on each other. */
static bool solve_set(quad *r, quad *g, const quad_exact *x, unsigned set)
{
    quad A[100], y[10];
    int64_t rows[10], n = 0, stop;
    for (int64_t i = 0; i < x->m; i++)
        if (set >> i & 1)
            rows[n++] = i;
    for (int64_t i = 0; i < n; i++) {
        y[i] = x->g0[rows[i]];
        for (int64_t j = 0; j < n; j++)
            A[i * n + j] = x->D[rows[i] * x->m + rows[j]];
    }
    if (!quad_cholesky(A, n, NULL, QUAD_DEPENDENT, &stop))
        return false;
    quad_forward(y, A, n, NULL);
    quad_backward(y, A, n, NULL);
    for (int64_t i = 0; i < x->m; i++) {
        r[i] = 0;
        g[i] = x->g0[i];
        for (int64_t k = 0; k < n; k++)
            g[i] -= x->D[i * x->m + rows[k]] * y[k];
    }
    for (int64_t k = 0; k < n; k++)
        r[rows[k]] = y[k];
    return true;
}

/* How far the pair is from r <= 0 <= g, in the energy norm of the motion that mends it. */
static quad violation(const quad *r, const quad *g, const quad_exact *x)
{
    quad worst = 0;
    for (int64_t i = 0; i < x->m; i++) {
        quad size = quad_sqrt(x->D[i * x->m + i]);
        quad pull = r[i] * size, depth = size > 0 ? -g[i] / size : 0;
        worst = pull > worst ? pull : worst;
        worst = depth > worst ? depth : worst;
    }
    return worst;
}

/* ||u_r - u*||_K in quadruple precision. */
static quad distance(const quad *r, const quad_exact *x)
{
    quad sum = 0;
    for (int64_t j = 0; j < x->d; j++) {
        quad y = 0;
        for (int64_t i = 0; i < x->m; i++)
            y += x->Z[i * x->d + j] * (r[i] - x->r[i]);
        sum += y * y;
    }
    return quad_sqrt(sum);
}

/* The best of all active sets. Returns its distance from the reference, relative; *least: its violation, relative. */
static double search(const truth *t, double *least)
{
    quad r[10], g[10], best = INFINITY, far = INFINITY, norm = t->norm > 0 ? t->norm : 1;
    for (unsigned set = 0; set < 1u << t->best.m; set++) {
        if (!solve_set(r, g, &t->best, set))
            continue;
        quad wrong = violation(r, g, &t->best);
        if (wrong < best) {
            best = wrong;
            far = distance(r, &t->best);
        }
    }
    *least = (double)(best / norm);
    return (double)(far / norm);
}

void run_exhaustive(suite *all)
{
    enum { PROBLEMS = 120 };
    char name[64];
    for (uint64_t seed = 100000, found = 0; found < PROBLEMS && wants_family(all, "exhaustive"); seed++) {
        bool active[GENERATED_MOST];
        uz_qp qp = generated_qp(seed, active);
        truth t = {0};
        if (qp.N.rows >= 1 && qp.N.rows <= 10) {
            found++;
            t = find_truth(&qp, active);
        }
        if (t.feasible) {
            double least, far = search(&t, &least);
            judgement j = {.verdict = JUDGED_OK, .certified = least, .error = far, .floor = NAN, .ratio = NAN};
            double noise = 1e-15 + 10 * (double)(t.noise / (t.norm > 0 ? t.norm : 1));
            if (!(far <= noise && least <= noise))
                j = condemn(j, "the exhaustive search finds another solution");
            add_row(all, "exhaustive", name_of(name, sizeof name, "seed %d, m = %d", (int)seed, (int)qp.N.rows),
                    "search", "reference", &j, false);
            run_matrices(all, "exhaustive", name, qp, OWED_TRUTH);
        } else {
            uz_qp_clear(&qp);
        }
        truth_clear(&t);
    }
}
