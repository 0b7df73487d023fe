/* Checks, JUnit reports and comparisons with a baseline. */
#include "commands/contract.h"
#include "harness.h"
#include "show/junit.h"
#include "show/report.h"

#include <stdlib.h>
#include <unistd.h>

static json_t *parse(const char *text)
{
    json_t *value = json_loads(text, 0, NULL);
    CHECK_MSG(value, "%s", text);
    return value;
}

static const char *text_at(const client_checks *checks, size_t i)
{
    return i < checks->count ? checks->item[i].text : "there is none";
}

/* ---- exit codes */

static client_exit exit_of(const char *summary)
{
    char text[512];
    snprintf(text, sizeof text, "{\"status\": \"successful\", \"summary\": %s}", summary);
    json_t *job = parse(text);
    client_exit code = client_job_exit(job);
    json_decref(job);
    return code;
}

TEST(exit_codes_of_assertions)
{
    CHECK_INT(exit_of("{\"outcome\": \"converged\"}"), CLIENT_OK);
    CHECK_INT(exit_of("{\"outcome\": \"converged\", \"assertions\": [], \"assertions_passed\": true}"), CLIENT_OK);
    CHECK_INT(exit_of("{\"outcome\": \"converged\", \"assertions\": [{\"result\": \"uncertain\"}], "
                      "\"assertions_passed\": false}"),
              CLIENT_ASSERTION_FAILED);
    CHECK_INT(exit_of("{\"outcome\": \"time_limit\", \"assertions\": [{\"result\": \"uncertain\"}], "
                      "\"assertions_passed\": false}"),
              CLIENT_NOT_CONVERGED);
    CHECK_INT(exit_of("{\"outcome\": \"time_limit\", \"assertions\": [{\"result\": \"pass\"}, {\"result\": \"fail\"}], "
                      "\"assertions_passed\": false}"),
              CLIENT_ASSERTION_FAILED);
    CHECK_INT(exit_of("{\"outcome\": \"infeasible\", \"assertions\": [{\"result\": \"fail\"}], "
                      "\"assertions_passed\": false}"),
              CLIENT_INFEASIBLE);
}

/* ---- checks */

TEST(assertions_in_words)
{
    client_checks checks = {.item = NULL};
    json_t *summary = parse("{\"assertions\": ["
                            "{\"quantity\": \"a.b\", \"min\": 1, \"max\": 2.5, \"value\": 2, \"error\": null, "
                            "\"result\": \"pass\"},"
                            "{\"name\": \"mine\", \"quantity\": \"a\", \"near\": 3, \"value\": 4, \"error\": 0, "
                            "\"result\": \"fail\", \"reason\": \"4 is not 3\", \"case\": \"c\", "
                            "\"cases\": {\"pass\": 1, \"uncertain\": 1, \"fail\": 2}},"
                            "{\"quantity\": \"e\", \"near\": 3, \"value\": 4, \"error\": 0.5, \"result\": \"pass\"}]}");
    client_checks_assertions(&checks, summary, "g");
    CHECK_INT(checks.count, 3);
    CHECK_STR(checks.item[0].name, "a.b at least 1 at most 2.5");
    CHECK_STR(text_at(&checks, 0), "2");
    CHECK_STR(checks.item[1].name, "mine");
    CHECK_STR(text_at(&checks, 1), "4 is not 3 (case c; 3 cases in all)");
    CHECK_STR(text_at(&checks, 2), "4, the exact one within 0.5");
    CHECK(client_checks_worst(&checks, 0) == CLIENT_FAIL && client_checks_worst(&checks, 2) == CLIENT_PASS);
    CHECK(client_checks_worst(&checks, 3) == CLIENT_PASS && !checks.failed);
    json_decref(summary);
    client_checks_clear(&checks);
    client_checks_clear(&checks);
}

TEST(outcomes_in_words)
{
    static const struct {
        const char *job, *says;
        client_verdict verdict;
    } LIST[] = {{"{\"status\": \"running\"}", "has not ended", CLIENT_NO_ANSWER},
                {"{\"status\": \"failed\", \"error\": {\"detail\": \"K is bad\"}}", "K is bad", CLIENT_NO_ANSWER},
                {"{\"status\": \"dismissed\"}", "no answer", CLIENT_NO_ANSWER},
                {"{\"status\": \"successful\", \"summary\": {\"outcome\": \"time_limit\", \"message\": \"late\"}}",
                 "time_limit: late", CLIENT_FAIL},
                {"{\"status\": \"successful\", \"summary\": {\"outcome\": \"converged\", \"error\": "
                 "{\"total\": 1e-9, \"kind\": \"guaranteed\"}}}",
                 "1e-09", CLIENT_PASS}};
    for (size_t i = 0; i < sizeof LIST / sizeof LIST[0]; i++) {
        client_checks checks = {.item = NULL};
        json_t *job = parse(LIST[i].job);
        client_checks_outcome(&checks, job);
        CHECK_MSG(checks.count == 1 && checks.item[0].verdict == LIST[i].verdict, "%s", LIST[i].job);
        CHECK_MSG(strstr(text_at(&checks, 0), LIST[i].says), "%s: %s", LIST[i].job, text_at(&checks, 0));
        json_decref(job);
        client_checks_clear(&checks);
    }
}

/* ---- JUnit */

TEST(reports_are_escaped)
{
    char path[] = "junit-XXXXXX", message[256] = "";
    client_suites suites = {.item = NULL};
    client_checks checks = {.item = NULL};
    json_t *job = parse("{\"id\": \"0123\", \"created\": \"2026-01-31T12:00:00.000Z\", \"status\": \"successful\", "
                        "\"summary\": {\"outcome\": \"converged\", \"timings_s\": {\"total\": 0.25}}}");
    client_checks_add(&checks, CLIENT_PASS, "", "a<b", "fine & \"good\"");
    client_checks_add(&checks, CLIENT_FAIL, "c\001d", "n\xef\xbf\xbfm", "x>'y'\n");
    checks.compared = 1;
    CHECK(client_suites_add(&suites, "0123", job, &checks) && checks.count == 0);
    client_checks_add(&checks, CLIENT_NO_ANSWER, "", "z", "gone");
    CHECK(client_suites_add(&suites, "file.json", job, &checks));
    int file = mkstemp(path);
    CHECK(file >= 0 && close(file) == 0);
    CHECK_MSG(client_junit_write(&suites, path, message, sizeof message), "%s", message);
    size_t len;
    char *text = test_read_file(path, &len);
    CHECK_STR(text,
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
              "<testsuites name=\"uzawa\" tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"0\" time=\"0.500000\">\n"
              "  <testsuite name=\"0123\" tests=\"2\" failures=\"1\" errors=\"0\" skipped=\"0\" time=\"0.250000\" "
              "timestamp=\"2026-01-31T12:00:00\">\n"
              "    <properties>\n"
              "      <property name=\"job\" value=\"0123\"/>\n"
              "      <property name=\"outcome\" value=\"converged\"/>\n"
              "    </properties>\n"
              "    <testcase classname=\"0123\" name=\"a&#60;b\" time=\"0.250000\">\n"
              "      <system-out>fine &#38; &#34;good&#34;</system-out>\n"
              "    </testcase>\n"
              "    <testcase classname=\"0123.c?d\" name=\"baseline: n?m\" time=\"0.000000\">\n"
              "      <failure type=\"fail\" message=\"x&#62;&#39;y&#39;&#10;\"/>\n"
              "    </testcase>\n"
              "  </testsuite>\n"
              "  <testsuite name=\"file.json\" tests=\"1\" failures=\"0\" errors=\"1\" skipped=\"0\" "
              "time=\"0.250000\" timestamp=\"2026-01-31T12:00:00\">\n"
              "    <properties>\n"
              "      <property name=\"job\" value=\"0123\"/>\n"
              "      <property name=\"outcome\" value=\"converged\"/>\n"
              "    </properties>\n"
              "    <testcase classname=\"file.json\" name=\"z\" time=\"0.250000\">\n"
              "      <error type=\"no_answer\" message=\"gone\"/>\n"
              "    </testcase>\n"
              "  </testsuite>\n"
              "</testsuites>\n");
    free(text);
    unlink(path);
    CHECK(!client_junit_write(&suites, "no/such/folder/report.xml", message, sizeof message) && message[0]);
    json_decref(job);
    client_suites_clear(&suites);
}

/* ---- baselines */

#define SUMMARY(energy, gap, sum)                                                                                      \
    "\"summary\": {\"outcome\": \"converged\", \"energy\": {\"primal\": " #energy                                      \
    "}, \"contact\": {\"reaction_sum\": " #sum ", \"max_pressure\": null}, \"certificate\": {\"gap\": " #gap "}}"
#define SCENE(energy, gap, sum, u, nodes, rows, r)                                                                     \
    "{" SUMMARY(energy, gap, sum) ", \"displacements\": " u ", \"nodes\": " nodes ", \"contact_nodes\": " rows         \
                                  ", \"reactions\": " r "}"
#define THREE  "[[0, 0], [1, 0], [2, 0]]"
#define MOVED  "[[0, 1], [0, 2], [0, 2]]"
#define MOVED2 "[[0, 1], [0, 2], [0, 2.1]]"

static client_checks compare(const char *now, const char *then, double tolerance)
{
    client_checks checks = {.item = NULL};
    json_t *a = parse(now), *b = parse(then);
    client_baseline_results(&checks, "", a, b, tolerance);
    json_decref(a);
    json_decref(b);
    return checks;
}

static void check_lines(client_checks checks, const client_verdict *wanted, const char *const *says, size_t count)
{
    CHECK_INT(checks.count, count);
    for (size_t i = 0; i < count && i < checks.count; i++) {
        CHECK_MSG(checks.item[i].verdict == wanted[i], "%s: %s", checks.item[i].name, checks.item[i].text);
        CHECK_MSG(strstr(checks.item[i].text, says[i]), "%s: %s", checks.item[i].name, checks.item[i].text);
    }
    client_checks_clear(&checks);
}

TEST(the_same_answer_does_not_differ)
{
    static const char A[] = SCENE(-2, 0, -3, MOVED, THREE, "[0, 1]", "[-1, 0]");
    check_lines(compare(A, A, 0), (client_verdict[]){CLIENT_PASS, CLIENT_PASS, CLIENT_PASS, CLIENT_PASS},
                (const char *const[]){"-2, was -2", "-3, was -3", "6 numbers differ by 0", "0 of 1"}, 4);
}

/* Rows that the other job has not count as apart; contact is compared by node. */
TEST(what_differs_is_told)
{
    static const char A[] = SCENE(-2, 0, -3, MOVED, THREE, "[0, 1]", "[-1, -1]");
    static const char B[] = SCENE(-2.1, 0, -3, MOVED2, THREE, "[1, 2]", "[-1, -2]");
    check_lines(compare(B, A, 1e-2), (client_verdict[]){CLIENT_FAIL, CLIENT_PASS, CLIENT_FAIL, CLIENT_FAIL},
                (const char *const[]){"differs by 0.048, more than 0.01", "-3", "in norm, more than 0.01",
                                      "2 of 3 that touch have changed; opened at node 0; closed at node 2"},
                4);
    check_lines(compare(B, A, 0.7), (client_verdict[]){CLIENT_PASS, CLIENT_PASS, CLIENT_PASS, CLIENT_PASS},
                (const char *const[]){"differs by 0.048", "-3", "in norm", "2 of 3"}, 4);
}

/* The exact energies are in [-2.01, -2] and [-2.04, -2.03]: they differ by 0.01 to 0.02 of 2.03. */
TEST(what_the_certificates_leave_open_is_uncertain)
{
    static const char A[] = SCENE(-2, 0.01, -3, MOVED, THREE, "[0]", "[-1]");
    static const char B[] = SCENE(-2.03, 0.01, -3, MOVED, THREE, "[0]", "[-1]");
    static const client_verdict OPEN[] = {CLIENT_UNCERTAIN, CLIENT_PASS, CLIENT_PASS, CLIENT_PASS};
    static const char *const SAYS[] = {"the exact ones differ by", "", "", ""};
    check_lines(compare(A, B, 0.0147), OPEN, SAYS, 4);
    client_checks sure = compare(A, B, 0.03);
    CHECK(sure.item[0].verdict == CLIENT_PASS);
    client_checks_clear(&sure);
    sure = compare(A, B, 0.001);
    CHECK(sure.item[0].verdict == CLIENT_FAIL);
    client_checks_clear(&sure);
}

TEST(other_meshes_are_told)
{
    static const char A[] = SCENE(-2, 0, -3, MOVED, THREE, "[0]", "[-1]");
    static const char FEWER[] = SCENE(-2, 0, -3, "[[0, 1], [0, 2]]", "[[0, 0], [1, 0]]", "[0]", "[-1]");
    static const char ELSEWHERE[] = SCENE(-2, 0, -3, MOVED, "[[0, 0], [1, 0], [3, 0]]", "[0]", "[-1]");
    static const char MATRICES[] =
        "{" SUMMARY(-2, 0, -3) ", \"displacements\": [0, 1, 0, 2, 0, 2], \"reactions\": [-1]}";
    static const char ROWS[] =
        "{" SUMMARY(-2, 0, -3) ", \"displacements\": [0, 1, 0, 2, 0, 2], \"reactions\": [-1, 0]}";
    static const client_verdict WORSE[] = {CLIENT_PASS, CLIENT_PASS, CLIENT_FAIL};
    check_lines(compare(A, FEWER, 1), WORSE, (const char *const[]){"", "", "number of nodes (6 and 4)"}, 3);
    check_lines(compare(A, ELSEWHERE, 1), WORSE, (const char *const[]){"", "", "other places"}, 3);
    check_lines(compare(A, MATRICES, 1), WORSE, (const char *const[]){"", "", "is a scene"}, 3);
    static const client_verdict OTHER_ROWS[] = {CLIENT_PASS, CLIENT_PASS, CLIENT_PASS, CLIENT_FAIL};
    check_lines(compare(ROWS, MATRICES, 1), OTHER_ROWS, (const char *const[]){"", "", "", "2 rows"}, 4);
}

TEST(a_baseline_without_certificate_is_told)
{
    static const char A[] = SCENE(-2, 0, -3, MOVED, THREE, "[0]", "[-1]");
    static const char STOPPED[] = "{\"summary\": {\"outcome\": \"time_limit\"}}";
    client_checks checks = compare(A, STOPPED, 1);
    CHECK(checks.count > 1 && checks.item[0].verdict == CLIENT_UNCERTAIN);
    CHECK_STR(text_at(&checks, 0), "it ended with time_limit");
    client_checks_clear(&checks);
}
