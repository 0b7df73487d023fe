/* objects.h: what of a database's blobs is in an object store (store_settings.objects): who names objects and knows
 * whose they are.
 *
 *   - An object has a row from before it is written until after it was removed, and its name, the SHA-256 of its bytes
 *     and a random number, is never used twice: whatever crashes, what is there without belonging to anything is found
 *     by its row, by any daemon, and nobody can take it up again meanwhile (uzawa.object_keep, object_doom).
 *   - It is written first; the transaction that publishes what it is a part of makes it somebody's. */
#ifndef SERVER_STORE_POSTGRESQL_OBJECTS_H
#define SERVER_STORE_POSTGRESQL_OBJECTS_H

#include "store/objects/objects.h"
#include "store/postgresql/internal.h"

/* Writes an object of at most OBJECT_MOST bytes. A failure: cause. */
store_status postgresql_put_object(postgresql_store *s, const void *data, size_t size, char name[OBJECT_NAME],
                                   char cause[OBJECT_CAUSE]);

/* The body of a request in objects, which are nobody's yet: the text of an array of their names, in order. NULL: it is
 * to be in a row, as it also is where the object store does not answer. The caller frees it. */
char *postgresql_place_request(postgresql_store *s, const void *body, size_t size);
/* Back from there; names: as postgresql_place_request returned it. STORE_DAMAGED: they have not `size` bytes. */
store_status postgresql_get_request(postgresql_store *s, const char *names, char *body, size_t size);

/* A piece of a result: where its bytes are. */
typedef struct {
    char name[32]; /* of the vector or history, as in its row */
    int64_t number, part, encoding, header, size, at;
    double last;
    size_t object; /* which of the objects */
    unsigned char digest[32];
} placed_piece;

/* The result of a job in objects, which are nobody's yet. */
typedef struct {
    placed_piece *pieces;
    char (*objects)[OBJECT_NAME];
    size_t n_pieces, room_pieces, n_objects, room_objects;
    int64_t bytes;
    char *contents;
} placed_result;
/* NULL where objects do not come into it, or on failure: *status, and the message is set. */
placed_result *postgresql_place_result(postgresql_store *s, const char *id, const store_outcome *outcome,
                                       store_status *status);
void postgresql_placed_free(placed_result *r); /* NULL is fine */
/* In the transaction that ends the job. */
void postgresql_send_placed(link_to *l, const char *id, uint64_t token, const placed_result *r);

/* A piece as it is read: rows of `placed` are collected, and their bytes got when the connection is free again. */
typedef struct {
    char object[OBJECT_NAME];
    result_piece piece;
    int64_t at;
    unsigned char digest[32];
} placed_row;
/* Hands over the pieces in order, with their bytes; of a history those up to `after` without (result_blobs.h). */
store_status postgresql_get_placed(postgresql_store *s, const placed_row *rows, size_t n, int64_t after, bool history,
                                   bool (*take)(void *ctx, const result_piece *piece), void *ctx);

#endif
