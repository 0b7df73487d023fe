#include "store/postgresql/connection.h"
#include "base/clock.h"

#include <endian.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A server that says nothing for so long is taken for lost; it ends what it was asked itself before (SETTINGS). */
#define SILENT_S 45.0

#define FLUSH_MOST ((size_t)64 << 10) /* bytes of a call that need not be on their way at once */

/* ---- opening */

bool link_address_fits(const char *address, char *message, size_t size)
{
    char *cause = NULL;
    bool secret = false;
    PQconninfoOption *options = PQconninfoParse(address, &cause);
    const bool read = options != NULL;
    for (PQconninfoOption *o = options; o && o->keyword; o++)
        secret = secret || (o->val && o->val[0] && strstr(o->keyword, "password"));
    if (!read)
        snprintf(message, size, "it is no address of a database: %.150s", cause ? cause : "no memory");
    else if (secret)
        snprintf(message, size, "a password does not belong into an address: give it in ~/.pgpass or PGPASSFILE");
    message[strcspn(message, "\n")] = '\0';
    PQconninfoFree(options);
    PQfreemem(cause);
    return read && !secret;
}

/* A pooler tells its clients process numbers of its own, and hands the connection on after each transaction. */
static bool find_out(link_to *l, link_kind kind)
{
    link_begin(l, kind == LINK_GLANCE ? LINK_GLANCE : LINK_READ);
    link_send(l, &(call){.sql = "SELECT pg_backend_pid()"});
    const bool good = link_end(l) == STORE_OK;
    l->direct = good && cell_integer(l->answers[0], 0, 0) == PQbackendPID(l->pg);
    return good;
}

bool link_open(link_to *l, const char *address, link_kind kind)
{
    /* Before what the address says: after so many seconds without a sign from the other machine it is gone. */
    static const char *const NAMES[] = {"connect_timeout",  "keepalives_idle",           "keepalives_interval",
                                        "keepalives_count", "tcp_user_timeout",          "dbname",
                                        "client_encoding",  "fallback_application_name", NULL};
    const char *const values[] = {"5", "15", "5", "3", "30000", address, "UTF8", "uzawad", NULL};
    link_close(l);
    l->pg = PQconnectdbParams(NAMES, values, 1);
    const bool begun =
        l->pg && PQstatus(l->pg) == CONNECTION_OK && PQsetnonblocking(l->pg, 1) == 0 && PQenterPipelineMode(l->pg) == 1;
    if (begun && find_out(l, kind))
        return true;
    char cause[LINK_CAUSE];
    snprintf(cause, sizeof cause, "%s", begun ? l->message : l->pg ? PQerrorMessage(l->pg) : "no memory");
    snprintf(l->message, sizeof l->message, "cannot reach the database: %.200s", cause);
    l->message[strcspn(l->message, "\n")] = '\0';
    PQfinish(l->pg);
    l->pg = NULL;
    return false;
}

static void forget_answers(link_to *l)
{
    for (size_t i = 0; i < l->n_answers; i++)
        PQclear(l->answers[i]);
    l->n_answers = l->sent = l->asked = l->heard = l->n_parsing = 0;
    l->settings = SIZE_MAX;
    l->status = STORE_OK;
    l->lost = l->silent = l->passing = false;
}

void link_close(link_to *l)
{
    forget_answers(l);
    free(l->answers);
    PQfinish(l->pg);
    *l = (link_to){.pg = NULL};
}

bool link_alive(link_to *l)
{
    struct pollfd p = {.events = POLLIN};
    if (!l->pg || l->lost || PQstatus(l->pg) != CONNECTION_OK)
        return false;
    p.fd = PQsocket(l->pg);
    /* Nothing is asked: what comes is a notice, or the end. */
    return poll(&p, 1, 0) == 0 || (PQconsumeInput(l->pg) && PQstatus(l->pg) == CONNECTION_OK);
}

/* ---- arguments */

static void add_argument(call *c, const char *value, size_t size, int format)
{
    if (c->n < CALL_ARGUMENTS) {
        c->values[c->n] = value;
        c->lengths[c->n] = (int)size;
        c->formats[c->n] = format;
    }
    c->n++;
}

void call_text(call *c, const char *text)
{
    add_argument(c, text, 0, 0);
}

void call_integer(call *c, int64_t value)
{
    if (c->n < CALL_ARGUMENTS)
        snprintf(c->numbers[c->n], sizeof c->numbers[0], "%lld", (long long)value);
    add_argument(c, c->numbers[c->n < CALL_ARGUMENTS ? c->n : 0], 0, 0);
}

void call_real(call *c, double value)
{
    if (c->n < CALL_ARGUMENTS)
        snprintf(c->numbers[c->n], sizeof c->numbers[0], "%.17g", value);
    add_argument(c, c->numbers[c->n < CALL_ARGUMENTS ? c->n : 0], 0, 0);
}

void call_bool(call *c, bool value)
{
    add_argument(c, value ? "t" : "f", 0, 0);
}

void call_bytes(call *c, const void *data, size_t size)
{
    add_argument(c, data ? data : "", data ? size : 0, 1);
}

/* ---- failures */

static void fail(link_to *l, store_status status, const char *cause)
{
    if (l->status != STORE_OK)
        return;
    l->status = status;
    snprintf(l->message, sizeof l->message, "%s", cause);
    l->message[strcspn(l->message, "\n")] = '\0';
}

static void lose(link_to *l, const char *cause)
{
    char text[LINK_CAUSE];
    snprintf(text, sizeof text, "the database was lost: %.200s", cause);
    l->lost = true;
    if (l->status != STORE_AWAY) /* whatever was wrong before, what was carried out is open now */
        l->status = STORE_OK;
    fail(l, STORE_AWAY, text);
}

/* Codes of PostgreSQL's manual, appendix A. */
static void fail_as_said(link_to *l, const PGresult *r)
{
    static const struct {
        const char *begin;
        store_status status;
    } CODES[] = {{"UZ001", STORE_CONFLICT},  {"UZ002", STORE_NOT_FOUND},
                 {"UZ003", STORE_AWAY},                               /* an object has to be written again */
                 {"23503", STORE_NOT_FOUND},                          /* what it belongs to is gone */
                 {"53100", STORE_FULL},      {"55P03", STORE_LOCKED}, /* lock_timeout */
                 {"57014", STORE_LOCKED},                             /* statement_timeout */
                 {"40", STORE_LOCKED}, /* a deadlock or a serialization failure, after what was tried again */
                 {"53", STORE_AWAY},   /* too many connections, out of memory */
                 {"57", STORE_AWAY},   /* the server shuts down or starts */
                 {"08", STORE_AWAY},         {"25006", STORE_AWAY}}; /* it only reads: a standby */
    const char *code = PQresultErrorField(r, PG_DIAG_SQLSTATE), *text = PQresultErrorField(r, PG_DIAG_MESSAGE_PRIMARY);
    char cause[LINK_CAUSE];
    store_status status = STORE_ERROR;
    /* libpq's own: the connection. Or there is no such statement, or another of that name, since somebody stands
     * between after all; or its tables have changed since it was parsed. */
    l->misled = l->misled || (code && (strcmp(code, "26000") == 0 || strcmp(code, "42P05") == 0));
    if (!code || l->misled || strcmp(code, "0A000") == 0) {
        lose(l, code ? text : PQresultErrorMessage(r));
        return;
    }
    for (size_t i = 0; i < sizeof CODES / sizeof CODES[0] && status == STORE_ERROR; i++)
        if (strncmp(code, CODES[i].begin, strlen(CODES[i].begin)) == 0)
            status = CODES[i].status;
    /* A key that another transaction has just brought is found when one looks again. */
    l->passing = l->status == STORE_OK && (strncmp(code, "40", 2) == 0 || strcmp(code, "23505") == 0);
    snprintf(cause, sizeof cause, "%.200s (PostgreSQL code %s)", text ? text : "", code);
    fail(l, status, cause);
}

/* ---- exchange */

/* Waits until something can be read, or also written, and reads it. */
static bool wait_for(link_to *l, bool write)
{
    const double until = clock_seconds(CLOCK_MONOTONIC) + l->patience_s;
    struct pollfd p = {.fd = PQsocket(l->pg), .events = (short)(POLLIN | (write ? POLLOUT : 0))};
    while (poll(&p, 1, 1000) <= 0)
        if (clock_seconds(CLOCK_MONOTONIC) > until) {
            l->silent = true;
            lose(l, "it does not answer");
            return false;
        }
    if (!(p.revents & (POLLIN | POLLERR | POLLHUP)) || PQconsumeInput(l->pg))
        return true;
    lose(l, PQerrorMessage(l->pg));
    return false;
}

static void flush(link_to *l)
{
    int left;
    while (!l->lost && (left = PQflush(l->pg)) != 0)
        if (left < 0)
            lose(l, PQerrorMessage(l->pg));
        else
            wait_for(l, true);
}

/* The next answer; NULL: the end of those of one call, or it is lost. */
static PGresult *next_answer(link_to *l)
{
    while (!l->lost && PQisBusy(l->pg))
        wait_for(l, false);
    return l->lost ? NULL : PQgetResult(l->pg);
}

/* The number of a statement that the server keeps, which has it parsed where it was not; -1: it is sent as it stands.
 */
static int statement_of(link_to *l, const call *c)
{
    char name[16];
    int free_one = -1;
    if (!l->direct || c->once)
        return -1;
    for (int i = 0; i < LINK_KEPT; i++) {
        if (l->kept[i] == c->sql)
            return i;
        if (!l->kept[i] && free_one < 0)
            free_one = i;
    }
    snprintf(name, sizeof name, "u%d", free_one);
    if (free_one < 0 || !PQsendPrepare(l->pg, name, c->sql, c->n, NULL))
        return -1;
    l->kept[free_one] = c->sql;
    l->parsing[l->n_parsing++] = (link_parsing){free_one, l->asked++};
    return free_one;
}

static bool send_one(link_to *l, const call *c)
{
    char name[16];
    if (l->lost)
        return false;
    const int kept = c->n <= CALL_ARGUMENTS ? statement_of(l, c) : -1;
    snprintf(name, sizeof name, "u%d", kept);
    const bool sent = c->n <= CALL_ARGUMENTS &&
                      (kept >= 0 ? PQsendQueryPrepared(l->pg, name, c->n, c->values, c->lengths, c->formats, 1)
                                 : PQsendQueryParams(l->pg, c->sql, c->n, NULL, c->values, c->lengths, c->formats, 1));
    if (!sent)
        lose(l, c->n > CALL_ARGUMENTS ? "a call has too many arguments" : PQerrorMessage(l->pg));
    l->asked++;
    return sent;
}

/* What holds for one transaction: a statement, and one that waits for a lock, ends before the caller gives up. A server
 * that was set up not to wait for its disk still has to. */
#define LIMITS                                                                                                         \
    "set_config('statement_timeout', '40s', true), set_config('lock_timeout', '5s', true),"                            \
    " set_config('idle_in_transaction_session_timeout', '30s', true)"
static const char *const SETTINGS[] = {
    [LINK_READ] = NULL,
    [LINK_GLANCE] = NULL,
    [LINK_DURABLE] = "SELECT " LIMITS ", CASE WHEN current_setting('synchronous_commit') = 'off'"
                     " THEN set_config('synchronous_commit', 'on', true) END",
    [LINK_LAZY] = "SELECT " LIMITS ", set_config('synchronous_commit', 'off', true)"};

void link_begin(link_to *l, link_kind kind)
{
    forget_answers(l);
    l->patience_s = kind == LINK_GLANCE ? LINK_GLANCE_S : SILENT_S;
    if (!l->pg) {
        l->status = STORE_AWAY; /* the message is link_open's */
        l->lost = true;
        return;
    }
    if (SETTINGS[kind] && send_one(l, &(call){.sql = SETTINGS[kind]}))
        l->settings = l->asked - 1;
}

/* Small calls go together when the transaction ends, or as libpq's buffer fills: each by itself would be a system call
 * here and a server that wakes for it. What a large call has does not stay in memory until then. */
void link_send(link_to *l, const call *c)
{
    size_t size = 0;
    for (int i = 0; i < c->n && i < CALL_ARGUMENTS; i++)
        size += (size_t)c->lengths[i];
    if (send_one(l, c) && size > FLUSH_MOST)
        flush(l);
    l->sent++;
}

static void keep_answer(link_to *l, PGresult *r)
{
    if (l->n_answers == l->room) {
        const size_t room = l->room ? 2 * l->room : 16;
        PGresult **grown = realloc(l->answers, room * sizeof(PGresult *));
        if (!grown) {
            PQclear(r);
            fail(l, STORE_ERROR, "no memory for the answers of the database");
            return;
        }
        l->answers = grown;
        l->room = room;
    }
    l->answers[l->n_answers++] = r;
}

/* One answer, in the order of what was asked. */
static void hear(link_to *l, PGresult *r)
{
    const ExecStatusType is = PQresultStatus(r);
    const bool good = is == PGRES_TUPLES_OK || is == PGRES_COMMAND_OK;
    const size_t number = l->heard++;
    bool ours = number == l->settings;
    for (size_t i = 0; i < l->n_parsing; i++)
        if (l->parsing[i].answer == number) {
            ours = true;
            if (!good)
                l->kept[l->parsing[i].kept] = NULL;
        }
    if (is == PGRES_FATAL_ERROR || is == PGRES_BAD_RESPONSE)
        fail_as_said(l, r);
    if (good && !ours)
        keep_answer(l, r);
    else
        PQclear(r);
}

store_status link_end(link_to *l)
{
    if (!l->lost && !PQpipelineSync(l->pg))
        lose(l, PQerrorMessage(l->pg));
    flush(l);
    for (bool ended = false; !ended && !l->lost;) {
        PGresult *r = next_answer(l); /* NULL: the next one is of another call */
        if (!r && !l->lost && PQstatus(l->pg) != CONNECTION_OK)
            lose(l, PQerrorMessage(l->pg));
        ended = r && PQresultStatus(r) == PGRES_PIPELINE_SYNC;
        if (r && !ended)
            hear(l, r);
        else
            PQclear(r);
    }
    if (l->status == STORE_OK && l->n_answers != l->sent)
        fail(l, STORE_ERROR, "the database answered more or less than it was asked");
    return l->status;
}

store_status link_stream(link_to *l, const call *c, bool (*take)(void *ctx, const PGresult *row), void *ctx)
{
    bool more = true;
    call alone = *c; /* its answer is the first */
    alone.once = true;
    link_begin(l, LINK_READ);
    if (send_one(l, &alone) && !(PQsetSingleRowMode(l->pg) && PQpipelineSync(l->pg)))
        lose(l, PQerrorMessage(l->pg));
    flush(l);
    for (bool ended = false; !ended && !l->lost;) {
        PGresult *r = next_answer(l);
        if (!r && !l->lost && PQstatus(l->pg) != CONNECTION_OK)
            lose(l, PQerrorMessage(l->pg));
        const ExecStatusType is = r ? PQresultStatus(r) : PGRES_EMPTY_QUERY;
        ended = is == PGRES_PIPELINE_SYNC;
        if (is == PGRES_SINGLE_TUPLE)
            more = more && take(ctx, r);
        else if (is == PGRES_FATAL_ERROR || is == PGRES_BAD_RESPONSE)
            fail_as_said(l, r);
        PQclear(r);
    }
    return l->status;
}

store_status link_script(link_to *l, const char *sql)
{
    link_begin(l, LINK_READ);
    if (!l->lost && (!PQexitPipelineMode(l->pg) || !PQsendQuery(l->pg, sql)))
        lose(l, PQerrorMessage(l->pg));
    flush(l);
    for (PGresult *r; (r = next_answer(l));) {
        const ExecStatusType is = PQresultStatus(r);
        if (is != PGRES_TUPLES_OK && is != PGRES_COMMAND_OK)
            fail_as_said(l, r);
        PQclear(r);
    }
    if (!l->lost && !PQenterPipelineMode(l->pg))
        lose(l, PQerrorMessage(l->pg));
    return l->status;
}

/* ---- answers */

int64_t cell_integer(const PGresult *r, int row, int column)
{
    const unsigned char *at = (const unsigned char *)PQgetvalue(r, row, column);
    const int size = PQgetisnull(r, row, column) ? 0 : PQgetlength(r, row, column);
    uint64_t bits = size > 1 && (at[0] & 0x80) ? UINT64_MAX : 0;
    for (int i = 0; i < size && size <= 8; i++)
        bits = bits << 8 | at[i];
    return (int64_t)bits;
}

double cell_real(const PGresult *r, int row, int column)
{
    uint64_t bits = 0;
    double x;
    if (PQgetlength(r, row, column) == sizeof bits)
        memcpy(&bits, PQgetvalue(r, row, column), sizeof bits);
    bits = be64toh(bits);
    memcpy(&x, &bits, sizeof x);
    return x;
}

char *cell_copy(const PGresult *r, int row, int column, bool *ok)
{
    char *copy = PQgetisnull(r, row, column) ? NULL : strdup(PQgetvalue(r, row, column));
    *ok = *ok && (copy || PQgetisnull(r, row, column));
    return copy;
}

bool cell_write(char *out, size_t size, const PGresult *r, int row, int column)
{
    return (size_t)snprintf(out, size, "%s", PQgetvalue(r, row, column)) < size;
}
