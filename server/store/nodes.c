/* nodes.c: the nodes of a store; where its engine is of one process, that is this one. */
#include "store/nodes.h"
#include "store/engine_base.h"

#include <stdlib.h>
#include <string.h>

bool store_is_shared(const store *s)
{
    return s->engine->nodes != NULL;
}

store_status store_report(store *s, const store_node *now, bool *draining)
{
    *draining = false;
    if (s->engine->nodes)
        return s->engine->nodes->report(s, now, draining);
    pthread_mutex_lock(&s->node_lock);
    const double begun = s->node.begun, seen = clock_seconds(CLOCK_REALTIME);
    const bool drains = s->node.draining;
    s->node = *now;
    s->node.begun = begun > 0.0 ? begun : seen;
    s->node.seen = seen;
    s->node.alive = true;
    s->node.draining = *draining = drains;
    s->node.bodies = NULL;
    s->node.n_bodies = 0;
    pthread_mutex_unlock(&s->node_lock);
    return STORE_OK;
}

void store_nodes_free(store_node *nodes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(nodes[i].bodies);
    free(nodes);
}

store_status store_nodes(store *s, store_node **nodes, size_t *count)
{
    int64_t counts[STORE_COUNTS];
    *nodes = NULL;
    *count = 0;
    if (s->engine->nodes)
        return s->engine->nodes->list(s, nodes, count);
    const store_status status = store_counts(s, counts);
    if (status != STORE_OK)
        return status;
    *nodes = malloc(sizeof **nodes);
    if (!*nodes) {
        store_set_message(s, "no memory for the nodes");
        return STORE_ERROR;
    }
    pthread_mutex_lock(&s->node_lock);
    **nodes = s->node;
    pthread_mutex_unlock(&s->node_lock);
    (*nodes)->running = counts[JOB_RUNNING];
    *count = 1;
    return STORE_OK;
}

store_status store_drain(store *s, const char *name, bool drain)
{
    if (s->engine->nodes)
        return s->engine->nodes->drain(s, name, drain);
    pthread_mutex_lock(&s->node_lock);
    const bool ours = strcmp(s->node.name, name) == 0;
    if (ours)
        s->node.draining = drain;
    pthread_mutex_unlock(&s->node_lock);
    if (ours)
        store_tell(s, NULL, false, NULL); /* workers look again */
    return ours ? STORE_OK : STORE_NOT_FOUND;
}

store_status store_forget_bodies(store *s, const uint64_t *bodies, size_t n)
{
    return s->engine->nodes && n > 0 ? s->engine->nodes->forget(s, bodies, n) : STORE_OK;
}

store_status store_exchange_rates(store *s, store_rate *rates, size_t n)
{
    for (size_t i = 0; i < n; i++)
        rates[i].total = 0;
    return s->engine->nodes && n > 0 ? s->engine->nodes->rates(s, rates, n) : STORE_OK;
}
