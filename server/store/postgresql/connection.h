/* connection.h: one connection to a PostgreSQL server, the calls made on it and what they answer. Used by one thread at
 * a time. Calls are sent together and answered together (libpq's pipeline mode): a transaction is one round trip,
 * however many calls it has. No setting outlives its transaction, so that a pooler may stand between; where none does,
 * statements are parsed and planned once for each connection. */
#ifndef SERVER_STORE_POSTGRESQL_CONNECTION_H
#define SERVER_STORE_POSTGRESQL_CONNECTION_H

#include "store/store.h"

#include <libpq-fe.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LINK_CAUSE 256
#define LINK_KEPT  64 /* statements that the server keeps for a connection */

/* A statement that is being parsed for later use: which, and the number of the answer that says so. */
typedef struct {
    int kept;
    size_t answer;
} link_parsing;

typedef struct {
    PGconn *pg;         /* NULL: there is none */
    PGresult **answers; /* of the calls of the last transaction, in order, from 0 */
    size_t n_answers, room, sent;
    size_t asked, heard;         /* all that was sent and answered, with what is not the caller's */
    size_t settings;             /* which of them is that of the settings of the transaction; SIZE_MAX: none */
    const char *kept[LINK_KEPT]; /* texts, by their address, that the server has as statements; NULL: free */
    link_parsing parsing[LINK_KEPT];
    size_t n_parsing;
    bool direct; /* the server itself answers, and keeps what it has parsed: no pooler hands out its connections */
    bool misled; /* it seemed so, and was not */
    store_status status; /* the first failure since link_begin */
    bool lost;           /* it failed in a way that leaves open what was carried out; it is closed when given back */
    bool silent;         /* it was given up because the server did not answer */
    bool passing;        /* the failure is one that another try may not meet: a deadlock, a key that came meanwhile */
    double patience_s;   /* for the server's silence */
    char message[LINK_CAUSE];
} link_to;

/* An address with a password in it is refused: others can read it, in the list of processes and in the log. The caller
 * does not show it then. */
bool link_address_fits(const char *address, char *message, size_t size);

/* A statement and its arguments $1, $2, ... in order; what they point to must live until it was sent. */
#define CALL_ARGUMENTS 24
typedef struct {
    const char *sql; /* a text that stays where it is, the same for the same statement */
    bool once;       /* it is planned for its arguments, each time */
    int n;
    const char *values[CALL_ARGUMENTS];
    int lengths[CALL_ARGUMENTS], formats[CALL_ARGUMENTS];
    char numbers[CALL_ARGUMENTS][32];
} call;
void call_text(call *c, const char *text); /* NULL: NULL */
void call_integer(call *c, int64_t value);
void call_real(call *c, double value);
void call_bool(call *c, bool value);
void call_bytes(call *c, const void *data, size_t size);

/* A transaction: begin, send..., end. */
typedef enum {
    LINK_READ,    /* only reads */
    LINK_GLANCE,  /* only reads, for who would rather know soon that there is no answer (LINK_GLANCE_S) */
    LINK_DURABLE, /* on disk when it ended */
    LINK_LAZY     /* may be lost with the server for a moment longer (engine.h: claim and renew) */
} link_kind;
#define LINK_GLANCE_S 5.0

/* NULL in pg on failure, and the cause with a remedy in message. Takes 5 s at most for each address, and a pooler whose
 * server does not answer as long as a transaction of this kind waits. */
bool link_open(link_to *l, const char *address, link_kind kind);
void link_close(link_to *l);
/* Is the other side still there, as far as can be known without asking? */
bool link_alive(link_to *l);

void link_begin(link_to *l, link_kind kind);
void link_send(link_to *l, const call *c);
/* STORE_OK: all of it was carried out; else nothing was, or l->lost. Answers stay until the next link_begin. Codes that
 * functions raise: UZ001 STORE_CONFLICT, UZ002 STORE_NOT_FOUND, UZ003 STORE_AWAY. */
store_status link_end(link_to *l);

/* Hands over the rows of a call one by one, as of one moment, until `take` returns false. */
store_status link_stream(link_to *l, const call *c, bool (*take)(void *ctx, const PGresult *row), void *ctx);
/* Statements of our own, without arguments, as they stand; for opening. */
store_status link_script(link_to *l, const char *sql);

/* ---- answers, which are binary */
int64_t cell_integer(const PGresult *r, int row, int column); /* also of a boolean; 0 of NULL */
double cell_real(const PGresult *r, int row, int column);
/* A copy of a text; NULL of NULL, and *ok false when there is no memory. */
char *cell_copy(const PGresult *r, int row, int column, bool *ok);
/* The text in room for size - 1 bytes; false: it has more. */
bool cell_write(char *out, size_t size, const PGresult *r, int row, int column);

#endif
