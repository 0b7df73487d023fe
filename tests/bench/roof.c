/* roof.c: how much more two threads can do than one on this machine: arithmetic, and reads of so many bytes each, which
 * caches that they share, or memory, may give to one of them alone almost as fast. */
#include "bench/bench.h"

#include "core/clock.h"

#include <pthread.h>
#include <stdlib.h>

enum { MB = 1 << 20, STEPS = 20000, LANES = 8, TRIES = 5 };
static const int READS_MB[] = {0, 4, 16, 128}; /* 0: arithmetic */
enum { COUNT = sizeof READS_MB / sizeof READS_MB[0] };

#define LASTS_S 0.05

typedef struct {
    double *room; /* NULL: arithmetic */
    int64_t n;
    double end, passes, sink; /* end: by the clock */
} worker;

static double pass(const worker *w)
{
    double lane[LANES] = {0.0};
    for (int64_t j = 0; w->room && j < w->n; j += LANES)
        for (int k = 0; k < LANES; k++)
            lane[k] += w->room[j + k];
    for (int step = 0; !w->room && step < STEPS; step++)
        for (int k = 0; k < LANES; k++)
            lane[k] = 0.5 * lane[k] + (double)k;
    double sum = 0.0;
    for (int k = 0; k < LANES; k++)
        sum += lane[k];
    return sum;
}

static void *work(void *arg)
{
    worker *w = arg;
    const double begin = uz_seconds();
    double passes = 0.0, sink = 0.0, now = begin;
    for (; now < w->end; now = uz_seconds(), passes++)
        sink += pass(w);
    w->passes = passes / (now - begin);
    w->sink = sink;
    return NULL;
}

/* Passes a second by so many threads, the most of several tries: what others do on the machine only takes from it. */
static double passes_of(worker *workers, int threads)
{
    double most = 0.0;
    for (int try = 0; try < TRIES; try++) {
        pthread_t other;
        const double end = uz_seconds() + LASTS_S;
        for (int t = 0; t < threads; t++)
            workers[t].end = end;
        const bool two = threads > 1 && pthread_create(&other, NULL, work, &workers[1]) == 0;
        work(&workers[0]);
        if (two)
            pthread_join(other, NULL);
        const double all = workers[0].passes + (two ? workers[1].passes : 0.0);
        most = all > most ? all : most;
    }
    return most;
}

bool bench_roof(FILE *json)
{
    bool ok = true;
    fprintf(json, "\"roof\": [\n");
    for (int k = 0; ok && k < COUNT; k++) {
        worker workers[2] = {{.n = (int64_t)READS_MB[k] * MB / (int64_t)sizeof(double)}};
        workers[1].n = workers[0].n;
        for (int t = 0; t < 2 && workers[0].n > 0; t++) {
            ok = (workers[t].room = malloc((size_t)workers[t].n * sizeof(double))) && ok;
            for (int64_t j = 0; workers[t].room && j < workers[t].n; j++)
                workers[t].room[j] = 1.0;
        }
        const double ratio = ok ? passes_of(workers, 2) / passes_of(workers, 1) : 0.0;
        fprintf(json, "%s{\"read_mb\": %d, \"ratio\": %.3f}", k > 0 ? ",\n" : "", READS_MB[k], ratio);
        if (READS_MB[k] > 0)
            printf("two threads over one, reads of %3d MB each: %.2f\n", READS_MB[k], ratio);
        else
            printf("two threads over one, arithmetic: %.2f\n", ratio);
        free(workers[0].room);
        free(workers[1].room);
    }
    fprintf(json, "]\n");
    return ok;
}
