/* write.c: changes as transactions.
 *
 * Changes that wait together (store/batch.h) are one transaction, each in a savepoint of its own, so that one that
 * fails takes nothing with it. What many changes touch alike (the ends of tables and indexes) is so written once for
 * all. What they wait for next is the disk: sync.c. */
#include "store/sqlite/internal.h"

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

typedef struct {
    batch_change base;
    store_change change;
    void *args;
    bool frees; /* WRITE_FREES */
    store_status status;
    uint64_t number; /* of its commit */
} pending;

static pending *next_of(const pending *p)
{
    return (pending *)p->base.next;
}

static store_status run_query(connection *c, query_id q)
{
    statement st = statement_begin(c, q);
    return statement_run(&st);
}

/* Ends what is left of a transaction; the message stays the cause. */
static void roll_back(connection *c)
{
    char cause[sizeof c->message];
    if (sqlite3_get_autocommit(c->db)) /* a full disk may have rolled back already */
        return;
    memcpy(cause, c->message, sizeof cause);
    run_query(c, QUERY_ROLLBACK);
    memcpy(c->message, cause, sizeof cause);
}

/* The change could not be made, whatever it is. */
static bool is_failure(store_status status)
{
    return status == STORE_ERROR || status == STORE_FULL || status == STORE_LOCKED;
}

/* What a deletion writes: the pages that held the rows' keys, those that list the free ones (one for a thousand), and
 * all of it once more when the journal is moved. */
#define SPARE_BYTES ((off_t)4 << 20)
/* What of it a start may have, as SQLite opens no file without room for its log beside it. */
#define LENT_BYTES ((off_t)1 << 19)

bool sqlite_is_full(int fd)
{
    struct statvfs disk;
    return fstatvfs(fd, &disk) == 0 && (off_t)(disk.f_bavail * disk.f_frsize) < LENT_BYTES;
}

void sqlite_lend_spare(sqlite_store *s)
{
    struct stat st;
    const bool whole = s->spare >= 0 && fstat(s->spare, &st) == 0 && st.st_size == SPARE_BYTES;
    if (whole && sqlite_is_full(s->spare) && ftruncate(s->spare, SPARE_BYTES - LENT_BYTES) != 0)
        return; /* the start will say what it lacks */
}

void sqlite_take_spare(sqlite_store *s)
{
    struct stat st;
    if (s->spare >= 0 && !s->spare_there)
        s->spare_there = posix_fallocate(s->spare, 0, SPARE_BYTES) == 0 ||
                         (fstat(s->spare, &st) == 0 && st.st_size >= SPARE_BYTES - LENT_BYTES);
}

/* The change by itself; on a full disk once more when the journal is moved into the database, and where the change
 * makes room once more with what is kept for that. Then the disk has as much as before, and nobody else had it. */
static void run_alone(sqlite_store *s, pending *p)
{
    connection *c = &s->writer;
    bool given = false; /* the spare room */
    for (int tries = 0; tries < 2 + (p->frees && s->spare_there); tries++) {
        if (tries == 2)
            s->spare_there = !(given = ftruncate(s->spare, 0) == 0);
        if (tries > 0)
            sqlite_move_log(s);
        s->trail.noted.len = 0;
        p->status = run_query(c, QUERY_BEGIN);
        if (p->status == STORE_OK) {
            p->status = p->change(s, c, p->args);
            if (p->status == STORE_OK)
                p->status = sqlite_commit(s, &p->number);
            roll_back(c);
        }
        if (p->status != STORE_FULL)
            break;
    }
    if (given)
        sqlite_move_log(s);
    sqlite_take_spare(s);
    if (is_failure(p->status) || p->status == STORE_QUOTA)
        store_set_message(&s->base, c->message);
}

/* False with nothing changed: each must then be tried alone, so that the failure is told to whom it belongs. */
static bool run_together(sqlite_store *s, pending *list)
{
    connection *c = &s->writer;
    uint64_t number = 0;
    s->trail.noted.len = 0;
    bool good = run_query(c, QUERY_BEGIN) == STORE_OK;
    for (pending *p = list; p && good; p = next_of(p)) {
        good = run_query(c, QUERY_SAVEPOINT) == STORE_OK;
        if (!good)
            break;
        p->status = p->change(s, c, p->args);
        good = !is_failure(p->status) && !sqlite3_get_autocommit(c->db) && /* else the whole transaction can't go on */
               (p->status == STORE_OK || run_query(c, QUERY_ROLLBACK_TO) == STORE_OK) &&
               run_query(c, QUERY_RELEASE_SAVEPOINT) == STORE_OK;
    }
    good = good && sqlite_commit(s, &number) == STORE_OK;
    roll_back(c);
    for (pending *p = list; p && good; p = next_of(p))
        p->number = number;
    return good;
}

void sqlite_run_batch(void *ctx, batch_change *first)
{
    sqlite_store *s = ctx;
    pending *list = (pending *)first;
    int count = 0;
    bool locked = false; /* that was waited for once (busy_timeout): not again for each */
    pthread_mutex_lock(&s->writer_lock);
    if (!next_of(list) || !run_together(s, list))
        for (pending *p = list; p; p = next_of(p)) {
            if (locked)
                p->status = STORE_LOCKED;
            else
                run_alone(s, p);
            locked = p->status == STORE_LOCKED;
        }
    pthread_mutex_unlock(&s->writer_lock);
    for (pending *p = list; p; p = next_of(p))
        count += p->status == STORE_OK;
    metrics_add(s->base.settings.metrics, METRIC_CHANGES, count);
}

store_status sqlite_change(uint64_t *number, sqlite_store *s, bool frees, store_change change, void *args)
{
    pending me = {.change = change, .args = args, .frees = frees};
    batch_do(&s->changes, &me.base);
    *number = me.number;
    return me.status;
}

store_status sqlite_write(sqlite_store *s, write_durability durability, store_change change, void *args)
{
    uint64_t number;
    const store_status status = sqlite_change(&number, s, durability == WRITE_FREES, change, args);
    if (status != STORE_OK || durability == WRITE_LAZY)
        return status;
    return sqlite_sync(s, number, durability != WRITE_SOON);
}

/* There and back: a row that is given the value that it has is not written (SQLite, btreeOverwriteContent). */
static store_status write_nothing(sqlite_store *s, connection *c, void *args)
{
    (void)args;
    store_status status = sqlite_check_place(s, c);
    if (status == STORE_OK)
        status = run_query(c, QUERY_COUNT_ONE_MORE);
    return status == STORE_OK ? run_query(c, QUERY_COUNT_ONE_LESS) : status;
}

store_status sqlite_try_write(store *base)
{
    return sqlite_write(sqlite_of(base), WRITE_DURABLE, write_nothing, NULL);
}
