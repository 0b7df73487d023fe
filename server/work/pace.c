#include "work/pace.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

enum { KEPT = 15, FEWEST = 3 };
#define SHORTEST_S 0.05 /* below it what no model counts is as much */
#define MOST       4.0  /* beyond it the solves are of another kind than those of the model, and the next may not be */

struct pace {
    pthread_mutex_t lock; /* what follows; taken last */
    struct {
        double ratio[KEPT]; /* a ring */
        int count, next;
    } of[PACE_FORMS];
};

pace *pace_new(void)
{
    pace *p = calloc(1, sizeof *p);
    if (p)
        pthread_mutex_init(&p->lock, NULL);
    return p;
}

void pace_free(pace *p)
{
    if (!p)
        return;
    pthread_mutex_destroy(&p->lock);
    free(p);
}

void pace_add(pace *p, uz_operator op, double said, double took)
{
    if (!p || (int)op < 0 || (int)op >= PACE_FORMS || !(took >= SHORTEST_S) || !(said > 0.0) || isinf(took / said))
        return;
    pthread_mutex_lock(&p->lock);
    p->of[op].ratio[p->of[op].next] = took / said;
    p->of[op].next = (p->of[op].next + 1) % KEPT;
    p->of[op].count += p->of[op].count < KEPT;
    pthread_mutex_unlock(&p->lock);
}

static double median(const double *ratio, int count)
{
    double sorted[KEPT] = {0};
    for (int k = 0; k < count; k++) {
        int at = k;
        for (; at > 0 && sorted[at - 1] > ratio[k]; at--)
            sorted[at] = sorted[at - 1];
        sorted[at] = ratio[k];
    }
    return 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]);
}

void pace_now(pace *p, double factor[PACE_FORMS])
{
    for (int k = 0; k < PACE_FORMS; k++)
        factor[k] = 1.0;
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    for (int k = 0; k < PACE_FORMS; k++)
        if (p->of[k].count >= FEWEST)
            factor[k] = fmin(MOST, fmax(1.0 / MOST, median(p->of[k].ratio, p->of[k].count)));
    pthread_mutex_unlock(&p->lock);
}
