/* bench.c: the ratios that the product promises, as medians of paired runs in one process: a contact solve against the
 * linear solve of the same K. Prints a table and writes JSON. usage: bench OUTPUT.json [name part] */
#include "bench.h"
#include "core/clock.h"

#include <ctype.h>
#include <limits.h>
#include <malloc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RUNS_MOST 15

typedef struct {
    FILE *json;
    int rows;
    const char *filter;
} report;

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bench_value bench_summarise(double *samples, int count)
{
    qsort(samples, (size_t)count, sizeof *samples, compare);
    double middle = count % 2 ? samples[count / 2] : 0.5 * (samples[count / 2 - 1] + samples[count / 2]);
    return (bench_value){middle, samples[0], samples[count - 1], count};
}

static void print_row(report *out, const char *name, const char *unit, bench_value v, const char *target)
{
    printf("%-34s %9.3f  (%.3f .. %.3f, %d runs)  %s %s\n", name, v.median, v.min, v.max, v.runs, unit, target);
    fprintf(out->json,
            "%s  {\"name\": \"%s\", \"median\": %.6g, \"min\": %.6g, \"max\": %.6g, \"runs\": %d, \"unit\": \"%s\"}",
            out->rows++ ? ",\n" : "", name, v.median, v.min, v.max, v.runs, unit);
    fflush(stdout);
}

static void print_count(report *out, const char *row, const char *what, int64_t count)
{
    char name[64];
    snprintf(name, sizeof name, "%s_%s", row, what);
    print_row(out, name, "", (bench_value){(double)count, (double)count, (double)count, 1}, "");
}

static uz_material *one_material(void)
{
    uz_material *m = calloc(1, sizeof *m);
    strcpy(m->on, "all");
    m->young = 200e3;
    m->poisson = 0.3;
    return m;
}

uz_scene bench_paper_scene(int64_t nx)
{
    uz_scene s;
    memset(&s, 0, sizeof s);
    s.model = UZ_PLANE_STRESS;
    s.thickness = 5.0;
    s.box = (uz_box){.size = {60.0, 20.0}, .cells = {nx, nx / 3}, .element = "quad4", .dim = 2};
    s.materials = one_material();
    s.n_materials = s.n_supports = s.n_contacts = 1;
    s.n_loads = 2;
    s.supports = calloc(1, sizeof *s.supports);
    strcpy(s.supports[0].on, "left");
    s.supports[0].u[2] = NAN;
    s.loads = calloc(2, sizeof *s.loads);
    strcpy(s.loads[0].on, "top");
    s.loads[0].v[1] = -0.05;
    strcpy(s.loads[1].on, "right");
    s.loads[1].v[0] = 0.5;
    s.contacts = calloc(1, sizeof *s.contacts);
    strcpy(s.contacts[0].on, "bottom");
    s.contacts[0].normal[1] = 1.0;
    return s;
}

/* *iterations may be NULL */
static double seconds_of_solve(const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                               double *iterations)
{
    uz_error err;
    uz_result *result = NULL;
    double start = uz_seconds();
    uz_status status = uz_solve(&result, problem, settings, cache, NULL, &err);
    double seconds = uz_seconds() - start;
    if (status != UZ_OK || result->summary.outcome != UZ_CONVERGED) {
        printf("a bench problem did not converge: %s\n", status ? err.message : result->summary.message);
        exit(1);
    }
    if (iterations)
        *iterations = (double)result->summary.iterations;
    uz_result_free(result);
    return seconds;
}

typedef struct {
    uz_problem problem;
    uz_qp qp;
    uz_mesh_info info;
    uz_cache *cache;
} body;

static void body_begin(body *b, int64_t nx)
{
    uz_error err;
    memset(b, 0, sizeof *b);
    b->problem.kind = UZ_PROBLEM_SCENE;
    b->problem.scene = bench_paper_scene(nx);
    b->cache = uz_cache_new((size_t)4 << 30);
    if (uz_scene_to_qp(&b->qp, &b->info, &b->problem.scene, &err) != UZ_OK)
        exit(1);
}

static void body_end(body *b)
{
    uz_cache_free(b->cache);
    uz_qp_clear(&b->qp);
    uz_mesh_info_clear(&b->info);
    uz_scene_clear(&b->problem.scene);
}

static void bench_body(report *out, int64_t nx, double relative_error)
{
    uz_problem matrices = {.kind = UZ_PROBLEM_MATRICES};
    uz_settings settings = uz_settings_default();
    double cold[RUNS_MOST] = {0}, cached[RUNS_MOST] = {0};
    int runs = nx <= 300 ? 11 : nx <= 600 ? 9 : 5;
    char name[64];
    body b;
    settings.relative_error = relative_error;
    settings.op = UZ_OPERATOR_CONDENSED; /* by its cells the scene would have no factor */
    body_begin(&b, nx);
    matrices.qp = b.qp;
    bench_ordering ordering = bench_better_ordering(&b.qp.K, b.qp.p);
    for (int k = 0; k < 3; k++)
        seconds_of_solve(&b.problem, &settings, b.cache, NULL);
    for (int k = 0; k < runs; k++) {
        bench_linear linear = bench_cholmod(&b.qp.K, b.qp.p, ordering);
        double contact = seconds_of_solve(&matrices, &settings, NULL, NULL);
        cold[k] = contact / (linear.analyze + linear.factorize + linear.solve);
        cached[k] = seconds_of_solve(&b.problem, &settings, b.cache, NULL) / linear.solve;
    }
    snprintf(name, sizeof name, "cold_nx%lld_%.0e", (long long)nx, relative_error);
    print_row(out, name, "x", bench_summarise(cold, runs), "linear solve (analyse, factorise, solve)");
    snprintf(name, sizeof name, "cached_nx%lld_%.0e", (long long)nx, relative_error);
    print_row(out, name, "x", bench_summarise(cached, runs), "one CHOLMOD solve");
    body_end(&b);
}

/* What digits cost: solves with the factor cached, in units of one CHOLMOD solve, and the iterations they took. */
static void bench_accuracy(report *out, uz_method method, double relative_error, body *b)
{
    uz_settings settings = uz_settings_default();
    double samples[RUNS_MOST], iterations = 0.0;
    char name[64];
    settings.method = method;
    settings.op = UZ_OPERATOR_CONDENSED;
    settings.relative_error = relative_error;
    settings.max_iterations = 1000000;
    for (int k = 0; k < 3; k++)
        seconds_of_solve(&b->problem, &settings, b->cache, &iterations);
    for (int k = 0; k < 7; k++) {
        bench_linear linear = bench_cholmod(&b->qp.K, b->qp.p, BENCH_AMD);
        samples[k] = seconds_of_solve(&b->problem, &settings, b->cache, &iterations) / linear.solve;
    }
    snprintf(name, sizeof name, "accuracy_%s_%.0e", uz_method_name(method), relative_error);
    print_row(out, name, "x", bench_summarise(samples, 7), "one CHOLMOD solve");
    strcat(name, "_iterations");
    print_row(out, name, "", (bench_value){iterations, iterations, iterations, 1}, "");
}

static void bench_accuracies(report *out)
{
    static const double errors[] = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART};
    body b;
    body_begin(&b, 300);
    for (int m = 0; m < 2; m++)
        for (int e = 0; e < 5; e++)
            bench_accuracy(out, methods[m], errors[e], &b);
    body_end(&b);
}

static void bench_reader(report *out)
{
    const double reader = bench_mm_rate();
    print_row(out, "matrix_market_read", "MB/s", (bench_value){reader, reader, reader, 5}, "");
}

static void bench_obstacles(report *out)
{
    bench_value ratio, milliseconds;
    bool compared;
    if (!bench_obstacle(&ratio, &milliseconds, &compared)) {
        printf("the obstacle problem did not converge to its reference\n");
        exit(1);
    }
    print_row(out, "obstclae", "ms", milliseconds, "");
    if (compared)
        print_row(out, "ipopt_over_uzawa_obstclae", "x", ratio, "");
    else
        printf("%-34s skipped: no Ipopt (Debian: coinor-libipopt-dev)\n", "ipopt_over_uzawa_obstclae");
}

/* Pressed so that few dofs touch, some, and many. */
static void bench_floors(report *out)
{
    static const struct {
        const char *name;
        int64_t n;
        bool plate;
        double sink;
    } rows[] = {{"membrane_500_weak", 500, false, 1.1},
                {"plate_100_weak", 100, true, 1.5},
                {"plate_100", 100, true, 5.0},
                {"plate_100_strong", 100, true, 100.0}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        bench_value ratio;
        int64_t steps;
        if (!bench_floor(&ratio, &steps, rows[i].n, rows[i].plate, rows[i].sink)) {
            printf("%s was not solved\n", rows[i].name);
            exit(1);
        }
        print_row(out, rows[i].name, "x", ratio,
                  rows[i].plate ? "linear solve (at most 10)" : "linear solve (at most 2.5)");
        print_count(out, rows[i].name, "steps", steps);
    }
}

static void bench_memories(report *out)
{
    static const char *const sizes[] = {"300", "600", "900", BENCH_CUBE "32"};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        bench_value ratio, megabytes;
        char name[64];
        if (!bench_memory(&ratio, &megabytes, sizes[i])) {
            printf("%-34s skipped: could not be measured\n", sizes[i]);
            continue;
        }
        snprintf(name, sizeof name, "memory_%s%s", isdigit(*sizes[i]) ? "nx" : "", sizes[i]);
        print_row(out, name, "x", ratio, "linear solve, peak resident");
        strcat(name, "_megabytes");
        print_row(out, name, "MB", megabytes, "");
    }
}

static void bench_cubes(report *out)
{
    static const struct {
        const char *name;
        int64_t n;
        bool leaning;
    } rows[] = {
        {"cold_hex8_d13005", 16, false}, {"cold_hex8_d101277", 32, false}, {"cold_hex8_leaning_d43125", 24, true}};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        bench_value ratio;
        if (!bench_hex8(&ratio, rows[k].n, rows[k].leaning)) {
            printf("%s did not converge\n", rows[k].name);
            exit(1);
        }
        print_row(out, rows[k].name, "x", ratio, "linear solve (analyse, factorise, solve)");
    }
}

static void bench_boxes(report *out)
{
    static const int64_t sizes[] = {16, 24};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        bench_cells_row row;
        char name[64];
        if (!bench_cells(&row, sizes[k])) {
            printf("the cube of %lld^3 cells did not converge\n", (long long)sizes[k]);
            exit(1);
        }
        const bench_value values[] = {row.linear, row.aggregates, row.cached};
        static const char *const over[] = {"", "_over_aggregates", "_cached"},
                                 *const of[] = {"linear solve (analyse, factorise, solve)",
                                                "the same by its matrix and aggregates",
                                                "the same with nothing cached"};
        for (int i = 0; i < 3; i++) {
            snprintf(name, sizeof name, "cells_hex8_n%lld%s", (long long)sizes[k], over[i]);
            print_row(out, name, "x", values[i], of[i]);
        }
    }
}

static void bench_oblique_planes(report *out)
{
    for (int64_t nx = 300; nx <= 600; nx += 300) {
        bench_value ratio;
        char name[64];
        if (!bench_oblique(&ratio, nx)) {
            printf("the body on an oblique plane did not converge\n");
            exit(1);
        }
        snprintf(name, sizeof name, "oblique_nx%lld", (long long)nx);
        print_row(out, name, "x", ratio, "the plane along an axis, cold");
    }
}

static void bench_surfaces(report *out)
{
    static const struct {
        const char *name;
        int64_t n;
        bool solid;
    } rows[] = {
        {"candidates_box_nx600", 600, false}, {"candidates_cube_n16", 16, true}, {"candidates_cube_n24", 24, true}};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        bench_candidates x;
        char text[128];
        if (!bench_candidates_left_out(&x, rows[k].n, rows[k].solid)) {
            printf("%s did not converge\n", rows[k].name);
            exit(1);
        }
        snprintf(text, sizeof text, "with all, %.3f s: %lld of %lld rows, %lld rounds, %.0f of %.0f MB",
                 x.all_seconds.median, (long long)x.kept, (long long)x.given, (long long)x.rounds, 1e-6 * x.bytes,
                 1e-6 * x.all_bytes);
        const bench_value ratio = {x.seconds.median / x.all_seconds.median, x.seconds.min / x.all_seconds.max,
                                   x.seconds.max / x.all_seconds.min, x.seconds.runs};
        print_row(out, rows[k].name, "x", ratio, text);
        print_count(out, rows[k].name, "given", x.given);
        print_count(out, rows[k].name, "kept", x.kept);
    }
}

static void bench_cases(report *out, int64_t nx)
{
    bench_value ratio;
    char name[64];
    if (!bench_load_cases(&ratio, nx)) {
        printf("the load cases did not converge\n");
        exit(1);
    }
    snprintf(name, sizeof name, "100_load_cases_nx%lld", (long long)nx);
    print_row(out, name, "x", ratio, "one CHOLMOD solve (target: 60)");
}

/* A filter that names a row, "stop_bounds", runs that row alone. */
static void bench_stops(report *out)
{
    const char *row;
    for (int k = 0; (row = bench_stop_name(k)) != NULL; k++) {
        bench_value between, work, to_return;
        char name[64];
        if (out->filter && !strstr(row, out->filter))
            continue;
        if (!bench_stop(&between, &work, &to_return, k)) {
            printf("%s gave no answer\n", row);
            exit(1);
        }
        print_row(out, row, "ms", between, "longest between two questions (target: 50)");
        snprintf(name, sizeof name, "%s_work", row);
        print_row(out, name, "ms", work, "the same, of the processor's time");
        snprintf(name, sizeof name, "%s_return", row);
        print_row(out, name, "ms", to_return, "from \"stop\" to the return");
    }
}

static bool wanted(const report *out, const char *name)
{
    return !out->filter || strstr(name, out->filter);
}

static void bench_assemblies(report *out)
{
    const char *row;
    for (int k = 0; (row = bench_assembly_name(k)) != NULL; k++) {
        bench_assembly cost;
        char name[64];
        if (!wanted(out, row))
            continue;
        if (!bench_assembly_of(&cost, k)) {
            printf("%s gave no answer\n", row);
            exit(1);
        }
        print_row(out, row, "x", cost.whole, "analysis and factorization (target: 0.5)");
        const bench_value parts[] = {cost.assembly, cost.outputs, cost.factor};
        static const char *const names[] = {"matrices", "outputs", "factor"};
        for (int i = 0; i < 3; i++) {
            snprintf(name, sizeof name, "%s_%s", row, names[i]);
            print_row(out, name, "s", parts[i], "");
        }
    }
}

static void bench_guarantees(report *out)
{
    char row[64], name[80];
    for (int k = 0; bench_guarantee_name(row, k) != NULL; k++) {
        bench_guarantee_row cost;
        if (!wanted(out, row))
            continue;
        if (!bench_guarantee(&cost, k)) {
            printf("%s was not proved\n", row);
            exit(1);
        }
        print_row(out, row, "x", cost.error, "the solve (target: 10)");
        snprintf(name, sizeof name, "%s_quantity", row);
        if (cost.proved)
            print_row(out, name, "x", cost.quantity, "the solve (target: 25)");
        snprintf(name, sizeof name, "%s_milliseconds", row);
        print_row(out, name, "ms", cost.solve_ms, "the solve");
        snprintf(name, sizeof name, "%s_bound", row);
        print_row(out, name, "", (bench_value){cost.bound, cost.bound, cost.bound, 1}, "");
    }
}

/* Not in the solver: what it would save, and where. Large D are slow to iterate on: fewer digits of those. */
static void bench_precisions(report *out)
{
    static const struct {
        int m, count;
        double errors[2];
    } sizes[] = {{600, 2, {1e-6, 1e-10}}, {2000, 1, {1e-6, 0}}, {5000, 0, {0, 0}}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        bench_mixed_row each, row[2];
        char name[64], text[128];
        if (!bench_mixed(&each, row, sizes[k].count, sizes[k].errors, sizes[k].m)) {
            printf("mixed precision at m = %d did not converge\n", sizes[k].m);
            exit(1);
        }
        snprintf(name, sizeof name, "mixed_m%d_iteration", sizes[k].m);
        snprintf(text, sizeof text, "float64 alone, %.3f ms", each.milliseconds.median);
        print_row(out, name, "x", each.ratio, text);
        for (int e = 0; e < sizes[k].count; e++) {
            snprintf(name, sizeof name, "mixed_m%d_%.0e", sizes[k].m, sizes[k].errors[e]);
            snprintf(text, sizeof text, "float64 alone, %.1f ms: %lld iterations, %lld with float32",
                     row[e].milliseconds.median, (long long)row[e].iterations, (long long)row[e].mixed_iterations);
            print_row(out, name, "x", row[e].ratio, text);
        }
    }
}

/* Condition numbers of slender bodies: as few linear solves as on others. */
static void bench_slender_bodies(report *out)
{
    const char *row;
    for (int k = 0; (row = bench_slender_name(k)) != NULL; k++) {
        bench_value ratio, milliseconds;
        int64_t steps;
        char name[64];
        if (!bench_slender(&ratio, &milliseconds, &steps, k)) {
            printf("%s did not converge\n", row);
            exit(1);
        }
        print_row(out, row, "x", ratio, "linear solve (target: 20)");
        snprintf(name, sizeof name, "%s_milliseconds", row);
        print_row(out, name, "ms", milliseconds, "");
        print_count(out, row, "steps", steps);
    }
}

/* The first jobs of a new daemon are in the row of all cold ones, and apart from the others. */
static void bench_services(report *out)
{
    bench_service_cost cost;
    if (!bench_service(&cost)) {
        printf("the daemon was not measured\n");
        exit(1);
    }
    print_row(out, "service_cold", "x", cost.cold, "linear solve (target: 1.1, at most 1.3)");
    print_row(out, "service_cold_first", "x", cost.first, "those of a new daemon");
    print_row(out, "service_cold_later", "x", cost.later, "those after them");
    print_row(out, "service_second", "x", cost.second, "one CHOLMOD solve (target: 2.5)");
    print_row(out, "service_tenth", "x", cost.tenth, "one CHOLMOD solve (target: 1.3)");
    print_row(out, "service_cold_seconds", "s", cost.cold_s, "");
    print_row(out, "service_linear_seconds", "s", cost.linear_s, "CHOLMOD's analyse, factorise, solve");
    print_row(out, "service_factorize_seconds", "s", cost.factored_s, "the same without its analysis");
    print_row(out, "service_second_milliseconds", "ms", cost.second_ms, "");
    print_row(out, "service_tenth_milliseconds", "ms", cost.tenth_ms, "");
    print_row(out, "service_solve_milliseconds", "ms", cost.solve_ms, "one CHOLMOD solve");
}

/* Memory that is given back and asked for again costs the kernel, or the host of a virtual machine, up to as much as
 * the factorization itself, now to us and now to the reference: both keep what they have touched once. */
static void keep_memory(void)
{
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

int main(int argc, char **argv)
{
    static const int64_t sizes[] = {150, 300, 600, 900};
    report out = {.filter = argc > 2 ? argv[2] : NULL};
    if (argc == 4 && strcmp(argv[1], BENCH_MEMORY_FLAG) == 0) {
        uz_process_init(2);
        uz_thread_init();
        return bench_memory_child(argv[2], argv[3]);
    }
    if (argc == 3 && strcmp(argv[1], BENCH_PREDICTIONS_FLAG) == 0) {
        uz_process_init(1);
        uz_thread_init();
        return bench_predictions_child(argv[2]);
    }
    if (argc < 2 || !(out.json = fopen(argv[1], "w"))) {
        fprintf(stderr, "usage: bench OUTPUT.json [name part]\n");
        return 2;
    }
    keep_memory();
    uz_process_init(2);
    uz_thread_init();
    if (out.filter && strcmp(out.filter, "size") == 0) {
        fprintf(out.json, "{");
        bench_sizes(out.json, argv + 3, argc - 3);
        fprintf(out.json, "}\n");
        return fclose(out.json) != 0;
    }
    if (out.filter && (strcmp(out.filter, "cycles") == 0 || strcmp(out.filter, "roof") == 0)) {
        fprintf(out.json, "{");
        const bool measured = (out.filter[0] == 'c' ? bench_cycles : bench_roof)(out.json);
        fprintf(out.json, "}\n");
        return fclose(out.json) != 0 || !measured;
    }
    if (out.filter && strcmp(out.filter, "predictions") == 0) {
        fprintf(out.json, "{");
        const bool solved = bench_predictions(out.json, argc > 3 ? argv[3] : NULL);
        fprintf(out.json, "}\n");
        return fclose(out.json) != 0 || !solved;
    }
    fprintf(out.json, "{\"ratios\": [\n");
    if (wanted(&out, "matrix_market"))
        bench_reader(&out);
    if (wanted(&out, "accuracy"))
        bench_accuracies(&out);
    if (wanted(&out, "obstclae"))
        bench_obstacles(&out);
    if (wanted(&out, "floor"))
        bench_floors(&out);
    if (wanted(&out, "slender"))
        bench_slender_bodies(&out);
    if (wanted(&out, "service"))
        bench_services(&out);
    if (wanted(&out, "oblique"))
        bench_oblique_planes(&out);
    if (wanted(&out, "memory"))
        bench_memories(&out);
    if (wanted(&out, "candidates"))
        bench_surfaces(&out);
    if (wanted(&out, "hex8"))
        bench_cubes(&out);
    if (wanted(&out, "cells"))
        bench_boxes(&out);
    if (!out.filter || strncmp(out.filter, "stop", 4) == 0)
        bench_stops(&out);
    bench_assemblies(&out);
    bench_guarantees(&out);
    if (wanted(&out, "mixed"))
        bench_precisions(&out);
    for (int64_t nx = 300; wanted(&out, "load_cases") && nx <= 600; nx += 300)
        bench_cases(&out, nx);
    for (size_t i = 0; wanted(&out, "body") && i < sizeof sizes / sizeof sizes[0]; i++) {
        bench_body(&out, sizes[i], 1e-6);
        bench_body(&out, sizes[i], 1e-8);
    }
    fprintf(out.json, "\n]}\n");
    if (out.rows == 0)
        fprintf(stderr, "bench: no row's name contains '%s'\n", out.filter);
    return fclose(out.json) != 0 || out.rows == 0;
}
