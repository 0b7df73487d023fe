/* guard.c: small problems whose instructions are counted. guard_measured is what counts; everything before it prepares.
 * Nothing in it depends on time: iterations are fixed or the active set's.
 * usage: guard NAME [REPEATS] | guard --names | guard --compiler */
#include "codec/codec.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    uz_problem problem;
    uz_settings settings;
    uz_cache *cache;
    int64_t iterations;
    char *text; /* a request, and a matrix */
    size_t len;
} state;

typedef struct {
    const char *name;
    int repeats;
    bool (*prepare)(state *s);
    bool (*run)(state *s);
} problem_of;

static bool fail(const char *what, const char *message)
{
    fprintf(stderr, "%s: %s\n", what, message);
    return false;
}

/* ------------------------------------------------------------------ solves */

static bool paper_body(state *s, int64_t nx)
{
    char request[1200];
    codec_request decoded;
    problem_details problem;
    int len = snprintf(request, sizeof request,
                       "{\"problem\": {\"kind\": \"scene\", \"model\": \"plane_stress\", \"thickness\": 5, \"mesh\": "
                       "{\"box\": {\"size\": [60, 20], \"cells\": [%lld, %lld], \"element\": \"quad4\"}}, "
                       "\"materials\": [{\"on\": \"all\", \"young\": 200e3, \"poisson\": 0.3}], \"supports\": "
                       "[{\"on\": \"left\", \"ux\": 0, \"uy\": 0}], \"loads\": [{\"on\": \"top\", \"traction\": [0, "
                       "-0.05]}, {\"on\": \"right\", \"traction\": [0.5, 0]}], \"contacts\": [{\"on\": \"bottom\", "
                       "\"obstacle\": {\"plane\": {\"point\": [0, 0], \"normal\": [0, 1]}}}]}}",
                       (long long)nx, (long long)(nx / 3));
    if (!codec_decode(&decoded, CODEC_SOLVE, request, (size_t)len, NULL, &problem))
        return fail("the paper's body", problem.detail);
    s->problem = decoded.problem; /* the rest of the request has nothing of it */
    memset(&decoded.problem, 0, sizeof decoded.problem);
    codec_request_clear(&decoded);
    s->settings = uz_settings_default();
    return true;
}

/* iterations 0: it has to converge. */
static bool solve(state *s)
{
    uz_result *result = NULL;
    uz_error err = {0};
    if (uz_solve(&result, &s->problem, &s->settings, s->cache, NULL, &err) != UZ_OK)
        return fail("solve", err.message);
    const uz_summary *end = &result->summary;
    bool good = s->iterations > 0 ? end->iterations == s->iterations : end->outcome == UZ_CONVERGED;
    uz_result_free(result);
    return good || fail("solve", "another end than expected");
}

static bool cold(state *s)
{
    bool good = paper_body(s, 60);
    s->settings.op = UZ_OPERATOR_CONDENSED;
    return good;
}

/* The factor, D and its largest eigenvalue are there; no bound is met, so that so many iterations are made. */
static bool fixed(state *s, int64_t nx, uz_operator op, int64_t iterations)
{
    if (!paper_body(s, nx))
        return false;
    if (op == UZ_OPERATOR_MATRIX_FREE) /* cells that are not equal, so that it has a matrix */
        s->problem.scene.box.grading[0] = 1.01;
    s->settings.method = UZ_METHOD_ACCELERATED_RESTART;
    s->settings.op = op;
    s->settings.relative_error = 0.0;
    s->settings.max_iterations = s->iterations = iterations;
    s->cache = uz_cache_new((size_t)1 << 30);
    return s->cache && solve(s);
}

static bool cached(state *s)
{
    return fixed(s, 60, UZ_OPERATOR_CONDENSED, 400);
}

static bool matrix_free(state *s)
{
    return fixed(s, 18, UZ_OPERATOR_MATRIX_FREE, 8);
}

/* ----------------------------------------------------------------- reading */

/* A tridiagonal K as Matrix Market text within a request, and numbers as JSON. */
static bool request_text(state *s)
{
    enum { D = 500 };
    size_t room = 200 * (size_t)D, at;
    char *t = s->text = malloc(room);
    if (!t)
        return fail("request", "no memory");
    at = (size_t)snprintf(t, room,
                          "{\"problem\": {\"kind\": \"matrices\", \"K\": \"%%%%MatrixMarket matrix coordinate real "
                          "symmetric\\n%d %d %d\\n",
                          D, D, 2 * D - 1);
    for (int i = 1; i <= D; i++) {
        at += (size_t)snprintf(t + at, room - at, "%d %d %.17g\\n", i, i, 2.0 + 1.0 / i);
        if (i < D)
            at += (size_t)snprintf(t + at, room - at, "%d %d %.17g\\n", i + 1, i, -1.0 + 0.1 / i);
    }
    at += (size_t)snprintf(t + at, room - at,
                           "\", \"N\": \"%%%%MatrixMarket matrix coordinate real general\\n1 %d 1\\n1 1 1\\n\", "
                           "\"h\": [0.5], \"p\": [",
                           D);
    for (int i = 0; i < D; i++)
        at += (size_t)snprintf(t + at, room - at, "%s%.17g", i ? ", " : "", sin(i));
    at += (size_t)snprintf(t + at, room - at, "]}}");
    s->len = at;
    return true;
}

static bool decode(state *s)
{
    codec_request request;
    problem_details problem;
    if (!codec_decode(&request, CODEC_SOLVE, s->text, s->len, NULL, &problem))
        return fail("request", problem.detail);
    codec_request_clear(&request);
    return true;
}

/* -------------------------------------------------------------------- main */

static const problem_of PROBLEMS[] = {{"paper_cold", 1, cold, solve},
                                      {"cached_restart", 1, cached, solve},
                                      {"matrix_free", 1, matrix_free, solve},
                                      {"decode_request", 10, request_text, decode}};
static const size_t N_PROBLEMS = sizeof PROBLEMS / sizeof PROBLEMS[0];

/* callgrind counts from here to its return. Once before, so that what is made on first use is there. */
__attribute__((noinline)) bool guard_measured(state *s, const problem_of *p, int repeats);
bool guard_measured(state *s, const problem_of *p, int repeats)
{
    for (int i = 0; i < repeats; i++)
        if (!p->run(s))
            return false;
    return true;
}

/* So that no compiler makes a copy of it under another name for what it is called with. */
static bool (*volatile const measured)(state *, const problem_of *, int) = guard_measured;

static bool run(const problem_of *p, int repeats)
{
    state s = {.iterations = 0};
    bool good = p->prepare(&s) && p->run(&s) && measured(&s, p, repeats > 0 ? repeats : p->repeats);
    uz_problem_clear(&s.problem);
    uz_cache_free(s.cache);
    free(s.text);
    return good;
}

int main(int argc, char **argv)
{
    char message[256] = "usage: guard NAME [REPEATS] | --names | --compiler";
    if (argc == 2 && strcmp(argv[1], "--compiler") == 0)
        return puts(__VERSION__) < 0;
    for (size_t i = 0; argc == 2 && strcmp(argv[1], "--names") == 0 && i < N_PROBLEMS; i++)
        printf("%s %d\n", PROBLEMS[i].name, PROBLEMS[i].repeats);
    if (argc == 2 && strcmp(argv[1], "--names") == 0)
        return 0;
    uz_process_init(1);
    uz_thread_init();
    for (size_t i = 0; argc >= 2 && i < N_PROBLEMS; i++)
        if (strcmp(argv[1], PROBLEMS[i].name) == 0) {
            bool good = codec_init(NULL, message, sizeof message) && run(&PROBLEMS[i], argc > 2 ? atoi(argv[2]) : 0);
            codec_end();
            return !good;
        }
    fprintf(stderr, "%s\n", message);
    return 2;
}
