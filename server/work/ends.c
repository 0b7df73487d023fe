#include "work/ends.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* As many as end between an end and the look of who waits for it, with room to spare. */
#define ENDS_KEPT 64
#define TEXT_MOST ((size_t)32 << 10) /* bytes of a summary and of tags */

struct ends {
    pthread_mutex_t lock; /* what follows; taken last */
    size_t next;
    job kept[ENDS_KEPT]; /* a ring; id "": none */
};

ends *ends_new(void)
{
    ends *e = calloc(1, sizeof *e);
    if (e)
        pthread_mutex_init(&e->lock, NULL);
    return e;
}

void ends_free(ends *e)
{
    if (!e)
        return;
    for (size_t i = 0; i < ENDS_KEPT; i++)
        job_clear(&e->kept[i]);
    pthread_mutex_destroy(&e->lock);
    free(e);
}

/* With texts of its own; false: no memory, and *to is zero. */
static bool copy(job *to, const job *from, const char *summary)
{
    *to = *from;
    to->error = NULL;
    to->tags = strdup(from->tags);
    to->summary = strdup(summary);
    if (to->tags && to->summary)
        return true;
    job_clear(to);
    return false;
}

void ends_keep(ends *e, const job *claimed, const store_outcome *outcome, double finished)
{
    const char *summary = outcome->whole.summary;
    job ended, gone;
    if (outcome->status != JOB_SUCCESSFUL || finished <= 0.0 || !summary || !claimed->tags ||
        strlen(summary) > TEXT_MOST || strlen(claimed->tags) > TEXT_MOST || !copy(&ended, claimed, summary))
        return;
    ended.status = JOB_SUCCESSFUL;
    ended.progress = 100;
    ended.finished = finished;
    pthread_mutex_lock(&e->lock);
    gone = e->kept[e->next];
    e->kept[e->next] = ended;
    e->next = (e->next + 1) % ENDS_KEPT;
    pthread_mutex_unlock(&e->lock);
    job_clear(&gone);
}

bool ends_find(ends *e, const char *id, job *out)
{
    bool found = false;
    *out = (job){.progress = 0};
    pthread_mutex_lock(&e->lock);
    for (size_t i = 0; i < ENDS_KEPT && !found; i++)
        found = strcmp(e->kept[i].id, id) == 0 && copy(out, &e->kept[i], e->kept[i].summary);
    pthread_mutex_unlock(&e->lock);
    return found;
}
