/* peer.c: the loop of a program that solves problems for the comparison, and rows that are bounds. */
#include "peers/peer.h"
#include "core/alloc.h"
#include "peers/files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double peer_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void say(const peer_answer *answer)
{
    printf("{\"status\": \"%s\", \"seconds\": %.9g, \"iterations\": %lld}\n", answer->status, answer->seconds,
           (long long)answer->iterations);
    fflush(stdout);
}

void peer_fail(peer_answer *answer, const char *why)
{
    snprintf(answer->status, sizeof answer->status, "%s", why);
    answer->has_u = answer->has_r = false;
}

static void answer_line(const uz_qp *qp, peer_method solve, void *ctx, const char *line)
{
    char method[64], path[512];
    double tolerance;
    peer_answer x = {.has_u = true, .has_r = true, .status = "ok"};
    if (sscanf(line, "%63s %lf %511s", method, &tolerance, path) != 3)
        return;
    x.u = uz_alloc_zero(qp->K.cols, sizeof *x.u);
    x.r = uz_alloc_zero(qp->N.rows, sizeof *x.r);
    if (x.u && x.r)
        solve(&x, ctx, method, tolerance, path);
    else
        peer_fail(&x, "no memory");
    if ((x.has_u || x.has_r) && !peers_write_answer(path, qp, x.has_u ? x.u : NULL, x.has_r ? x.r : NULL))
        peer_fail(&x, "answer not written");
    say(&x);
    free(x.u);
    free(x.r);
}

int peer_serve(const uz_qp *qp, peer_method solve, void *ctx)
{
    char line[1024];
    puts("{\"status\": \"ready\"}");
    fflush(stdout);
    while (fgets(line, sizeof line, stdin))
        answer_line(qp, solve, ctx, line);
    return 0;
}

static bool rows_are_bounds(const uz_qp *qp)
{
    int64_t *count = uz_alloc_zero(qp->N.rows, sizeof *count);
    bool ok = count != NULL;
    for (int64_t k = 0; ok && k < qp->N.ptr[qp->N.cols]; k++)
        ok = qp->N.val[k] != 0 && ++count[qp->N.idx[k]] == 1;
    for (int64_t i = 0; ok && i < qp->N.rows; i++)
        ok = count[i] == 1;
    free(count);
    return ok;
}

static void take_row(peer_bounds *out, int64_t dof, int64_t row, double factor, double h)
{
    double bound = h / factor;
    if (factor > 0 && (out->by_upper[dof] < 0 || bound < out->upper[dof])) {
        out->upper[dof] = bound;
        out->by_upper[dof] = row;
    }
    if (factor < 0 && (out->by_lower[dof] < 0 || bound > out->lower[dof])) {
        out->lower[dof] = bound;
        out->by_lower[dof] = row;
    }
}

bool peer_bounds_of(peer_bounds *out, const uz_qp *qp, double infinity)
{
    int64_t d = qp->K.cols;
    memset(out, 0, sizeof *out);
    if (!rows_are_bounds(qp))
        return false;
    *out = (peer_bounds){uz_alloc(d, sizeof(double)), uz_alloc(d, sizeof(double)), uz_alloc(d, sizeof(int64_t)),
                         uz_alloc(d, sizeof(int64_t))};
    if (!out->lower || !out->upper || !out->by_lower || !out->by_upper) {
        peer_bounds_clear(out);
        return false;
    }
    for (int64_t j = 0; j < d; j++) {
        out->by_lower[j] = out->by_upper[j] = -1;
        out->lower[j] = -infinity;
        out->upper[j] = infinity;
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            take_row(out, j, qp->N.idx[k], qp->N.val[k], qp->h[qp->N.idx[k]]);
    }
    return true;
}

void peer_bounds_clear(peer_bounds *bounds)
{
    free(bounds->lower);
    free(bounds->upper);
    free(bounds->by_lower);
    free(bounds->by_upper);
    memset(bounds, 0, sizeof *bounds);
}

void peer_bounds_reactions(double *r, const peer_bounds *bounds, const uz_qp *qp, const double *f)
{
    for (int64_t j = 0; j < qp->K.cols; j++) {
        int64_t row = f[j] < 0 ? bounds->by_upper[j] : bounds->by_lower[j];
        for (int64_t k = qp->N.ptr[j]; row >= 0 && k < qp->N.ptr[j + 1]; k++)
            if (qp->N.idx[k] == row)
                r[row] = f[j] / qp->N.val[k];
    }
}

void peer_not_installed(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file)
{
    (void)ctx, (void)method, (void)tolerance, (void)file;
    peer_fail(answer, "not installed");
}

int peer_main(int argc, char **argv, peer_method solve)
{
    uz_qp qp = {0};
    int status = argc == 2 && peers_read_problem(&qp, argv[1]) ? peer_serve(&qp, solve, &qp) : 2;
    uz_qp_clear(&qp);
    return status;
}
