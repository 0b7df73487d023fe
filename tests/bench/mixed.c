/* mixed.c: what a float32 copy of the condensed operator would save the accelerated method.
 *
 * An iteration reads D once and does little else with it, so that half the bytes may be half the time where D does not
 * fit in the caches. Rounding to 24 bits must not decide the answer: with r_0 the iterate of the last check and D r_0
 * known in float64,
 *     D r = D r_0 + D32 (r - r_0) + O(6e-8 |D| |r - r_0|),
 * whose error vanishes as the iterates settle (the residual correction of Higham, Accuracy and Stability of Numerical
 * Algorithms, chapter 12, with the inner solver cut short). r_0 is renewed at every check, whose bound needs D r in
 * float64 anyway. Both ways take the checks of the product's own method (solver/methods/gradient.c). */
#include "bench/bench.h"
#include "run/setup_cache.h"
#include "core/clock.h"
#include "dual/dual.h"

#include <cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_ITERATIONS = 200000, RUNS_MOST = 9, VECTORS = 9 };

typedef struct {
    int m;
    double *D; /* m x m, lower triangle */
    float *D32;
    double *g0, *exact, *D_exact; /* m */
    double alpha, norm;           /* 1/lambda_max; energy norm of the answer */
    double *room;                 /* VECTORS x m */
    float *x32, *y32;             /* m */
} problem_of;

typedef struct {
    double *r, *Dr, *next, *Dnext, *rho, *Drho;
    double *base, *Dbase; /* float32: r_0 and D r_0 */
    double *move;
    double tau;
} iterate;

static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void apply(const problem_of *p, double *y, const double *x)
{
    cblas_dsymv(CblasColMajor, CblasLower, p->m, 1.0, p->D, p->m, x, 1, 0.0, y, 1);
}

static void apply_mixed(const problem_of *p, const iterate *it, double *y, const double *x)
{
    for (int i = 0; i < p->m; i++)
        p->x32[i] = (float)(x[i] - it->base[i]);
    cblas_ssymv(CblasColMajor, CblasLower, p->m, 1.0F, p->D32, p->m, p->x32, 1, 0.0F, p->y32, 1);
    for (int i = 0; i < p->m; i++)
        y[i] = it->Dbase[i] + (double)p->y32[i];
}

static void swap(double **a, double **b)
{
    double *t = *a;
    *a = *b;
    *b = t;
}

/* One step of Kanno's Algorithm 2, as solver/methods/gradient.c takes it. */
static void step(iterate *it, const problem_of *p, bool mixed)
{
    double ascent = 0.0;
    for (int i = 0; i < p->m; i++) {
        const double gap = p->g0[i] - it->Drho[i], moved = it->rho[i] + p->alpha * gap;
        it->next[i] = moved < 0.0 ? moved : 0.0;
        ascent += gap * (it->next[i] - it->r[i]);
    }
    if (mixed)
        apply_mixed(p, it, it->Dnext, it->next);
    else
        apply(p, it->Dnext, it->next);
    const bool restart = ascent < 0.0;
    const double tau = 0.5 * (1.0 + sqrt(1.0 + 4.0 * it->tau * it->tau)), omega = restart ? 0.0 : (it->tau - 1.0) / tau;
    for (int i = 0; i < p->m; i++) {
        it->rho[i] = it->next[i] + omega * (it->next[i] - it->r[i]);
        it->Drho[i] = it->Dnext[i] + omega * (it->Dnext[i] - it->Dr[i]);
    }
    it->tau = restart ? 1.0 : tau;
    swap(&it->r, &it->next);
    swap(&it->Dr, &it->Dnext);
}

/* ||u - u*||_K over ||u*||_K of the iterate: D r in float64, which a bound needs too. */
static double check(iterate *it, const problem_of *p, bool mixed)
{
    double *Dr = it->move, square = 0.0;
    if (!mixed)
        Dr = it->Dr;
    else
        apply(p, Dr, it->r);
    for (int i = 0; i < p->m; i++)
        square += (it->r[i] - p->exact[i]) * (Dr[i] - p->D_exact[i]);
    if (mixed) { /* the iterate goes on from what is known exactly */
        for (int i = 0; i < p->m; i++)
            it->Drho[i] += Dr[i] - it->Dr[i];
        memcpy(it->Dr, Dr, (size_t)p->m * sizeof *Dr);
        memcpy(it->base, it->r, (size_t)p->m * sizeof *Dr);
        memcpy(it->Dbase, Dr, (size_t)p->m * sizeof *Dr);
    }
    return sqrt(fmax(square, 0.0)) / p->norm;
}

/* r = 0 */
static iterate begin(const problem_of *p)
{
    double *v[VECTORS];
    memset(p->room, 0, VECTORS * (size_t)p->m * sizeof *p->room);
    for (int k = 0; k < VECTORS; k++)
        v[k] = p->room + (size_t)k * (size_t)p->m;
    return (iterate){v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], 1.0};
}

/* Seconds of so many iterations, of this thread's processor, as are those below. */
static double time_steps(const problem_of *p, int count, bool mixed)
{
    iterate it = begin(p);
    const double start = processor_seconds();
    for (int k = 0; k < count; k++)
        step(&it, p, mixed);
    return processor_seconds() - start;
}

/* Iterations to the error, 0: never. */
static int64_t run(double *seconds, const problem_of *p, double error, bool mixed)
{
    iterate it = begin(p);
    const double start = processor_seconds();
    int64_t next_check = 1, k = 1;
    for (; k <= MOST_ITERATIONS; k++) {
        step(&it, p, mixed);
        if (k < next_check)
            continue;
        if (check(&it, p, mixed) <= error)
            break;
        next_check = k + (k < 16 ? 1 : k / 16);
    }
    *seconds = processor_seconds() - start;
    return k <= MOST_ITERATIONS ? k : 0;
}

/* The paper's body as a strip with m cells along the contact. */
static uz_scene strip(int m)
{
    uz_scene scene = bench_paper_scene(3);
    scene.box.cells[0] = m;
    scene.box.cells[1] = 24;
    return scene;
}

static bool read_operator(problem_of *p, const uz_problem *problem, uz_setup *setup)
{
    uz_dual_load *load = NULL;
    uz_error err;
    double lambda = 0.0;
    uz_qp qp = {0};
    const uz_csc *K = uz_setup_K(setup, problem);
    uz_mesh_info info = {0};
    bool good = uz_scene_to_qp(&qp, &info, &problem->scene, &err) == UZ_OK &&
                uz_dual_load_create(&load, setup->dual, K, qp.p, qp.h, &err) == UZ_OK &&
                uz_dual_load_prepare(load, &err) == UZ_OK &&
                uz_dual_load_lambda_max(load, &lambda, false, &err) == UZ_OK && lambda > 0.0;
    for (int i = 0; good && i < p->m; i++)
        good = uz_dual_load_column(load, p->D + (size_t)i * (size_t)p->m, i, &err) == UZ_OK;
    for (size_t k = 0; good && k < (size_t)p->m * (size_t)p->m; k++)
        p->D32[k] = (float)p->D[k];
    if (good)
        memcpy(p->g0, load->g0, (size_t)p->m * sizeof *p->g0);
    p->alpha = 1.0 / lambda;
    uz_dual_load_free(load);
    uz_mesh_info_clear(&info);
    uz_qp_clear(&qp);
    return good;
}

static bool make(problem_of *p, int m)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = strip(m)};
    uz_settings settings = uz_settings_default();
    uz_cache *cache = uz_cache_new((size_t)4 << 30);
    uz_reuse reused;
    uz_setup *setup = NULL;
    uz_result *result = NULL;
    uz_error err;
    const size_t n = (size_t)m;
    settings.op = UZ_OPERATOR_CONDENSED;
    settings.relative_error = 0.0;
    *p = (problem_of){.m = m,
                      .D = malloc(n * n * sizeof(double)),
                      .D32 = malloc(n * n * sizeof(float)),
                      .g0 = calloc(3 * n, sizeof(double)),
                      .room = malloc(VECTORS * n * sizeof(double)),
                      .x32 = calloc(2 * n, sizeof(float))};
    bool good = p->D && p->D32 && p->g0 && p->room && p->x32 && cache &&
                uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK && result->m == m &&
                uz_setup_acquire(&setup, &reused, cache, &problem, NULL, &settings, NULL, &err) == UZ_OK;
    if (good) {
        p->exact = p->g0 + n;
        p->D_exact = p->exact + n;
        p->y32 = p->x32 + n;
        memcpy(p->exact, result->r, n * sizeof(double));
        p->norm = result->summary.certificate.energy_norm;
        good = read_operator(p, &problem, setup);
    }
    if (good)
        apply(p, p->D_exact, p->exact);
    uz_setup_release(cache, setup);
    uz_cache_free(cache);
    uz_result_free(result);
    uz_problem_clear(&problem);
    return good;
}

static void drop(problem_of *p)
{
    free(p->D);
    free(p->D32);
    free(p->g0);
    free(p->room);
    free(p->x32);
}

/* Time of `steps` iterations each way, without what comes before them. */
static void compare_steps(bench_mixed_row *out, const problem_of *p, int steps)
{
    double ratio[RUNS_MOST], whole[RUNS_MOST];
    for (int k = 0; k < RUNS_MOST; k++) {
        const double full = time_steps(p, steps, false);
        ratio[k] = time_steps(p, steps, true) / full;
        whole[k] = 1e3 * full / steps;
    }
    out->ratio = bench_summarise(ratio, RUNS_MOST);
    out->milliseconds = bench_summarise(whole, RUNS_MOST);
    out->iterations = out->mixed_iterations = steps;
}

static bool compare_runs(bench_mixed_row *out, const problem_of *p, double error, int runs)
{
    double ratio[RUNS_MOST], whole[RUNS_MOST], half, full;
    bool good = true;
    for (int k = 0; good && k < runs; k++) {
        out->iterations = run(&full, p, error, false);
        out->mixed_iterations = run(&half, p, error, true);
        ratio[k] = half / full;
        whole[k] = 1e3 * full;
        good = out->iterations > 0 && out->mixed_iterations > 0;
    }
    out->ratio = bench_summarise(ratio, runs);
    out->milliseconds = bench_summarise(whole, runs);
    return good;
}

bool bench_mixed(bench_mixed_row *step_row, bench_mixed_row *out, int count, const double *errors, int m)
{
    problem_of p;
    bool good = make(&p, m);
    if (good)
        compare_steps(step_row, &p, m < 1000 ? 500 : 40);
    for (int e = 0; good && e < count; e++)
        good = compare_runs(&out[e], &p, errors[e], m < 1000 ? RUNS_MOST : 1);
    drop(&p);
    return good;
}
