/* fields.h: what an answer means, computed from the stored request and the stored answer when somebody asks. */
#ifndef SERVER_HTTP_FIELDS_H
#define SERVER_HTTP_FIELDS_H

#include "codec/codec.h"
#include "http/api.h"

/* A job's problem, opened for as many of its cases as wanted. */
typedef struct {
    api_asker asker;
    const job *j;
    codec_request request;
    bool has_turn, is_open;
} field_reader;

/* Waits for a turn and decodes the stored request. False with a 409 for a problem in matrices, a 503 where no turn came
 * in time, or a failure of the store. fields_close in every case. */
bool fields_open(field_reader *reader, api *context, const http_request *rq, const job *j, http_reply *reply);
void fields_close(field_reader *reader);

/* A computation of the library on the case's scene and its stored answer; it ends where nobody waits for it any more.
 * Case number 0: the job has none. False with a reply. */
typedef uz_status (*field_computation)(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                                       const uz_hooks *hooks, uz_error *err);
bool fields_compute(void *out, field_computation run, const field_reader *reader, int64_t number, unsigned which,
                    http_reply *reply);
/* A computation of uz_fields; `which`: uz_field bits. */
uz_status fields_of_case(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                         const uz_hooks *hooks, uz_error *err);

/* Fields of a list separated by commas: "summary", "nodes" and those of `allowed` (uz_field bits); of no list (NULL)
 * `otherwise`. False with a 400 that has the list. */
typedef struct {
    unsigned which;
    bool nodes;
    bool part;           /* only entries from .. from + count - 1 of each field */
    int64_t from, count; /* an entry is a contact row, or a node (of matrices: a dof) */
} field_list;
bool fields_parse(field_list *out, const char *text, unsigned otherwise, unsigned allowed, problem_details *problem);

#endif
