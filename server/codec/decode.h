/* decode.h: the steps from a checked document to the solver's structs; inside the codec only.
 * The document has passed schemas/request.json, so keys and types are as it says. Each step fills a zeroed struct that
 * the caller clears whatever happens; false: *problem says why. */
#ifndef SERVER_CODEC_DECODE_H
#define SERVER_CODEC_DECODE_H

#include "codec/json_doc.h"
#include "uzawa.h"

/* Takes big vectors out of the document and frees big texts as soon as they are read. body_len bounds what the
 * matrices may take. */
bool decode_matrices(uz_qp *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem);
bool decode_scene(uz_scene *out, const json_t *object, problem_details *problem);
/* object NULL: the defaults. */
void decode_settings(uz_settings *out, const json_t *object);

#endif
