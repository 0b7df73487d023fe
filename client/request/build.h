/* build.h: the requests that the command line of submit stands for. */
#ifndef CLIENT_BUILD_H
#define CLIENT_BUILD_H

#include "session/session.h"

typedef struct {
    client_buffer body;
    char label[160]; /* the values that this one has, "70e3"; "" where nothing varies over jobs */
} client_job_body;

typedef struct {
    client_job_body *item;
    size_t count;
} client_bodies;

/* From FILE, --K and the like, --mesh, --surface, --set, --vary and --tag; large files are uploaded on the way. A FILE
 * that nothing is put into goes as it is, byte for byte but for tags. CLIENT_USAGE: a path or value is wrong;
 * CLIENT_LOCAL: a file is, or no memory; else what the upload ended with. Told on s->err. The caller clears *out. */
client_exit client_build(client_session *s, client_bodies *out);
void client_bodies_clear(client_bodies *bodies);

/* ---- the parts */

/* The file as the text of a JSON string or as an upload, under the key; key NULL: under that of the mesh that it is.
 * path NULL: nothing is put. */
client_exit client_put_file(client_session *s, json_t *to, const char *key, const char *path);
/* By its name: a part from a CAD program (STEP, IGES, BREP). */
bool client_is_cad(const char *path);
/* Puts the mesh that gmsh makes of the part, in elements of the length options->size, and tells of its faces on s->err.
 * CLIENT_LOCAL: gmsh is not installed, makes no mesh, or takes more than it may. */
client_exit client_put_cad(client_session *s, json_t *mesh, const char *path);
/* By its name: a deck of Abaqus or CalculiX. */
bool client_is_deck(const char *path);
/* The request that the service makes of a deck, new; what is not in it is told on s->err, with `all` also what does not
 * matter. */
client_exit client_build_deck(client_session *s, json_t **request, const char *path, bool all);
/* Puts the values of --set into the request. */
client_exit client_build_values(client_session *s, json_t *request);

/* A request for each combination of what varies over jobs, with cases for what varies over cases. *requests: array,
 * new. *labels: array of strings beside it, new. */
client_exit client_build_variants(client_session *s, json_t **requests, json_t **labels, const json_t *request);

/* The values of --vary as an array, new; NULL: message says what is wrong, "" where there is no
 * memory. */
json_t *client_vary_values(const char *text, char *message, size_t size);

/* The command upload. */
client_exit client_upload(client_session *s);

/* By its name: the bytes are gzip's. */
bool client_is_packed(const char *name);
/* Does the file's name end so, without regard to case? packed: or so with ".gz" behind. */
bool client_ends_in(const char *path, const char *ending, bool packed);
/* The id of a file's bytes on the service, which is sent them unless it has them. `name` tells whether it is packed. */
client_exit client_upload_once(client_session *s, char id[65], const char *name, const client_buffer *file);

#endif
