/* codec.h: JSON in, JSON out.
 *
 * In: bytes -> json_scan (strict grammar, duplicate keys, NUL bytes; a tree with arrays of numbers as values) -> schema
 * check (schemas/request.json) -> decode into the solver's plain structs.
 * Out: a growing text; every function returns malloc'ed NUL-terminated text or NULL when there is no memory. */
#ifndef SERVER_CODEC_H
#define SERVER_CODEC_H

#include "base/problem_details.h"
#include "codec/json.h"
#include "store/nodes.h"
#include "store/store.h"
#include "store/uploads.h"
#include "uzawa.h"

#include <stdbool.h>
#include <stddef.h>

/* What a request may ask for at most. */
typedef struct {
    int json_depth;               /* 1..JSON_MAX_DEPTH */
    int64_t dofs, rows, nonzeros; /* d; m; entries of K and of N given as matrices */
} codec_limits;
/* Once, before threads start: parses the embedded schemas. limits NULL: only the codec's own bounds hold; jobs that are
 * stored already are not held to them. False: message says why. */
bool codec_init(const codec_limits *limits, char *message, size_t size);
void codec_end(void);

/* ---- requests */

/* Where a run begins: at another job's reactions (job), at given ones (reactions), or at zero (neither). */
typedef struct {
    char job[33], case_name[64]; /* "": none */
    bool continued;              /* the other job's run goes on */
    double *reactions;           /* n_reactions, or NULL */
    int64_t n_reactions;
} codec_start;

/* Somebody's answer. */
typedef struct {
    double *u, *r; /* n_u and n_r numbers; u NULL: there is nothing to verify */
    int64_t n_u, n_r;
    int columns; /* u came as points of so many numbers; 0: as numbers */
} codec_answer;

/* What a number of the summary must be: at least, at most, or near a value. NaN: not given. */
typedef struct {
    char quantity[128], name[64], case_name[64]; /* name "": none; case_name "": every case, or the job has none */
    double least, most;
    double near, absolute, relative; /* near: within the larger of absolute and relative * |near| */
} codec_assertion;

typedef struct {
    uz_problem problem;
    uz_settings settings;
    codec_start start;
    codec_answer answer;
    codec_assertion *assertions; /* n_assertions, in the request's order */
    int64_t n_assertions;
    char *tags;          /* JSON array text */
    char (*uploads)[65]; /* n_uploads ids of the uploads that it names, each once */
    size_t n_uploads;
    int priority;         /* -10..10 */
    double queue_limit_s; /* 0: none */
    char *webhook;        /* address to tell of the end, or NULL */
} codec_request;

/* A job's name is kept as the first of its tags, behind a character that no tag has: so every store finds jobs by it.
 */
#define CODEC_NAME_TAG "\x1f"

/* What a body may be: the one that a route takes, or any that the store may hold. */
typedef enum { CODEC_SOLVE, CODEC_VERIFY, CODEC_STORED } codec_kind;

/* Decodes and checks a body. False: *problem is filled (400 json_syntax, 422 with pointer, ...). Everything that can be
 * known without factoring K is known here. uploads: the store whose uploads the body may name, NULL: none. On success
 * the caller clears *out. */
bool codec_decode(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                  problem_details *problem);
/* The same with a cache, or NULL, that keeps meshes of uploads: it must outlive *out. */
bool codec_decode_kept(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                       uz_cache *meshes, problem_details *problem);
/* All that the schema has against a body that codec_decode refuses, as problem+json whose `mistakes` they are. NULL: it
 * has no more than one thing against it, or there is no memory: what codec_decode says is all. */
char *codec_mistakes(const char *body, size_t len);
void codec_request_clear(codec_request *request);
/* Frees the problem and all numbers, and leaves what the store keeps beside the body. */
void codec_request_strip(codec_request *request);

/* A deck that is to be made a request; upload: the id of the one that it is, "": it came as text. */
typedef struct {
    uz_deck deck;
    char upload[65];
} codec_deck;
/* Reads the body of POST /v1/decks. False: *problem. The caller clears *out, whatever happens. */
bool codec_decode_deck(codec_deck *out, const char *body, size_t len, store *uploads, problem_details *problem);
void codec_deck_clear(codec_deck *deck);
char *codec_encode_deck(const codec_deck *deck); /* schemas/translation.json */

/* How many reactions and displacements an answer has (a scene's: dim numbers for each node). False: *problem. */
bool codec_request_sizes(const codec_request *request, int64_t *m, int64_t *n_u, problem_details *problem);
/* Whether what a scene is checked for takes milliseconds and megabytes. It grows with the nodes, and with the parts
 * (selections, supports, loads, ties, contacts), each of which may be all of them: a short text can ask for gigabytes,
 * or minutes. What is not light is left to the run, whose process has a bound on its memory. */
bool codec_request_is_light(const codec_request *request);

/* The body of a refining job: `old` (a valid request) with the values of a POST /v1/jobs/{id}/refine body, and a start
 * that continues `id`. malloc'ed; NULL: *problem says why. */
char *codec_refine(const char *old, size_t old_len, const char *id, const char *body, size_t len, size_t *out_len,
                   problem_details *problem);
/* True if two valid requests have the same problem and cases, byte by byte. */
bool codec_same_problem(const char *a, size_t a_len, const char *b, size_t b_len);

/* Turns the library's error into problem details: status 422, code = uz_status_name, pointer = "/problem/" + where, or
 * where alone if that points elsewhere in the request ("/cases/3/p"). What a request of this kind has no member for is
 * about its problem as a whole: "K" of a scene is "/problem" (or its mesh, if it is too large), "/cases/3/K" is
 * "/problem/K". */
void codec_problem_from_error(problem_details *out, const uz_error *err, uz_problem_kind kind);

/* What is stored of this job is not what was written. */
void codec_problem_damaged(problem_details *out, const char *id);

/* Reads back what codec_encode_problem wrote (a job's error); members that are missing stay empty. */
bool codec_decode_problem(problem_details *out, const char *json);

/* ---- replies */
char *codec_encode_problem(const problem_details *problem);             /* application/problem+json */
char *codec_encode_mistakes(const problem_details *list, size_t count); /* the first, with a list of all */
char *codec_encode_job(const job *j);
char *codec_encode_jobs(const job *jobs, size_t count,
                        bool more); /* {"jobs": [...], "next": cursor or null, "links": ...} */

/* A summary of this service, read back from its text, which must outlive it: its numbers by quantity_read. False: no
 * memory, and *out is empty. json_clear in every case. */
bool codec_summary_read(json_tree *out, const char *json);
/* The text at a name like "problem.kind"; "": it has none, or summary is NULL. Lives as long as the summary. */
const char *codec_summary_text(const json_value *summary, const char *name);

/* How many cases of a job ended in each way. */
#define CODEC_OUTCOMES (UZ_UNHELD + 1)
typedef struct {
    int64_t count, outcomes[CODEC_OUTCOMES];
    const char *worst; /* name */
} codec_cases;
/* What is known of the run around a summary. */
typedef struct {
    const char *started_from; /* "zero", "warm", "continued"; NULL: not said */
    const uz_units *units;    /* NULL, or without words: not said */
    const codec_cases *cases; /* a job with cases: `summary` is what they come to together; else NULL */
} codec_run;
char *codec_encode_summary(const uz_summary *summary, uz_problem_kind kind,
                           const codec_run *run); /* run NULL: nothing */

/* What became of an assertion: the exact value meets it, does not, or may or may not. In the order of their badness. */
typedef enum { CODEC_PASS, CODEC_UNCERTAIN, CODEC_FAIL, CODEC_VERDICTS } codec_verdict;
/* One assertion, of all summaries that were judged by it: how many ended in which way, and the worst of them. */
typedef struct {
    int64_t counts[CODEC_VERDICTS];
    codec_verdict verdict;
    double value, error, margin; /* NaN: not known; margin: of the value to the nearer limit, negative beyond it */
    char reason[160], case_name[64];
} codec_finding;
/* An assertion and what became of it; of_cases: all of them, of which the finding is the worst. */
typedef struct {
    const codec_assertion *of;
    codec_finding found;
    bool of_cases;
} codec_judged;
/* Adds `assertions` and `assertions_passed` to a summary of this service (malloc'ed, replaced). False: no memory, and
 * it stays as it is. */
bool codec_add_findings(char **summary, const codec_judged *list, int64_t n);

char *codec_encode_factors(const uz_cache_entry *entries, size_t count, size_t max_bytes);
/* The reply to a request that is only checked; NULL: nothing is predicted. */
char *codec_encode_valid(const uz_prediction *predicted);
/* The data of a progress event; row: the newest of the history, or NULL. */
char *codec_encode_progress(int progress, const job_grid *grid, const double *row);
char *codec_encode_upload(const upload_info *info);
char *codec_encode_nodes(const store_node *nodes, size_t count);
char *codec_encode_health(const char *status, const int64_t counts[5], int workers);
/* A bound that holds for this service. */
typedef struct {
    const char *name, *unit, *meaning;
    double value; /* infinity: no bound */
} codec_limit;

/* A result as GET /v1/jobs/{id}/result answers it. Vectors that were not asked for are NULL. dim 0: plain numbers;
 * 2, 3: displacements and nodes are written as [[x, y], ...]. Doubles are written with the digits that read back
 * exactly; a NaN or Inf becomes null. */
typedef struct {
    const char *job_id, *summary; /* summary: JSON text, embedded as it is */
    const char *case_name;        /* NULL: none */
    int dim;
    bool own_rows;           /* contact_nodes are of this case, not of all */
    bool part;               /* only a part of the vectors was asked for: */
    int64_t from;            /* the entry that it begins with */
    int64_t m, n_u, n_nodes; /* lengths of reactions and gaps, displacements, nodes (in doubles) */
    const double *reactions, *gaps, *displacements, *nodes, *contact_nodes;
    const double *pressure;  /* scenes: m, of each reaction */
    const double *ray;       /* m: the proof of an infeasible problem */
    const uz_fields *fields; /* scenes: what was computed; its pressure is not written. NULL: nothing */
} codec_result;
char *codec_encode_result(const codec_result *result, size_t *len);
/* What of it is no vector. */
char *codec_encode_result_head(const codec_result *result);
/* The same as an archive of NumPy's: an array for each vector, of points with a column for each number, and the rest
 * as result.json. Of Gauss points there are stress_gauss_elements, _points and _stress. NaN stays NaN. NULL: no
 * memory, or more than such a file can hold. */
char *codec_encode_result_npz(const codec_result *result, size_t *len);

/* Pieces of such a text, for the answers of many cases in one, of which only one case's vectors need be there at a
 * time: an item of "cases", which has all but the job, nodes and contact_nodes (unless own_rows); and these, once for
 * all. */
struct text;
void codec_put_case(struct text *t, const codec_result *one);
void codec_put_places(struct text *t, const codec_result *shared);

/* The surface of a deformed body as a binary glTF file. NULL: no memory. */
typedef struct {
    const uz_surface *surface;
    const uz_scene *scene;
    const char *job_id, *case_name; /* case_name NULL: none */
} codec_surface;
char *codec_encode_surface(const codec_surface *surface, size_t *len);

/* The history's columns in order, and rows of doubles in that order. */
#define CODEC_HISTORY_COLUMNS 12
extern const char *const CODEC_HISTORY_NAMES[CODEC_HISTORY_COLUMNS];
void codec_history_row(double out[CODEC_HISTORY_COLUMNS], const uz_history_row *row);
char *codec_encode_history(const char *case_name, const double *rows, int64_t count, size_t *len); /* NULL: no case */
char *codec_encode_history_csv(const double *rows, int64_t count, size_t *len);
/* Fields along a path: JSON, and the same as CSV with a row for each point. case_name NULL: the job has no cases. */
char *codec_encode_path(const uz_path *path, const char *job_id, const char *case_name, size_t *len);
char *codec_encode_path_csv(const uz_path *path, size_t *len);

/* What accuracy took a run, and what its summary says of its errors; NaN: not known. */
typedef struct {
    const char *job_id, *case_name; /* case_name NULL: none */
    uz_trade trade;
    double mesh_error, solver_error;
} codec_trade;
char *codec_encode_trade(const codec_trade *of, size_t *len);

#endif
