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

/* Where rows of a history go. */
typedef struct {
    const char *id;
    int64_t number, part, columns;
} rows_place;

static store_status insert_rows(connection *c, const rows_place *at, const double *rows, int64_t count,
                                unsigned char *part)
{
    int64_t columns = at->columns;
    encode(part, rows, count * columns);
    statement st = statement_begin(c, QUERY_INSERT_HISTORY);
    bind_text(&st, 1, at->id);
    bind_integer(&st, 2, at->part);
    bind_integer(&st, 3, FILE_FORMAT_VECTOR_VERSION);
    bind_integer(&st, 4, columns);
    bind_real(&st, 5, count > 0 ? rows[(count - 1) * columns] : -1.0);
    bind_blob(&st, 6, part, (size_t)(count * columns) * 8);
    bind_integer(&st, 7, at->number);
    return statement_run(&st);
}

/* A history without rows is one empty part. */
static store_status insert_history(connection *c, const char *id, int64_t number, const store_answer *answer,
                                   unsigned char *part)
{
    rows_place place = {id, number, 0, answer->history_columns};
    store_status status = STORE_OK;
    if (!answer->history || place.columns <= 0 || place.columns > PART_DOUBLES)
        return STORE_OK;
    int64_t rows_in_part = PART_DOUBLES / place.columns;
    for (int64_t at = 0; status == STORE_OK && (at < answer->history_rows || place.part == 0); place.part++) {
        int64_t left = answer->history_rows - at;
        int64_t count = left < rows_in_part ? left : rows_in_part;
        status = insert_rows(c, &place, answer->history + at * place.columns, count, part);
        at += rows_in_part;
    }
    return status;
}

static store_status insert_answer(connection *c, const char *id, int64_t number, const store_answer *answer,
                                  unsigned char *part)
{
    store_status status = STORE_OK;
    for (size_t i = 0; i < answer->n_vectors && status == STORE_OK; i++)
        status = insert_vector(c, id, number, &answer->vectors[i], part);
    return status == STORE_OK ? insert_history(c, id, number, answer, part) : status;
}

static store_status insert_case(connection *c, const char *id, int64_t number, const store_answer *answer,
                                unsigned char *part)
{
    statement st = statement_begin(c, QUERY_INSERT_ANSWER);
    bind_text(&st, 1, id);
    bind_integer(&st, 2, number);
    bind_text(&st, 3, answer->name);
    bind_text(&st, 4, answer->summary);
    store_status status = statement_run(&st);
    return status == STORE_OK ? insert_answer(c, id, number, answer, part) : status;
}

store_status sqlite_insert_results(connection *c, const char *id, const store_outcome *outcome)
{
    unsigned char *part = malloc(PART_DOUBLES * 8);
    if (!part)
        return no_memory(c);
    store_status status = insert_answer(c, id, 0, &outcome->whole, part);
    for (size_t i = 0; i < outcome->n_cases && status == STORE_OK; i++)
        status = insert_case(c, id, (int64_t)i + 1, &outcome->cases[i], part);
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

typedef struct {
    double *x;     /* rows, one after another */
    int64_t count; /* doubles in x */
    int64_t columns;
} rows_buffer;

static store_status read_part(statement *st, const char *id, rows_buffer *rows)
{
    rows->columns = sqlite3_column_int64(st->stmt, 1);
    if (!sqlite3_column_int(st->stmt, 3) || sqlite3_column_int64(st->stmt, 0) != FILE_FORMAT_VECTOR_VERSION ||
        rows->columns <= 0)
        return damaged(st->c, id);
    int64_t total = rows->count + sqlite3_column_bytes(st->stmt, 2) / 8;
    double *grown = realloc(rows->x, total > 0 ? (size_t)total * 8 : 1);
    if (!grown)
        return no_memory(st->c);
    rows->x = grown;
    return append_blob(st, 2, rows->x, &rows->count, total) && rows->count % rows->columns == 0 ? STORE_OK
                                                                                                : damaged(st->c, id);
}

static store_status read_history(statement *st, const char *id, rows_buffer *rows)
{
    store_status status = STORE_NOT_FOUND;
    while ((status == STORE_OK || status == STORE_NOT_FOUND) && statement_row(st))
        status = read_part(st, id, rows);
    return status;
}

/* Drops the rows whose iteration is not after `after`; iterations ascend. */
static void drop_seen(rows_buffer *rows, int64_t after)
{
    int64_t skip = 0;
    while (skip < rows->count && !(rows->x[skip] > (double)after))
        skip += rows->columns;
    rows->count -= skip;
    memmove(rows->x, rows->x + skip, (size_t)rows->count * 8);
}

store_status sqlite_get_history(store *base, const char *id, int64_t number, int64_t after, double **rows,
                                int64_t *count, int64_t *columns)
{
    sqlite_store *s = sqlite_of(base);
    rows_buffer found = {NULL, 0, 0};
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_HISTORY);
    bind_text(&st, 1, id);
    bind_real(&st, 2, (double)after);
    bind_integer(&st, 3, number);
    store_status status = read_history(&st, id, &found);
    store_status ended = statement_end(&st);
    if (ended != STORE_OK)
        status = ended;
    if (status == STORE_OK) {
        drop_seen(&found, after);
        *count = found.count / found.columns;
        *columns = found.columns;
    }
    *rows = found.x;
    return sqlite_give_reader(s, c, status);
}
