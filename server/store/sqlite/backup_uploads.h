/* backup_uploads.h: the files of uploads that belong to a copy of the database. */
#ifndef SERVER_STORE_SQLITE_BACKUP_UPLOADS_H
#define SERVER_STORE_SQLITE_BACKUP_UPLOADS_H

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>

/* Puts the files of all uploads that have a row in db from beside the database `from` to beside
 * the one that will be named `to` (their folders are FILE-uploads): as hard links, which cost nothing, since no upload
 * is ever changed; as copies where the file system has no links. What is there already stays. On disk before this
 * returns. False: message.
 *
 * First for the original, with db == original, whose uploads may go at any moment; then, once the pages are copied, for
 * the copy: a row whose upload went from the original meanwhile goes too, unless a job of the copy refers to it. */
bool backup_uploads(sqlite3 *db, sqlite3 *original, const char *from, const char *to, char *message, size_t size);
/* True if the upload has a row in db at this moment. */
bool backup_has_upload(sqlite3 *db, const char *id);
/* Takes the folder beside `to` away again. */
void backup_uploads_undo(const char *to);

#endif
