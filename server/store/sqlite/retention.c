/* retention.c: jobs that waited too long, and ended ones that were kept long enough. */
#include "store/sqlite/internal.h"

#include <stdio.h>
#include <stdlib.h>

/* Jobs, and bytes of theirs, that go in one transaction: others wait for its end. */
#define MOST_AT_ONCE  20
#define BYTES_AT_ONCE ((int64_t)64 << 20)

typedef struct {
    const char *error_json;
    int64_t count;
    char (*ids)[33]; /* n_ids of them, which expired; where there is no memory fewer */
    size_t n_ids, capacity;
} expire_args;

static store_status expire(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    expire_args *a = args;
    statement st = statement_begin(c, QUERY_EXPIRE);
    bind_real(&st, 1, clock_seconds(CLOCK_REALTIME));
    bind_text(&st, 2, a->error_json);
    a->count = 0;
    a->n_ids = 0;
    for (; statement_row(&st); a->count++) {
        if (a->n_ids == a->capacity) {
            size_t capacity = a->capacity ? 2 * a->capacity : 64;
            char(*grown)[33] = realloc(a->ids, capacity * sizeof *grown);
            if (!grown) /* nobody is told of this one; who looks sees it all the same */
                continue;
            a->ids = grown;
            a->capacity = capacity;
        }
        snprintf(a->ids[a->n_ids++], sizeof *a->ids, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
    }
    return statement_end(&st, STORE_OK);
}

store_status sqlite_expire(store *base, const char *error_json, int64_t *count)
{
    sqlite_store *s = sqlite_of(base);
    expire_args a = {.error_json = error_json};
    connection *c = sqlite_take_reader(s);
    /* Looks before it writes: most of the time there is nothing. */
    statement st = statement_begin(c, QUERY_ANY_EXPIRED);
    bind_real(&st, 1, clock_seconds(CLOCK_REALTIME));
    bool any = statement_row(&st);
    sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
    store_status status = any ? sqlite_write(s, WRITE_DURABLE, expire, &a) : STORE_OK;
    *count = status == STORE_OK ? a.count : 0;
    for (size_t i = 0; status == STORE_OK && i < a.n_ids; i++)
        store_tell(base, a.ids[i], false, NULL);
    free(a.ids);
    return status;
}

/* ---- retention */

typedef struct {
    char ids[MOST_AT_ONCE][33], clients[MOST_AT_ONCE][STORE_CLIENT];
    int n_ids;
    int64_t count;
} retain_args;

static store_status delete_chosen(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    retain_args *a = args;
    store_status status = STORE_OK;
    a->count = 0;
    for (int i = 0; i < a->n_ids && status == STORE_OK; i++) {
        statement st = statement_begin(c, QUERY_DELETE);
        bind_text(&st, 1, a->ids[i]);
        status = statement_run(&st);
        a->count += status == STORE_OK ? sqlite3_changes64(c->db) : 0;
    }
    return status;
}

store_status sqlite_retain(store *base, const store_retention *limits, double now, int64_t *count)
{
    sqlite_store *s = sqlite_of(base);
    retain_args a = {.n_ids = 0};
    int64_t jobs = 0, bytes = 0, chosen_bytes = 0; /* the first two: ended, as they stand */
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_ENDED);
    if (statement_row(&st)) {
        jobs = sqlite3_column_int64(st.stmt, 0);
        bytes = sqlite3_column_int64(st.stmt, 1);
    }
    store_status status = statement_end(&st, STORE_OK);
    if (status == STORE_OK) { /* the oldest ones that must go */
        st = statement_begin(c, QUERY_OLD_JOBS);
        bind_integer(&st, 1, MOST_AT_ONCE);
        while (a.n_ids < MOST_AT_ONCE && chosen_bytes < BYTES_AT_ONCE && statement_row(&st) &&
               ((limits->keep_s > 0 && sqlite3_column_double(st.stmt, 1) < now - limits->keep_s) ||
                (limits->keep_jobs > 0 && jobs > limits->keep_jobs) ||
                (limits->keep_bytes > 0 && bytes > limits->keep_bytes))) {
            const char *client = (const char *)sqlite3_column_text(st.stmt, 3);
            snprintf(a.clients[a.n_ids], sizeof a.clients[0], "%s", client ? client : "");
            snprintf(a.ids[a.n_ids++], sizeof a.ids[0], "%s", (const char *)sqlite3_column_text(st.stmt, 0));
            jobs--;
            bytes -= sqlite3_column_int64(st.stmt, 2);
            chosen_bytes += sqlite3_column_int64(st.stmt, 2);
        }
        status = statement_end(&st, STORE_OK);
    }
    status = sqlite_give_reader(s, c, status);
    if (status == STORE_OK && a.n_ids > 0) /* an ended job does not change any more: it may only be gone already */
        status = sqlite_write(s, WRITE_FREES, delete_chosen, &a);
    *count = status == STORE_OK ? a.count : 0;
    for (int i = 0; status == STORE_OK && i < a.n_ids; i++)
        store_tell(base, a.ids[i], false, a.clients[i]);
    return status;
}
