/* semicoercive_fixture.h: bodies without supports, and every active set there is, in quadruple precision. */
#ifndef TESTS_SEMICOERCIVE_FIXTURE_H
#define TESTS_SEMICOERCIVE_FIXTURE_H

#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle_process(void)
{
    uz_process_init(2);
    uz_thread_init();
}

/* ---------------------------------------------------------------- the reference */

/* Gauss elimination with partial pivoting of the n x n system A x = b, row by row. False: singular, a pivot is less
 * than `least`. */
static inline bool quad_eliminate(quad *A, quad *b, int64_t n, double least)
{
    for (int64_t k = 0; k < n; k++) {
        int64_t best = k;
        for (int64_t i = k + 1; i < n; i++)
            best = quad_abs(A[i * n + k]) > quad_abs(A[best * n + k]) ? i : best;
        if (quad_abs(A[best * n + k]) < least)
            return false;
        for (int64_t j = 0; j < n && best != k; j++) {
            quad t = A[k * n + j];
            A[k * n + j] = A[best * n + j];
            A[best * n + j] = t;
        }
        quad t = b[k];
        b[k] = b[best];
        b[best] = t;
        for (int64_t i = k + 1; i < n; i++) {
            quad factor = A[i * n + k] / A[k * n + k];
            for (int64_t j = k; j < n && factor != 0; j++)
                A[i * n + j] -= factor * A[k * n + j];
            b[i] -= factor * b[k];
        }
    }
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t j = i + 1; j < n; j++)
            b[i] -= A[i * n + j] * b[j];
        b[i] /= A[i * n + i];
    }
    return true;
}

typedef struct {
    int64_t d, m;
    double least;  /* smaller pivots are zero */
    double *K, *N; /* dense, row by row */
    quad u[64];
    bool exists; /* some active set meets the KKT conditions, and gives one u only */
    bool strict; /* with pressing rows that press and open rows that are open */
    unsigned set;
} exhaustive;

/* u and the reactions of the rows in `set` as equations: [K -N'; N 0] [u; r] = [p; h]. */
static inline bool try_set(exhaustive *x, const uz_qp *qp, unsigned set)
{
    quad A[64 * 64] = {0}, b[64] = {0};
    int64_t rows[16] = {0}, n = x->d;
    for (int64_t i = 0; i < x->m; i++)
        if (set >> i & 1)
            rows[n++ - x->d] = i;
    for (int64_t j = 0; j < x->d; j++) {
        b[j] = qp->p[j];
        for (int64_t k = 0; k < x->d; k++)
            A[j * n + k] = x->K[j * x->d + k];
        for (int64_t k = x->d; k < n; k++) {
            A[j * n + k] = -x->N[rows[k - x->d] * x->d + j];
            A[k * n + j] = -A[j * n + k];
            b[k] = qp->h[rows[k - x->d]];
        }
    }
    if (!quad_eliminate(A, b, n, x->least))
        return false;
    bool strict = true;
    for (int64_t k = x->d; k < n; k++) {
        if (b[k] > 1e-25)
            return false;
        strict = strict && b[k] < -1e-6;
    }
    for (int64_t i = 0; i < x->m; i++) {
        quad gap = qp->h[i];
        for (int64_t j = 0; j < x->d; j++)
            gap -= (quad)x->N[i * x->d + j] * b[j];
        if (gap < -1e-25)
            return false;
        strict = strict && ((set >> i & 1) || gap > 1e-6);
    }
    memcpy(x->u, b, (size_t)x->d * sizeof *b);
    x->exists = true;
    x->strict = strict;
    x->set = set;
    return true;
}

/* least: what rounding may have left of a zero in the entries of K. */
static inline exhaustive search_all_above(const uz_qp *qp, double least)
{
    exhaustive x = {.d = qp->K.cols, .m = qp->N.rows, .least = least};
    x.K = dense_symmetric(&qp->K);
    x.N = vector(x.m * x.d);
    for (int64_t j = 0; j < x.d; j++)
        for (int64_t q = qp->N.ptr[j]; q < qp->N.ptr[j + 1]; q++)
            x.N[qp->N.idx[q] * x.d + j] += qp->N.val[q];
    for (unsigned set = 0; set < 1u << x.m; set++)
        if (try_set(&x, qp, set))
            break;
    return x;
}

static inline exhaustive search_all(const uz_qp *qp)
{
    return search_all_above(qp, 1e-20);
}

static inline void exhaustive_free(exhaustive *x)
{
    free(x->K);
    free(x->N);
}

/* ||u - u*||_K */
static inline double error_of(const exhaustive *x, const double *u)
{
    quad sum = 0;
    for (int64_t j = 0; j < x->d; j++)
        for (int64_t k = 0; k < x->d; k++)
            sum += (u[j] - x->u[j]) * (quad)x->K[j * x->d + k] * (u[k] - x->u[k]);
    return (double)quad_sqrt(sum);
}

static inline double energy_norm_of(const exhaustive *x)
{
    quad sum = 0;
    for (int64_t j = 0; j < x->d; j++)
        for (int64_t k = 0; k < x->d; k++)
            sum += x->u[j] * (quad)x->K[j * x->d + k] * x->u[k];
    return (double)quad_sqrt(sum);
}

static inline double energy_of(const exhaustive *x, const uz_qp *qp)
{
    quad sum = 0;
    for (int64_t j = 0; j < x->d; j++) {
        sum -= qp->p[j] * x->u[j];
        for (int64_t k = 0; k < x->d; k++)
            sum += x->u[j] * (quad)x->K[j * x->d + k] * x->u[k] / 2;
    }
    return (double)sum;
}

/* ------------------------------------------------------------------- helpers */

/* The outcome, or the error; the result may be NULL. */
static inline uz_status attempt(uz_result **result, const uz_problem *problem, const uz_settings *settings,
                                uz_error *err)
{
    memset(err, 0, sizeof *err);
    return uz_solve(result, problem, settings, NULL, NULL, err);
}

static inline void expect_refusal(const uz_problem *problem, uz_status status, const char *where, const char *says)
{
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    uz_result *result = NULL;
    uz_error err;
    uz_status got = attempt(&result, problem, &settings, &err);
    CHECK_STR(uz_status_name(got), uz_status_name(status));
    CHECK(result == NULL);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, says) != NULL, "\"%s\" lacks \"%s\"", err.message, says);
    uz_result_free(result);
}

/* K and N of two blocks side by side in matrices, each between a floor and a wall on its left: no support at all. The
 * load on block b presses it down and to the left with the pressures press[b]. */
static inline uz_qp two_blocks(const double press[2])
{
    uz_scene scene = box_scene(3, 2, 3, 2);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    add_plane(&scene, "left", 0, 0, 1, 0);
    uz_body_model model;
    uz_error err = {0};
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_HELD, &err) == UZ_OK);
    const int64_t d = model.d, m = model.m;
    double *one = dense_symmetric(&model.K), *K = vector(4 * d * d), *N = vector(4 * m * d);
    uz_qp qp = {.p = vector(2 * d), .h = vector(2 * m)};
    for (int64_t b = 0; b < 2; b++) {
        for (int64_t i = 0; i < d; i++)
            for (int64_t j = 0; j < d; j++)
                K[(b * d + i) * 2 * d + b * d + j] = one[i * d + j];
        for (int64_t j = 0; j < d; j++)
            for (int64_t q = model.N.ptr[j]; q < model.N.ptr[j + 1]; q++)
                N[(b * m + model.N.idx[q]) * 2 * d + b * d + j] = model.N.val[q];
        scene.n_loads = 0;
        add_load(&scene, "top", 0, -press[b]);
        add_load(&scene, "right", -press[b], 0);
        CHECK(uz_body_model_load(qp.p + b * d, qp.h + b * m, NULL, &model, &scene, &err) == UZ_OK);
    }
    qp.K = csc_from_dense(K, 2 * d, 2 * d, true);
    qp.N = csc_from_dense(N, 2 * m, 2 * d, false);
    free(one);
    free(K);
    free(N);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
    return qp;
}

#endif
