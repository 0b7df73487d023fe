#include "codec/codec.h"
#include "codec/quantity.h"
#include "codec/schema.h"
#include "codec/text.h"
#include "harness.h"

/* Reads a reply back through the strict scanner and checks it against its schema. The caller clears *doc. */
static void read_reply(json_tree *doc, char *reply, const char *schema)
{
    char message[256] = "";
    problem_details problem = {0};
    schemas *all = schemas_load(NULL, 0, message, sizeof message);
    CHECK_MSG(all, "%s", message);
    CHECK(reply != NULL);
    *doc = (json_tree){0};
    if (reply && json_scan(doc, reply, strlen(reply), &problem) && all)
        schemas_check(all, schema, doc->root, &problem);
    CHECK_MSG(problem.status == 0, "%s: %s %s in %s", schema, problem.pointer, problem.detail, reply);
    schemas_free(all);
}

static void drop(json_tree *doc, char *reply)
{
    json_clear(doc);
    free(reply);
}

/* The number at "a/b/c" of a document, NaN for null. */
static double number_at(const json_tree *doc, const char *place)
{
    const json_value *value = doc->root;
    for (const char *at = place; value && *at;) {
        size_t n = strcspn(at, "/");
        value = json_get_n(value, at, n);
        at += n + (at[n] == '/');
    }
    CHECK_MSG(value, "no %s", place);
    return json_number(value, (double)NAN);
}

static const char *text_at(const json_tree *doc, const char *key)
{
    const char *found = json_text(json_get(doc->root, key));
    return found ? found : "";
}

static bool is_false(const json_value *value)
{
    return json_is(value, JSON_IS_BOOLEAN) && !value->truth;
}

/* xorshift64*: Vigna 2016. */
static uint64_t next_random(uint64_t *state)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return *state * 2685821657736338717u;
}

TEST(doubles_read_back_from_the_fewest_digits)
{
    static const struct {
        double x;
        const char *want;
    } CASES[] = {{0, "0"},
                 {-0.0, "-0"},
                 {1, "1"},
                 {-3, "-3"},
                 {0.1, "0.1"},
                 {1e-6, "1e-06"},
                 {1e22, "1e+22"},
                 {123456789012345, "123456789012345"},
                 {0.1 + 0.2, "0.30000000000000004"},
                 {5e-324, "5e-324"},
                 {1.7976931348623157e308, "1.7976931348623157e+308"},
                 {1.0 / 3, "0.3333333333333333"}};
    char digits[UZ_DOUBLE_ROOM];
    uint64_t state = 42;
    for (size_t i = 0; i < sizeof CASES / sizeof CASES[0]; i++) {
        digits[uz_format_double(digits, CASES[i].x)] = '\0';
        CHECK_STR(digits, CASES[i].want);
    }
    for (int i = 0; i < 20000; i++) {
        double x;
        uint64_t bits = next_random(&state);
        memcpy(&x, &bits, sizeof x);
        if (!isfinite(x))
            continue;
        const size_t n = uz_format_double(digits, x);
        CHECK(n < 25);
        digits[n] = '\0';
        CHECK_MSG(strtod(digits, NULL) == x, "%s is not %.17g", digits, x);
    }
}

TEST(strings_are_escaped)
{
    text t = {0};
    text_string(&t, NULL, "a\"b\\c\n\t\x01\x7f \xc3\xa9 \xf0\x9f\x98\x80 \xff \xed\xa0\x80");
    char *json = text_finish(&t, NULL);
    CHECK_STR(json, "\"a\\\"b\\\\c\\n\\t\\u0001\\u007f \xc3\xa9 \xf0\x9f\x98\x80 \xef\xbf\xbd "
                    "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\"");
    free(json);
    text_string(&t, NULL, NULL);
    json = text_finish(&t, NULL);
    CHECK_STR(json, "null");
    free(json);
}

TEST(problem)
{
    json_tree doc;
    problem_details problem = {.status = 422, .code = "unknown_key", .title = "T", .detail = "say \"x\"", .line = 3};
    char *reply = codec_encode_problem(&problem);
    read_reply(&doc, reply, "problem-details.json");
    CHECK_STR(text_at(&doc, "type"), "/schemas/problem-details.json#unknown_key");
    CHECK_STR(text_at(&doc, "detail"), "say \"x\"");
    CHECK(json_get(doc.root, "pointer") != NULL); /* the whole request */
    CHECK(number_at(&doc, "line") == 3 && number_at(&doc, "status") == 422);
    drop(&doc, reply);
    problem = (problem_details){.status = 404, .code = "not_found"};
    reply = codec_encode_problem(&problem);
    read_reply(&doc, reply, "problem-details.json");
    CHECK(!json_get(doc.root, "pointer") && !json_get(doc.root, "line"));
    drop(&doc, reply);
}

static uz_summary paper_summary(void)
{
    uz_summary s = {.outcome = UZ_CONVERGED,
                    .method = UZ_METHOD_ACCELERATED_RESTART,
                    .row_scaling = UZ_ROW_SCALING_UNIT,
                    .op = UZ_OPERATOR_CONDENSED,
                    .ordering = UZ_ORDERING_CAMD,
                    .d = 660,
                    .m = 30,
                    .kept = 25,
                    .added = 3,
                    .rounds = 2,
                    .iterations = 283,
                    .restarts = 2,
                    .active = 22,
                    .reaction_sum = -10.5137,
                    .max_penetration = 1e-12,
                    .dim = 2,
                    .force = {0, 10.5137, 99},
                    .max_pressure = 0.5,
                    .alpha = 1060.75,
                    .lambda_max = 9.427e-4,
                    .discretization_error = NAN,
                    .requested_error = 1e-6,
                    .factor_cached = true,
                    .reused = {.ordering = true, .factor = true},
                    .factor_nnz = 12345,
                    .factor_bytes = 98765,
                    .rcond = 1e-5,
                    .timings = {1, 2, 3, 4, 5, 6, 7, 8, 9}};
    s.certificate = (uz_certificate){.relative_error = INFINITY,
                                     .absolute_error = 1e-10,
                                     .gap = 1e-20,
                                     .energy_primal = -3.9608e-3,
                                     .energy_dual = -3.9609e-3,
                                     .residual = {1, 2, 3, 4, 5},
                                     .relative_residual = {6, 7, 8, 9, 10}};
    return s;
}

TEST(summary_of_a_scene)
{
    static const struct {
        const char *place;
        double want;
    } NUMBERS[] = {{"iterations", 283},
                   {"restarts", 2},
                   {"contact/candidates", 30},
                   {"contact/kept", 25},
                   {"contact/added", 3},
                   {"contact/rounds", 2},
                   {"contact/active", 22},
                   {"contact/reaction_sum", -10.5137},
                   {"contact/max_penetration", 1e-12},
                   {"contact/max_pressure", 0.5},
                   {"energy/primal", -3.9608e-3},
                   {"energy/dual", -3.9609e-3},
                   {"certificate/absolute_error", 1e-10},
                   {"certificate/gap", 1e-20},
                   {"certificate/residual/total", 1},
                   {"certificate/residual/e4", 5},
                   {"certificate/relative_residual/total", 6},
                   {"certificate/relative_residual/e1", 7},
                   {"factor/nnz", 12345},
                   {"factor/bytes", 98765},
                   {"factor/rcond", 1e-5},
                   {"timings_s/queue", 1},
                   {"timings_s/parse", 2},
                   {"timings_s/assemble", 3},
                   {"timings_s/order", 4},
                   {"timings_s/factor", 5},
                   {"timings_s/condense", 6},
                   {"timings_s/iterate", 7},
                   {"timings_s/certify", 8},
                   {"timings_s/total", 9},
                   {"problem/d", 660},
                   {"problem/m", 30},
                   {"requested_error", 1e-6},
                   {"alpha", 1060.75},
                   {"lambda_max", 9.427e-4}};
    json_tree doc;
    uz_summary s = paper_summary();
    char *reply = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
    read_reply(&doc, reply, "summary.json");
    for (size_t i = 0; i < sizeof NUMBERS / sizeof NUMBERS[0]; i++)
        CHECK_MSG(number_at(&doc, NUMBERS[i].place) == NUMBERS[i].want, "%s", NUMBERS[i].place);
    CHECK(isnan(number_at(&doc, "certificate/relative_error")) && isnan(number_at(&doc, "discretization_error")));
    CHECK_STR(text_at(&doc, "outcome"), "converged");
    CHECK_STR(text_at(&doc, "method"), "accelerated_restart");
    CHECK_STR(text_at(&doc, "operator"), "condensed");
    CHECK_INT(json_size(json_get(json_get(doc.root, "contact"), "force")), 2);
    CHECK(json_truth(json_get(json_get(doc.root, "factor"), "cached")));
    const json_value *reused = json_get(json_get(doc.root, "factor"), "reused");
    CHECK(is_false(json_get(reused, "assembly")) && json_truth(json_get(reused, "ordering")));
    CHECK(json_truth(json_get(reused, "factor")) && is_false(json_get(reused, "operator")));
    drop(&doc, reply);
}

TEST(summary_of_a_body_held_by_contact)
{
    json_tree doc;
    uz_summary s = paper_summary();
    char *reply = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
    read_reply(&doc, reply, "summary.json");
    CHECK(!json_get(doc.root, "semicoercive"));
    drop(&doc, reply);
    s.semicoercive = (uz_semicoercive){.free_modes = 2, .held = 9, .held_by = {3, 5, 6, 7, 8, 9, 10, 12}, .rounds = 4};
    reply = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
    read_reply(&doc, reply, "summary.json");
    CHECK(number_at(&doc, "semicoercive/free_modes") == 2 && number_at(&doc, "semicoercive/held") == 9);
    CHECK(number_at(&doc, "semicoercive/rounds") == 4);
    const json_value *rows = json_get(json_get(doc.root, "semicoercive"), "held_by_rows");
    CHECK(json_size(rows) == 8 && rows->numbers[7] == 12);
    drop(&doc, reply);
}

TEST(summary_of_matrices)
{
    json_tree doc;
    uz_summary s = paper_summary();
    s.outcome = UZ_PRECISION_LIMIT;
    snprintf(s.message, sizeof s.message, "reached 1e-9");
    char *reply = codec_encode_summary(&s, UZ_PROBLEM_MATRICES, NULL);
    read_reply(&doc, reply, "summary.json");
    const json_value *contact = json_get(doc.root, "contact");
    CHECK(!json_get(contact, "force") && !json_get(contact, "max_pressure"));
    CHECK_STR(text_at(&doc, "outcome"), "precision_limit");
    CHECK_STR(text_at(&doc, "message"), "reached 1e-9");
    drop(&doc, reply);
}

TEST(numbers_and_texts_of_a_summary_are_read_back)
{
    double value = 0;
    json_tree read;
    CHECK(codec_summary_read(&read, "{\"outcome\": \"converged\", \"problem\": {\"kind\": \"scene\", \"d\": 4},"
                                    " \"certificate\": {\"relative_error\": 5e-8, \"gap\": null}}"));
    CHECK_STR(codec_summary_text(read.root, "outcome"), "converged");
    CHECK_STR(codec_summary_text(read.root, "problem.kind"), "scene");
    static const char *const NONE[] = {"problem.d", "problem", "problem.kind.x", "method", "", "problem.", ".kind"};
    for (size_t i = 0; i < sizeof NONE / sizeof NONE[0]; i++)
        CHECK_STR(codec_summary_text(read.root, NONE[i]), "");
    CHECK(quantity_read(&value, read.root, "certificate.relative_error") && value == 5e-8);
    CHECK(quantity_read(&value, read.root, "certificate.gap") && isnan(value));
    CHECK(!quantity_read(&value, read.root, "discretization_error") && isnan(value));
    json_clear(&read);
    CHECK(!codec_summary_read(&read, "{") && !read.root);
    CHECK_STR(codec_summary_text(NULL, "outcome"), "");
}

TEST(what_accuracy_took_fits_the_schema)
{
    json_tree doc;
    codec_trade of = {.job_id = "0190f3a5c1d87d0b9e4f2a6b8c1d3e5f"};
    uz_trade_clear(&of.trade);
    of.mesh_error = of.solver_error = NAN;
    char *reply = codec_encode_trade(&of, NULL);
    read_reply(&doc, reply, "work-precision.json");
    CHECK(json_is(json_get(doc.root, "mesh_error"), JSON_IS_NULL));
    drop(&doc, reply);
    for (int k = 0; k < 30; k++)
        of.trade.step[k] = (uz_trade_step){.seconds = 0.01 * k, .iterations = 10 * k, .by_certificate = k > 27};
    of.trade.iterated_s = 0.29;
    of.trade.total_s = 0.3;
    of.case_name = "a";
    of.mesh_error = 0.02;
    of.solver_error = 5e-8;
    reply = codec_encode_trade(&of, NULL);
    read_reply(&doc, reply, "work-precision.json");
    const json_value *decades = json_get(doc.root, "decades"), *second = &decades->items[1],
                     *eighth = &decades->items[7], *levels = json_get(doc.root, "levels");
    CHECK_INT(json_number(json_get(second, "iterations"), 0), 70);
    CHECK_STR(json_text(json_get(second, "by")), "iteration");
    CHECK(json_is(json_get(eighth, "seconds"), JSON_IS_NULL) && json_is(json_get(eighth, "by"), JSON_IS_NULL));
    CHECK_INT(json_number(json_get(&levels->items[1], "iterations"), 0), 100); /* 2e-3 is met at 10^-2.75 */
    drop(&doc, reply);
}

TEST(every_outcome_fits_the_schema)
{
    for (int i = UZ_CONVERGED; i <= UZ_DISMISSED; i++) {
        json_tree doc;
        uz_summary s = paper_summary();
        s.outcome = (uz_outcome)i;
        char *reply = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
        read_reply(&doc, reply, "summary.json");
        drop(&doc, reply);
    }
}

TEST(jobs)
{
    uz_summary s = paper_summary();
    json_tree doc;
    job list[2] = {{.id = "0193aa", .status = JOB_SUCCESSFUL, .progress = 100, .attempts = 1, .created = 1769860800.25},
                   {.id = "0193ab", .status = JOB_FAILED, .created = 1769860799.9996}};
    list[0].started = list[0].finished = 1769860801;
    list[0].summary = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
    list[0].tags = "[\"demo\"]";
    list[1].tags = "[]";
    list[1].error = codec_encode_problem(&(problem_details){.status = 422, .code = "free_body"});
    char *reply = codec_encode_job(&list[0]);
    read_reply(&doc, reply, "job.json");
    CHECK_STR(text_at(&doc, "id"), "0193aa");
    CHECK_STR(text_at(&doc, "status"), "successful");
    CHECK_STR(text_at(&doc, "created"), "2026-01-31T12:00:00.250Z");
    CHECK_INT(json_size(json_get(doc.root, "links")), 4);
    drop(&doc, reply);
    reply = codec_encode_job(&list[1]);
    read_reply(&doc, reply, "job.json");
    CHECK_STR(text_at(&doc, "created"), "2026-01-31T12:00:00.000Z"); /* rounding carries into the second */
    CHECK(json_is(json_get(doc.root, "started"), JSON_IS_NULL) && json_is(json_get(doc.root, "summary"), JSON_IS_NULL));
    CHECK_INT(json_size(json_get(doc.root, "links")), 1);
    drop(&doc, reply);
    reply = codec_encode_jobs(list, 2, true);
    read_reply(&doc, reply, "jobs.json");
    CHECK_STR(text_at(&doc, "next"), "0193ab");
    drop(&doc, reply);
    reply = codec_encode_jobs(NULL, 0, false);
    read_reply(&doc, reply, "jobs.json");
    CHECK(json_is(json_get(doc.root, "next"), JSON_IS_NULL));
    drop(&doc, reply);
    free(list[0].summary);
    free(list[1].error);
}

TEST(service)
{
    json_tree doc;
    uz_cache_entry entries[2] = {{.digest = "ab", .d = 660, .m = 30, .nnz = 7, .hits = 3, .bytes = 100},
                                 {.digest = "cd", .bytes = 23}};
    char *reply = codec_encode_factors(entries, 2, 1 << 30);
    read_reply(&doc, reply, "factors.json");
    CHECK(number_at(&doc, "bytes") == 123 && number_at(&doc, "max_bytes") == 1 << 30);
    drop(&doc, reply);
    reply = codec_encode_health("ok", (int64_t[5]){1, 2, 3, 4, 5}, 2);
    read_reply(&doc, reply, "health.json");
    CHECK(number_at(&doc, "jobs/accepted") == 1 && number_at(&doc, "jobs/dismissed") == 5);
    drop(&doc, reply);
}

TEST(result)
{
    json_tree doc;
    size_t len;
    uz_summary s = paper_summary();
    char *summary = codec_encode_summary(&s, UZ_PROBLEM_SCENE, NULL);
    const double r[2] = {-0.1, 0}, g[2] = {0, NAN}, u[4] = {1, 2, 3, 0.5}, at[2] = {0, 1};
    codec_result result = {.job_id = "x",
                           .summary = summary,
                           .dim = 2,
                           .m = 2,
                           .n_u = 4,
                           .n_nodes = 4,
                           .reactions = r,
                           .gaps = g,
                           .displacements = u,
                           .nodes = u,
                           .contact_nodes = at};
    char *reply = codec_encode_result(&result, &len);
    CHECK_INT(len, strlen(reply));
    CHECK(strstr(reply, "\"reactions\":[-0.1,0],\"gaps\":[0,null],\"displacements\":[[1,2],[3,0.5]],\"nodes\":[[1,2],"
                        "[3,0.5]],\"contact_nodes\":[0,1]}"));
    read_reply(&doc, reply, "result.json");
    drop(&doc, reply);
    result.dim = 0;
    result.reactions = NULL;
    result.nodes = NULL;
    reply = codec_encode_result(&result, &len);
    CHECK(strstr(reply, "\"displacements\":[1,2,3,0.5]") && !strstr(reply, "reactions\"") &&
          !strstr(reply, "nodes\":[["));
    read_reply(&doc, reply, "result.json");
    drop(&doc, reply);
    free(summary);
}

TEST(history)
{
    json_tree doc;
    size_t len;
    double rows[2 * CODEC_HISTORY_COLUMNS];
    uz_history_row row = {.iteration = 7,
                          .seconds = 0.5,
                          .dual_objective = -1,
                          .residual = {1, 2, 3, 4, 5},
                          .step_norm = 6,
                          .error_bound = INFINITY,
                          .contacts = 8,
                          .restart = true};
    codec_history_row(rows, &row);
    row.error_bound = 0.25;
    codec_history_row(rows + CODEC_HISTORY_COLUMNS, &row);
    char *reply = codec_encode_history(NULL, rows, 2, &len);
    CHECK_INT(len, strlen(reply));
    CHECK(strstr(reply, "\"rows\":[[7,0.5,-1,1,2,3,4,5,6,null,8,1],[7,0.5,-1,1,2,3,4,5,6,0.25,8,1]]"));
    read_reply(&doc, reply, "history.json");
    drop(&doc, reply);
    reply = codec_encode_history_csv(rows, 2, &len);
    CHECK_STR(reply, "iteration,seconds,dual_objective,residual_total,e1,e2,e3,e4,step_norm,error_bound,contacts,"
                     "restart\n7,0.5,-1,1,2,3,4,5,6,inf,8,1\n7,0.5,-1,1,2,3,4,5,6,0.25,8,1\n");
    free(reply);
    reply = codec_encode_history(NULL, rows, 0, &len);
    read_reply(&doc, reply, "history.json");
    drop(&doc, reply);
}
