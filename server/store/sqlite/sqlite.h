/* sqlite.h: the engine that keeps jobs in an SQLite database file, and uploads in the folder FILE-uploads beside it.
 * One process at a time has the file: its lock proves that no owner of a running job is alive when it is opened. */
#ifndef SERVER_STORE_SQLITE_SQLITE_H
#define SERVER_STORE_SQLITE_SQLITE_H

#include "store/engine_base.h"

extern const store_engine STORE_SQLITE;

#endif
