/* Assertions: what may be asserted, and what becomes of it. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/quantity.h"
#include "harness.h"
#include "work/judge.h"

#include <math.h>

#define SPRINGS                                                                                                        \
    "{\"problem\": {\"kind\": \"matrices\", \"K\": \"%%MatrixMarket matrix coordinate real symmetric\\n2 2 2\\n"       \
    "1 1 2\\n2 2 1\\n\", \"N\": \"%%MatrixMarket matrix coordinate real general\\n1 2 1\\n1 1 1\\n\", \"h\": [0.5],"   \
    " \"p\": [2, 2]}, "

static void load(void)
{
    char message[256];
    CHECK_MSG(codec_init(NULL, message, sizeof message), "%s", message);
}

static bool decode(codec_request *out, const char *rest, problem_details *problem)
{
    char body[4096];
    snprintf(body, sizeof body, "%s%s}", SPRINGS, rest);
    return codec_decode(out, CODEC_SOLVE, body, strlen(body), NULL, problem);
}

/* ---- decoding */

TEST(assertions_are_read)
{
    codec_request r;
    problem_details problem;
    load();
    CHECK_MSG(decode(&r,
                     "\"cases\": [{\"name\": \"a\", \"p\": [1, 1]}], \"assert\": ["
                     "{\"quantity\": \"contact.active\", \"min\": 1, \"max\": 3},"
                     "{\"quantity\": \"energy.primal\", \"near\": -4, \"relative\": 1e-3, \"case\": \"a\", \"name\": "
                     "\"energy \\u00e9\"}]",
                     &problem),
              "%s", problem.detail);
    CHECK_INT(r.n_assertions, 2);
    CHECK_STR(r.assertions[0].quantity, "contact.active");
    CHECK(r.assertions[0].least == 1 && r.assertions[0].most == 3 && isnan(r.assertions[0].near));
    CHECK(r.assertions[1].near == -4 && r.assertions[1].relative == 1e-3 && isnan(r.assertions[1].absolute));
    CHECK_STR(r.assertions[1].case_name, "a");
    CHECK_STR(r.assertions[1].name, "energy \xc3\xa9");
    codec_request_clear(&r);
    codec_end();
}

TEST(what_cannot_be_meant_is_refused)
{
    static const struct {
        const char *rest, *pointer, *says;
    } BAD[] = {
        {"\"assert\": [{\"quantity\": \"contact.max_presure\", \"max\": 1}]", "/assert/0/quantity",
         "Did you mean \"contact.max_pressure\"?"},
        {"\"assert\": [{\"quantity\": \"max_pressure\", \"max\": 1}]", "/assert/0/quantity",
         "Did you mean \"contact.max_pressure\"?"},
        {"\"assert\": [{\"quantity\": \"energy\", \"max\": 1}]", "/assert/0/quantity", "energy.primal, energy.dual"},
        {"\"assert\": [{\"quantity\": \"outcome\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"contact..active\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"contact.active.\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"contact.active\\u0000\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"contact.force.01\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"warnings.large_strian\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"assertions\", \"max\": 1}]", "/assert/0/quantity", "no number"},
        {"\"assert\": [{\"quantity\": \"iterations\", \"min\": 2, \"max\": 1}]", "/assert/0/min", "above max"},
        {"\"assert\": [{\"quantity\": \"iterations\", \"near\": 0, \"relative\": 1}]", "/assert/0/relative",
         "absolute"},
        {"\"assert\": [{\"quantity\": \"iterations\", \"max\": 1, \"case\": \"a\"}]", "/assert/0/case", "none at all"},
        {"\"cases\": [{\"name\": \"b\", \"p\": [1, 1]}], \"assert\": [{\"quantity\": \"iterations\", \"max\": 1,"
         " \"case\": \"a\"}]",
         "/assert/0/case", "no case \"a\""},
        {"\"assert\": [{\"quantity\": \"iterations\", \"max\": 1, \"name\": \"a\\n\"}]", "/assert/0/name", "control"},
        {"\"assert\": [{\"quantity\": \"iterations\"}]", "/assert/0", "max, min or near"},
        {"\"assert\": [{\"quantity\": \"iterations\", \"near\": 1}]", "/assert/0", "relative"},
        {"\"assert\": [{\"quantity\": \"iterations\", \"near\": 1, \"relative\": 1, \"max\": 2}]", "/assert/0/max",
         "tolerance"},
        {"\"solver\": {\"warm_start\": {\"job\": \"0123456789abcdef0123456789abcdef\", \"case\": \"a\\u0001\"}}",
         "/solver/warm_start/case", "control"},
    };
    codec_request r;
    problem_details problem;
    load();
    for (size_t i = 0; i < sizeof BAD / sizeof BAD[0]; i++) {
        bool good = decode(&r, BAD[i].rest, &problem);
        CHECK_MSG(!good && problem.status == 422, "%s: %d", BAD[i].rest, problem.status);
        CHECK_MSG(strcmp(problem.pointer, BAD[i].pointer) == 0, "%s: %s", BAD[i].rest, problem.pointer);
        CHECK_MSG(strstr(problem.detail, BAD[i].says), "%s: %s", BAD[i].rest, problem.detail);
        if (good)
            codec_request_clear(&r);
    }
    codec_end();
}

/* ---- numbers of a summary */

TEST(quantities_are_read)
{
    static const char SUMMARY[] = "{\"a\": {\"b\": 2, \"n\": null, \"s\": \"x\", \"l\": [5, [6, 7]]}, \"warnings\": "
                                  "[{\"code\": \"locking\", \"value\": 0.49}]}";
    static const struct {
        const char *name;
        bool there;
        double value;
    } LIST[] = {{"a.b", true, 2},
                {"a.n", true, NAN},
                {"a.n.x", true, NAN},
                {"a.s", false, NAN},
                {"a", false, NAN},
                {"a.l", true, 2},
                {"a.l.0", true, 5},
                {"a.l.1.1", true, 7},
                {"a.l.2", false, NAN},
                {"a.b.c", false, NAN},
                {"c", false, NAN},
                {"warnings", true, 1},
                {"a.c", false, NAN},
                {"warnings.locking", true, 0.49},
                {"warnings.large_strain", true, 0}};
    json_tree doc;
    problem_details problem;
    CHECK(json_scan(&doc, SUMMARY, strlen(SUMMARY), &problem));
    for (size_t i = 0; i < sizeof LIST / sizeof LIST[0]; i++) {
        double value = -1;
        CHECK_MSG(quantity_read(&value, doc.root, LIST[i].name) == LIST[i].there, "%s", LIST[i].name);
        CHECK_MSG(value == LIST[i].value || (isnan(value) && isnan(LIST[i].value)), "%s: %g", LIST[i].name, value);
    }
    json_clear(&doc);
}

/* ---- verdicts */

enum { LINE = 1024 };

static codec_assertion limits(const char *quantity, double least, double most)
{
    codec_assertion a = {.least = least, .most = most, .near = NAN, .absolute = NAN, .relative = NAN};
    snprintf(a.quantity, sizeof a.quantity, "%s", quantity);
    return a;
}

static codec_assertion nearness(const char *quantity, double near, double absolute, double relative)
{
    codec_assertion a = limits(quantity, NAN, NAN);
    a.near = near;
    a.absolute = absolute;
    a.relative = relative;
    return a;
}

static char *summary_of(const char *outcome)
{
    char text[LINE];
    snprintf(text, sizeof text,
             "{\"outcome\":\"%s\",\"iterations\":7,\"contact\":{\"active\":3,\"candidates\":9,\"max_pressure\":250,"
             "\"area\":null},\"energy\":{\"primal\":-1,\"dual\":-1.5,\"strain\":2},"
             "\"certificate\":{\"gap\":0.5,\"absolute_error\":1}}",
             outcome);
    return strdup(text);
}

static void check_verdict(const char *outcome, codec_assertion a, const char *wanted)
{
    char result[64];
    char *text = summary_of(outcome);
    const codec_request request = {.assertions = &a, .n_assertions = 1};
    snprintf(result, sizeof result, "\"result\":\"%s\"", wanted);
    CHECK(judge(&text, &request, NULL, false, NULL));
    CHECK_MSG(strstr(text, result), "%s: wanted %s in %s", a.quantity, wanted, text);
    CHECK_MSG(!strstr(text, "\"reason\"") == (strcmp(wanted, "pass") == 0), "%s", text);
    CHECK_MSG(
        strstr(text, strcmp(wanted, "pass") == 0 ? "\"assertions_passed\":true}" : "\"assertions_passed\":false}"),
        "%s", text);
    free(text);
}

TEST(limits_of_numbers_without_a_bound)
{
    check_verdict("converged", limits("contact.max_pressure", NAN, 250), "pass");
    check_verdict("converged", limits("contact.max_pressure", NAN, 249.9), "fail");
    check_verdict("converged", limits("contact.max_pressure", 250, NAN), "pass");
    check_verdict("converged", limits("contact.active", 4, 10), "fail");
    check_verdict("converged", limits("contact.active", 3, 3), "pass");
    check_verdict("verified", nearness("contact.max_pressure", 251, NAN, 0.01), "pass");
    check_verdict("verified", nearness("contact.max_pressure", 251, 0.5, NAN), "fail");
    check_verdict("verified", nearness("contact.max_pressure", 251, 0.5, 0.01), "pass");
    check_verdict("converged", nearness("contact.max_pressure", -250, NAN, 0.01), "fail");
    check_verdict("converged", limits("contact.area", 0, 1), "uncertain"); /* not known */
    check_verdict("converged", limits("contact.force.1", 0, 1), "fail");   /* not there */
}

/* The exact minimum is in [-1.5, -1]; the exact strain energy between half of (2 - 1)^2 and of (2 + 1)^2. */
TEST(the_certified_error_counts)
{
    check_verdict("converged", limits("energy.primal", -1.5, -1), "pass");
    check_verdict("converged", limits("energy.primal", -1.4, NAN), "uncertain");
    check_verdict("converged", limits("energy.primal", -0.9, NAN), "fail");
    check_verdict("converged", limits("energy.primal", NAN, -1.6), "fail");
    check_verdict("converged", limits("energy.dual", -1.5, -1), "pass");
    check_verdict("converged", limits("energy.dual", NAN, -1.2), "uncertain");
    check_verdict("converged", limits("energy.dual", NAN, -1.6), "fail");
    check_verdict("converged", limits("energy.strain", 0.5, 4.5), "pass");
    check_verdict("converged", limits("energy.strain", 0.6, 4.5), "uncertain");
    check_verdict("converged", limits("energy.strain", NAN, 4.4), "uncertain");
    check_verdict("converged", limits("energy.strain", NAN, 0.4), "fail");
    check_verdict("converged", nearness("energy.primal", -1.25, 0.25, NAN), "pass");
    check_verdict("converged", nearness("energy.primal", -1.25, 0.2, NAN), "uncertain");
}

TEST(an_answer_that_is_not_as_asked_passes_nothing)
{
    check_verdict("time_limit", limits("contact.max_pressure", NAN, 250), "uncertain");
    check_verdict("time_limit", limits("contact.max_pressure", NAN, 1), "uncertain"); /* a better one may */
    check_verdict("precision_limit", limits("energy.primal", -2, 0), "uncertain");
    check_verdict("iteration_limit", limits("energy.primal", -0.9, NAN), "fail"); /* the bound holds all the same */
    check_verdict("dismissed", limits("iterations", NAN, 6), "fail");
    check_verdict("dismissed", limits("iterations", NAN, 8), "uncertain");
    check_verdict("infeasible", limits("contact.area", NAN, 8), "uncertain");
    check_verdict("not_verified", limits("contact.candidates", 9, 9), "uncertain");
}

TEST(a_line_says_what_was_found)
{
    codec_assertion a = nearness("energy.primal", -1.25, 0.25, NAN);
    const codec_request request = {.assertions = &a, .n_assertions = 1};
    snprintf(a.name, sizeof a.name, "the \"energy\"");
    char *text = strdup("{\"outcome\":\"converged\",\"energy\":{\"primal\":-1.625},\"certificate\":{\"gap\":0}}");
    CHECK(judge(&text, &request, NULL, false, NULL));
    CHECK_STR(text, "{\"outcome\":\"converged\",\"energy\":{\"primal\":-1.625},\"certificate\":{\"gap\":0},"
                    "\"assertions\":[{\"name\":\"the \\\"energy\\\"\",\"quantity\":\"energy.primal\",\"near\":-1.25,"
                    "\"absolute\":0.25,\"value\":-1.625,\"error\":0,\"result\":\"fail\","
                    "\"reason\":\"-1.625 is not within 0.25 of -1.25\"}],\"assertions_passed\":false}");
    free(text);
    text = strdup("{}");
    CHECK(judge(&text, &(codec_request){.tags = NULL}, NULL, false, NULL));
    CHECK_STR(text, "{}");
    free(text);
}

/* ---- load cases */

static void judge_case(const codec_request *request, const char *name, double pressure, codec_finding *all, bool passed,
                       size_t lines)
{
    char made[LINE];
    size_t found = 0;
    snprintf(made, sizeof made,
             "{\"outcome\":\"converged\",\"contact\":{\"max_pressure\":%.17g},\"timings_s\":{\"total\":9}}", pressure);
    char *text = strdup(made);
    CHECK(judge(&text, request, name, false, all));
    for (const char *at = text; (at = strstr(at, "\"quantity\"")); at++)
        found++;
    CHECK_INT(found, lines);
    CHECK_MSG(strstr(text, passed ? "\"assertions_passed\":true}" : "\"assertions_passed\":false}"), "%s", text);
    free(text);
}

TEST(cases_are_judged_each_and_together)
{
    codec_assertion list[] = {limits("contact.max_pressure", NAN, 10), limits("contact.max_pressure", NAN, 20),
                              limits("cases.converged", 3, NAN), limits("timings_s.total", NAN, 1),
                              limits("contact.max_pressure", NAN, 5)};
    codec_finding all[5] = {{{0}, 0, 0, 0, 0, "", ""}};
    const codec_request request = {.assertions = list, .n_assertions = 5};
    snprintf(list[4].case_name, sizeof list[4].case_name, "b");
    judge_case(&request, "a", 9, all, true, 2);
    judge_case(&request, "b", 12, all, false, 3);
    judge_case(&request, "c", 13, all, false, 2);
    CHECK(all[0].counts[CODEC_PASS] == 1 && all[0].counts[CODEC_FAIL] == 2 && all[0].verdict == CODEC_FAIL);
    CHECK_STR(all[0].case_name, "c"); /* farthest beyond the limit */
    CHECK(all[1].counts[CODEC_PASS] == 3 && all[1].value == 13);
    CHECK_STR(all[1].case_name, "c"); /* nearest to it */
    CHECK_STR(all[4].case_name, "b");
    char *text = strdup("{\"outcome\":\"converged\",\"cases\":{\"converged\":3},\"timings_s\":{\"total\":0.5}}");
    CHECK(judge(&text, &request, NULL, true, all));
    CHECK_MSG(strstr(text,
                     "\"quantity\":\"contact.max_pressure\",\"case\":\"c\",\"max\":10,\"value\":13,\"error\":null,"
                     "\"result\":\"fail\",\"reason\":\"13 is above 10\","
                     "\"cases\":{\"pass\":1,\"uncertain\":0,\"fail\":2}}"),
              "%s", text);
    CHECK_MSG(strstr(text, "\"cases.converged\",\"min\":3,\"value\":3,\"error\":0,\"result\":\"pass\"}"), "%s", text);
    CHECK_MSG(strstr(text, "\"timings_s.total\",\"max\":1,\"value\":0.5,\"error\":0,\"result\":\"pass\"}"), "%s", text);
    CHECK_MSG(strstr(text, "\"assertions_passed\":false}"), "%s", text);
    free(text);
}
