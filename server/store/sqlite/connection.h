/* connection.h: one SQLite connection and the statements prepared on it. Used by one thread at a time. */
#ifndef SERVER_STORE_SQLITE_CONNECTION_H
#define SERVER_STORE_SQLITE_CONNECTION_H

#include "store/store.h"

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* STORE_PRIORITY_SHARED as it stands in the queries and the indexes that they use. */
#define SHARED "5"
_Static_assert(STORE_PRIORITY_SHARED == 5, "SHARED is the same number");

typedef enum {
    QUERY_BEGIN,
    QUERY_COMMIT,
    QUERY_ROLLBACK,
    QUERY_SAVEPOINT,
    QUERY_RELEASE_SAVEPOINT,
    QUERY_ROLLBACK_TO,
    QUERY_NEWEST_ID,
    QUERY_FIND_KEY,
    QUERY_INSERT_JOB,
    QUERY_INSERT_REQUEST,
    QUERY_INSERT_TAGS,
    QUERY_CLAIM,
    QUERY_CLAIM_SMALL,
    QUERY_BODY,
    QUERY_RENEW,
    QUERY_CHARGE,
    QUERY_FINISH,
    QUERY_INSERT_ANSWER,
    QUERY_INSERT_PIECE,
    QUERY_INSERT_VECTOR,
    QUERY_INSERT_HISTORY,
    QUERY_RELEASE,
    QUERY_RECOVER_FAIL,
    QUERY_RECOVER_REQUEUE,
    QUERY_DISMISS_RUNNING,
    QUERY_END_DISMISSED,
    QUERY_DISMISS,
    QUERY_DELETE,
    QUERY_JOB,
    QUERY_LIST,
    QUERY_LIST_STATUS,
    QUERY_LIST_TAG,
    QUERY_LIST_TAG_STATUS,
    QUERY_OLDEST, /* the same four, oldest first */
    QUERY_OLDEST_STATUS,
    QUERY_OLDEST_TAG,
    QUERY_OLDEST_TAG_STATUS,
    QUERY_LIST_CLIENT,
    QUERY_OLDEST_CLIENT,
    QUERY_WAITING,
    QUERY_CLIENT,
    QUERY_INSERT_WEBHOOK,
    QUERY_WEBHOOK_NEXT,
    QUERY_WEBHOOK_ATTEMPTED,
    QUERY_WEBHOOK_POSTPONE,
    QUERY_WEBHOOKS_OPEN,
    QUERY_ANY_EXPIRED,
    QUERY_EXPIRE,
    QUERY_ADD_CONTENTS,
    QUERY_CONTENTS,
    QUERY_ENDED,
    QUERY_OLD_JOBS,
    QUERY_VECTOR,
    QUERY_COUNT_VECTORS,
    QUERY_ANSWERS,
    QUERY_HISTORY,
    QUERY_COUNTS,
    QUERY_NUMBER,
    QUERY_COUNT_ONE_MORE,
    QUERY_COUNT_ONE_LESS,
    QUERY_UPLOAD,
    QUERY_INSERT_UPLOAD,
    QUERY_TOUCH_UPLOAD,
    QUERY_USE_UPLOAD,
    QUERY_UPLOAD_NAMED,
    QUERY_OWN_UPLOAD,
    QUERY_DISOWN_UPLOAD,
    QUERY_DELETE_UPLOAD,
    QUERY_IDLE_UPLOAD,
    QUERY_UPLOAD_BYTES,
    QUERY_COUNT
} query_id;

typedef struct {
    sqlite3 *db;
    sqlite3_stmt *statements[QUERY_COUNT]; /* prepared when first used */
    char message[256];                     /* cause of the last failure that statement_status saw */
} connection;

/* The writer sets WAL, full synchronisation and the limit of the journal; a reader cannot write. */
bool connection_open(connection *c, const char *path, bool writer, char *message, size_t size);
void connection_close(connection *c);

/* A statement in use. The first failure of its calls is kept in rc and makes the later ones do nothing, so that only
 * the end needs a look: bind..., step..., statement_end. Bound memory must live until statement_end. */
typedef struct {
    connection *c;
    sqlite3_stmt *stmt;
    int rc;
    int cause; /* errno after the step that failed */
} statement;

statement statement_begin(connection *c, query_id q);
void bind_integer(statement *st, int at, int64_t value);
void bind_real(statement *st, int at, double value);
void bind_text(statement *st, int at, const char *text); /* NULL binds NULL */
void bind_blob(statement *st, int at, const void *data, size_t size);
bool statement_row(statement *st); /* true while there is a row; then columns may be read */
/* Ends it: `status`, what the rows said, unless the statement failed: then STORE_FULL, STORE_LOCKED or STORE_ERROR, and
 * the cause in c->message. */
store_status statement_end(statement *st, store_status status);
/* Steps a statement that yields nothing and ends it. */
store_status statement_run(statement *st);

#endif
