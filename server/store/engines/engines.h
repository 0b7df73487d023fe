/* engines.h: opening, checking and copying a store by its address: which engine it is of. */
#ifndef SERVER_STORE_ENGINES_ENGINES_H
#define SERVER_STORE_ENGINES_ENGINES_H

#include "store/engine.h"

/* Every engine, the last one NULL. */
extern const store_engine *const STORE_ENGINES[];

/* The engine whose scheme the address has. */
const store_engine *store_engine_of(const char *address);

/* Opens or creates the store. NULL on failure with the reason in message[0..size). Refuses, with a clear message, what
 * is not its own or has a newer format. */
store *store_open(const char *address, char *message, size_t size);

/* store_check of a store that may be open elsewhere; false where it can't be read at all, with the reason and a remedy
 * in message. Changes nothing. */
bool store_check_file(const char *address, store_findings *out, char *message, size_t size);

/* Copies the store as it is at one moment to a new file. The copy appears under its name only when it is complete and
 * on disk. *bytes (may be NULL) is its size. False with the reason in message. */
bool store_backup_file(const char *address, const char *to, int64_t *bytes, char *message, size_t size);

#endif
