#include "codec/codec.h"
#include "harness.h"

static bool ready(void)
{
    char message[256] = "";
    bool good = codec_init(NULL, message, sizeof message);
    CHECK_MSG(good, "%s", message);
    return good;
}

/* Decodes a body that must be taken. */
static codec_request take(const char *body)
{
    codec_request request = {0};
    problem_details problem = {0};
    bool good = ready() && codec_decode(&request, CODEC_SOLVE, body, strlen(body), NULL, &problem);
    CHECK_MSG(good, "%s %s: %s", problem.code, problem.pointer, problem.detail);
    return request;
}

/* Decodes a body that must be refused. */
static problem_details refuse(const char *body, int status, const char *code, const char *pointer)
{
    codec_request request;
    problem_details problem = {0};
    bool good = ready() && codec_decode(&request, CODEC_SOLVE, body, strlen(body), NULL, &problem);
    CHECK_MSG(!good, "taken: %s", body);
    CHECK_INT(problem.status, status);
    CHECK_MSG(strcmp(problem.code, code) == 0, "code %s, want %s: %s", problem.code, code, problem.detail);
    CHECK_STR(problem.pointer, pointer);
    if (good)
        codec_request_clear(&request);
    return problem;
}

#define SCENE_HEAD                                                                                                     \
    "{\"problem\":{\"kind\":\"scene\",\"model\":\"plane_strain\",\"mesh\":{\"box\":{\"origin\":[-1,2.5],"              \
    "\"size\":[60,20],\"cells\":[30,10]}},\"materials\":[{\"on\":\"all\",\"young\":2e5,\"poisson\":0.3}]"
#define HELD SCENE_HEAD ",\"supports\":[{\"on\":\"left\",\"ux\":0,\"uy\":0}]"

TEST(scene)
{
    codec_request r =
        take(SCENE_HEAD ",\"thickness\":5,\"supports\":[{\"on\":\"left\",\"ux\":0,\"uy\":-1e-3},{\"on\":\"right\","
                        "\"uy\":0}],\"loads\":[{\"on\":\"top\",\"traction\":[0.5,-0.25]}],\"contacts\":[{\"on\":"
                        "\"bottom\",\"obstacle\":{\"plane\":{\"point\":[1,2],\"normal\":[0,3]}}}]},"
                        "\"tags\":[\"a\",\"\\u00e9\"]}");
    const uz_scene *s = &r.problem.scene;
    CHECK_INT(r.problem.kind, UZ_PROBLEM_SCENE);
    CHECK_INT(s->model, UZ_PLANE_STRAIN);
    CHECK(s->thickness == 5 && s->box.dim == 2);
    CHECK(s->box.origin[0] == -1 && s->box.origin[1] == 2.5 && s->box.origin[2] == 0);
    CHECK(s->box.size[0] == 60 && s->box.size[1] == 20);
    CHECK(s->box.cells[0] == 30 && s->box.cells[1] == 10);
    CHECK_STR(s->box.element, "quad4");
    CHECK_INT(s->n_materials, 1);
    CHECK(s->materials[0].young == 2e5 && s->materials[0].poisson == 0.3);
    CHECK_INT(s->n_supports, 2);
    CHECK(s->supports[0].u[0] == 0 && s->supports[0].u[1] == -1e-3 && isnan(s->supports[0].u[2]));
    CHECK(isnan(s->supports[1].u[0]) && s->supports[1].u[1] == 0);
    CHECK_STR(s->supports[1].on, "right");
    CHECK_INT(s->n_loads, 1);
    CHECK(s->loads[0].v[0] == 0.5 && s->loads[0].v[1] == -0.25 && s->loads[0].v[2] == 0);
    CHECK_INT(s->n_contacts, 1);
    CHECK(s->contacts[0].point[1] == 2 && s->contacts[0].normal[1] == 3);
    CHECK_STR(r.tags, "[\"a\",\"\xc3\xa9\"]");
    codec_request_clear(&r);
    r = take(HELD "}}");
    CHECK(r.problem.scene.thickness == 1 && r.problem.scene.n_loads == 0 && r.problem.scene.n_contacts == 0);
    CHECK_STR(r.tags, "[]");
    codec_request_clear(&r);
}

TEST(beyond_the_schema)
{
    refuse(SCENE_HEAD ",\"contacts\":[{\"on\":\"bottom\",\"obstacle\":{\"plane\":{\"point\":[0,0],\"normal\":[0,1]}}},"
                      "{\"on\":\"bottom\",\"obstacle\":{\"plane\":{\"point\":[0,0],\"normal\":[0,-0.0]}}}]}}",
           422, "out_of_range", "/problem/contacts/1/obstacle/plane/normal");
    refuse("{\"problem\":{\"kind\":\"scene\",\"model\":\"plane_strain\",\"mesh\":{\"box\":{\"size\":[60,20],"
           "\"cells\":[10001,1000]}},\"materials\":[{\"on\":\"all\",\"young\":2e5,\"poisson\":0.3}]}}",
           422, "out_of_range", "/problem/mesh/box/cells");
    refuse(SCENE_HEAD "},\"tags\":[\"a\",\"b\\n\"]}", 422, "not_allowed", "/tags/1");
    refuse(SCENE_HEAD "},\"tags\":[\"a\\u0000b\"]}", 422, "not_allowed", "/tags/0");
    refuse(SCENE_HEAD "},\"tags\":[\"a\\u009bb\"]}", 422, "not_allowed", "/tags/0");
    refuse(SCENE_HEAD "},\"tags\":[\"\\u202egpj.exe\"]}", 422, "not_allowed", "/tags/0");
    refuse(SCENE_HEAD "},\"tags\":[\"a\", \"x\xe2\x81\xa6y\"]}", 422, "not_allowed", "/tags/1");
}

/* The settings of a scene with this "solver". */
static uz_settings settings_of(const char *solver)
{
    char body[1024];
    snprintf(body, sizeof body, "%s},\"solver\":%s}", HELD, solver);
    codec_request r = take(body);
    uz_settings s = r.settings;
    codec_request_clear(&r);
    return s;
}

TEST(settings)
{
    uz_settings s = settings_of("{}"), d = uz_settings_default();
    CHECK(s.method == UZ_METHOD_AUTO && s.op == UZ_OPERATOR_AUTO && s.ordering == UZ_ORDERING_AUTO);
    CHECK(s.stopping == UZ_STOP_CERTIFIED && s.relative_error == 1e-8 && !s.balanced && s.alpha == 0 &&
          s.row_scaling == UZ_ROW_SCALING_AUTO);
    CHECK(s.max_iterations == d.max_iterations && isinf(s.time_limit_s));
    s = settings_of("{\"method\":\"accelerated\",\"operator\":\"condensed\",\"ordering\":\"amd\",\"alpha\":2.5,\"row_"
                    "scaling\":\"unit\","
                    "\"max_iterations\":1000000000,\"time_limit_s\":0.5,\"accuracy\":{\"relative_error\":1e-4}}");
    CHECK(s.method == UZ_METHOD_ACCELERATED && s.op == UZ_OPERATOR_CONDENSED && s.ordering == UZ_ORDERING_AMD);
    CHECK(s.alpha == 2.5 && s.row_scaling == UZ_ROW_SCALING_UNIT && s.max_iterations == 1000000000 &&
          s.time_limit_s == 0.5 && s.relative_error == 1e-4);
    s = settings_of("{\"stopping\":\"paper\"}");
    CHECK(s.stopping == UZ_STOP_PAPER && s.epsilon == 1e-6 && s.relative_error == 1e-2);
    s = settings_of("{\"stopping\":\"paper\",\"epsilon\":1e-9,\"accuracy\":\"precise\"}");
    CHECK(s.epsilon == 1e-9 && s.relative_error == 1e-8);
    s = settings_of("{\"accuracy\":\"quick\"}");
    CHECK(s.relative_error == 1e-2 && !s.balanced);
    s = settings_of("{\"accuracy\":\"balanced\"}");
    CHECK(s.balanced);
    s = settings_of("{\"accuracy\":\"exact\"}");
    CHECK(s.relative_error == 0 && !s.balanced);
}

TEST(every_name_of_the_schema_is_known_to_the_library)
{
    static const char *const METHODS[] = {"auto", "uzawa", "accelerated", "accelerated_restart"};
    static const char *const OPERATORS[] = {"auto", "condensed", "factored"};
    static const char *const ORDERINGS[] = {"auto", "camd", "amd", "metis"};
    char solver[128];
    for (size_t i = 0; i < 4; i++) {
        snprintf(solver, sizeof solver, "{\"method\":\"%s\",\"ordering\":\"%s\"}", METHODS[i], ORDERINGS[i]);
        uz_settings s = settings_of(solver);
        CHECK_STR(uz_method_name(s.method), METHODS[i]);
        CHECK_STR(uz_choice_name(UZ_CHOICE_ORDERING, s.ordering), ORDERINGS[i]);
    }
    for (size_t i = 0; i < 3; i++) {
        snprintf(solver, sizeof solver, "{\"operator\":\"%s\"}", OPERATORS[i]);
        CHECK_STR(uz_choice_name(UZ_CHOICE_OPERATOR, settings_of(solver).op), OPERATORS[i]);
    }
}

#define MM         "%%MatrixMarket matrix "
#define K2         "\"K\":\"" MM "coordinate real symmetric\\n2 2 3\\n1 1 2\\n2 1 -1\\n2 2 2\\n\""
#define MATRICES   "{\"problem\":{\"kind\":\"matrices\","
#define N_GENERAL  "\"N\":\"" MM "coordinate real general\\n1 2 1\\n1 2 1\\n\""
#define N_DIAGONAL "\"N\":\"" MM "coordinate real symmetric\\n2 2 3\\n1 1 1\\n2 1 0.5\\n2 2 1\\n\""

TEST(matrices)
{
    codec_request r = take(MATRICES K2 "," N_GENERAL ",\"h\":[0.25],\"p\":[1,-2e-3]}}");
    const uz_qp *q = &r.problem.qp;
    CHECK_INT(r.problem.kind, UZ_PROBLEM_MATRICES);
    CHECK(q->K.rows == 2 && q->K.cols == 2 && q->K.ptr[2] == 3);
    CHECK(q->N.rows == 1 && q->N.cols == 2 && q->N.ptr[2] == 1 && q->N.idx[0] == 0);
    CHECK(q->h[0] == 0.25 && q->p[0] == 1 && q->p[1] == -2e-3);
    codec_request_clear(&r);
    r = take(MATRICES "\"K\":\"" MM "array real general\\n2 2\\n2\\n-1\\n-1\\n2\\n\"," N_GENERAL ",\"h\":\"" MM
                      "array real general\\n1 1\\n0.25\\n\",\"p\":\"" MM "coordinate integer general\\n2 1 1\\n2 1 "
                      "7\\n\"}}");
    CHECK_INT(q->K.ptr[2], 3); /* its lower triangle */
    CHECK(q->p[0] == 0 && q->p[1] == 7 && q->h[0] == 0.25);
    codec_request_clear(&r);
}

TEST(no_contact_rows)
{
    codec_request r = take(MATRICES K2 ",\"p\":[1,0]}}");
    CHECK(r.problem.qp.N.rows == 0 && r.problem.qp.N.cols == 2);
    codec_request_clear(&r);
    r = take(MATRICES K2 ",\"p\":[1,0],\"h\":[],\"N\":\"" MM "coordinate real general\\n0 2 0\\n\"}}");
    CHECK(r.problem.qp.N.rows == 0);
    codec_request_clear(&r);
    refuse(MATRICES K2 ",\"p\":[1,0],\"h\":[1]}}", 422, "size_mismatch", "/problem/h");
}

TEST(symmetric_N_gets_both_halves)
{
    codec_request r = take(MATRICES K2 "," N_DIAGONAL ",\"h\":[1,1],\"p\":[1,0]}}");
    const uz_csc *N = &r.problem.qp.N;
    CHECK_INT(N->ptr[2], 4);
    CHECK(N->val[0] == 1 && N->val[1] == 0.5 && N->val[2] == 0.5 && N->val[3] == 1);
    codec_request_clear(&r);
}

TEST(matrix_errors_have_pointer_and_line)
{
    problem_details e = refuse(MATRICES "\"K\":\"" MM "coordinate real symmetric\\n2 2 3\\n1 1 2\\n2 1 x\\n2 2 "
                                        "2\\n\",\"p\":[1,0]}}",
                               422, "matrix_market_syntax", "/problem/K");
    CHECK_INT(e.line, 4);
    refuse(MATRICES "\"K\":\"hello\",\"p\":[1,0]}}", 422, "matrix_market_syntax", "/problem/K");
    refuse(MATRICES "\"K\":\"" MM "array complex general\\n1 1\\n1 0\\n\",\"p\":[1]}}", 422,
           "matrix_market_unsupported", "/problem/K");
    refuse(MATRICES "\"K\":\"" MM "array real general\\n2 2\\n2\\n-1\\n-1.5\\n2\\n\",\"p\":[1,0]}}", 422,
           "not_symmetric", "/problem/K");
    refuse(MATRICES "\"K\":\"" MM "array real general\\n1 2\\n2\\n-1\\n\",\"p\":[1,0]}}", 422, "size_mismatch",
           "/problem/K");
    refuse(MATRICES K2 ",\"p\":[1,0,0]}}", 422, "size_mismatch", "/problem/p");
    refuse(MATRICES K2 ",\"p\":\"" MM "array real general\\n2 2\\n1\\n1\\n1\\n1\\n\"}}", 422, "size_mismatch",
           "/problem/p");
    refuse(MATRICES K2 "," N_GENERAL ",\"h\":[1,2],\"p\":[1,0]}}", 422, "size_mismatch", "/problem/h");
    refuse(MATRICES K2 ",\"N\":\"" MM "coordinate real general\\n1 3 1\\n1 3 1\\n\",\"h\":[1],\"p\":[1,0]}}", 422,
           "size_mismatch", "/problem/N");
    e = refuse(MATRICES K2 "," N_GENERAL ",\"h\":[1],\"p\":\"" MM "array real general\\n2 1\\n1\\nNaN\\n\"}}", 422,
               "not_finite", "/problem/p");
    CHECK_INT(e.line, 4);
}

TEST(a_size_line_alone_cannot_fill_the_machine)
{
    refuse(MATRICES "\"K\":\"" MM "coordinate real symmetric\\n4000000000 4000000000 0\\n\",\"p\":[1]}}", 422,
           "memory_limit", "/problem/K");
    refuse(MATRICES K2 ",\"p\":\"" MM "coordinate real general\\n4000000000 1 0\\n\"}}", 422, "memory_limit",
           "/problem/p");
}

TEST(long_vectors_are_taken_over)
{
    enum { D = 3000 };
    size_t size = 200 + 64 * D;
    char *body = malloc(size), *at = body;
    at += sprintf(at, "%s", MATRICES "\"K\":\"" MM "coordinate real symmetric\\n");
    at += sprintf(at, "%d %d %d\\n", D, D, D);
    for (int i = 1; i <= D; i++)
        at += sprintf(at, "%d %d %d\\n", i, i, i);
    at += sprintf(at, "\",\"p\":[0");
    for (int i = 1; i < D; i++)
        at += sprintf(at, ",%d.25", i);
    sprintf(at, "]}}");
    codec_request r = take(body);
    const uz_qp *q = &r.problem.qp;
    CHECK_INT(q->K.rows, D);
    for (int i = 0; q->p && i < D; i++)
        CHECK(q->p[i] == (i ? i + 0.25 : 0) && q->K.val[i] == i + 1);
    codec_request_clear(&r);
    free(body);
}

TEST(library_errors_become_problems)
{
    problem_details problem;
    uz_error err = {.status = UZ_ERR_SCENE, .where = "/contacts/0/on", .message = "no group \"x\""};
    codec_problem_from_error(&problem, &err, UZ_PROBLEM_MATRICES);
    CHECK_INT(problem.status, 422);
    CHECK_STR(problem.code, "bad_scene");
    CHECK_STR(problem.pointer, "/problem/contacts/0/on");
    CHECK_STR(problem.detail, "no group \"x\"");
    err = (uz_error){.status = UZ_ERR_NOT_SPD, .where = "K", .line = 7, .message = "pivot"};
    codec_problem_from_error(&problem, &err, UZ_PROBLEM_MATRICES);
    CHECK_STR(problem.pointer, "/problem/K");
    CHECK_INT(problem.line, 7);
    err = (uz_error){.status = UZ_ERR_MEMORY};
    codec_problem_from_error(&problem, &err, UZ_PROBLEM_MATRICES);
    CHECK_INT(problem.status, 503);
    CHECK_STR(problem.pointer, "/problem");
    err = (uz_error){.status = UZ_ERR_INTERNAL};
    codec_problem_from_error(&problem, &err, UZ_PROBLEM_MATRICES);
    CHECK_INT(problem.status, 500);
}

/* Every pointer is one of a member that the request can have. */
TEST(library_errors_point_into_the_request)
{
    static const struct {
        const char *where, *of_matrices, *of_scene;
    } ROWS[] = {{"", "/problem", "/problem"},
                {"K", "/problem/K", "/problem"},
                {"p", "/problem/p", "/problem"},
                {"/loads", "/problem/loads", "/problem/loads"},
                {"/cases", "/cases", "/cases"},
                {"/casesx", "/problem/casesx", "/problem/casesx"},
                {"/cases/12", "/cases/12", "/cases/12"},
                {"/cases/12/h", "/cases/12/h", "/cases/12/h"},
                {"/cases/12/K", "/problem/K", "/problem"},
                {"/cases/12/supports", "/problem/supports", "/problem/supports"},
                {"/cases/12/loads/0/on", "/cases/12/loads/0/on", "/cases/12/loads/0/on"},
                {"/solver/warm_start", "/solver/warm_start", "/solver/warm_start"},
                {"/answer/reactions", "/answer/reactions", "/answer/reactions"}};
    for (size_t i = 0; i < sizeof ROWS / sizeof ROWS[0]; i++) {
        problem_details problem;
        uz_error err = {.status = UZ_ERR_NOT_SPD};
        snprintf(err.where, sizeof err.where, "%s", ROWS[i].where);
        codec_problem_from_error(&problem, &err, UZ_PROBLEM_MATRICES);
        CHECK_STR(problem.pointer, ROWS[i].of_matrices);
        codec_problem_from_error(&problem, &err, UZ_PROBLEM_SCENE);
        CHECK_STR(problem.pointer, ROWS[i].of_scene);
    }
    problem_details problem;
    uz_error err = {.status = UZ_ERR_LIMIT, .where = "K"};
    codec_problem_from_error(&problem, &err, UZ_PROBLEM_SCENE);
    CHECK_STR(problem.pointer, "/problem/mesh");
}

TEST(problems_are_read_back)
{
    problem_details in = refuse(SCENE_HEAD ",\"modle\":\"x\"}}", 422, "unknown_key", "/problem/modle"), out;
    char *json = codec_encode_problem(&in);
    CHECK(codec_decode_problem(&out, json));
    CHECK(out.status == in.status && out.line == in.line);
    CHECK_STR(out.code, in.code);
    CHECK_STR(out.title, in.title);
    CHECK_STR(out.detail, in.detail);
    CHECK_STR(out.pointer, in.pointer);
    free(json);
}

TEST(the_data_of_other_tests_is_taken)
{
    static const char *const FILES[] = {"tests/data/paper_body.json", "tests/data/paper_body_120.json",
                                        "tests/data/small_matrices.json"};
    for (size_t i = 0; i < sizeof FILES / sizeof FILES[0]; i++) {
        size_t len;
        char *body = test_read_file(FILES[i], &len);
        CHECK_MSG(body, "no %s", FILES[i]);
        if (!body)
            continue;
        codec_request r = take(body);
        codec_request_clear(&r);
        free(body);
    }
}
