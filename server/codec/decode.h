/* decode.h: the steps from a checked tree to the solver's structs; inside the codec only.
 * The request has passed schemas/request.json, so keys and types are as it says. Each step fills a zeroed struct that
 * the caller clears whatever happens; false: the problem says why. */
#ifndef SERVER_CODEC_DECODE_H
#define SERVER_CODEC_DECODE_H

#include "codec/codec.h"
#include "codec/json.h"
#include "codec/schema.h"
#include "store/uploads.h"
#include "uzawa.h"

/* A request on its way. */
typedef struct {
    struct store *store; /* where uploads are read that it names; NULL: there are none */
    char (*uploads)[65]; /* n_uploads ids that were read, each once; who takes them sets it to NULL */
    size_t n_uploads;
    uz_cache *meshes; /* keeps those of uploads; NULL: nobody does */
    size_t bound;     /* bytes that one matrix or vector may take */
    uz_scene *scene;  /* what groups are of; NULL: the problem is in matrices */
    problem_details *problem;
} decoding;

/* The schema files; set while the codec is. */
const schemas *decode_schemas(void);

bool decode_matrices(uz_qp *out, decoding *d, const json_value *object);
bool decode_scene(uz_scene *out, decoding *d, const json_value *object);
bool decode_loads(uz_load **out, int64_t *n, decoding *d, const json_value *list, int dim);
/* A scene's mesh, not a box; out->model is there. */
bool decode_mesh(uz_scene *out, decoding *d, const json_value *mesh);
/* Groups by where they are (decode_groups.c), after the mesh; d->scene is where they go. */
bool decode_selections(uz_scene *out, decoding *d, const json_value *list);
/* What is said `on`: the name of a group of d->scene, of sides of boxes also +x and the like; or a place, which becomes
 * a selection of the scene, and its name says which. value NULL: "". */
typedef enum {
    GROUP_OF_ANY,
    GROUP_OF_SIDES,
    GROUP_OF_ELEMENTS,
    GROUP_OR_CONTACT /* any name: also what several groups are called together, which is no group; checked later */
} group_use;
bool decode_group(char name[64], decoding *d, const json_value *value, group_use use);
/* The selection of all outer sides, for the sake of value. */
bool decode_everywhere(char name[64], decoding *d, const json_value *value);
/* What stands beside the problem (decode_beside.c); list or object NULL: none, or the defaults. */
bool decode_cases(uz_problem *problem, decoding *d, const json_value *list);
void decode_settings(uz_settings *out, const json_value *object);
/* Numbers to be answered by intervals; first that of the accuracy (of the solver), if it is one. After the scene. */
bool decode_quantities(uz_problem *problem, uz_settings *settings, decoding *d, const json_value *list,
                       const json_value *accuracy);
/* Assertions about the summary; after the cases. */
bool decode_assertions(codec_request *out, decoding *d, const json_value *list);

/* ---- pieces (decode_pieces.c) */

/* 422 with "POINTER message" about the value; returns false. */
bool decode_refuse(decoding *d, const char *code, const json_value *at, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* What the library says of the matrix or the vector at `at`; returns false. */
bool decode_refuse_file(decoding *d, const uz_error *err, const json_value *at);
/* Room for the items of a list that may be absent, zeroed; NULL: no memory, and the problem says so. */
void *decode_room(decoding *d, const json_value *list, size_t size, int64_t *count);
/* A group's name; one that no mesh has (too long, or with a NUL in it) becomes "". */
void decode_name(char *out, size_t size, const json_value *object, const char *key, const char *otherwise);
/* Whether a text has a character that a terminal would obey, or that changes the order of others (text/utf8.h). */
bool decode_unsafe(const char *text, size_t len);
/* A short text of the user's, label[0..len): 1 to 63 bytes without such characters, since it is compared as a C
 * string by the store and shown in terminals. at: where the refusal points; what: "A name of a case". */
bool decode_label(char out[64], decoding *d, const json_value *at, const char *label, size_t len, const char *what);
/* The vector `key` of an object into out[0..dim), `otherwise` in what is absent and 0 beyond dim; false if it has not
 * dim numbers, or if it is zero where it must not be: what: "it must point out of the obstacle", or NULL. */
bool decode_components(double out[3], decoding *d, const json_value *object, const char *key, double otherwise, int dim,
                       const char *what);
/* A text or file of the request: a string's bytes, or those of the upload that it names. */
typedef struct {
    const char *data; /* not NUL-terminated */
    size_t len;
    const char *digest; /* of an upload, hex: its id; NULL: it came with the request */
    char *copy;         /* of a long string */
    upload_text mapped; /* of an upload */
} decode_source;
bool decode_source_open(decode_source *out, decoding *d, const json_value *value);
void decode_source_close(decode_source *source);
/* An array of numbers, Matrix Market text, or a file of NumPy's. The caller frees *out also on failure. */
bool decode_vector(double **out, int64_t *n, decoding *d, const json_value *value);
/* The same for an array whose items may be points; *columns is their size, 0 for numbers; *n counts numbers. */
bool decode_points(double **out, int64_t *n, int *columns, decoding *d, const json_value *value);

#endif
