/* file_format.h: the format of the database file, and the rule for changing it. */
#ifndef SERVER_STORE_SQLITE_FILE_FORMAT_H
#define SERVER_STORE_SQLITE_FILE_FORMAT_H

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FILE_FORMAT_APPLICATION_ID 0x757a6177 /* "uzaw" */
#define FILE_FORMAT_VERSION        11         /* PRAGMA user_version */

/* Why the last read of the file failed, for the person who gave its path. Valid until the next call on db. */
const char *file_format_why_unreadable(sqlite3 *db);

/* True if the file is empty (*version 0) or ours in a version that this program reads; otherwise the reason in message.
 * Changes nothing, so that a file that belongs to another program stays as it was. */
bool file_format_check(sqlite3 *db, int *version, char *message, size_t size);

/* Takes a file that file_format_check has passed from `version` to the present one: all tables where it is 0, else the
 * missing steps. Each step is one transaction that also sets the version: a crash leaves the file as it was before the
 * step, and the next start goes on from there. On failure nothing of the failed step remains. */
bool file_format_upgrade(sqlite3 *db, int version, char *message, size_t size);

/* The single integer that `sql` yields; false on any error, and *value stays. */
bool file_format_integer(sqlite3 *db, const char *sql, int64_t *value);

#endif
