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

/* ---- writing */

/* What an answer has of doubles: a vector, or a history, whose name is NULL. */
typedef struct {
    const char *name;
    const double *x;
    int64_t count;  /* doubles */
    int64_t header; /* what every part repeats: the count of a vector, the columns of a history */
    int64_t each;   /* doubles that stay together in one part */
} numbers;

/* number: of the case. At least one part, so that an empty vector or history is not the same as none. */
static store_status insert_parts(connection *c, const char *id, int64_t number, const numbers *of, unsigned char *part)
{
    const int64_t most = PART_DOUBLES / of->each * of->each;
    store_status status = STORE_OK;
    for (int64_t at = 0, n = 0; status == STORE_OK && (at < of->count || n == 0); at += most, n++) {
        const int64_t count = of->count - at < most ? of->count - at : most;
        for (int64_t i = 0; i < count; i++) {
            uint64_t bits;
            memcpy(&bits, of->x + at + i, 8);
            bits = htole64(bits);
            memcpy(part + 8 * i, &bits, 8);
        }
        statement st = statement_begin(c, of->name ? QUERY_INSERT_VECTOR : QUERY_INSERT_HISTORY);
        bind_text(&st, 1, id);
        if (of->name)
            bind_text(&st, 2, of->name);
        else /* the iteration of its last row */
            bind_real(&st, 2, count > 0 ? of->x[at + count - of->each] : -1.0);
        bind_integer(&st, 3, n);
        bind_integer(&st, 4, FILE_FORMAT_VECTOR_VERSION);
        bind_integer(&st, 5, of->header);
        bind_blob(&st, 6, part, (size_t)count * 8);
        bind_integer(&st, 7, number);
        status = statement_run(&st);
    }
    return status;
}

store_status sqlite_insert_results(connection *c, const char *id, const store_outcome *outcome)
{
    store_status status = STORE_OK;
    unsigned char *part = malloc(PART_DOUBLES * 8);
    if (!part) {
        strcpy(c->message, "no memory for a result");
        return STORE_ERROR;
    }
    for (size_t number = 0; number <= outcome->n_cases && status == STORE_OK; number++) {
        const store_answer *answer = number == 0 ? &outcome->whole : &outcome->cases[number - 1];
        if (number > 0) { /* the job's own summary stands in its own row */
            statement st = statement_begin(c, QUERY_INSERT_ANSWER);
            bind_text(&st, 1, id);
            bind_integer(&st, 2, (int64_t)number);
            bind_text(&st, 3, answer->name);
            bind_text(&st, 4, answer->summary);
            status = statement_run(&st);
        }
        for (size_t i = 0; i < answer->n_vectors && status == STORE_OK; i++) {
            const store_vector *v = &answer->vectors[i];
            status = insert_parts(c, id, (int64_t)number, &(numbers){v->name, v->data, v->count, v->count, 1}, part);
        }
        const int64_t columns = answer->history_columns;
        if (status == STORE_OK && answer->history && columns > 0 && columns <= PART_DOUBLES)
            status =
                insert_parts(c, id, (int64_t)number,
                             &(numbers){NULL, answer->history, answer->history_rows * columns, columns, columns}, part);
    }
    free(part);
    return status;
}

/* ---- reading */

/* Reads the doubles of all parts, one behind the other: *count of them, and the header that the parts repeat. Every
 * part has to be as it was written, and to have whole rows of `each` doubles (0: of as many as its header says). */
static store_status read_parts(statement *st, const char *id, int64_t each, double **x, int64_t *count, int64_t *header)
{
    store_status status = STORE_NOT_FOUND;
    int64_t have = 0;
    while (status != STORE_DAMAGED && statement_row(st)) {
        const int64_t bytes = sqlite3_column_bytes(st->stmt, 2), total = have + bytes / 8;
        const unsigned char *blob = sqlite3_column_blob(st->stmt, 2);
        double *grown = realloc(*x, total > 0 ? (size_t)total * 8 : 1);
        if (!grown) {
            strcpy(st->c->message, "no memory for a result");
            return STORE_ERROR;
        }
        *x = grown;
        *header = sqlite3_column_int64(st->stmt, 1);
        const int64_t row = each > 0 ? each : *header;
        const bool good = sqlite3_column_int(st->stmt, 3) && row > 0 && bytes % (8 * row) == 0 &&
                          sqlite3_column_int64(st->stmt, 0) == FILE_FORMAT_VECTOR_VERSION && (bytes == 0 || blob);
        status = good ? STORE_OK : STORE_DAMAGED;
        for (; good && have < total; have++, blob += 8) {
            uint64_t bits;
            memcpy(&bits, blob, 8);
            bits = le64toh(bits);
            memcpy(grown + have, &bits, 8);
        }
    }
    *count = have;
    if (status == STORE_OK && each == 1 && have != *header)
        status = STORE_DAMAGED;
    if (status == STORE_DAMAGED)
        snprintf(st->c->message, sizeof st->c->message,
                 "the result of job %.32s is damaged or was written by another version", id);
    return status;
}

store_status sqlite_get_vector(store *base, const char *id, int64_t number, const char *name, double **x,
                               int64_t *count)
{
    sqlite_store *s = sqlite_of(base);
    int64_t header;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_VECTOR);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    bind_integer(&st, 3, number);
    store_status status = read_parts(&st, id, 1, x, count, &header);
    return sqlite_give_reader(s, c, statement_end(&st, status));
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
    return sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
}

store_status sqlite_get_history(store *base, const char *id, int64_t number, int64_t after, double **rows,
                                int64_t *count, int64_t *columns)
{
    sqlite_store *s = sqlite_of(base);
    int64_t have = 0, skip = 0; /* doubles */
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_HISTORY);
    bind_text(&st, 1, id);
    bind_real(&st, 2, (double)after);
    bind_integer(&st, 3, number);
    store_status status = statement_end(&st, read_parts(&st, id, 0, rows, &have, columns));
    if (status == STORE_OK) { /* parts are left out whole where all their iterations were seen; those ascend */
        while (skip < have && !((*rows)[skip] > (double)after))
            skip += *columns;
        memmove(*rows, *rows + skip, (size_t)(have - skip) * 8);
        *count = (have - skip) / *columns;
    }
    return sqlite_give_reader(s, c, status);
}
