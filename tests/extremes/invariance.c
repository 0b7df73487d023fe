/* invariance.c: the same problem in other units, with its rows scaled or its dofs renumbered, has the same answer. */
#include "extremes.h"

#include "qp_fixture.h"
#include "scene_fixture.h"

/* The same problem twice. u of the second = length[j] times u of the first at dof place[j]. */
typedef struct {
    uz_qp first, second;
    double *length;
    int64_t *place;
} twins;

static twins twins_of(const uz_qp *qp)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    twins t = {.length = vector(d), .place = calloc((size_t)d + 1, sizeof *t.place)};
    uz_qp *copies[] = {&t.first, &t.second};
    for (int k = 0; k < 2; k++) {
        if (!t.place || uz_csc_copy(&copies[k]->K, &qp->K, NULL) != UZ_OK ||
            uz_csc_copy(&copies[k]->N, &qp->N, NULL) != UZ_OK)
            abort();
        copies[k]->p = vector(d);
        copies[k]->h = vector(m);
        memcpy(copies[k]->p, qp->p, (size_t)d * sizeof *qp->p);
        memcpy(copies[k]->h, qp->h, (size_t)m * sizeof *qp->h);
    }
    for (int64_t j = 0; j < d; j++) {
        t.length[j] = 1;
        t.place[j] = j;
    }
    return t;
}

/* Row i of N and h times factor[i]. */
static void scale_rows(uz_qp *qp, const double *factor)
{
    for (int64_t k = 0; k < qp->N.ptr[qp->N.cols]; k++)
        qp->N.val[k] *= factor[qp->N.idx[k]];
    for (int64_t i = 0; i < qp->N.rows; i++)
        qp->h[i] *= factor[i];
}

/* Dof j becomes dof place[j]. */
static void renumber(uz_qp *qp, const int64_t *place)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    double *K = vector(d * d), *N = vector(m * d), *p = vector(d);
    for (int64_t j = 0; j < d; j++) {
        p[place[j]] = qp->p[j];
        for (int64_t k = qp->K.ptr[j]; k < qp->K.ptr[j + 1]; k++)
            K[place[qp->K.idx[k]] * d + place[j]] = K[place[j] * d + place[qp->K.idx[k]]] = qp->K.val[k];
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            N[qp->N.idx[k] * d + place[j]] = qp->N.val[k];
    }
    uz_csc_clear(&qp->K);
    uz_csc_clear(&qp->N);
    free(qp->p);
    qp->K = csc_from_dense(K, d, d, true);
    qp->N = csc_from_dense(N, m, d, false);
    qp->p = p;
    free(K);
    free(N);
}

static void shuffle(qp_random *rng, int64_t *place, int64_t n)
{
    for (int64_t j = n - 1; j > 0; j--) {
        int64_t k = random_int(rng, 0, j + 1), swap = place[j];
        place[j] = place[k];
        place[k] = swap;
    }
}

/* ||u_1 - u_2||_K / ||u_1||_K in the units of the first. */
static double difference(const twins *t, const uz_result *a, const uz_result *b)
{
    int64_t d = t->first.K.cols;
    double *e = vector(d), *Ke = vector(d), *Ku = vector(d), square = 0, norm2 = 0;
    for (int64_t j = 0; j < d; j++)
        e[j] = b->u[t->place[j]] / t->length[j] - a->u[j];
    uz_csc_symv(Ke, &t->first.K, 1, e);
    uz_csc_symv(Ku, &t->first.K, 1, a->u);
    for (int64_t j = 0; j < d; j++) {
        square += e[j] * Ke[j];
        norm2 += a->u[j] * Ku[j];
    }
    free(e);
    free(Ke);
    free(Ku);
    return sqrt(fmax(0, square) / norm2);
}

static bool same_contacts(const uz_result *a, const uz_result *b)
{
    for (int64_t i = 0; i < a->m; i++)
        if ((a->r[i] < 0) != (b->r[i] < 0))
            return false;
    return true;
}

static uz_result *solve(const uz_qp *qp, uz_method method)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    settings.method = method;
    settings.max_iterations = 20000;
    uz_solve(&result, &problem, &settings, NULL, NULL, NULL);
    return result;
}

/* rounding: what the twins' matrices differ by, after the condition of K. */
static void compare(suite *all, const char *name, const twins *t, uz_method method, double rounding)
{
    uz_result *a = solve(&t->first, method), *b = solve(&t->second, method);
    judgement j = {.verdict = JUDGED_OK, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN};
    bool both = a && b && a->summary.outcome == UZ_CONVERGED && b->summary.outcome == UZ_CONVERGED, same = false;
    if (both) {
        const uz_summary *s = &a->summary, *q = &b->summary;
        same = same_contacts(a, b);
        j.error = difference(t, a, b);
        j.certified = s->certificate.relative_error + q->certificate.relative_error;
        snprintf(j.why, sizeof j.why, "%s contacts, iterations %d and %d", same ? "same" : "DIFFERENT",
                 (int)s->iterations, (int)q->iterations);
        if (!(j.error <= j.certified + rounding))
            j = condemn(j, "two certified answers differ by more than their bounds");
    } else if (a && b) {
        snprintf(j.why, sizeof j.why, "%s and %s", uz_choice_name(UZ_CHOICE_OUTCOME, a->summary.outcome),
                 uz_choice_name(UZ_CHOICE_OUTCOME, b->summary.outcome));
    }
    add_row(all, "invariance", name, uz_method_name(method), both ? "converged" : "one did not converge", &j, !same);
    uz_result_free(a);
    uz_result_free(b);
}

static void finish(suite *all, const char *name, twins *t, double rounding)
{
    compare(all, name, t, UZ_METHOD_AUTO, rounding);
    compare(all, name, t, UZ_METHOD_ACCELERATED_RESTART, rounding);
    uz_qp_clear(&t->first);
    uz_qp_clear(&t->second);
    free(t->length);
    free(t->place);
}

static void in_metres(suite *all, uz_scene scene)
{
    uz_qp mm, m;
    uz_scene *s = &scene;
    if (uz_scene_to_qp(&mm, NULL, s, NULL) != UZ_OK)
        abort();
    s->thickness *= 1e-3;
    s->materials[0].young *= 1e6;
    for (int c = 0; c < 2; c++) {
        s->box.size[c] *= 1e-3;
        s->contacts[0].point[c] *= 1e-3;
        s->supports[0].u[c] *= 1e-3;
        for (int64_t k = 0; k < s->n_loads; k++)
            s->loads[k].v[c] *= 1e6;
    }
    if (uz_scene_to_qp(&m, NULL, s, NULL) != UZ_OK)
        abort();
    twins t = twins_of(&mm);
    uz_qp_clear(&t.second);
    t.second = m;
    for (int64_t j = 0; j < mm.K.cols; j++)
        t.length[j] = 1e-3;
    finish(all, "in m, N, Pa", &t, 1e-11);
    uz_qp_clear(&mm);
    uz_scene_clear(s);
}

static void with_scaled_rows(suite *all, const char *name, const uz_qp *qp, double base, double low, double high)
{
    qp_random rng = {31};
    twins t = twins_of(qp);
    double *factor = vector(qp->N.rows);
    for (int64_t i = 0; i < qp->N.rows; i++)
        factor[i] = pow(base, floor(low + (high - low) * random_unit(&rng)));
    scale_rows(&t.second, factor);
    finish(all, name, &t, 1e-14);
    free(factor);
}

static void renumbered(suite *all, const uz_qp *qp)
{
    qp_random rng = {37};
    for (int k = 0; k < 3; k++) {
        twins t = twins_of(qp);
        shuffle(&rng, t.place, qp->K.cols);
        renumber(&t.second, t.place);
        finish(all, "dofs renumbered", &t, 1e-14);
    }
}

static uz_scene tilted(void)
{
    uz_scene s = paper_scene(12, 4);
    s.contacts[0].normal[0] = -1e-4;
    return s;
}

void run_invariance(suite *all)
{
    qp_random rng = {41};
    qp_kind kind = {.d = 24, .m = 16, .condition = 1e4};
    uz_scene scene = tilted();
    uz_qp problems[2];
    if (!wants_family(all, "invariance"))
        return;
    if (uz_scene_to_qp(&problems[0], NULL, &scene, NULL) != UZ_OK)
        abort();
    problems[1] = random_qp(&rng, &kind);
    in_metres(all, paper_scene(12, 4));
    in_metres(all, paper_scene(30, 10));
    in_metres(all, tilted());
    for (int k = 0; k < 2; k++) {
        with_scaled_rows(all, "all rows times 1e8", &problems[k], 10, 8, 8);
        with_scaled_rows(all, "all rows times 1e-8", &problems[k], 10, -8, -8);
        with_scaled_rows(all, "rows times 1e-4 to 1e4", &problems[k], 10, -4, 5);
        with_scaled_rows(all, "rows times 1e-8 to 1e8", &problems[k], 10, -8, 9);
        with_scaled_rows(all, "rows times 2^-20 to 2^20", &problems[k], 2, -20, 21);
        renumbered(all, &problems[k]);
        uz_qp_clear(&problems[k]);
    }
    uz_scene_clear(&scene);
}
