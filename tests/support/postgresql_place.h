/* postgresql_place.h: for tests, a PostgreSQL server of the package (tests/postgresql.sh) on a socket in a temporary
 * folder, one for each test program, which ends with it; and databases there. */
#ifndef TESTS_POSTGRESQL_PLACE_H
#define TESTS_POSTGRESQL_PLACE_H

#include "harness.h"

#include <libpq-fe.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static struct {
    bool asked;
    pid_t server; /* 0: there is none */
    char folder[64];
    int databases;
} postgresql;

/* Runs a statement on a database there; *number (may be NULL) is the integer it yields. */
static inline bool postgresql_run(const char *database, const char *sql, int64_t *number)
{
    char address[160];
    snprintf(address, sizeof address, "host=%s user=postgres dbname=%s connect_timeout=5", postgresql.folder, database);
    PGconn *c = PQconnectdb(address);
    PGresult *r = PQstatus(c) == CONNECTION_OK ? PQexec(c, sql) : NULL;
    const bool good = PQresultStatus(r) == PGRES_COMMAND_OK || PQresultStatus(r) == PGRES_TUPLES_OK;
    if (good && number)
        *number = PQntuples(r) > 0 ? atoll(PQgetvalue(r, 0, 0)) : 0;
    PQclear(r);
    PQfinish(c);
    return good;
}

static inline void postgresql_end(void)
{
    char command[128];
    if (postgresql.server > 0) {
        kill(postgresql.server, SIGQUIT);
        waitpid(postgresql.server, NULL, 0);
    }
    snprintf(command, sizeof command, "rm -rf '%s'", postgresql.folder);
    if (system(command) != 0)
        printf("# %s is left behind\n", postgresql.folder);
}

/* Starts the server with its first use. */
static inline bool postgresql_there(void)
{
    if (postgresql.asked)
        return postgresql.server > 0;
    postgresql.asked = true;
    strcpy(postgresql.folder, "/tmp/test-postgresql-XXXXXX");
    if (!mkdtemp(postgresql.folder))
        return false;
    fflush(stdout);
    atexit(postgresql_end);
    const pid_t child = fork();
    if (child == 0) {
        char log[96];
        snprintf(log, sizeof log, "%s/log", postgresql.folder);
        if (!freopen(log, "w", stderr) || !freopen("/dev/null", "w", stdout))
            _exit(1);
        execl("tests/postgresql.sh", "postgresql.sh", postgresql.folder, "fsync=off", (char *)NULL);
        _exit(77);
    }
    for (int i = 0; i < 600; i++) {
        int status;
        if (postgresql_run("postgres", "SELECT 1", NULL)) {
            postgresql.server = child;
            return true;
        }
        if (waitpid(child, &status, WNOHANG) == child) {
            if (!WIFEXITED(status) || WEXITSTATUS(status) != 77)
                test_fail(__FILE__, __LINE__, "PostgreSQL did not start");
            return false;
        }
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
    }
    kill(child, SIGQUIT);
    return false;
}

/* The name of a new, empty database. */
static inline void postgresql_database(char name[32])
{
    char sql[96];
    snprintf(name, 32, "place%d", ++postgresql.databases);
    snprintf(sql, sizeof sql, "CREATE DATABASE %s TEMPLATE template0", name);
    CHECK(postgresql_run("postgres", sql, NULL));
}

static inline void postgresql_address(const char *name, char *out, size_t size)
{
    snprintf(out, size, "postgresql://postgres@/%s?host=%s", name, postgresql.folder);
}

#endif
