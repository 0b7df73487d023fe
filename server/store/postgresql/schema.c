#include "store/postgresql/schema.h"
#include "base/clock.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

/* The steps as they stand in their files. */
__asm__(".section .rodata\nschema_1: .incbin \"server/store/postgresql/schema_1.sql\"\n.byte 0\n"
        "schema_2: .incbin \"server/store/postgresql/schema_2.sql\"\n.byte 0\n"
        "schema_3: .incbin \"server/store/postgresql/schema_3.sql\"\n.byte 0\n"
        "schema_4: .incbin \"server/store/postgresql/schema_4.sql\"\n.byte 0\n"
        "schema_5: .incbin \"server/store/postgresql/schema_5.sql\"\n.byte 0\n"
        "schema_6: .incbin \"server/store/postgresql/schema_6.sql\"\n.byte 0\n.text");
extern const char schema_1[], schema_2[], schema_3[], schema_4[], schema_5[], schema_6[];
static const char *const STEPS[SCHEMA_VERSION + 1] = {NULL, schema_1, schema_2, schema_3, schema_4, schema_5, schema_6};

/* A database of another encoding could not keep every text. */
#define LEAST_SERVER 150000

#define PATIENCE_S 60.0 /* for those who use a table that is to be changed */

static int refuse(link_to *l, const char *cause)
{
    snprintf(l->message, sizeof l->message, "%s", cause);
    return -1;
}

int schema_version(link_to *l)
{
    if (PQserverVersion(l->pg) < LEAST_SERVER)
        return refuse(l, "the server is older than PostgreSQL 15: give a database of a newer one");
    link_begin(l, LINK_READ);
    link_send(l, &(call){.sql = "SELECT current_setting('server_encoding'), to_regnamespace('uzawa') IS NOT NULL,"
                                " CASE WHEN has_schema_privilege(to_regnamespace('uzawa')::oid, 'USAGE')"
                                " THEN to_regclass('uzawa.format') IS NOT NULL ELSE false END"});
    if (link_end(l) != STORE_OK)
        return -1;
    if (strcmp(PQgetvalue(l->answers[0], 0, 0), "UTF8") != 0)
        return refuse(l, "the database's encoding is not UTF8: make one with CREATE DATABASE ... ENCODING 'UTF8'");
    if (!cell_integer(l->answers[0], 0, 1))
        return 0;
    if (!cell_integer(l->answers[0], 0, 2))
        return refuse(l, "the schema \"uzawa\" of the database is another program's, or this role may not use it: give "
                         "another database, or GRANT USAGE");
    link_begin(l, LINK_READ);
    link_send(l, &(call){.sql = "SELECT max(version) FROM uzawa.format"});
    if (link_end(l) != STORE_OK)
        return -1;
    const int version = (int)cell_integer(l->answers[0], 0, 0);
    return version >= 1 && version <= SCHEMA_VERSION + 1
               ? version
               : refuse(l, "the database has a version that this program does not know: take a newer program");
}

/* Under a lock of their own, in one transaction: another daemon may have made them meanwhile. A step changes tables
 * that others use. Who waits for such a lock lets nobody else in: so it waits for a moment only, and then lets them all
 * pass before it tries again. *passing: it was that. */
static bool take_steps(link_to *l, bool *passing)
{
    bool good = link_script(l, "BEGIN; SET LOCAL lock_timeout = '60s'; SELECT pg_advisory_xact_lock(1970954615, 1);"
                               "SET LOCAL lock_timeout = '500ms'") == STORE_OK;
    int version = good ? schema_version(l) : -1;
    *passing = false;
    for (good = version >= 0; good && version < SCHEMA_VERSION; version++) {
        good = link_script(l, STEPS[version + 1]) == STORE_OK;
        *passing = !good && l->status == STORE_LOCKED;
    }
    return good && link_script(l, "COMMIT") == STORE_OK;
}

bool schema_bring(link_to *l)
{
    const int version = schema_version(l);
    const double until = clock_seconds(CLOCK_MONOTONIC) + PATIENCE_S;
    char cause[LINK_CAUSE];
    bool passing = true;
    if (version < 0 || version >= SCHEMA_VERSION)
        return version >= 0;
    while (passing) {
        if (take_steps(l, &passing))
            return true;
        snprintf(cause, sizeof cause, "cannot make the tables: %.200s", l->message);
        link_script(l, "ROLLBACK");
        passing = passing && clock_seconds(CLOCK_MONOTONIC) < until;
        nanosleep(&(struct timespec){.tv_nsec = 300000000}, NULL);
    }
    refuse(l, cause);
    return false;
}
