/* output.h: what can be had of a job: one row for each thing under /v1/jobs/{id}/ that is no JSON about the job itself.
 * A new one is a writer and a row in outputs.c, and a path in schemas/openapi.json (docs/architecture/output.md). */
#ifndef SERVER_HTTP_OUTPUT_H
#define SERVER_HTTP_OUTPUT_H

#include "http/api.h"
#include "http/fields.h"
#include "uzawa.h"

/* What the query asks for. */
typedef struct {
    unsigned fields; /* uz_field bits: `fields`, or the row's own choice */
    uz_picture picture;
    uz_path_line path;
    uz_plane plane;
} output_options;

/* What an output is written from. */
typedef struct {
    const char *job_id, *case_name; /* case_name NULL: the job has no cases */
    const output_options *options;
    const uz_scene *scene; /* OUTPUT_OF_ANSWER: with the loads of the case; */
    const uz_field_source *answer;
    const double *rows; /* OUTPUT_OF_HISTORY: n_rows x CODEC_HISTORY_COLUMNS */
    int64_t n_rows;
} output_source;

typedef enum {
    OUTPUT_OF_ANSWER,  /* of a case of a scene, once the job ended: 409 for matrices, a tag, ranges of bytes */
    OUTPUT_OF_HISTORY, /* of a case, also while it runs */
    OUTPUT_OWN         /* more than one answer is in it: the route has a handler of its own, and the rest is not used */
} output_kind;

/* Writes the whole file. *file: malloc'ed, NULL on failure; hooks may end the work, as in the library. */
typedef uz_status (*output_writer)(char **file, size_t *len, const output_source *of, const uz_hooks *hooks,
                                   uz_error *err);

typedef struct output {
    route route;      /* the first member, so that the route of a request is a row; handler: output_get */
    const char *type; /* of the content */
    output_kind kind;
    output_writer write;
    unsigned by_default, allowed; /* uz_field bits of the parameter `fields`; 0: it has none */
    /* Parameters of its own, before the job is looked for; NULL: none. False: *problem, a 400. */
    bool (*read)(output_options *out, const http_request *rq, problem_details *problem);
    bool negotiated; /* a client that accepts the type of the next row gets that */
} output;

extern const output OUTPUTS[]; /* `type` NULL ends it */
void output_get(api *context, http_request *rq, http_reply *reply);

#endif
