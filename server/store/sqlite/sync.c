/* sync.c: when a change is on disk.
 *
 * SQLite's COMMIT with synchronous = FULL writes the change into the log and waits for the disk while it holds the
 * writer: one change per turn of the disk. Here COMMIT only writes (synchronous = NORMAL: the log is synced before a
 * checkpoint, and by its checksums it is valid up to its last whole transaction, in order), and one thread syncs the
 * log, again and again while somebody wants it. All changes that were committed before a sync began are on disk when it
 * ends, so that any number of them share one turn, and the next ones are committed meanwhile.
 * Sources: SQLite documentation, "Write-Ahead Logging" and PRAGMA synchronous; Helland et al., "Group Commit Timers and
 * High Volume Transaction Systems", 1987. */
#include "store/sqlite/internal.h"

#include <string.h>

static void *sync_loop(void *argument)
{
    sqlite_store *s = argument;
    bool suspect = false;
    pthread_mutex_lock(&s->sync_lock);
    while (!s->sync_stop) {
        if (s->wanted <= s->synced || s->committed <= s->synced) {
            pthread_cond_wait(&s->sync_asked, &s->sync_lock);
            continue;
        }
        uint64_t upto = s->committed;
        memcpy(s->trail.taken.data, s->trail.waiting.data, s->trail.waiting.len);
        s->trail.taken.len = s->trail.waiting.len;
        s->trail.waiting.len = 0;
        pthread_mutex_unlock(&s->sync_lock);
        double begun = clock_seconds(CLOCK_MONOTONIC);
        /* xSync touches nothing of the log, which is open as long as the writer, but its descriptor. */
        suspect = suspect || atomic_exchange(&s->log_suspect, false) ||
                  s->log->pMethods->xSync(s->log, SQLITE_SYNC_NORMAL | SQLITE_SYNC_DATAONLY) != SQLITE_OK;
        if (suspect) {
            /* After a failed sync the kernel may take the log's pages for clean, and a second sync would succeed
             * without them. A checkpoint writes them once more, elsewhere, and syncs that; until one succeeds a sync's
             * word counts for nothing. */
            connection *c = &s->writer;
            pthread_mutex_lock(&s->writer_lock);
            suspect = !sqlite_move_log(s);
            if (suspect) {
                snprintf(c->message, sizeof c->message, "the log could not be synced, nor moved: %s",
                         sqlite3_errmsg(c->db));
                store_set_message(&s->base, c->message);
            }
            pthread_mutex_unlock(&s->writer_lock);
        }
        trail_append(&s->trail, !suspect);
        metrics_seconds(s->base.settings.metrics, METRIC_COMMIT, clock_seconds(CLOCK_MONOTONIC) - begun);
        pthread_mutex_lock(&s->sync_lock);
        if (!suspect) {
            s->synced = upto;
        } else { /* those who wait are told so; who asks later has it tried again */
            s->failures++;
            s->failed = upto;
            s->wanted = s->synced;
        }
        pthread_cond_broadcast(&s->sync_ended);
    }
    pthread_mutex_unlock(&s->sync_lock);
    return NULL;
}

bool sqlite_sync_begin(sqlite_store *s)
{
    s->sync_started = sqlite3_file_control(s->writer.db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &s->log) == SQLITE_OK &&
                      s->log && s->log->pMethods && pthread_create(&s->syncer, NULL, sync_loop, s) == 0;
    return s->sync_started;
}

void sqlite_sync_end(sqlite_store *s)
{
    if (!s->sync_started)
        return;
    pthread_mutex_lock(&s->sync_lock);
    s->sync_stop = true;
    pthread_cond_signal(&s->sync_asked);
    pthread_mutex_unlock(&s->sync_lock);
    pthread_join(s->syncer, NULL);
}

store_status sqlite_commit(sqlite_store *s, uint64_t *number)
{
    statement numbered = statement_begin(&s->writer, QUERY_NUMBER);
    bind_integer(&numbered, 1, (int64_t)++s->trail.number);
    const store_status noted = statement_run(&numbered);
    if (noted != STORE_OK)
        return noted;
    pthread_mutex_lock(&s->sync_lock);
    s->begun++;
    pthread_mutex_unlock(&s->sync_lock);
    statement st = statement_begin(&s->writer, QUERY_COMMIT);
    store_status status = statement_run(&st);
    pthread_mutex_lock(&s->sync_lock);
    *number = s->committed = s->begun;
    if (status == STORE_OK)
        trail_committed(&s->trail, s->trail.number);
    if (s->wanted > s->synced)
        pthread_cond_signal(&s->sync_asked);
    pthread_mutex_unlock(&s->sync_lock);
    return status;
}

store_status sqlite_sync(sqlite_store *s, uint64_t number, bool wait)
{
    pthread_mutex_lock(&s->sync_lock);
    const uint64_t failures = s->failures;
    while (s->synced < number && !s->sync_stop && (s->failures == failures || s->failed < number)) {
        if (number > s->wanted) {
            s->wanted = number;
            pthread_cond_signal(&s->sync_asked);
        }
        if (!wait)
            break;
        pthread_cond_wait(&s->sync_ended, &s->sync_lock);
    }
    const bool ok = !wait || s->synced >= number;
    pthread_mutex_unlock(&s->sync_lock);
    return ok ? STORE_OK : STORE_ERROR;
}

store_status sqlite_settle(sqlite_store *s)
{
    pthread_mutex_lock(&s->sync_lock);
    const uint64_t number = s->begun; /* readers see a commit a moment before its COMMIT returns */
    pthread_mutex_unlock(&s->sync_lock);
    return sqlite_sync(s, number, true);
}
