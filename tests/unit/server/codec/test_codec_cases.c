/* Requests with load cases, starts and answers, and what is made of them. */
#include "codec/codec.h"
#include "codec/text.h"
#include "harness.h"

#include <jansson.h>

static bool ready(void)
{
    char message[256] = "";
    bool good = codec_init(NULL, message, sizeof message);
    CHECK_MSG(good, "%s", message);
    return good;
}

static codec_request take(codec_kind kind, const char *body)
{
    codec_request request = {0};
    problem_details problem = {0};
    bool good = ready() && codec_decode(&request, kind, body, strlen(body), NULL, &problem);
    CHECK_MSG(good, "%s %s: %s", problem.code, problem.pointer, problem.detail);
    return request;
}

static problem_details refuse(codec_kind kind, const char *body, const char *code, const char *pointer)
{
    codec_request request;
    problem_details problem = {0};
    bool good = ready() && codec_decode(&request, kind, body, strlen(body), NULL, &problem);
    CHECK_MSG(!good, "taken: %.200s", body);
    CHECK_MSG(strcmp(problem.code, code) == 0, "code %s, want %s: %s", problem.code, code, problem.detail);
    CHECK_STR(problem.pointer, pointer);
    if (good)
        codec_request_clear(&request);
    return problem;
}

/* d = 2, m = 1 */
#define SPRINGS                                                                                                        \
    "{\"problem\":{\"kind\":\"matrices\",\"K\":\"%%MatrixMarket matrix coordinate real symmetric\\n2 2 2\\n1 1 2\\n"   \
    "2 2 1\\n\",\"N\":\"%%MatrixMarket matrix coordinate real general\\n1 2 1\\n1 1 1\\n\",\"h\":[0.5],\"p\":[2,2]}"
/* 3 x 2 nodes; the two of the bottom that are not supported may touch: m = 2 */
#define BLOCK                                                                                                          \
    "{\"problem\":{\"kind\":\"scene\",\"model\":\"plane_stress\",\"mesh\":{\"box\":{\"size\":[2,1],\"cells\":[2,1]}}," \
    "\"materials\":[{\"on\":\"all\",\"young\":1,\"poisson\":0}],\"supports\":[{\"on\":\"left\",\"ux\":0,\"uy\":0}],"   \
    "\"contacts\":[{\"on\":\"bottom\",\"obstacle\":{\"plane\":{\"point\":[0,0],\"normal\":[0,1]}}}]}"

/* ---- cases */

TEST(cases_of_matrices)
{
    codec_request r = take(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"a\",\"p\":[3,4]},{\"name\":\"\\u00e9 b\","
                                                "\"h\":\"%%MatrixMarket matrix array real general\\n1 1\\n7\\n\"}]}");
    CHECK_INT(r.problem.n_cases, 2);
    if (r.problem.n_cases == 2) {
        const uz_load_case *c = r.problem.cases;
        CHECK_STR(c[0].name, "a");
        CHECK(c[0].p && c[0].p[0] == 3 && c[0].p[1] == 4 && !c[0].h && !c[0].loads);
        CHECK_STR(c[1].name, "\xc3\xa9 b");
        CHECK(!c[1].p && c[1].h && c[1].h[0] == 7);
    }
    codec_request_clear(&r);
    CHECK(!r.problem.cases && !r.tags);
}

TEST(cases_of_a_scene)
{
    codec_request r = take(CODEC_SOLVE, BLOCK ",\"cases\":[{\"name\":\"a\",\"loads\":[{\"on\":\"top\",\"traction\":"
                                              "[1,-2]}]},{\"name\":\"none\",\"loads\":[]}]}");
    CHECK_INT(r.problem.n_cases, 2);
    if (r.problem.n_cases == 2) {
        const uz_load_case *c = r.problem.cases;
        CHECK(c[0].n_loads == 1 && c[0].loads && c[0].loads[0].v[1] == -2);
        CHECK(c[1].n_loads == 0 && c[1].loads); /* no load, not the scene's own */
    }
    codec_request_clear(&r);
}

#define BYTES_16 "\\u00e9\\u00e9\\u00e9\\u00e9\\u00e9\\u00e9\\u00e9\\u00e9"

TEST(names_of_cases)
{
    problem_details problem =
        refuse(CODEC_SOLVE,
               SPRINGS ",\"cases\":[{\"name\":\"a\",\"h\":[1]},{\"name\":\"b\",\"h\":[1]},{\"name\":\"c\",\"h\":[1]},"
                       "{\"name\":\"b\",\"h\":[2]},{\"name\":\"a\",\"h\":[3]}]}",
               "not_allowed", "/cases/3/name");
    CHECK_MSG(strstr(problem.detail, "\"b\"") && strstr(problem.detail, "case 1"), "%s", problem.detail);
    refuse(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"" BYTES_16 BYTES_16 BYTES_16 BYTES_16 "\",\"h\":[1]}]}",
           "out_of_range", "/cases/0/name"); /* 64 bytes, 32 characters */
    refuse(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"a\\nb\",\"h\":[1]}]}", "out_of_range", "/cases/0/name");
    refuse(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"a\\u0000b\",\"h\":[1]}]}", "out_of_range", "/cases/0/name");
}

TEST(cases_have_the_sizes_of_the_problem)
{
    refuse(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"a\",\"h\":[1]},{\"name\":\"b\",\"p\":[1]}]}", "size_mismatch",
           "/cases/1/p");
    refuse(CODEC_SOLVE, SPRINGS ",\"cases\":[{\"name\":\"a\",\"h\":[1,2]}]}", "size_mismatch", "/cases/0/h");
    problem_details problem = refuse(CODEC_SOLVE,
                                     SPRINGS ",\"cases\":[{\"name\":\"a\",\"p\":\"%%MatrixMarket matrix "
                                             "array real general\\n2 1\\n1\\nx\\n\"}]}",
                                     "matrix_market_syntax", "/cases/0/p");
    CHECK_INT(problem.line, 4);
}

/* A load of a case is a block of numbers, as the problem's own is. */
TEST(long_loads_of_cases)
{
    enum { D = 1000 };
    char *body = malloc(100 * D), *at = body;
    at += sprintf(at,
                  "{\"problem\":{\"kind\":\"matrices\",\"K\":\"%%%%MatrixMarket matrix coordinate real symmetric\\n"
                  "%d %d %d\\n",
                  D, D, D);
    for (int i = 1; i <= D; i++)
        at += sprintf(at, "%d %d 2\\n", i, i);
    at += sprintf(at, "\",\"p\":[0");
    for (int i = 1; i < D; i++)
        at += sprintf(at, ",%d", i);
    at += sprintf(at, "]},\"cases\":[{\"name\":\"a\",\"p\":[5");
    for (int i = 1; i < D; i++)
        at += sprintf(at, ",%d", 2 * i);
    strcpy(at, "]}]}");
    codec_request r = take(CODEC_SOLVE, body);
    CHECK(r.problem.n_cases == 1 && r.problem.cases[0].p[0] == 5 && r.problem.cases[0].p[D - 1] == 2 * (D - 1));
    codec_request_clear(&r);
    free(body);
}

/* ---- starts */

TEST(starts)
{
    codec_request r = take(CODEC_SOLVE, SPRINGS "}");
    CHECK(!r.start.job[0] && !r.start.reactions && !r.start.continued);
    codec_request_clear(&r);
    r = take(CODEC_SOLVE, SPRINGS ",\"solver\":{\"warm_start\":{\"reactions\":[-1.5]}}}");
    CHECK(r.start.n_reactions == 1 && r.start.reactions && r.start.reactions[0] == -1.5);
    codec_request_clear(&r);
    r = take(CODEC_SOLVE, SPRINGS ",\"solver\":{\"warm_start\":{\"job\":\"0123456789abcdef0123456789abcdef\","
                                  "\"case\":\"a\",\"continue\":false}}}");
    CHECK_STR(r.start.job, "0123456789abcdef0123456789abcdef");
    CHECK_STR(r.start.case_name, "a");
    CHECK(!r.start.continued);
    codec_request_clear(&r);
    refuse(CODEC_SOLVE, SPRINGS ",\"solver\":{\"warm_start\":{\"reactions\":[-1,-1]}}}", "size_mismatch",
           "/solver/warm_start/reactions");
    refuse(CODEC_SOLVE, BLOCK ",\"solver\":{\"warm_start\":{\"reactions\":[-1]}}}", "size_mismatch",
           "/solver/warm_start/reactions");
    r = take(CODEC_SOLVE, BLOCK ",\"solver\":{\"warm_start\":{\"reactions\":[-1,-1]}}}");
    codec_request_clear(&r);
}

/* ---- answers */

TEST(answers)
{
    codec_request r = take(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[0.5,2],\"reactions\":[-1]}}");
    CHECK(r.answer.n_u == 2 && r.answer.u[1] == 2 && r.answer.n_r == 1 && r.answer.r[0] == -1);
    codec_request_clear(&r);
    r = take(CODEC_STORED, BLOCK ",\"answer\":{\"displacements\":[[0,0],[1,2],[3,4],[0,0],[5,6],[7,8]],"
                                 "\"reactions\":[0,-1]}}");
    CHECK(r.answer.n_u == 12 && r.answer.u[2] == 1 && r.answer.u[11] == 8);
    codec_request_clear(&r);
    r = take(CODEC_VERIFY, BLOCK ",\"answer\":{\"displacements\":[0,0,0,0,0,0,0,0,0,0,0,0],\"reactions\":[0,0]}}");
    codec_request_clear(&r);
}

TEST(answers_of_other_shapes)
{
    refuse(CODEC_VERIFY, SPRINGS "}", "missing_key", "");
    refuse(CODEC_SOLVE, SPRINGS ",\"answer\":{\"displacements\":[0.5,2],\"reactions\":[-1]}}", "unknown_key",
           "/answer");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[0.5],\"reactions\":[-1]}}", "size_mismatch",
           "/answer/displacements");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[0.5,2],\"reactions\":[]}}", "size_mismatch",
           "/answer/reactions");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[[0.5,2]],\"reactions\":[-1]}}", "size_mismatch",
           "/answer/displacements");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[0.5,[2,3]],\"reactions\":[-1]}}", "wrong_type",
           "/answer/displacements/1");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[[2,3],0.5],\"reactions\":[-1]}}", "wrong_type",
           "/answer/displacements/1");
    refuse(CODEC_VERIFY, BLOCK ",\"answer\":{\"displacements\":[[0,0,0],[0,0,0],[0,0,0],[0,0,0]],\"reactions\":[0,0]}}",
           "size_mismatch", "/answer/displacements");
    refuse(CODEC_VERIFY, SPRINGS ",\"answer\":{\"displacements\":[null,2],\"reactions\":[-1]}}", "wrong_type",
           "/answer/displacements/0");
    refuse(CODEC_VERIFY,
           SPRINGS ",\"cases\":[{\"name\":\"a\",\"h\":[1]}],\"answer\":{\"displacements\":[0,0],"
                   "\"reactions\":[0]}}",
           "unknown_key", "/cases");
}

/* ---- refine */

/* The refined text, parsed; released by the caller. */
static json_t *refine(const char *old, const char *change)
{
    problem_details problem = {0};
    size_t len = 0;
    char *made = ready() ? codec_refine(old, strlen(old), "ID", change, strlen(change), &len, &problem) : NULL;
    CHECK_MSG(made, "%s", problem.detail);
    json_t *parsed = made ? json_loadb(made, len, JSON_REJECT_DUPLICATES, NULL) : NULL;
    CHECK_MSG(parsed, "%s", made ? made : "");
    free(made);
    return parsed;
}

static void check_refined(const char *old, const char *change, const char *solver)
{
    json_t *parsed = refine(old, change), *before = json_loads(old, 0, NULL), *want = json_loads(solver, 0, NULL);
    CHECK_MSG(want && json_equal(json_object_get(parsed, "solver"), want), "%s with %s is not %s", old, change, solver);
    json_object_del(parsed, "solver");
    json_object_del(before, "solver");
    CHECK_MSG(json_equal(parsed, before), "%s", old); /* all else stays */
    json_decref(parsed);
    json_decref(before);
    json_decref(want);
}

#define START "\"stopping\":\"certified\",\"warm_start\":{\"job\":\"ID\",\"continue\":true}"

TEST(refined_requests)
{
    static const char EXACT[] = "{\"accuracy\":\"exact\"}";
    check_refined("{\"problem\":1}", EXACT, "{" START ",\"accuracy\":\"exact\"}");
    check_refined(" { \"problem\" : {\"solver\": [1, \"}\"]} , \"tags\":[\"solver\"] } ", EXACT,
                  "{" START ",\"accuracy\":\"exact\"}");
    check_refined("{\"a\":\"\\\"solver\\\":\\\\\",\"s\\u006flver\":{\"method\":\"uzawa\",\"max_iterations\":7.0,"
                  "\"accuracy\":{\"relative_error\":0.1}} ,\"problem\":2}",
                  "{\"accuracy\":{\"relative_error\":1e-7},\"time_limit_s\":2.5}",
                  "{\"method\":\"uzawa\",\"max_iterations\":7," START
                  ",\"accuracy\":{\"relative_error\":1e-7},\"time_limit_s\":2.5}");
    check_refined("{\"solver\":{\"stopping\":\"paper\",\"epsilon\":0.5,\"warm_start\":{\"reactions\":[1,2]}}}",
                  "{\"accuracy\":\"quick\",\"max_iterations\":9}",
                  "{" START ",\"accuracy\":\"quick\",\"max_iterations\":9}");
}

TEST(refinements_that_are_refused)
{
    static const char *const CHANGES[][2] = {{"{}", ""},
                                             {"{\"accuracy\":2}", "/accuracy"},
                                             {"{\"accuracy\":{\"relative_error\":0}}", "/accuracy/relative_error"},
                                             {"{\"accuracy\":\"exact\",\"method\":\"uzawa\"}", "/method"},
                                             {"{\"accuracy\":\"exact\",\"max_iterations\":0.5}", "/max_iterations"},
                                             {"{\"accuracy\"", ""}};
    for (size_t i = 0; ready() && i < sizeof CHANGES / sizeof CHANGES[0]; i++) {
        problem_details problem = {0};
        size_t len = 0;
        char *made = codec_refine("{\"problem\":1}", 13, "ID", CHANGES[i][0], strlen(CHANGES[i][0]), &len, &problem);
        CHECK_MSG(!made && problem.status >= 400 && problem.status < 500, "%s", CHANGES[i][0]);
        CHECK_STR(problem.pointer, CHANGES[i][1]);
        free(made);
    }
}

static bool same(const char *a, const char *b)
{
    return codec_same_problem(a, strlen(a), b, strlen(b));
}

TEST(same_problem)
{
    CHECK(same("{\"problem\":{\"a\":1}}", "{\"solver\":{}, \"problem\" : {\"a\":1} }"));
    CHECK(same("{\"problem\":1,\"cases\":[2]}", "{\"cases\":[2],\"tags\":[],\"problem\":1}"));
    CHECK(!same("{\"problem\":{\"a\":1}}", "{\"problem\":{\"a\":2}}"));
    CHECK(!same("{\"problem\":{\"a\":1}}", "{\"problem\":{\"a\":1 }}"));
    CHECK(!same("{\"problem\":1,\"cases\":[2]}", "{\"problem\":1}"));
    CHECK(!same("{\"problem\":1,\"cases\":[2]}", "{\"problem\":1,\"cases\":[3]}"));
    size_t len; /* a request to verify has an answer, and no other has */
    CHECK(json_member_text("{\"problem\":{},\"answer\":{}}", 26, "answer", &len) &&
          !json_member_text("{\"problem\":{\"answer\":1}}", 24, "answer", &len));
}

/* ---- replies */

TEST(results_of_cases)
{
    static const double r[2] = {-1, 0}, u[4] = {1, 2, 3, 4}, nodes[4] = {0, 0, 1, 0}, contact[2] = {1, 2};
    const codec_result one = {
        .case_name = "a\"b", .summary = "{\"x\":1}", .dim = 2, .m = 2, .n_u = 4, .reactions = r, .displacements = u};
    const codec_result shared = {.dim = 2, .m = 2, .n_nodes = 4, .nodes = nodes, .contact_nodes = contact};
    size_t len = 0;
    text all = {0};
    text_open(&all, NULL, '{');
    text_open(&all, "cases", '[');
    codec_put_case(&all, &one);
    codec_put_case(&all, &one);
    text_close(&all, ']');
    codec_put_places(&all, &shared);
    text_close(&all, '}');
    char *written = text_finish(&all, &len);
    CHECK_STR(written,
              "{\"cases\":["
              "{\"name\":\"a\\\"b\",\"summary\":{\"x\":1},\"reactions\":[-1,0],\"displacements\":[[1,2],[3,4]]},"
              "{\"name\":\"a\\\"b\",\"summary\":{\"x\":1},\"reactions\":[-1,0],\"displacements\":[[1,2],[3,4]]}],"
              "\"nodes\":[[0,0],[1,0]],\"contact_nodes\":[1,2]}");
    CHECK_INT(len, strlen(written));
    free(written);
}

TEST(summaries_of_cases)
{
    uz_summary summary = {.outcome = UZ_ITERATION_LIMIT};
    codec_cases counts = {.count = 3, .outcomes = {[UZ_CONVERGED] = 2, [UZ_ITERATION_LIMIT] = 1}, .worst = "b"};
    char *written =
        codec_encode_summary(&summary, UZ_PROBLEM_SCENE, &(codec_run){.started_from = "warm", .cases = &counts});
    CHECK(written && strstr(written, "\"started_from\":\"warm\",\"cases\":{\"count\":3,\"worst\":\"b\",\"converged\":2,"
                                     "\"iteration_limit\":1}"));
    free(written);
    written = codec_encode_summary(&summary, UZ_PROBLEM_SCENE, NULL);
    CHECK(written && !strstr(written, "cases") && !strstr(written, "started_from"));
    free(written);
}
