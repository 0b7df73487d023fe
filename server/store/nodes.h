/* nodes.h: the daemons that share a store, what they hold, and what they tell each other through it. With an engine of
 * one process there is one, and nothing is kept. */
#ifndef SERVER_STORE_NODES_H
#define SERVER_STORE_NODES_H

#include "store/store.h"

enum { STORE_NODE = 64 };

/* A daemon as it was when it said so last. */
typedef struct {
    char name[STORE_NODE]; /* --node */
    char host[65], version[16];
    int pid;
    double begun, seen; /* Unix seconds by the store's clock: of its start, and when it was heard of last */
    bool alive;         /* that is not long ago */
    bool draining;      /* it claims nothing */
    int workers, busy;  /* workers, and those of them with a job */
    int64_t running;    /* jobs that are its own now */
    int64_t factors, bytes, max_bytes; /* of its caches */
    uint64_t *bodies;                  /* n_bodies, ascending: whose factor it has, or makes now */
    size_t n_bodies;
} store_node;

/* How this daemon is: name, host, version, pid, workers, busy, factors, bytes, max_bytes. *draining: it shall claim
 * nothing, and is answered nothing by store_claim. */
store_status store_report(store *s, const store_node *now, bool *draining);
/* By name; the caller frees with store_nodes_free. */
store_status store_nodes(store *s, store_node **nodes, size_t *count);
void store_nodes_free(store_node *nodes, size_t count);
/* Those alive with this name claim nothing any more, or go on claiming; STORE_NOT_FOUND: there is none. */
store_status store_drain(store *s, const char *name, bool drain);

/* ---- bodies. A job may say what stands for its body (store_request.held_body); what a daemon claims it has from then
 * on, until it says that it has not. */

/* Is it of use to say so: do several daemons share the store? */
bool store_is_shared(const store *s);
/* This daemon has these no more. */
store_status store_forget_bodies(store *s, const uint64_t *bodies, size_t n);

/* ---- rates: how much each client has asked of all daemons together */
typedef struct {
    char client[STORE_CLIENT];
    int64_t used;  /* here, since the last exchange */
    int64_t total; /* out: of all */
} store_rate;
/* Adds what was used and sets the totals; with an engine of one process they stay 0. */
store_status store_exchange_rates(store *s, store_rate *rates, size_t n);

/* ---- for who writes an engine of several daemons: the same operations */
typedef struct {
    store_status (*report)(store *s, const store_node *now, bool *draining);
    store_status (*list)(store *s, store_node **nodes, size_t *count);
    store_status (*drain)(store *s, const char *name, bool drain);
    store_status (*forget)(store *s, const uint64_t *bodies, size_t n); /* n > 0 */
    store_status (*rates)(store *s, store_rate *rates, size_t n);       /* n > 0 */
} store_engine_nodes;

#endif
