/* codec.h: JSON in, JSON out. The only folder that knows jansson.
 *
 * In: bytes -> json_scan (strict grammar, duplicate keys, NUL bytes; lifts big number arrays and long strings out of
 * the text so that they never become jansson values) -> jansson (the small rest) -> schema check (schemas/request.json)
 * -> decode into the solver's plain structs.
 * Out: a growing text; every function returns malloc'ed NUL-terminated text or NULL when there is no memory. */
#ifndef SERVER_CODEC_H
#define SERVER_CODEC_H

#include "problem_details.h"
#include "store/store.h"
#include "uzawa.h"

#include <stdbool.h>
#include <stddef.h>

/* Once, before threads start: seeds jansson's hash and parses the embedded schemas. False: message says why. */
bool codec_init(char *message, size_t size);
void codec_end(void);

/* ---- requests */
typedef struct {
    uz_problem problem;
    uz_settings settings;
    char *tags; /* JSON array text */
} codec_request;

/* Decodes and checks a POST /v1/jobs body. False: *problem is filled (400 json_syntax, 422 with pointer, ...).
 * Everything that can be known without factoring K is known here. On success the caller clears *out. */
bool codec_decode_request(codec_request *out, const char *body, size_t len, problem_details *problem);
void codec_request_clear(codec_request *request);

/* Turns the library's error into problem details: status 422, code = uz_status_name, pointer = "/problem/" + where. */
void codec_problem_from_error(problem_details *out, const uz_error *err);

/* Reads back what codec_encode_problem wrote (a job's error); members that are missing stay empty. */
bool codec_decode_problem(problem_details *out, const char *json);

/* ---- replies */
char *codec_encode_problem(const problem_details *problem); /* application/problem+json */
char *codec_encode_job(const job *j);
char *codec_encode_jobs(const job *jobs, size_t count,
                        bool more); /* {"jobs": [...], "next": cursor or null, "links": ...} */
char *codec_encode_summary(const uz_summary *summary, uz_problem_kind kind);
char *codec_encode_factors(const uz_cache_entry *entries, size_t count, size_t max_bytes);
char *codec_encode_health(const char *status, const int64_t counts[5], int workers);

/* A result as GET /v1/jobs/{id}/result answers it. Vectors that were not asked for are NULL. dim 0: plain numbers;
 * 2, 3: displacements and nodes are written as [[x, y], ...]. Doubles are written with the digits that read back
 * exactly; a NaN or Inf becomes null. */
typedef struct {
    const char *job_id, *summary; /* summary: JSON text, embedded as it is */
    int dim;
    int64_t m, n_u, n_nodes; /* lengths of reactions and gaps, displacements, nodes (in doubles) */
    const double *reactions, *gaps, *displacements, *nodes, *contact_nodes;
    const double *pressure; /* scenes: m, of each reaction */
    const double *ray;      /* m: the proof of an infeasible problem */
} codec_result;
char *codec_encode_result(const codec_result *result, size_t *len);

/* The history's columns in order, and rows of doubles in that order. */
#define CODEC_HISTORY_COLUMNS 12
extern const char *const CODEC_HISTORY_NAMES[CODEC_HISTORY_COLUMNS];
void codec_history_row(double out[CODEC_HISTORY_COLUMNS], const uz_history_row *row);
char *codec_encode_history(const double *rows, int64_t count, size_t *len);
char *codec_encode_history_csv(const double *rows, int64_t count, size_t *len);

#endif
