/* log.c: when the write-ahead log is moved into the file.
 *
 * SQLite would do it within the COMMIT that makes the log long, with two syncs: whoever waits for a large result waits
 * for its bytes to be written twice. Here a connection of its own moves a long log, in the thread that tidies up, while
 * the writer goes on behind it; the next change after all was moved begins the log anew. Where changes come so thick
 * that there is none in between, the writer does it, as SQLite would. LONG pages are some that the many small jobs
 * share: what they change is written into the file once for many.
 * Source: SQLite documentation, "Write-Ahead Logging" and sqlite3_wal_checkpoint_v2. */
#include "store/sqlite/internal.h"

enum { LONG = 4000, TOO_LONG = 8000 }; /* pages */

/* A failure may be one of syncing the log, after which a sync's word counts for nothing (sync.c). */
static int move(sqlite_store *s, sqlite3 *db, int how, int *pages, int *moved)
{
    pthread_mutex_lock(&s->move_lock); /* else SQLITE_BUSY, at once */
    const int rc = sqlite3_wal_checkpoint_v2(db, NULL, how, pages, moved);
    pthread_mutex_unlock(&s->move_lock);
    if (rc != SQLITE_OK && rc != SQLITE_BUSY)
        atomic_store(&s->log_suspect, true);
    return rc;
}

bool sqlite_move_log(sqlite_store *s)
{
    return move(s, s->writer.db, SQLITE_CHECKPOINT_TRUNCATE, NULL, NULL) == SQLITE_OK;
}

/* After each commit, by the writer. A log that was not too long before is left to the mover. */
static int note_pages(void *ctx, sqlite3 *db, const char *name, int pages)
{
    sqlite_store *s = ctx;
    const int before = atomic_exchange(&s->log_pages, pages);
    (void)name;
    if (before >= TOO_LONG && pages > before)
        move(s, db, SQLITE_CHECKPOINT_PASSIVE, NULL, NULL); /* the change is committed, however that ends */
    return SQLITE_OK;
}

store_status sqlite_tidy(store *base)
{
    sqlite_store *s = sqlite_of(base);
    int pages = atomic_load(&s->log_pages), all, moved;
    if (pages < LONG)
        return STORE_OK;
    const int rc = move(s, s->mover.db, SQLITE_CHECKPOINT_PASSIVE, &all, &moved);
    if (rc == SQLITE_OK && moved == all) /* and nothing was committed since: there is nothing to do */
        atomic_compare_exchange_strong(&s->log_pages, &pages, 0);
    return rc == SQLITE_OK ? STORE_OK : STORE_ERROR;
}

bool sqlite_log_begin(sqlite_store *s, char *message, size_t size)
{
    if (!connection_open(&s->mover, s->path, true, message, size))
        return false;
    sqlite3_wal_hook(s->writer.db, note_pages, s);
    return true;
}
