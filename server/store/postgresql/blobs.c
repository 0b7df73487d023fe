/* blobs.c: bytes of uploads in the database, in pieces, so that every daemon has them; large pieces in an object store,
 * where there is one. They are written under a name of their own, in transactions of a piece each, and are the blob
 * once they are published. Whoever reads one gets a copy in a file that has no name. */
#include "store/blobs.h"
#include "store/postgresql/objects.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#define PIECE ((size_t)1 << 20)

typedef struct {
    blobs base;
    postgresql_store *s;
} database_blobs;

typedef struct {
    blob_writer base;
    postgresql_store *s;
    char name[33];
    int64_t part;
    size_t len, room;
    bool published;
    char piece[]; /* room of them */
} database_writer;

static store_status run(postgresql_store *s, const call *c, char cause[BLOB_CAUSE])
{
    const store_status status = postgresql_do(s, LINK_DURABLE, false, c, NULL, NULL);
    if (status != STORE_OK)
        store_message(&s->base, cause, BLOB_CAUSE);
    return status;
}

static store_status begin(blobs *b, blob_writer **out, char cause[BLOB_CAUSE])
{
    postgresql_store *s = ((database_blobs *)b)->s;
    uint64_t random[2];
    const size_t room = s->base.settings.objects ? OBJECT_MOST : PIECE;
    database_writer *w = calloc(1, sizeof *w + room);
    call c = {.sql = "INSERT INTO uzawa.blob(id, written, sealed) VALUES ($1, uzawa.moment(), false)"};
    *out = NULL;
    if (!w || getrandom(random, sizeof random, 0) != (ssize_t)sizeof random) {
        snprintf(cause, BLOB_CAUSE, "no memory for an upload");
        free(w);
        return STORE_ERROR;
    }
    w->base.blobs = b;
    w->s = s;
    w->room = room;
    snprintf(w->name, sizeof w->name, "%016llx%016llx", (unsigned long long)random[0], (unsigned long long)random[1]);
    call_text(&c, w->name);
    const store_status status = run(s, &c, cause);
    if (status == STORE_OK)
        *out = &w->base;
    else
        free(w);
    return status;
}

static store_status send_piece(database_writer *w, char cause[BLOB_CAUSE])
{
    objects *place = w->s->base.settings.objects;
    char name[OBJECT_NAME];
    const bool placed = place && (int64_t)w->len >= objects_least(place);
    call c = {.sql = placed ? "SELECT uzawa.blob_place($1, $2, $3, $4)"
                            : "INSERT INTO uzawa.blob_piece(blob, part, data) VALUES ($1, $2, $3)"};
    if (w->len == 0)
        return STORE_OK;
    call_text(&c, w->name);
    call_integer(&c, w->part++);
    if (placed) {
        const store_status status = postgresql_put_object(w->s, w->piece, w->len, name, cause);
        if (status != STORE_OK)
            return status;
        call_text(&c, name);
        call_integer(&c, (int64_t)w->len);
    } else {
        call_bytes(&c, w->piece, w->len);
    }
    w->len = 0;
    return run(w->s, &c, cause);
}

static store_status put(blob_writer *base, const void *data, size_t size, char cause[BLOB_CAUSE])
{
    database_writer *w = (database_writer *)base;
    store_status status = STORE_OK;
    for (const char *at = data; size > 0 && status == STORE_OK;) {
        const size_t n = size < w->room - w->len ? size : w->room - w->len;
        memcpy(w->piece + w->len, at, n);
        w->len += n;
        at += n;
        size -= n;
        if (w->len == w->room)
            status = send_piece(w, cause);
    }
    return status;
}

static store_status seal(blob_writer *base, char cause[BLOB_CAUSE])
{
    return send_piece((database_writer *)base, cause);
}

static store_status publish(blob_writer *base, const char *id, char cause[BLOB_CAUSE])
{
    database_writer *w = (database_writer *)base;
    call c = {.sql = "SELECT uzawa.blob_publish_2($1, $2)"};
    call_text(&c, w->name);
    call_text(&c, id);
    const store_status status = run(w->s, &c, cause);
    w->published = status == STORE_OK;
    return status;
}

static void end(blob_writer *base)
{
    database_writer *w = (database_writer *)base;
    char cause[BLOB_CAUSE];
    call c = {.sql = "DELETE FROM uzawa.blob WHERE id = $1"};
    call_text(&c, w->name);
    if (!w->published)
        run(w->s, &c, cause);
    free(w);
}

/* A piece whose bytes are in an object, and where they go. */
typedef struct {
    char object[OBJECT_NAME];
    int64_t size;
    off_t at;
} placed_part;

typedef struct {
    int fd, cause;
    bool any;
    off_t at; /* of the next piece */
    placed_part *placed;
    size_t n_placed, room;
} copy;

static bool note_placed(copy *to, const PGresult *r)
{
    if (to->n_placed == to->room) {
        const size_t room = to->room ? 2 * to->room : 16;
        placed_part *grown = realloc(to->placed, room * sizeof *grown);
        to->cause = grown ? 0 : ENOMEM;
        if (!grown)
            return false;
        to->placed = grown;
        to->room = room;
    }
    placed_part *one = &to->placed[to->n_placed++];
    *one = (placed_part){.size = cell_integer(r, 0, 2), .at = to->at};
    if (!cell_write(one->object, sizeof one->object, r, 0, 1) || one->size <= 0 || one->size > OBJECT_MOST)
        to->cause = ENOENT;
    to->at += one->size;
    return to->cause == 0;
}

static bool copy_piece(void *ctx, const PGresult *r)
{
    copy *to = ctx;
    to->any = true;
    if (!PQgetisnull(r, 0, 1))
        return note_placed(to, r);
    if (PQgetisnull(r, 0, 0)) /* it has no bytes */
        return true;
    if (lseek(to->fd, to->at, SEEK_SET) < 0 ||
        !blob_write_all(to->fd, PQgetvalue(r, 0, 0), (size_t)PQgetlength(r, 0, 0)))
        to->cause = errno;
    to->at += PQgetlength(r, 0, 0);
    return to->cause == 0;
}

/* Sets to->cause, and the store's message. */
static void copy_placed(postgresql_store *s, copy *to)
{
    char cause[OBJECT_CAUSE] = "a part of this is in an object store, and this daemon was given none: --objects";
    char *bytes = to->n_placed > 0 ? malloc(OBJECT_MOST) : NULL;
    if (to->n_placed > 0 && !bytes)
        to->cause = ENOMEM;
    for (size_t i = 0; i < to->n_placed && to->cause == 0; i++) {
        const placed_part *one = &to->placed[i];
        const store_status status = s->base.settings.objects ? objects_get(s->base.settings.objects, one->object, 0,
                                                                           bytes, (size_t)one->size, cause)
                                                             : STORE_AWAY;
        if (status != STORE_OK) {
            store_set_message(&s->base, cause);
            to->cause = status == STORE_DAMAGED ? ENOENT : EHOSTUNREACH;
        } else if (lseek(to->fd, one->at, SEEK_SET) < 0 || !blob_write_all(to->fd, bytes, (size_t)one->size)) {
            to->cause = errno;
        }
    }
    free(bytes);
}

static int open_blob(blobs *b, const char *id)
{
    postgresql_store *s = ((database_blobs *)b)->s;
    const char *folder = getenv("TMPDIR");
    copy to = {.fd = open(folder ? folder : "/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)};
    call c = {.sql = "SELECT data, object, size FROM uzawa.blob LEFT JOIN uzawa.blob_piece ON blob = id WHERE id = $1"
                     " AND sealed ORDER BY part"};
    if (to.fd < 0)
        return -1;
    call_text(&c, id);
    link_to *l = postgresql_take(s);
    const store_status status = postgresql_give(s, l, link_stream(l, &c, copy_piece, &to));
    if (status == STORE_OK && to.cause == 0)
        copy_placed(s, &to);
    free(to.placed);
    if (status == STORE_OK && to.any && to.cause == 0 && lseek(to.fd, 0, SEEK_SET) == 0)
        return to.fd;
    close(to.fd);
    errno = status == STORE_AWAY ? EHOSTUNREACH : status != STORE_OK ? EIO : to.cause != 0 ? to.cause : ENOENT;
    return -1;
}

/* One that somebody has just named again stays: its row refers to it. */
static void remove_blob(blobs *b, const char *id)
{
    call c = {.sql = "DELETE FROM uzawa.blob WHERE id = $1 AND NOT EXISTS (SELECT 1 FROM uzawa.upload WHERE id = $1)"};
    call_text(&c, id);
    postgresql_do(((database_blobs *)b)->s, LINK_DURABLE, true, &c, NULL, NULL);
}

/* Others may be writing: what is old goes. */
static void sweep(blobs *b, bool (*keep)(void *ctx, const char *id), void *ctx)
{
    const call c = {.sql = "SELECT uzawa.blob_sweep()"};
    (void)keep;
    (void)ctx;
    postgresql_do(((database_blobs *)b)->s, LINK_DURABLE, true, &c, NULL, NULL);
}

static void close_blobs(blobs *b)
{
    free(b);
}

blobs *postgresql_blobs(postgresql_store *s)
{
    static const blob_operations DOES = {.begin = begin,
                                         .write = put,
                                         .seal = seal,
                                         .publish = publish,
                                         .end = end,
                                         .open = open_blob,
                                         .remove = remove_blob,
                                         .sweep = sweep,
                                         .close = close_blobs};
    database_blobs *b = calloc(1, sizeof *b);
    if (b)
        *b = (database_blobs){{&DOES}, s};
    return (blobs *)b;
}
