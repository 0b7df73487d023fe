/* paths.h: values inside a request by their path, as --set and --vary name them. */
#ifndef CLIENT_PATHS_H
#define CLIENT_PATHS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#define CLIENT_PATH_PARTS 32

/* "loads.1.traction.0" as keys and indices from the request's top: problem, loads, 1, traction, 0. */
typedef struct {
    char text[256]; /* the parts, each ended by NUL */
    const char *part[CLIENT_PATH_PARTS];
    int count;
} client_path;

/* A path that begins neither at a member of the request nor at one of those that it may have begins in its problem.
 * False: message says what is wrong with it. */
bool client_path_read(client_path *out, const json_t *request, const char *text, size_t len, char *message,
                      size_t size);

/* The value there, borrowed; NULL: message says which part is missing and what is there. */
json_t *client_path_get(const client_path *path, json_t *request, char *message, size_t size);

/* Puts value (whose reference it takes in any case) there. Only the last part may be new, and objects below "solver"
 * and "webhook", which a request may do without. */
bool client_path_set(const client_path *path, json_t *request, json_t *value, char *message, size_t size);

/* VALUE of --set: JSON, or else a string. NULL: not UTF-8, or no memory. */
json_t *client_value_read(const char *text, size_t len);

#endif
