/* engine_base.h: what every store is made of, whatever its engine. */
#ifndef SERVER_STORE_ENGINE_BASE_H
#define SERVER_STORE_ENGINE_BASE_H

#include "base/clock.h"
#include "store/engine.h"

#include <pthread.h>

/* What every store begins with; an engine's own struct has it as its first member. */
struct store {
    const store_engine *engine;
    store_settings settings;
    pthread_rwlock_t listener_lock; /* the next two; shared while the listener runs */
    store_listener *listener;       /* may be NULL */
    void *listener_ctx;
    store_uploads *uploads;
    age_clock ages; /* of who retains and collects */
    char *missing;  /* what was on disk once and was not any more at opening, in words; NULL: nothing that is known */
    pthread_mutex_t node_lock;    /* node; nothing is taken under it */
    store_node node;              /* of an engine of one process: this one */
    pthread_mutex_t message_lock; /* message; taken last */
    char message[256];
};

void store_base_begin(store *s, const store_engine *engine);
void store_base_end(store *s);
void store_set_message(store *s, const char *cause);
/* As a store_listener is told. */
void store_tell(store *s, const char *id, bool waits, const char *gone);

/* The next id of a job: 12 hex digits of milliseconds, 4 of a counter within them, 16 random. Under the engine's lock.
 * last_ms and sequence are those of the newest id, so that ids ascend when the clock does not. */
void store_next_id(uint64_t *last_ms, unsigned *sequence, char id[33]);

/* An idempotency key as engines keep it, the only one of the store: behind its client's name, where that has one. Keys
 * have printable characters only. */
typedef struct {
    char text[STORE_CLIENT + 260];
} kept_key;
kept_key store_kept_key(const store_request *request);

/* What a client has as many of as it may, in words; for STORE_QUOTA. */
typedef enum { QUOTA_WAITING, QUOTA_BYTES, QUOTA_SECONDS } quota;
void store_say_quota(char *message, size_t size, const char *client, quota what);

#endif
