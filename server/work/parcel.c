#include "work/parcel.h"

#include "linalg/pieces.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_VECTORS = 64 };

/* ---- the form: a head, then an answer's head, texts, vectors and history for the whole and for each case; all at
 * multiples of 8 */

typedef struct {
    int64_t status, n_answers, error; /* error, name, summary: bytes with the final NUL; 0: there is none */
} head;

typedef struct {
    int64_t name, summary, n_vectors, history, rows, columns; /* history: 0 or 1 */
} answer_head;

typedef struct {
    char name[sizeof((store_vector *)0)->name];
    int64_t count;
} vector_head;

/* ---- writing */

/* Appends, or with to NULL only counts. */
static void put(char *to, size_t *at, const void *data, size_t size)
{
    const size_t padded = (size + 7) / 8 * 8;
    if (to && size > 0) {
        memcpy(to + *at, data, size);
        memset(to + *at + size, 0, padded - size);
    }
    *at += padded;
}

static int64_t text_size(const char *text)
{
    return text ? (int64_t)strlen(text) + 1 : 0;
}

size_t parcel_write(char *to, const store_outcome *outcome)
{
    size_t at = 0;
    const head h = {outcome->status, 1 + (int64_t)outcome->n_cases, text_size(outcome->error)};
    put(to, &at, &h, sizeof h);
    put(to, &at, outcome->error, (size_t)h.error);
    for (size_t i = 0; i <= outcome->n_cases; i++) {
        const store_answer *a = i == 0 ? &outcome->whole : &outcome->cases[i - 1];
        const answer_head ah = {text_size(a->name),
                                text_size(a->summary),
                                (int64_t)a->n_vectors,
                                a->history != NULL,
                                a->history ? a->history_rows : 0,
                                a->history ? a->history_columns : 0};
        put(to, &at, &ah, sizeof ah);
        put(to, &at, a->name, (size_t)ah.name);
        put(to, &at, a->summary, (size_t)ah.summary);
        for (size_t k = 0; k < a->n_vectors; k++) {
            vector_head vh = {.count = a->vectors[k].count};
            memcpy(vh.name, a->vectors[k].name, sizeof vh.name);
            put(to, &at, &vh, sizeof vh);
            if (to && vh.count > 0) /* into pages that are new, as a rule, which threads share the price of */
                uz_long_copy(vh.count, (double *)(void *)(to + at), a->vectors[k].data);
            at += (size_t)vh.count * sizeof(double);
        }
        put(to, &at, a->history, (size_t)(ah.rows * ah.columns) * sizeof(double));
    }
    return at;
}

/* ---- reading */

typedef struct {
    const char *from;
    size_t at, size;
    bool good;
} reading;

/* The next `count` items of `size` bytes; NULL: there are not so many. */
static const void *take(reading *r, int64_t count, size_t size)
{
    const size_t left = r->size - r->at;
    if (!r->good || count < 0 || (uint64_t)count > left / size || ((size_t)count * size + 7) / 8 * 8 > left) {
        r->good = false;
        return NULL;
    }
    const char *found = r->from + r->at;
    r->at += ((size_t)count * size + 7) / 8 * 8;
    return found;
}

/* A copy; NULL where there is none. */
static char *take_text(reading *r, int64_t size)
{
    const char *found = take(r, size, 1);
    char *copy = r->good && size > 0 ? malloc((size_t)size) : NULL;
    if (copy) {
        memcpy(copy, found, (size_t)size);
        copy[size - 1] = '\0';
    }
    r->good = r->good && (copy || size == 0);
    return copy;
}

bool parcel_read(parcel *out, const char *from, size_t size)
{
    reading r = {from, 0, size, true};
    head h = {0};
    *out = (parcel){.n = 0};
    const head *found = take(&r, 1, sizeof h);
    if (found)
        h = *found;
    if (!r.good || h.n_answers < 1 || (uint64_t)h.n_answers > size / sizeof(answer_head) ||
        (h.status != JOB_SUCCESSFUL && h.status != JOB_FAILED && h.status != JOB_DISMISSED))
        return false;
    out->outcome.status = (job_status)h.status;
    out->outcome.error = take_text(&r, h.error);
    out->answers = calloc((size_t)h.n_answers, sizeof *out->answers);
    if (!out->answers)
        return false;
    while (r.good && out->n < (size_t)h.n_answers) {
        store_answer *one = &out->answers[out->n++];
        const answer_head *there = take(&r, 1, sizeof *there);
        const answer_head of = there ? *there : (answer_head){0};
        one->name = take_text(&r, of.name);
        one->summary = take_text(&r, of.summary);
        r.good = r.good && of.n_vectors >= 0 && of.n_vectors <= MOST_VECTORS;
        store_vector *vectors = r.good ? calloc((size_t)of.n_vectors + 1, sizeof *vectors) : NULL;
        one->vectors = vectors;
        r.good = r.good && vectors;
        for (int64_t k = 0; r.good && k < of.n_vectors; k++) {
            const vector_head *vh = take(&r, 1, sizeof *vh);
            if (!vh)
                break;
            memcpy(vectors[k].name, vh->name, sizeof vectors[k].name);
            vectors[k].name[sizeof vectors[k].name - 1] = '\0';
            vectors[k].count = vh->count;
            vectors[k].data = take(&r, vectors[k].count, sizeof(double));
            one->n_vectors = (size_t)k + 1;
        }
        if (!of.history)
            continue;
        r.good = r.good && of.columns > 0 && of.columns <= 1024;
        one->history = take(&r, of.rows, sizeof(double) * (size_t)of.columns);
        one->history_rows = of.rows;
        one->history_columns = of.columns;
    }
    if (!r.good)
        return false;
    out->outcome.whole = out->answers[0];
    out->outcome.cases = out->answers + 1;
    out->outcome.n_cases = out->n - 1;
    return true;
}

void parcel_clear(parcel *p)
{
    for (size_t i = 0; i < p->n; i++) {
        free((char *)(uintptr_t)p->answers[i].name);
        free((char *)(uintptr_t)p->answers[i].summary);
        free((void *)(uintptr_t)p->answers[i].vectors);
    }
    free(p->answers);
    free((char *)(uintptr_t)p->outcome.error);
    *p = (parcel){.n = 0};
}
