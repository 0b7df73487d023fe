/* lab.c: writes the problems of the comparison, solves them with this library, and certifies everybody's answers.
 *
 *   lab list                      the names of the generated problems
 *   lab write NAME FILE [CASES]   a problem into a file; CASES is the folder of "cases/..."
 *   lab serve NAME FILE MEGABYTES answers lines as peer.h says it. Methods: "cold" (uz_solve without a cache),
 *                                 "cached" (with the body's factor in it; from the scene where the problem is one),
 *                                 "condense" (D and g0 into the file), "certify" (the answer in the file; its bound
 *                                 is in "certified", and the seconds are of u = K^-1 (p + N'r) where it has no u) */
#include "core/alloc.h"
#include "peers/files.h"
#include "peers/lab.h"
#include "peers/peer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    uz_problem matrices, scene; /* scene.kind: UZ_PROBLEM_MATRICES where there is none */
    uz_cache *cache, *verifies; /* of the cached solves; of certificates */
    lab_factor *factor;         /* NULL: not needed yet */
    double most;                /* bytes of D */
} lab;

/* ---------------------------------------------------------------- solving */

static void take_result(peer_answer *answer, const lab *x, uz_status status, const uz_result *result)
{
    if (status != UZ_OK || result->summary.outcome != UZ_CONVERGED) {
        peer_fail(answer, status != UZ_OK ? uz_status_name(status)
                                          : uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome));
        return;
    }
    memcpy(answer->r, result->r, (size_t)x->matrices.qp.N.rows * sizeof *answer->r);
    memcpy(answer->u, result->u, (size_t)x->matrices.qp.K.cols * sizeof *answer->u);
    answer->iterations = result->summary.iterations;
}

static void solve_ours(peer_answer *answer, const lab *x, uz_cache *cache, double relative_error)
{
    uz_settings settings = uz_settings_default();
    uz_result *result;
    settings.relative_error = relative_error;
    double start = peer_seconds();
    uz_status status = uz_solve(&result, &x->matrices, &settings, cache, NULL, NULL);
    answer->seconds = peer_seconds() - start;
    take_result(answer, x, status, result);
    uz_result_free(result);
}

/* The scene's answer has the supported dofs of the left end too, which the matrices leave out. */
static void take_free_dofs(double *u, const uz_result *result)
{
    for (int64_t node = 0; node < result->n_nodes; node++)
        for (int c = 0; c < 2 && result->mesh.xyz[2 * node] > 0.0; c++)
            *u++ = result->u[2 * node + c];
}

static void solve_scene(peer_answer *answer, const lab *x, double relative_error)
{
    uz_settings settings = uz_settings_default();
    uz_result *result;
    settings.relative_error = relative_error;
    double start = peer_seconds();
    uz_status status = uz_solve(&result, &x->scene, &settings, x->cache, NULL, NULL);
    answer->seconds = peer_seconds() - start;
    if (status != UZ_OK || result->summary.outcome != UZ_CONVERGED) {
        peer_fail(answer, status != UZ_OK ? uz_status_name(status)
                                          : uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome));
    } else {
        memcpy(answer->r, result->r, (size_t)result->m * sizeof *answer->r);
        take_free_dofs(answer->u, result);
        answer->iterations = result->summary.iterations;
    }
    uz_result_free(result);
}

/* The first solve fills the cache, the next two are what a body that is solved again and again has behind it. */
static void solve_cached(peer_answer *answer, const lab *x, double relative_error)
{
    for (int k = 0; k < 4; k++) {
        if (x->scene.kind == UZ_PROBLEM_SCENE)
            solve_scene(answer, x, relative_error);
        else
            solve_ours(answer, x, x->cache, relative_error);
    }
}

/* -------------------------------------------------------------- for peers */

static bool factor_is_there(lab *x)
{
    if (!x->factor)
        x->factor = lab_factor_new(&x->matrices.qp.K);
    return x->factor != NULL;
}

static void condense(peer_answer *answer, lab *x, const char *file)
{
    const uz_qp *qp = &x->matrices.qp;
    double *D, *g0, start = peer_seconds();
    answer->has_u = answer->has_r = false;
    if (!factor_is_there(x))
        peer_fail(answer, "not positive definite");
    else if (!lab_condense(&D, &g0, x->factor, qp, x->most))
        peer_fail(answer, "out of memory");
    else {
        answer->seconds = peer_seconds() - start;
        if (!peers_write_condensed(file, qp->N.rows, D, g0))
            peer_fail(answer, "not written");
        free(D);
        free(g0);
    }
}

/* u = K^-1 (p + N'r) by the factor that formed D; the seconds are of the solve. */
static double *recover(peer_answer *answer, lab *x, const double *r)
{
    const uz_qp *qp = &x->matrices.qp;
    double *u = uz_alloc(qp->K.cols, sizeof *u);
    if (!u || !factor_is_there(x)) {
        free(u);
        return NULL;
    }
    double start = peer_seconds();
    memcpy(u, qp->p, (size_t)qp->K.cols * sizeof *u);
    uz_csc_gaxpy_t(u, &qp->N, 1.0, r);
    lab_factor_solve(x->factor, u, u, 1);
    answer->seconds = peer_seconds() - start;
    return u;
}

/* status: the bound as a number, which the caller reads. */
static void certify(peer_answer *answer, lab *x, const char *file)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    double *u, *r;
    answer->has_u = answer->has_r = false;
    bool ok = peers_read_answer(&u, &r, file, &x->matrices.qp) && r;
    if (ok && !u)
        u = recover(answer, x, r);
    if (!ok || !u)
        peer_fail(answer, "no answer to certify");
    else if (uz_verify(&result, &x->matrices, u, r, &settings, x->verifies, NULL, &err) != UZ_OK)
        peer_fail(answer, uz_status_name(err.status));
    else
        snprintf(answer->status, sizeof answer->status, "%.6e", result->summary.certificate.relative_error);
    uz_result_free(result);
    free(u);
    free(r);
}

static void serve_line(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file)
{
    lab *x = ctx;
    if (strcmp(method, "cold") == 0)
        solve_ours(answer, x, NULL, tolerance);
    else if (strcmp(method, "cached") == 0)
        solve_cached(answer, x, tolerance);
    else if (strcmp(method, "condense") == 0)
        condense(answer, x, file);
    else if (strcmp(method, "certify") == 0)
        certify(answer, x, file);
    else
        peer_fail(answer, "no such method");
}

/* ------------------------------------------------------------------- main */

static int serve(const char *name, const char *file, const char *megabytes)
{
    lab x = {.most = 1e6 * strtod(megabytes, NULL)};
    uz_process_init(2);
    uz_thread_init();
    x.cache = uz_cache_new((size_t)4 << 30);
    x.verifies = uz_cache_new((size_t)4 << 30);
    int status = 2;
    if (x.cache && x.verifies && peers_read_problem(&x.matrices.qp, file)) {
        x.scene.kind = lab_scene(&x.scene.scene, name) ? UZ_PROBLEM_SCENE : UZ_PROBLEM_MATRICES;
        status = peer_serve(&x.matrices.qp, serve_line, &x);
    }
    lab_factor_free(x.factor);
    uz_cache_free(x.cache);
    uz_cache_free(x.verifies);
    uz_problem_clear(&x.scene);
    uz_qp_clear(&x.matrices.qp);
    return status;
}

static int write_problem(const char *name, const char *file, const char *cases)
{
    uz_error err = {0};
    uz_qp qp;
    uz_status status = lab_problem(&qp, name, cases, &err);
    if (status != UZ_OK)
        fprintf(stderr, "%s: %s %s\n", name, uz_status_name(status), err.message);
    else
        printf("{\"d\": %lld, \"m\": %lld}\n", (long long)qp.K.cols, (long long)qp.N.rows);
    bool ok = status == UZ_OK && peers_write_problem(file, &qp);
    uz_qp_clear(&qp);
    return ok ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "list") == 0) {
        for (int k = 0; lab_generated_name(k); k++)
            puts(lab_generated_name(k));
        return 0;
    }
    if (argc >= 4 && strcmp(argv[1], "write") == 0)
        return write_problem(argv[2], argv[3], argc > 4 ? argv[4] : ".");
    if (argc == 5 && strcmp(argv[1], "serve") == 0)
        return serve(argv[2], argv[3], argv[4]);
    fprintf(stderr, "usage: lab list | write NAME FILE [CASES] | serve NAME FILE MEGABYTES\n");
    return 2;
}
