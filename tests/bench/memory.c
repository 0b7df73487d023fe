/* memory.c: how much memory a cold contact solve needs beside the linear solve of the same K. Each runs in a process of
 * its own, this program started again, as memory once touched tells nothing more; both hold the matrices and use the
 * same allocator. What counts is the largest resident set since the matrices stood (proc(5): VmHWM, and what writing 5
 * to clear_refs does). */
#include "bench/bench.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* The cube of bricks where it is there. */
#if __has_include("hex8.h")
#include "hex8.h"
#else
static uz_status hex8_qp(uz_qp *qp, int64_t n, uz_error *err)
{
    (void)qp, (void)n;
    snprintf(err->message, sizeof err->message, "built without the cube of bricks");
    return UZ_ERR_UNSUPPORTED;
}
#endif

static uz_status paper_qp(uz_qp *qp, int64_t cells, uz_error *err)
{
    uz_scene scene = bench_paper_scene(cells);
    uz_status status = uz_scene_to_qp(qp, NULL, &scene, err);
    uz_scene_clear(&scene);
    return status;
}

static bool matrices_of(uz_qp *qp, const char *problem)
{
    uz_error err = {0};
    bool cube = strncmp(problem, BENCH_CUBE, strlen(BENCH_CUBE)) == 0;
    int64_t n = strtol(problem + (cube ? strlen(BENCH_CUBE) : 0), NULL, 10);
    uz_status status = cube ? hex8_qp(qp, n, &err) : paper_qp(qp, n, &err);
    if (status != UZ_OK)
        fprintf(stderr, "%s: %s\n", problem, err.message);
    return status == UZ_OK;
}

static void forget_peak(void)
{
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file) {
        fputs("5", file);
        fclose(file);
    }
}

/* Bytes, 0 where the system does not tell. */
static double peak_bytes(void)
{
    char line[256];
    long long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "VmHWM: %lld kB", &kilobytes) == 1)
            break;
    if (file)
        fclose(file);
    return 1024.0 * (double)kilobytes;
}

static bool run_contact(const uz_qp *qp)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    bool ok =
        uz_solve(&result, &problem, &settings, NULL, NULL, NULL) == UZ_OK && result->summary.outcome == UZ_CONVERGED;
    uz_result_free(result);
    return ok;
}

int bench_memory_child(const char *what, const char *problem)
{
    uz_qp qp;
    bool ok = true;
    if (!matrices_of(&qp, problem))
        return 1;
    forget_peak();
    if (strcmp(what, "contact") == 0)
        ok = run_contact(&qp);
    else
        bench_cholmod(&qp.K, qp.p, strcmp(what, "metis") == 0 ? BENCH_METIS : BENCH_AMD);
    printf("%.0f\n", peak_bytes());
    uz_qp_clear(&qp);
    return !ok;
}

/* What the child prints; 0: it failed. */
static double run_child(const char *what, const char *problem)
{
    char self[PATH_MAX] = {0};
    double bytes = 0.0;
    int ends[2], status = 1;
    if (readlink("/proc/self/exe", self, sizeof self - 1) < 0 || pipe(ends) != 0)
        return 0.0;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        execl(self, self, BENCH_MEMORY_FLAG, what, problem, (char *)NULL);
        _exit(127);
    }
    close(ends[1]);
    FILE *out = fdopen(ends[0], "r");
    bool told = child > 0 && out && fscanf(out, "%lf", &bytes) == 1;
    if (out)
        fclose(out);
    if (child > 0)
        waitpid(child, &status, 0);
    return told && status == 0 ? bytes : 0.0;
}

bool bench_memory(bench_value *ratio, bench_value *megabytes, const char *problem)
{
    enum { RUNS = 3 };
    double ratios[RUNS], own[RUNS];
    for (int k = 0; k < RUNS; k++) {
        double contact = run_child("contact", problem), amd = run_child("amd", problem);
        double metis = run_child("metis", problem), linear = amd < metis ? amd : metis;
        if (!(contact > 0.0) || !(linear > 0.0))
            return false;
        ratios[k] = contact / linear;
        own[k] = 1e-6 * contact;
    }
    *ratio = bench_summarise(ratios, RUNS);
    *megabytes = bench_summarise(own, RUNS);
    return true;
}
