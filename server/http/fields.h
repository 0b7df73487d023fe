/* fields.h: what an answer means, computed from the stored request and the stored answer when somebody asks. */
#ifndef SERVER_HTTP_FIELDS_H
#define SERVER_HTTP_FIELDS_H

#include "codec/codec.h"
#include "http/api.h"

/* How many replies may be computed at a time; others wait for their turn, each in its connection's thread. */
typedef struct field_slots field_slots;
field_slots *field_slots_new(int count); /* NULL: no memory */
void field_slots_free(field_slots *slots);

/* A job's problem, opened for as many of its cases as wanted. */
typedef struct {
    api *context;
    const http_request *rq;
    const job *j;
    codec_request request;
    bool has_slot, is_open;
} field_reader;

/* Waits for a turn and decodes the stored request. False with a 409 for a problem in matrices, a 503 where no turn came
 * in time, or a failure of the store. fields_close in every case. */
bool fields_open(field_reader *reader, api *context, const http_request *rq, const job *j, http_reply *reply);
void fields_close(field_reader *reader);

/* What is made of the answer to a case. */
#define FIELDS_MOST_SURFACE ((size_t)256000000) /* openapi.json says so */
typedef struct {
    enum {
        OUTPUT_FIELDS,
        OUTPUT_MESH_ERROR,
        OUTPUT_VTU,
        OUTPUT_PICTURE,
        OUTPUT_SURFACE /* a glTF file of what a viewer draws; 413 where it is larger than FIELDS_MOST_SURFACE */
    } kind;
    unsigned which;        /* FIELDS, VTU, SURFACE: uz_field bits */
    uz_picture how;        /* PICTURE */
    const char *case_name; /* SURFACE; NULL: none */
    /* What it becomes: one of these three. */
    uz_fields *fields;
    double mesh_error;
    char *text; /* len bytes, malloc'ed */
    size_t len;
} field_output;

/* Case number 0: the job has none. False with a reply. */
bool fields_make(field_output *out, const field_reader *reader, int64_t number, http_reply *reply);
bool fields_of_case(uz_fields *out, const field_reader *reader, int64_t number, unsigned which, http_reply *reply);

/* Fields of a list separated by commas: "summary", "nodes" and those of `allowed` (uz_field bits). False with a 400
 * that has the list. */
typedef struct {
    unsigned which;
    bool nodes;
    bool part;           /* only entries from .. from + count - 1 of each field */
    int64_t from, count; /* an entry is a contact row, or a node (of matrices: a dof) */
} field_list;
bool fields_parse(field_list *out, const char *text, unsigned allowed, problem_details *problem);

#endif
