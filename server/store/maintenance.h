/* maintenance.h: looking after a database file, also while a daemon uses it: what is here only reads it. */
#ifndef SERVER_STORE_MAINTENANCE_H
#define SERVER_STORE_MAINTENANCE_H

#include "store/store.h"

/* What a check found. */
typedef struct {
    char *findings; /* one a line; "" when the file is whole; freed by the caller, NULL on failure */
    int64_t jobs;   /* in the file */
    double seconds;
} store_findings;

/* Looks at every page, every index and every reference; on its own reader, while others go on. */
store_status store_check(store *s, store_findings *out);

/* The same of a file; false where it can't be read at all, with the reason and a remedy in message. */
bool store_check_file(const char *path, store_findings *out, char *message, size_t size);

/* Copies the file as it is at one moment to a new file. The files of uploads go
 * to the folder TO-uploads. The copy appears under its name only when it is complete and on
 * disk. *bytes (may be NULL) is its size. False with the reason in message. */
bool store_backup_file(const char *path, const char *to, int64_t *bytes, char *message, size_t size);

#endif
