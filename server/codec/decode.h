/* decode.h: the steps from a checked document to the solver's structs; inside the codec only.
 * The document has passed schemas/request.json, so keys and types are as it says. Each step fills a zeroed struct that
 * the caller clears whatever happens; false: *problem says why. */
#ifndef SERVER_CODEC_DECODE_H
#define SERVER_CODEC_DECODE_H

#include "codec/codec.h"
#include "codec/json_doc.h"
#include "codec/schema.h"
#include "store/uploads.h"
#include "uzawa.h"

/* Takes big vectors out of the document and frees big texts as soon as they are read. body_len bounds what the
 * matrices may take. */
bool decode_matrices(uz_qp *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem);
bool decode_scene(uz_scene *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem);
/* dim: numbers in a vector; list_at: where the list is in the request. */
bool decode_loads(uz_load **out, int64_t *n, const json_t *list, int dim, const json_path *list_at,
                  problem_details *problem);
/* A scene's mesh (not a box) and contacts (decode_mesh.c, decode_contacts.c); out->model is there. */
bool decode_mesh(uz_scene *out, json_doc *doc, const json_t *mesh, size_t body_len, problem_details *problem);
bool decode_contacts(uz_scene *out, json_doc *doc, const json_t *list, size_t body_len, problem_details *problem);
/* The load cases of a decoded problem; list NULL: none. */
bool decode_cases(uz_problem *problem, json_doc *doc, const json_t *list, size_t body_len, problem_details *details);
/* A short text of the user's: 1 to 63 bytes without control characters, since it is compared as a C string by the store
 * and shown in terminals. what: "A name of a case". */
bool decode_label(char out[64], const json_t *value, const json_path *path, const char *what, problem_details *problem);
/* Assertions about the summary, after the cases; list NULL: none. */
bool decode_assertions(codec_request *out, const json_t *list, problem_details *problem);
/* object NULL: from zero. */
bool decode_start(codec_start *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem);
bool decode_answer(codec_answer *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem);
/* object NULL: the defaults. */
void decode_settings(uz_settings *out, const json_t *object);

/* ---- pieces (decode_vector.c). `where` is as in uz_error: the name of a member of /problem, or a pointer. */

/* What one matrix or vector of a request of so many bytes may take. */
size_t decode_memory_bound(size_t body_len);
/* A string's bytes, lifted or not; decode_text_done frees them early. */
const char *decode_text(const json_doc *doc, const json_t *value, size_t *len);
void decode_text_done(const json_doc *doc, const json_t *value);
/* What {"upload": id} names, or NULL where the value is something else. */
const char *decode_upload_id(const json_t *value);
/* A text of the request: a string's bytes, or those of the upload that it names. `where` as above. */
typedef struct {
    const char *data; /* not NUL-terminated */
    size_t len;
    upload_text mapped; /* of an upload */
} decode_source;
bool decode_source_open(decode_source *out, json_doc *doc, const json_t *value, const char *where,
                        problem_details *problem);
/* Gives the text back, so that it is not in memory twice: it can't be opened again if it was a string. */
void decode_source_close(decode_source *source, const json_doc *doc, const json_t *value);
/* The schema files; set while the codec is. */
const schemas *decode_schemas(void);
/* The document against a schema file, as schemas_check. */
bool decode_check(const json_doc *doc, const char *schema, problem_details *problem);
bool decode_no_memory(problem_details *problem); /* 503; returns false */
/* Room for the items of a list that may be absent, zeroed; NULL: *problem. */
void *decode_room(const json_t *list, size_t size, int64_t *count, problem_details *problem);
/* A group's name; one that no mesh has (too long, or with a NUL in it) becomes "". */
void decode_name(char *out, size_t size, const json_t *object, const char *key, const char *otherwise);
/* The vector `key` of an object into out[0..dim), `otherwise` in what is absent and 0 beyond dim; false if it has not
 * dim numbers. */
bool decode_components(double out[3], const json_t *object, const char *key, double otherwise, int dim,
                       const json_path *object_at, problem_details *problem);
/* The same, and false if it is zero; what: "it must point out of the obstacle". */
bool decode_direction(double out[3], const json_t *object, const char *key, int dim, const json_path *object_at,
                      const char *what, problem_details *problem);
/* An array of numbers, taken out of the document where it was lifted, or Matrix Market text. The caller frees *out. */
bool decode_vector(double **out, int64_t *n, json_doc *doc, const json_t *value, size_t bound, const char *where,
                   problem_details *problem);
/* The same for an array whose items may be points; *columns is their size, 0 for numbers; *n counts numbers. */
bool decode_points(double **out, int64_t *n, int *columns, json_doc *doc, const json_t *value, size_t bound,
                   const char *where, problem_details *problem);

#endif
