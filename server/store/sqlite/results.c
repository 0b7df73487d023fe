/* results.c: vectors and histories as rows of little-endian doubles, in parts of bounded size. */
#include "store/sqlite/internal.h"
#include "store/sqlite/file_format.h"

#include <endian.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Doubles in one part: 1 MiB. Small enough that neither side needs a second copy of a large vector, large enough that
 * the rows cost nothing. */
#define PART_DOUBLES 131072

static void encode(unsigned char *out, const double *x, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, x + i, 8);
        bits = htole64(bits);
        memcpy(out + 8 * i, &bits, 8);
    }
}

static void decode(double *x, const unsigned char *in, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, in + 8 * i, 8);
        bits = le64toh(bits);
        memcpy(x + i, &bits, 8);
    }
}

static store_status no_memory(connection *c)
{
    strcpy(c->message, "no memory for a result");
    return STORE_ERROR;
}

static store_status damaged(connection *c, const char *id)
{
    snprintf(c->message, sizeof c->message, "the result of job %.32s is damaged or was written by another version", id);
    return STORE_DAMAGED;
}

/* ---- writing */

/* At least one part, so that an empty vector is not the same as none. */
static store_status insert_vector(connection *c, const char *id, int64_t number, const store_vector *v,
                                  unsigned char *part)
{
    store_status status = STORE_OK;
    for (int64_t at = 0, n = 0; status == STORE_OK && (at < v->count || n == 0); at += PART_DOUBLES, n++) {
        int64_t count = v->count - at < PART_DOUBLES ? v->count - at : PART_DOUBLES;
        if (count > 0)
            encode(part, v->data + at, count);
        statement st = statement_begin(c, QUERY_INSERT_VECTOR);
        bind_text(&st, 1, id);
        bind_text(&st, 2, v->name);
        bind_integer(&st, 3, n);
        bind_integer(&st, 4, FILE_FORMAT_VECTOR_VERSION);
        bind_integer(&st, 5, v->count);
        bind_blob(&st, 6, part, (size_t)count * 8);
        bind_integer(&st, 7, number);
        status = statement_run(&st);
    }
    return status;
}

/* A history without rows is one empty part. */
static store_status insert_history(connection *c, const char *id, int64_t number, const store_answer *answer,
                                   unsigned char *part)
{
    const int64_t columns = answer->history_columns;
    store_status status = STORE_OK;
    if (!answer->history || columns <= 0 || columns > PART_DOUBLES)
        return STORE_OK;
    const int64_t most = PART_DOUBLES / columns; /* rows in a part */
    for (int64_t at = 0, n = 0; status == STORE_OK && (at < answer->history_rows || n == 0); at += most, n++) {
        const int64_t left = answer->history_rows - at, count = left < most ? left : most;
        const double *rows = answer->history + at * columns;
        encode(part, rows, count * columns);
        statement st = statement_begin(c, QUERY_INSERT_HISTORY);
        bind_text(&st, 1, id);
        bind_integer(&st, 2, n);
        bind_integer(&st, 3, FILE_FORMAT_VECTOR_VERSION);
        bind_integer(&st, 4, columns);
        bind_real(&st, 5, count > 0 ? rows[(count - 1) * columns] : -1.0);
        bind_blob(&st, 6, part, (size_t)(count * columns) * 8);
        bind_integer(&st, 7, number);
        status = statement_run(&st);
    }
    return status;
}

/* number 0: of the job itself, whose summary stands in its own row. */
static store_status insert_answer(connection *c, const char *id, int64_t number, const store_answer *answer,
                                  unsigned char *part)
{
    store_status status = STORE_OK;
    if (number > 0) {
        statement st = statement_begin(c, QUERY_INSERT_ANSWER);
        bind_text(&st, 1, id);
        bind_integer(&st, 2, number);
        bind_text(&st, 3, answer->name);
        bind_text(&st, 4, answer->summary);
        status = statement_run(&st);
    }
    for (size_t i = 0; i < answer->n_vectors && status == STORE_OK; i++)
        status = insert_vector(c, id, number, &answer->vectors[i], part);
    return status == STORE_OK ? insert_history(c, id, number, answer, part) : status;
}

store_status sqlite_insert_results(connection *c, const char *id, const store_outcome *outcome)
{
    unsigned char *part = malloc(PART_DOUBLES * 8);
    if (!part)
        return no_memory(c);
    store_status status = insert_answer(c, id, 0, &outcome->whole, part);
    for (size_t i = 0; i < outcome->n_cases && status == STORE_OK; i++)
        status = insert_answer(c, id, (int64_t)i + 1, &outcome->cases[i], part);
    free(part);
    return status;
}

/* ---- reading */

/* Appends the doubles of the blob in column `at` to x[*have..total). False if they do not fit or are not whole. */
static bool append_blob(statement *st, int at, double *x, int64_t *have, int64_t total)
{
    int64_t bytes = sqlite3_column_bytes(st->stmt, at);
    const unsigned char *blob = sqlite3_column_blob(st->stmt, at);
    if (bytes % 8 != 0 || bytes / 8 > total - *have || (bytes > 0 && !blob))
        return false;
    decode(x + *have, blob, bytes / 8);
    *have += bytes / 8;
    return true;
}

static store_status read_vector(statement *st, const char *id, double **out, int64_t *total)
{
    int64_t have = 0;
    if (!statement_row(st))
        return STORE_NOT_FOUND;
    *total = sqlite3_column_int64(st->stmt, 1);
    if (*total < 0 || *total > INT64_MAX / 8)
        return damaged(st->c, id);
    *out = malloc(*total > 0 ? (size_t)*total * 8 : 1);
    if (!*out)
        return no_memory(st->c);
    do {
        if (!sqlite3_column_int(st->stmt, 3) || sqlite3_column_int64(st->stmt, 0) != FILE_FORMAT_VECTOR_VERSION ||
            !append_blob(st, 2, *out, &have, *total))
            return damaged(st->c, id);
    } while (statement_row(st));
    return have == *total ? STORE_OK : damaged(st->c, id);
}

store_status sqlite_get_vector(store *base, const char *id, int64_t number, const char *name, double **x,
                               int64_t *count)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_VECTOR);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    bind_integer(&st, 3, number);
    store_status status = read_vector(&st, id, x, count);
    store_status ended = statement_end(&st);
    return sqlite_give_reader(s, c, ended == STORE_OK ? status : ended);
}

store_status sqlite_count_vectors(store *base, const char *id, const char *name, int64_t *total)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_COUNT_VECTORS);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    if (statement_row(&st))
        *total = sqlite3_column_int64(st.stmt, 0);
    return sqlite_give_reader(s, c, statement_end(&st));
}

/* The rows of all parts whose iteration is > after; those ascend. */
static store_status read_history(statement *st, const char *id, int64_t after, double **rows, int64_t *count,
                                 int64_t *columns)
{
    int64_t have = 0, skip = 0; /* doubles */
    while (statement_row(st)) {
        *columns = sqlite3_column_int64(st->stmt, 1);
        if (!sqlite3_column_int(st->stmt, 3) || sqlite3_column_int64(st->stmt, 0) != FILE_FORMAT_VECTOR_VERSION ||
            *columns <= 0)
            return damaged(st->c, id);
        int64_t total = have + sqlite3_column_bytes(st->stmt, 2) / 8;
        double *grown = realloc(*rows, total > 0 ? (size_t)total * 8 : 1);
        if (!grown)
            return no_memory(st->c);
        *rows = grown;
        if (!append_blob(st, 2, grown, &have, total) || have % *columns != 0)
            return damaged(st->c, id);
    }
    if (!*rows)
        return STORE_NOT_FOUND;
    while (skip < have && !((*rows)[skip] > (double)after))
        skip += *columns;
    memmove(*rows, *rows + skip, (size_t)(have - skip) * 8);
    *count = (have - skip) / *columns;
    return STORE_OK;
}

store_status sqlite_get_history(store *base, const char *id, int64_t number, int64_t after, double **rows,
                                int64_t *count, int64_t *columns)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_HISTORY);
    bind_text(&st, 1, id);
    bind_real(&st, 2, (double)after);
    bind_integer(&st, 3, number);
    store_status status = read_history(&st, id, after, rows, count, columns);
    store_status ended = statement_end(&st);
    return sqlite_give_reader(s, c, ended == STORE_OK ? status : ended);
}
