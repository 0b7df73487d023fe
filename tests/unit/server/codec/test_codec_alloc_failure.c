/* Every allocation of the codec fails once. What comes out then is a whole answer or a clear
 * refusal, and not one block is left behind. Linked with malloc, calloc, realloc and free wrapped. */
#include "codec/codec.h"
#include "codec/text.h"
#include "codec/decode.h"
#include "harness.h"
#include "sanitized.h"
#include "work/judge.h"

#include <math.h>
#include <stdint.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *block, size_t size);
void __real_free(void *block);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *block, size_t size);
void __wrap_free(void *block);

static int64_t countdown = -1; /* allocations until one fails; negative: none does */
static int64_t blocks;         /* alive */

static bool fails(void)
{
    return countdown >= 0 && countdown-- == 0;
}

static void *counted(void *block)
{
    blocks += block != NULL;
    return block;
}

void *__wrap_malloc(size_t size)
{
    return fails() ? NULL : counted(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return fails() ? NULL : counted(__real_calloc(count, size));
}

void *__wrap_realloc(void *block, size_t size)
{
    void *grown = fails() ? NULL : __real_realloc(block, size);
    blocks += grown && !block;
    return grown;
}

void __wrap_free(void *block)
{
    blocks -= block != NULL;
    __real_free(block);
}

/* Fails the 1st, 2nd, 3rd ... allocation of `attempt` until it gets through; attempt says whether it did, and checks
 * what it got otherwise. */
static void exhaust(bool (*attempt)(const char *), const char *argument)
{
    enum { MOST = 20000 };
    long n = 0;
    bool done = false;
    for (; n < MOST && !done; n = next_allocation(n)) {
        int64_t before = blocks;
        countdown = n;
        done = attempt(argument);
        CHECK_MSG(!done || countdown >= 0, "%s: allocation %ld failed without a word", argument ? argument : "", n);
        countdown = -1;
        CHECK_MSG(blocks == before, "allocation %ld failed: %lld blocks left", n, (long long)(blocks - before));
    }
    CHECK(done && n > 1);
}

static bool try_init(const char *argument)
{
    char message[256] = "";
    (void)argument;
    bool good = codec_init(NULL, message, sizeof message);
    countdown = good ? countdown : -1;
    CHECK(good || message[0]);
    codec_end();
    return good;
}

static bool try_decode(const char *path)
{
    codec_request request;
    problem_details problem;
    size_t len;
    int64_t planned = countdown;
    countdown = -1;
    char *body = test_read_file(path, &len);
    countdown = planned;
    bool good = codec_decode(&request, CODEC_STORED, body, len, NULL, &problem);
    if (good)
        codec_request_clear(&request);
    else
        CHECK_MSG(problem.status == 503 && strcmp(problem.code, "out_of_memory") == 0, "%s: %d %s %s", path,
                  problem.status, problem.code, problem.detail);
    planned = countdown;
    countdown = -1;
    free(body);
    countdown = planned;
    return good;
}

/* A scene's JSON up to the solver's structs, whether or not it can be solved. */
static bool try_scene(const char *path)
{
    uz_scene scene = {0};
    problem_details problem = {0};
    json_tree tree = {NULL, NULL};
    decoding d = {.bound = 1 << 30, .problem = &problem};
    size_t len;
    int64_t planned = countdown;
    countdown = -1;
    char *body = test_read_file(path, &len);
    countdown = planned;
    const bool good = json_scan(&tree, body, len, &problem) &&
                      schemas_check(decode_schemas(), "request.json", tree.root, &problem) &&
                      decode_scene(&scene, &d, json_get(tree.root, "problem"));
    planned = countdown;
    countdown = -1;
    CHECK_MSG(good || (problem.status == 503 && strcmp(problem.code, "out_of_memory") == 0), "%s: %d %s %s", path,
              problem.status, problem.code, problem.detail);
    json_clear(&tree);
    uz_scene_clear(&scene);
    free(body);
    countdown = planned;
    return good;
}

static bool try_encode(const char *argument)
{
    static const double rows[40 * CODEC_HISTORY_COLUMNS];
    size_t len;
    (void)argument;
    char *written = codec_encode_history(NULL, rows, 40, &len);
    CHECK(written ? len > 0 : len == 0);
    free(written);
    return written != NULL;
}

static bool try_refine(const char *old)
{
    static const char CHANGE[] = "{\"accuracy\": \"exact\"}";
    problem_details problem = {0};
    size_t len;
    char *made = codec_refine(old, strlen(old), "id", CHANGE, sizeof CHANGE - 1, &len, &problem);
    CHECK(made ? len > strlen(old) && strstr(made, "exact") : problem.status == 503 && len == 0);
    free(made);
    return made != NULL;
}

/* A summary stays as it was where there is no memory for what was found. */
static bool try_judge(const char *summary)
{
    codec_assertion list[] = {{"contact.active", "", "", 1, 3, NAN, NAN, NAN}};
    const codec_request request = {.assertions = list, .n_assertions = 1};
    codec_finding found = {.reason = ""};
    int64_t planned = countdown;
    countdown = -1;
    char *written =
        __wrap_malloc(strlen(summary) + 1); /* counted, unlike strdup; of malloc gcc knows that it reads no countdown */
    memcpy(written, summary, strlen(summary) + 1);
    countdown = planned;
    const bool good = judge(&written, &request, "a", false, &found) && judge(&written, &request, NULL, true, &found);
    CHECK(good ? strstr(written, "\"pass\"") != NULL : strncmp(written, summary, strlen(summary) - 1) == 0);
    free(written);
    return good;
}

static bool try_results(const char *argument)
{
    static const double r[100];
    const codec_result one = {.case_name = "a", .summary = "{}", .m = 100, .reactions = r};
    size_t len;
    (void)argument;
    text all = {0};
    codec_put_case(&all, &one);
    codec_put_places(&all, &one);
    char *written = text_finish(&all, &len);
    free(written);
    return written != NULL;
}

static bool try_trade(const char *summary)
{
    codec_trade of = {.job_id = "id", .case_name = "a"};
    uz_trade_clear(&of.trade);
    json_tree read;
    const bool named =
        codec_summary_read(&read, summary) && strcmp(codec_summary_text(read.root, "method"), "auto") == 0;
    json_clear(&read);
    char *written = named ? codec_encode_trade(&of, NULL) : NULL;
    free(written);
    return written != NULL;
}

static bool try_surface(const char *argument)
{
    static float at[9], u[9], r[1];
    static double x[2], y[2], z[4];
    static unsigned triangle[3] = {0, 1, 2}, row[1];
    uz_contact contacts[] = {{.on = "a", .kind = UZ_OBSTACLE_HEIGHT, .n_x = 2, .n_y = 2, .x = x, .y = y, .z = z},
                             {.on = "a", .kind = UZ_OBSTACLE_BODY, .with = "b"}};
    const uz_scene scene = {.contacts = contacts, .n_contacts = 2};
    const uz_surface surface = {.dim = 3,
                                .n_vertices = 3,
                                .n_triangles = 1,
                                .n_rows = 1,
                                .unit = 1,
                                .factor = 1,
                                .position = at,
                                .displacement = u,
                                .triangle = triangle,
                                .row_vertex = row,
                                .row_contact = row,
                                .row_normal = at,
                                .reaction = {.x = r, .unit = 1}};
    const codec_surface what = {&surface, &scene, "id", argument};
    size_t len;
    char *file = codec_encode_surface(&what, &len);
    CHECK(file ? len > 500 && len % 4 == 0 && memcmp(file, "glTF", 4) == 0 : len == 0);
    free(file);
    return file != NULL;
}

TEST(loading)
{
    exhaust(try_init, NULL);
}

TEST(decoding)
{
    char message[256];
    CHECK(codec_init(NULL, message, sizeof message));
    exhaust(try_decode, "tests/data/paper_body.json");
    exhaust(try_decode, "tests/data/small_matrices.json");
    exhaust(try_decode, "tests/data/long_vectors.json");
    exhaust(try_decode, "tests/data/cases.json");
    exhaust(try_decode, "tests/data/verify.json");
    exhaust(try_decode, "tests/data/assertions.json");
    exhaust(try_scene, "tests/data/mesh_scene.json");
    exhaust(try_scene, "tests/data/stabilized_scene.json");
    exhaust(try_scene, "tests/data/gmsh_scene.json");
    exhaust(try_refine, "{\"problem\": 1, \"solver\": {\"method\": \"uzawa\"}}");
    exhaust(try_refine, "{\"problem\": 1}");
    codec_end();
}

TEST(encoding)
{
    exhaust(try_results, NULL);
    exhaust(try_encode, NULL);
    exhaust(try_judge, "{\"outcome\":\"converged\",\"contact\":{\"active\":2}}");
    exhaust(try_surface, "a case");
    exhaust(try_trade, "{\"method\": \"auto\", \"certificate\": {\"relative_error\": 1e-9}}");
}
