/* closest.h: what a mistyped word was probably meant to be. */
#ifndef CLIENT_CLOSEST_H
#define CLIENT_CLOSEST_H

#include <stddef.h>

/* The best candidate for a word so far. Begin with {.word = w, .len = its length}. */
typedef struct {
    const char *word;
    size_t len;
    const char *best; /* NULL: none is near */
    int distance;     /* of best */
} client_closest;

/* Keeps the candidate where it is nearer than those before, and near: at most one edit (insert, delete, replace, swap
 * neighbours), and one more for each four letters of the word. *candidate must live as long as *c. */
void client_closest_try(client_closest *c, const char *candidate);

#endif
