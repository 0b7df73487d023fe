/* sqlite.h: the engine that keeps jobs in an SQLite database file, and uploads in the folder FILE-uploads beside it.
 * One process at a time has the file: its lock proves that no owner of a running job is alive when it is opened. */
#ifndef SERVER_STORE_SQLITE_SQLITE_H
#define SERVER_STORE_SQLITE_SQLITE_H

#include "store/engine.h"

extern const store_engine STORE_SQLITE;

/* The largest size of the database file (never less than it has), without its journal; 0: no limit. More is STORE_FULL,
 * as a full disk is. Not kept in the file. */
store_status sqlite_limit_bytes(store *s, int64_t bytes);

#endif
