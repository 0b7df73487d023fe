#include "store/engines/engines.h"
#include "store/postgresql/postgresql.h"
#include "store/sqlite/sqlite.h"

#include <stdio.h>
#include <string.h>

/* A new engine is one more row here, before the one that takes every address. */
const store_engine *const STORE_ENGINES[] = {&STORE_POSTGRESQL, &STORE_SQLITE, NULL};

const store_engine *store_engine_of(const char *address)
{
    size_t i = 0;
    while (strncmp(address, STORE_ENGINES[i]->scheme, strlen(STORE_ENGINES[i]->scheme)) != 0)
        i++;
    return STORE_ENGINES[i];
}

store *store_open(const char *address, char *message, size_t size)
{
    char why[300] = "";
    const store_engine *engine = store_engine_of(address);
    store *s = engine->open(address, why, sizeof why);
    if (!s) /* an address that is not the name of a file may have a secret in it */
        snprintf(message, size, "%s: %s", engine->scheme[0] ? "the database of --store" : address, why);
    return s;
}

bool store_check_file(const char *address, store_findings *out, char *message, size_t size)
{
    *out = (store_findings){.findings = NULL};
    return store_engine_of(address)->check_file(address, out, message, size);
}

bool store_backup_file(const char *address, const char *to, int64_t *bytes, char *message, size_t size)
{
    int64_t unused;
    return store_engine_of(address)->backup_file(address, to, bytes ? bytes : &unused, message, size);
}
