/* result_blobs.c: vectors and histories as little-endian doubles, in pieces of bounded size. */
#include "store/result_blobs.h"
#include "store/engine_base.h"

#include <endian.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PIECE_DOUBLES (RESULT_PIECE / 8)

/* ---- writing */

/* rows x columns doubles, whose rows stay together. piece: room for one, where bytes are in another order. */
static store_status put_blob(const result_blobs *place, void *transaction, const result_key *key, const double *x,
                             int64_t rows, int64_t columns, unsigned char *piece)
{
    const int64_t count = rows * columns, most = PIECE_DOUBLES / columns * columns;
    store_status status = STORE_OK;
    for (int64_t at = 0, part = 0; status == STORE_OK && (at < count || part == 0); at += most, part++) {
        const int64_t n = count - at < most ? count - at : most;
        const bool as_is = htole64(1) == 1;
        for (int64_t i = 0; i < n && !as_is; i++) {
            uint64_t bits;
            memcpy(&bits, x + at + i, 8);
            bits = htole64(bits);
            memcpy(piece + 8 * i, &bits, 8);
        }
        status = place->put(transaction, key,
                            &(result_piece){.part = part,
                                            .encoding = RESULT_ENCODING,
                                            .header = key->name ? count : columns,
                                            .last = n > 0 ? x[at + n - columns] : -1.0,
                                            .data = as_is ? (const void *)(x + at) : piece,
                                            .size = 8 * n});
    }
    return status;
}

static bool has_history(const store_answer *answer)
{
    return answer->history && answer->history_columns > 0 && answer->history_columns <= PIECE_DOUBLES;
}

store_status result_blobs_put(const result_blobs *place, void *transaction, const char *id,
                              const store_outcome *outcome, int64_t *bytes, char **contents, char cause[256])
{
    store_status status = STORE_OK;
    unsigned char *piece = malloc(RESULT_PIECE);
    size_t len = 0, n_blobs = outcome->n_cases;
    *bytes = 0;
    *contents = NULL;
    FILE *list = open_memstream(contents, &len);
    for (size_t number = 0; number <= outcome->n_cases; number++) {
        const store_answer *answer = number == 0 ? &outcome->whole : &outcome->cases[number - 1];
        n_blobs += answer->n_vectors + has_history(answer);
    }
    if (list)
        fprintf(list, "%zu %zu\n", n_blobs, outcome->n_cases);
    if (!piece || !list)
        status = STORE_ERROR;
    for (size_t number = 0; status == STORE_OK && number <= outcome->n_cases; number++) {
        const store_answer *answer = number == 0 ? &outcome->whole : &outcome->cases[number - 1];
        result_key key = {id, (int64_t)number, NULL};
        for (size_t i = 0; i < answer->n_vectors && status == STORE_OK; i++) {
            const store_vector *v = &answer->vectors[i];
            key.name = v->name;
            status = put_blob(place, transaction, &key, v->data, v->count, 1, piece);
            *bytes += 8 * v->count;
            fprintf(list, "%zu %s %lld\n", number, v->name, (long long)v->count);
        }
        const int64_t columns = answer->history_columns;
        key.name = NULL;
        if (status == STORE_OK && has_history(answer)) {
            status = put_blob(place, transaction, &key, answer->history, answer->history_rows, columns, piece);
            *bytes += 8 * answer->history_rows * columns;
            fprintf(list, "%zu / %lld\n", number, (long long)(answer->history_rows * columns));
        }
    }
    const bool listed = list && !ferror(list) && fflush(list) == 0;
    if (list)
        fclose(list);
    if (!piece || !listed) {
        strcpy(cause, "no memory for a result");
        status = STORE_ERROR;
    }
    free(piece);
    if (status == STORE_OK)
        return STORE_OK;
    free(*contents);
    *contents = NULL;
    return status;
}

/* ---- reading */

/* What was taken so far of the blob `key`. */
typedef struct {
    const result_key *key;
    double *x;
    int64_t count, header;
    store_status status;
} taken;

/* Each piece has to be as it was put, and to have whole rows. */
static bool take(void *ctx, const result_piece *piece)
{
    taken *t = ctx;
    const int64_t total = t->count + piece->size / 8, columns = t->key->name ? 1 : piece->header;
    if (!piece->good || piece->encoding != RESULT_ENCODING || columns <= 0 || piece->size % (8 * columns) != 0) {
        t->status = STORE_DAMAGED;
        return false;
    }
    double *grown = realloc(t->x, total > 0 ? (size_t)total * 8 : 1);
    if (!grown) {
        t->status = STORE_ERROR;
        return false;
    }
    t->x = grown;
    t->header = piece->header;
    for (const unsigned char *from = piece->data; t->count < total; t->count++, from += 8) {
        uint64_t bits;
        memcpy(&bits, from, 8);
        bits = le64toh(bits);
        memcpy(grown + t->count, &bits, 8);
    }
    return true;
}

store_status result_blobs_missing(store *s, const result_key *key, int64_t n_cases)
{
    char *list = NULL, line[80], cause[128];
    long long blobs, cases;
    store_status status = s->engine->results->contents ? s->engine->results->contents(s, key->job, &list) : STORE_OK;
    bool lost = status == STORE_DAMAGED;
    if (status == STORE_OK && list && n_cases >= 0)
        lost = sscanf(list, "%lld %lld", &blobs, &cases) != 2 || cases != n_cases;
    if (status == STORE_OK && list && n_cases < 0) {
        snprintf(line, sizeof line, "\n%lld %s ", (long long)key->number, key->name ? key->name : "/");
        lost = strstr(list, line) != NULL;
    }
    free(list);
    if (!lost)
        return STORE_OK;
    snprintf(cause, sizeof cause, "a part of the result of job %.32s is missing or has another name", key->job);
    store_set_message(s, cause);
    return STORE_DAMAGED;
}

/* All of it, or nothing and a message. */
static store_status get_blob(store *s, const result_key *key, int64_t after, taken *t)
{
    char cause[128];
    *t = (taken){.key = key};
    const store_status status = s->engine->results->get(s, key, after, take, t);
    if (status == STORE_OK && t->status == STORE_OK && key->name && t->count != t->header)
        t->status = STORE_DAMAGED;
    if (status == STORE_OK && t->status == STORE_OK)
        return STORE_OK;
    free(t->x);
    *t = (taken){.status = t->status};
    if (status == STORE_NOT_FOUND)
        return result_blobs_missing(s, key, -1) == STORE_DAMAGED ? STORE_DAMAGED : STORE_NOT_FOUND;
    if (status != STORE_OK)
        return status;
    if (t->status == STORE_DAMAGED)
        snprintf(cause, sizeof cause, "the result of job %.32s is damaged or was written by another version", key->job);
    else
        snprintf(cause, sizeof cause, "no memory for a result");
    store_set_message(s, cause);
    return t->status;
}

store_status store_get_vector(store *s, const char *id, int64_t number, const char *name, double **data, int64_t *count)
{
    taken t;
    const store_status status = get_blob(s, &(result_key){id, number, name}, -1, &t);
    *data = t.x;
    *count = t.count;
    return status;
}

store_status store_get_history(store *s, const char *id, int64_t number, int64_t after, double **rows, int64_t *count,
                               int64_t *columns)
{
    taken t;
    const store_status status = get_blob(s, &(result_key){id, number, NULL}, after, &t);
    int64_t skip = 0; /* pieces are left out whole where all their iterations were seen; those ascend */
    while (skip < t.count && !(t.x[skip] > (double)after))
        skip += t.header;
    if (skip > 0)
        memmove(t.x, t.x + skip, (size_t)(t.count - skip) * 8);
    *rows = t.x;
    *columns = t.header;
    *count = t.header > 0 ? (t.count - skip) / t.header : 0;
    return status;
}

store_status store_count_vectors(store *s, const char *id, const char *name, int64_t *total)
{
    *total = 0;
    return s->engine->results->count(s, id, name, total);
}
