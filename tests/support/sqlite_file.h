/* sqlite_file.h: for tests, the database file of a store, read and changed past the store. */
#ifndef TESTS_SQLITE_FILE_H
#define TESTS_SQLITE_FILE_H

#include "harness.h"
#include "store/sqlite/internal.h"

#include <sqlite3.h>
#include <stdint.h>

static inline int64_t rows_in(const char *path, const char *table)
{
    char sql[256];
    sqlite3 *db = NULL;
    sqlite3_stmt *stmt = NULL;
    int64_t count = -1;
    snprintf(sql, sizeof sql, "SELECT count(*) FROM %s", table);
    if (sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL) == SQLITE_OK &&
        sqlite3_prepare_v2(db, sql, -1, &stmt, NULL) == SQLITE_OK && sqlite3_step(stmt) == SQLITE_ROW)
        count = sqlite3_column_int64(stmt, 0);
    sqlite3_finalize(stmt);
    sqlite3_close(db);
    return count;
}

static inline void change_file(const char *path, const char *sql)
{
    sqlite3 *db = NULL;
    CHECK_INT(sqlite3_open(path, &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10000); /* a worker may be writing */
    CHECK_INT(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
}

/* The largest size of an open database file (never less than it has), without its journal; 0: no limit. More is
 * STORE_FULL, as a full disk is. */
static inline void limit_bytes(store *s, int64_t bytes)
{
    char sql[96];
    /* 2^32 - 2 pages of 4096 bytes is SQLite's own limit; 0 would ask for the limit instead of setting it. */
    const long long pages = bytes <= 0 ? 4294967294LL : bytes < 4096 ? 1 : (long long)(bytes / 4096);
    snprintf(sql, sizeof sql, "PRAGMA max_page_count = %lld", pages);
    pthread_mutex_lock(&sqlite_of(s)->writer_lock);
    CHECK_INT(sqlite3_exec(sqlite_of(s)->writer.db, sql, NULL, NULL, NULL), SQLITE_OK);
    pthread_mutex_unlock(&sqlite_of(s)->writer_lock);
}

#endif
