/* objects.c: bytes in an object store: bodies of requests; results, packed into objects of a few MiB, of which readers
 * get the ranges that they want; what belongs to nobody is removed. */
#include "store/postgresql/objects.h"
#include "core/alloc.h"

#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define COLLECT_S    2.0 /* between two looks for what is to go */
#define COLLECT_MOST 50  /* removed in one look's rounds each */
#define HISTORY      "/" /* results.c */

/* ---- writing */

store_status postgresql_put_object(postgresql_store *s, const void *data, size_t size, char name[OBJECT_NAME],
                                   char cause[OBJECT_CAUSE])
{
    unsigned char digest[32];
    char sum[65];
    uint64_t random = 0;
    call c = {.sql = "SELECT uzawa.object_begin($1, $2)"};
    if (gnutls_hash_fast(GNUTLS_DIG_SHA256, data, size, digest) != 0 ||
        getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random) {
        snprintf(cause, OBJECT_CAUSE, "the digest of an object failed");
        return STORE_ERROR;
    }
    for (int i = 0; i < 32; i++)
        snprintf(sum + 2 * i, 3, "%02x", digest[i]);
    snprintf(name, OBJECT_NAME, "%s-%016llx", sum, (unsigned long long)random);
    call_text(&c, name);
    call_integer(&c, (int64_t)size);
    const store_status status = postgresql_do(s, LINK_DURABLE, false, &c, NULL, NULL);
    if (status == STORE_OK)
        return objects_put(s->base.settings.objects, name, data, size, sum, cause);
    store_message(&s->base, cause, OBJECT_CAUSE);
    return status;
}

/* ---- requests */

char *postgresql_place_request(postgresql_store *s, const void *body, size_t size)
{
    const size_t n = (size + OBJECT_MOST - 1) / OBJECT_MOST;
    char cause[OBJECT_CAUSE];
    if (!s->base.settings.objects || (int64_t)size < objects_least(s->base.settings.objects))
        return NULL;
    char *names = malloc(n * (OBJECT_NAME + 1) + 2), *at = names;
    for (size_t i = 0; i < n && names; i++) {
        const size_t from = i * OBJECT_MOST, left = size - from;
        *at++ = i > 0 ? ',' : '{';
        if (postgresql_put_object(s, (const char *)body + from, left < OBJECT_MOST ? left : OBJECT_MOST, at, cause) !=
            STORE_OK) {
            free(names);
            return NULL;
        }
        at += strlen(at);
    }
    if (names)
        strcpy(at, "}");
    return names;
}

/* ---- results */

/* What result_blobs_put gives its pieces to. */
typedef struct {
    postgresql_store *s;
    placed_result *result;
    char *bytes; /* OBJECT_MOST of them: of the object that is being filled */
    size_t len;
    char cause[OBJECT_CAUSE];
} packer;

static bool grow(void **items, size_t *room, size_t n, size_t size)
{
    if (n < *room)
        return true;
    const size_t more = *room ? 2 * *room : 16;
    void *grown = realloc(*items, more * size);
    if (!grown)
        return false;
    *items = grown;
    *room = more;
    return true;
}

static store_status no_memory(packer *p)
{
    snprintf(p->cause, sizeof p->cause, "no memory for a result");
    return STORE_ERROR;
}

static store_status put_full(packer *p)
{
    placed_result *r = p->result;
    if (p->len == 0)
        return STORE_OK;
    if (!grow((void **)&r->objects, &r->room_objects, r->n_objects, sizeof *r->objects))
        return no_memory(p);
    const store_status status = postgresql_put_object(p->s, p->bytes, p->len, r->objects[r->n_objects], p->cause);
    r->n_objects += status == STORE_OK;
    p->len = 0;
    return status;
}

static store_status pack(void *transaction, const result_key *key, const result_piece *piece)
{
    packer *p = transaction;
    placed_result *r = p->result;
    const size_t size = (size_t)piece->size;
    if (p->len + size > OBJECT_MOST) {
        const store_status status = put_full(p);
        if (status != STORE_OK)
            return status;
    }
    if (!grow((void **)&r->pieces, &r->room_pieces, r->n_pieces, sizeof *r->pieces))
        return no_memory(p);
    placed_piece *one = &r->pieces[r->n_pieces++];
    *one = (placed_piece){.number = key->number,
                          .part = piece->part,
                          .encoding = piece->encoding,
                          .header = piece->header,
                          .last = piece->last,
                          .size = piece->size,
                          .at = (int64_t)p->len,
                          .object = r->n_objects};
    snprintf(one->name, sizeof one->name, "%s", key->name ? key->name : HISTORY);
    if (gnutls_hash_fast(GNUTLS_DIG_SHA256, size > 0 ? piece->data : "", size, one->digest) != 0) {
        snprintf(p->cause, sizeof p->cause, "the digest of a result failed");
        return STORE_ERROR;
    }
    if (size > 0)
        memcpy(p->bytes + p->len, piece->data, size);
    p->len += size;
    return STORE_OK;
}

static int64_t bytes_of(const store_answer *a)
{
    int64_t bytes = 8 * a->history_rows * a->history_columns;
    for (size_t i = 0; i < a->n_vectors; i++)
        bytes += 8 * a->vectors[i].count;
    return bytes;
}

placed_result *postgresql_place_result(postgresql_store *s, const char *id, const store_outcome *outcome,
                                       store_status *status)
{
    static const result_blobs PACK = {.put = pack};
    packer p = {.s = s};
    int64_t bytes = bytes_of(&outcome->whole);
    for (size_t i = 0; i < outcome->n_cases; i++)
        bytes += bytes_of(&outcome->cases[i]);
    *status = STORE_OK;
    if (!s->base.settings.objects || bytes < objects_least(s->base.settings.objects))
        return NULL;
    p.result = calloc(1, sizeof *p.result);
    p.bytes = malloc(OBJECT_MOST);
    *status = p.result && p.bytes ? STORE_OK : no_memory(&p);
    if (*status == STORE_OK)
        *status = result_blobs_put(&PACK, &p, id, outcome, &p.result->bytes, &p.result->contents, p.cause);
    if (*status == STORE_OK)
        *status = put_full(&p);
    free(p.bytes);
    if (*status == STORE_OK)
        return p.result;
    store_set_message(&s->base, p.cause);
    postgresql_placed_free(p.result);
    return NULL;
}

void postgresql_placed_free(placed_result *r)
{
    if (!r)
        return;
    uz_free_all(r->pieces, r->objects, r->contents, r);
}

/* The text of an array of the numbers, or words, of some pieces. */
static char *column(const placed_result *r, size_t from, size_t n, int which)
{
    char *text = NULL;
    size_t len;
    FILE *out = open_memstream(&text, &len);
    for (size_t i = from; out && i < from + n; i++) {
        const placed_piece *p = &r->pieces[i];
        const int64_t integers[] = {p->number, 0, p->part, p->encoding, p->header, 0, p->size, 0, p->at};
        fputc(i > from ? ',' : '{', out);
        if (which == 1 || which == 7) /* words of the solver's, names of ours: they need no quotes but for "/" */
            fprintf(out, "\"%s\"", which == 1 ? p->name : p->size > 0 ? r->objects[p->object] : "");
        else if (which == 5)
            fprintf(out, "%.17g", p->last);
        else
            fprintf(out, "%lld", (long long)integers[which]);
    }
    if (out && (fputc('}', out) == EOF || fclose(out) != 0)) {
        free(text);
        text = NULL;
    }
    return text;
}

static void send_pieces(link_to *l, const char *id, uint64_t token, const placed_result *r, size_t from, size_t n)
{
    enum { COLUMNS = 9 };
    char *text[COLUMNS] = {NULL};
    unsigned char digests[PIECES_AT_ONCE * 32];
    bool good = true;
    call c = {.sql = "SELECT uzawa.put_placed($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)"};
    call_text(&c, id);
    call_integer(&c, (int64_t)token);
    for (int k = 0; k < COLUMNS; k++) {
        text[k] = column(r, from, n, k);
        good = good && text[k];
        call_text(&c, text[k]);
    }
    for (size_t i = 0; i < n; i++)
        memcpy(digests + 32 * i, r->pieces[from + i].digest, 32);
    call_bytes(&c, digests, 32 * n);
    if (good) {
        link_send(l, &c);
    } else if (l->status == STORE_OK) {
        l->status = STORE_ERROR;
        strcpy(l->message, "no memory for a result");
    }
    for (int k = 0; k < COLUMNS; k++)
        free(text[k]);
}

void postgresql_send_placed(link_to *l, const char *id, uint64_t token, const placed_result *r)
{
    char *names = malloc(r->n_objects * (OBJECT_NAME + 1) + 3), *at = names;
    call c = {.sql = "SELECT uzawa.object_keep($1, $2, NULL)"};
    if (!names) {
        l->status = STORE_ERROR;
        strcpy(l->message, "no memory for a result");
        return;
    }
    *at++ = '{';
    for (size_t i = 0; i < r->n_objects; i++)
        at += sprintf(at, "%s%s", i > 0 ? "," : "", r->objects[i]);
    strcpy(at, "}");
    call_text(&c, names);
    call_text(&c, id);
    link_send(l, &c);
    free(names);
    for (size_t from = 0; from < r->n_pieces && l->status == STORE_OK; from += PIECES_AT_ONCE)
        send_pieces(l, id, token, r, from, r->n_pieces - from < PIECES_AT_ONCE ? r->n_pieces - from : PIECES_AT_ONCE);
}

/* ---- reading */

#define NO_OBJECTS "a part of this is in an object store, and this daemon was given none: --objects"

store_status postgresql_get_request(postgresql_store *s, const char *names, char *body, size_t size)
{
    char cause[OBJECT_CAUSE] = NO_OBJECTS, name[OBJECT_NAME];
    store_status status = s->base.settings.objects ? STORE_OK : STORE_AWAY;
    size_t from = 0;
    for (const char *at = names + 1; status == STORE_OK && from < size; from += OBJECT_MOST) { /* "{name,name}" */
        const size_t len = strcspn(at, ",}"), left = size - from;
        if (len == 0 || len >= sizeof name)
            return STORE_DAMAGED;
        memcpy(name, at, len);
        name[len] = '\0';
        at += len + 1;
        status =
            objects_get(s->base.settings.objects, name, 0, body + from, left < OBJECT_MOST ? left : OBJECT_MOST, cause);
    }
    if (status != STORE_OK)
        store_set_message(&s->base, cause);
    return status;
}

static store_status fetch(postgresql_store *s, const placed_row *row, void *bytes, char cause[OBJECT_CAUSE], bool *good)
{
    unsigned char digest[32];
    const size_t size = (size_t)row->piece.size;
    if (!s->base.settings.objects) {
        snprintf(cause, OBJECT_CAUSE, NO_OBJECTS);
        return STORE_AWAY;
    }
    const store_status status = objects_get(s->base.settings.objects, row->object, row->at, bytes, size, cause);
    *good = *good && status == STORE_OK && gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes, size, digest) == 0 &&
            memcmp(digest, row->digest, sizeof digest) == 0;
    return status;
}

store_status postgresql_get_placed(postgresql_store *s, const placed_row *rows, size_t n, int64_t after, bool history,
                                   bool (*take)(void *ctx, const result_piece *piece), void *ctx)
{
    char cause[OBJECT_CAUSE] = "no memory for a result";
    char *bytes = malloc(RESULT_PIECE);
    store_status status = bytes ? STORE_OK : STORE_ERROR;
    bool more = true;
    for (size_t i = 0; i < n && more && status == STORE_OK; i++) {
        result_piece piece = rows[i].piece;
        if (piece.size < 0 || piece.size > RESULT_PIECE) { /* what its checksum says too */
            piece.good = false;
            piece.size = 0;
        }
        if (history && !(piece.last > (double)after))
            piece.size = 0;
        piece.data = bytes;
        if (piece.size > 0 && piece.good)
            status = fetch(s, &rows[i], bytes, cause, &piece.good);
        if (status == STORE_DAMAGED) /* whoever takes it says so, with the job's name */
            status = STORE_OK;
        if (status == STORE_OK)
            more = take(ctx, &piece);
    }
    free(bytes);
    if (status != STORE_OK)
        store_set_message(&s->base, cause);
    return status;
}

/* ---- collecting */

typedef struct {
    char names[COLLECT_MOST][OBJECT_NAME];
    int n;
} doomed;

static store_status read_doomed(link_to *l, const PGresult *r, void *ctx)
{
    doomed *d = ctx;
    (void)l;
    for (d->n = 0; d->n < PQntuples(r) && d->n < COLLECT_MOST; d->n++)
        if (!cell_write(d->names[d->n], OBJECT_NAME, r, d->n, 0))
            return STORE_ERROR;
    return STORE_OK;
}

/* The row goes after its object: who comes between finds it again. */
store_status postgresql_collect(store *base, int64_t *count)
{
    postgresql_store *s = postgresql_of(base);
    char cause[OBJECT_CAUSE];
    const double now = clock_seconds(CLOCK_MONOTONIC);
    *count = 0;
    if (!s->base.settings.objects || now < s->collect_after)
        return STORE_OK;
    doomed *d = malloc(sizeof *d);
    store_status status = d ? STORE_OK : STORE_ERROR;
    call look = {.sql = "SELECT uzawa.object_doom($1)"};
    call_integer(&look, COLLECT_MOST);
    s->collect_after = now + COLLECT_S;
    if (status == STORE_OK)
        status = postgresql_do(s, LINK_DURABLE, true, &look, read_doomed, d);
    for (int i = 0; status == STORE_OK && i < d->n; i++) {
        call gone = {.sql = "DELETE FROM uzawa.object WHERE name = $1 AND doomed"};
        call_text(&gone, d->names[i]);
        status = objects_remove(s->base.settings.objects, d->names[i], cause);
        if (status != STORE_OK)
            store_set_message(base, cause);
        else
            status = postgresql_do(s, LINK_LAZY, true, &gone, NULL, NULL);
        *count += status == STORE_OK;
    }
    if (status == STORE_OK && d->n == COLLECT_MOST) /* there are more */
        s->collect_after = 0.0;
    free(d);
    return status;
}
