/* result_blobs.h: the numbers of results as bytes: the interface of the place where an engine keeps them, and what
 * makes bytes of numbers and numbers of bytes, which is the same for every engine (result_blobs.c).
 *
 * A vector or a history of a load case is one blob. It goes in pieces of at most RESULT_PIECE bytes, so that neither
 * side holds a second copy of a large one, and a piece repeats what all of them say (header).
 *
 *   - put belongs to the transaction of finish: a blob is seen with the end of its job, both or neither, whatever
 *     crashes. An engine that keeps blobs outside its transactions publishes them before the commit, under names that
 *     only the row written then knows.
 *   - get reads as of one moment. An empty blob has one piece, so that it is not the same as none.
 *   - Blobs are removed with their job, in the transaction of dismiss or retain that deletes it.
 *   - An engine tells of each piece whether it is what was put. */
#ifndef SERVER_STORE_RESULT_BLOBS_H
#define SERVER_STORE_RESULT_BLOBS_H

#include "store/store.h"

#define RESULT_PIECE    (1 << 20) /* bytes */
#define RESULT_ENCODING 1 /* little-endian IEEE 754 binary64. Another one gets another number; old ones are read */

typedef struct {
    const char *job;
    int64_t number;   /* of the case; 0: of the job, or of all its cases */
    const char *name; /* of the vector; NULL: the history */
} result_key;

typedef struct {
    int64_t part;     /* from 0 */
    int64_t encoding; /* RESULT_ENCODING */
    int64_t header;   /* numbers in all of the vector, or columns of the history */
    double last;      /* history: the iteration of the piece's last row, -1 where it has none */
    const void *data;
    int64_t size;
    bool good; /* get: it is what was put */
} result_piece;

typedef struct {
    /* transaction: as the engine gave it to result_blobs_put. The cause of a failure is left as the engine leaves its
     * own. */
    store_status (*put)(void *transaction, const result_key *key, const result_piece *piece);
    /* Hands over the pieces in order, until `take` returns false; of a history those whose rows all have iterations up
     * to `after` without their bytes (size 0). STORE_NOT_FOUND: there is none. */
    store_status (*get)(store *s, const result_key *key, int64_t after,
                        bool (*take)(void *ctx, const result_piece *piece), void *ctx);
    /* The sum of the headers of all vectors of that name in a job. */
    store_status (*count)(store *s, const char *id, const char *name, int64_t *total);
    /* The list that result_blobs_put made of the blobs of a job, freed by the caller; NULL: an older format kept none.
     * STORE_DAMAGED: it is not what was written. No such function: somebody else looks there. */
    store_status (*contents)(store *s, const char *id, char **list);
} result_blobs;

/* For an engine's finish: puts the vectors and histories of an outcome; *bytes is how many they are, *contents a list
 * of them, freed by the caller, which the engine keeps with the end of the job, under a checksum: a blob that is lost,
 * or has another name, would else not be missed. Its first line is how many blobs and cases there are together, and how
 * many cases; each other one "NUMBER NAME COUNT" of a vector, "NUMBER / COUNT" of a history. cause is set where it is
 * not the place that failed. */
store_status result_blobs_put(const result_blobs *place, void *transaction, const char *id,
                              const store_outcome *outcome, int64_t *bytes, char **contents, char cause[256]);

/* For what was read and not found: STORE_DAMAGED, and a message, where the list has the blob, or where it has another
 * number of cases than that (-1: any); key->name NULL and n_cases not -1: nothing is looked for. Otherwise STORE_OK. */
store_status result_blobs_missing(store *s, const result_key *key, int64_t n_cases);

#endif
