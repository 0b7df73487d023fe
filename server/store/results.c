/* results.c: vectors and histories as rows of little-endian doubles, in parts of bounded size. */
#include "store/internal.h"
#include "store/file_format.h"

#include <endian.h>
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

static store_status damaged(connection *c)
{
    strcpy(c->message, "a stored result is damaged or was written by another version");
    return STORE_ERROR;
}

/* ---- writing */

/* At least one part, so that an empty vector is not the same as none. */
static store_status insert_vector(connection *c, const char *id, const store_vector *v, unsigned char *part)
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
        status = statement_run(&st);
    }
    return status;
}

store_status store_insert_vectors(connection *c, const char *id, const store_outcome *outcome)
{
    store_status status = STORE_OK;
    unsigned char *part = malloc(PART_DOUBLES * 8);
    if (!part)
        return no_memory(c);
    for (size_t i = 0; i < outcome->n_vectors && status == STORE_OK; i++)
        status = insert_vector(c, id, &outcome->vectors[i], part);
    free(part);
    return status;
}

static store_status insert_rows(connection *c, const char *id, int64_t number, const double *rows, int64_t count,
                                int64_t columns, unsigned char *part)
{
    encode(part, rows, count * columns);
    statement st = statement_begin(c, QUERY_INSERT_HISTORY);
    bind_text(&st, 1, id);
    bind_integer(&st, 2, number);
    bind_integer(&st, 3, FILE_FORMAT_VECTOR_VERSION);
    bind_integer(&st, 4, columns);
    bind_real(&st, 5, count > 0 ? rows[(count - 1) * columns] : -1.0);
    bind_blob(&st, 6, part, (size_t)(count * columns) * 8);
    return statement_run(&st);
}

store_status store_insert_history(connection *c, const char *id, const store_outcome *outcome)
{
    int64_t columns = outcome->history_columns;
    if (!outcome->history || columns <= 0 || columns > PART_DOUBLES)
        return STORE_OK;
    store_status status = STORE_OK;
    int64_t rows_in_part = PART_DOUBLES / columns;
    unsigned char *part = malloc(PART_DOUBLES * 8);
    if (!part)
        return no_memory(c);
    for (int64_t at = 0, n = 0; status == STORE_OK && (at < outcome->history_rows || n == 0); at += rows_in_part, n++) {
        int64_t left = outcome->history_rows - at;
        status = insert_rows(c, id, n, outcome->history + at * columns, left < rows_in_part ? left : rows_in_part,
                             columns, part);
    }
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

static store_status read_vector(statement *st, double **out, int64_t *total)
{
    int64_t have = 0;
    if (!statement_row(st))
        return STORE_NOT_FOUND;
    *total = sqlite3_column_int64(st->stmt, 1);
    if (*total < 0 || *total > INT64_MAX / 8)
        return damaged(st->c);
    *out = malloc(*total > 0 ? (size_t)*total * 8 : 1);
    if (!*out)
        return no_memory(st->c);
    do {
        if (sqlite3_column_int64(st->stmt, 0) != FILE_FORMAT_VECTOR_VERSION || !append_blob(st, 2, *out, &have, *total))
            return damaged(st->c);
    } while (statement_row(st));
    return have == *total ? STORE_OK : damaged(st->c);
}

store_status store_get_vector(store *s, const char *id, const char *name, double **data, int64_t *count)
{
    double *x = NULL;
    int64_t total = 0;
    *data = NULL;
    *count = 0;
    connection *c = store_take_reader(s);
    statement st = statement_begin(c, QUERY_VECTOR);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    store_status status = read_vector(&st, &x, &total);
    store_status ended = statement_end(&st);
    if (ended != STORE_OK)
        status = ended;
    if (status == STORE_OK) {
        *data = x;
        *count = total;
        x = NULL;
    }
    free(x);
    return store_give_reader(s, c, status);
}

typedef struct {
    double *x;     /* rows, one after another */
    int64_t count; /* doubles in x */
    int64_t columns;
} rows_buffer;

static store_status read_part(statement *st, rows_buffer *rows)
{
    rows->columns = sqlite3_column_int64(st->stmt, 1);
    if (sqlite3_column_int64(st->stmt, 0) != FILE_FORMAT_VECTOR_VERSION || rows->columns <= 0)
        return damaged(st->c);
    int64_t total = rows->count + sqlite3_column_bytes(st->stmt, 2) / 8;
    double *grown = realloc(rows->x, total > 0 ? (size_t)total * 8 : 1);
    if (!grown)
        return no_memory(st->c);
    rows->x = grown;
    return append_blob(st, 2, rows->x, &rows->count, total) && rows->count % rows->columns == 0 ? STORE_OK
                                                                                                : damaged(st->c);
}

static store_status read_history(statement *st, rows_buffer *rows)
{
    store_status status = STORE_NOT_FOUND;
    while ((status == STORE_OK || status == STORE_NOT_FOUND) && statement_row(st))
        status = read_part(st, rows);
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

store_status store_get_history(store *s, const char *id, int64_t after, double **rows, int64_t *count, int64_t *columns)
{
    rows_buffer found = {NULL, 0, 0};
    *rows = NULL;
    *count = *columns = 0;
    connection *c = store_take_reader(s);
    statement st = statement_begin(c, QUERY_HISTORY);
    bind_text(&st, 1, id);
    bind_real(&st, 2, (double)after);
    store_status status = read_history(&st, &found);
    store_status ended = statement_end(&st);
    if (ended != STORE_OK)
        status = ended;
    if (status == STORE_OK) {
        drop_seen(&found, after);
        *rows = found.x;
        *count = found.count / found.columns;
        *columns = found.columns;
        found.x = NULL;
    }
    free(found.x);
    return store_give_reader(s, c, status);
}
