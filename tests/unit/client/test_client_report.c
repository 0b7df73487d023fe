/* What the client draws and says: CSV, drawing, the summary in words, exit codes. */
#include "harness.h"

#include "local/files.h"
#include "show/plot.h"
#include "show/report.h"

/* ------------------------------------------------------------ CSV, drawing */

#define HEADER "iteration,seconds,residual_total,error_bound,contacts,restart\n"

TEST(series_reads_columns_by_name)
{
    client_series s;
    char message[256];
    CHECK(client_series_read(&s, HEADER "0,0,5.5,,30,0\r\n1,0.1,1e-3,0.25,22,1\r\n2,0.2,null,inf,22,true", message,
                             sizeof message));
    CHECK_INT(s.count, 3);
    CHECK(s.column[CLIENT_RESIDUAL][0] == 5.5);
    CHECK(isnan(s.column[CLIENT_ERROR_BOUND][0]));
    CHECK(s.column[CLIENT_ERROR_BOUND][1] == 0.25);
    CHECK(s.column[CLIENT_RESTART][1] > 0 && s.column[CLIENT_RESTART][2] > 0);
    CHECK(isnan(s.column[CLIENT_RESIDUAL][2]));
    client_series_clear(&s);
}

TEST(series_refuses_what_is_no_history)
{
    client_series s;
    char message[256];
    CHECK(!client_series_read(&s, "<html>\n", message, sizeof message));
    CHECK(!client_series_read(&s, "", message, sizeof message));
    CHECK(!client_series_read(&s, "iteration,error_bound,restart\n", message, sizeof message));
    CHECK(strstr(message, "residual_total") != NULL);
}

/* The drawing of a bound that falls from 1 to 1e-10 over 100 iterations, or NULL when nothing was drawn. */
static char *draw(const client_series *s, int width, int height, bool ascii)
{
    char *out = NULL;
    size_t len = 0;
    client_plot_style style = {.width = width, .height = height, .ascii = ascii};
    FILE *memory = open_memstream(&out, &len);
    bool drawn = client_plot_print(memory, s, &style);
    fclose(memory);
    if (!drawn) {
        CHECK_INT(len, 0);
        free(out);
        out = NULL;
    }
    return out;
}

static client_series falling(void)
{
    client_buffer csv = {0};
    client_series s;
    char line[128], message[256];
    CHECK(client_buffer_append(&csv, HEADER, strlen(HEADER)));
    for (int k = 0; k <= 100; k++) {
        int len =
            snprintf(line, sizeof line, "%d,0,%g,%g,1,%d\n", k, 100 * pow(10, -k / 10.), pow(10, -k / 10.), k == 50);
        CHECK(client_buffer_append(&csv, line, (size_t)len));
    }
    CHECK(client_series_read(&s, csv.data, message, sizeof message));
    free(csv.data);
    return s;
}

static void check_lines(const char *text, int lines, int columns)
{
    int count = 0;
    for (const char *line = text; *line; count++) {
        int width = 0;
        for (; *line != '\n'; line++)
            width += ((unsigned char)*line & 0xc0) != 0x80; /* characters, not bytes */
        CHECK_MSG(width <= columns, "line %d has %d columns", count, width);
        line++;
    }
    CHECK_INT(count, lines);
}

TEST(plot_keeps_its_size)
{
    static const int SIZES[][2] = {{72, 20}, {56, 8}, {400, 200}, {80, 24}};
    client_series s = falling();
    for (size_t i = 0; i < sizeof SIZES / sizeof *SIZES; i++)
        for (int ascii = 0; ascii < 2; ascii++) {
            char *text = draw(&s, SIZES[i][0], SIZES[i][1], ascii);
            CHECK(text != NULL);
            if (text)
                check_lines(text, SIZES[i][1], SIZES[i][0]);
            free(text);
        }
    client_series_clear(&s);
}

/* Of a straight line in log10 the corners are known: decade and iteration of the ends, the restart in the middle. */
TEST(plot_puts_points_where_they_belong)
{
    client_series s = falling();
    char *text = draw(&s, 72, 20, true);
    CHECK(text != NULL);
    char *line[20] = {strtok(text, "\n")};
    for (int i = 1; i < 20; i++)
        line[i] = strtok(NULL, "\n");
    CHECK(strncmp(line[1] + 3, "1e+02 +.", 8) == 0); /* the residual starts at 100 */
    CHECK(line[17][71] == '*');                      /* the bound ends at 1e-10, iteration 100 */
    CHECK(strstr(line[17], "1e-10") != NULL);
    CHECK(line[18][10 + 31] == '^' || line[18][10 + 30] == '^');
    CHECK(strncmp(line[19], "iteration 0", 11) == 0);
    CHECK_STR(line[19] + 69, "100");
    for (int i = 1; i < 18; i++) /* every row of a falling line has a point */
        CHECK_MSG(strpbrk(line[i] + 10, "*.") != NULL, "row %d is empty", i);
    free(text);
    client_series_clear(&s);
}

TEST(plot_survives_odd_histories)
{
    static const char *const ODD[] = {
        HEADER "0,0,1,1,0,0\n",                     /* one row */
        HEADER "0,0,1e-300,1e300,0,0\n1,0,1,1,0,0", /* more decades than fit */
        HEADER "0,0,5e-324,1.7e308,0,0\n",
        HEADER "0,0,0,1,0,0\n1,0,-1,1,0,0\n",
        HEADER "1e18,0,1,1,0,1\n",
        HEADER "5,0,1,1,0,1\n3,0,2,1,0,1\n",
        HEADER "nan,0,1,1,0,1\n3,0,2,1,0,1\n",
    };
    static const char *const EMPTY[] = {HEADER, HEADER "0,0,,,0,0\n", HEADER "0,0,0,0,0,0\n", HEADER "-1,0,1,1,0,0\n"};
    client_series s;
    char message[256];
    for (size_t i = 0; i < sizeof ODD / sizeof *ODD; i++) {
        CHECK(client_series_read(&s, ODD[i], message, sizeof message));
        char *text = draw(&s, 72, 20, false);
        CHECK_MSG(text != NULL, "case %zu was not drawn", i);
        free(text);
        client_series_clear(&s);
    }
    for (size_t i = 0; i < sizeof EMPTY / sizeof *EMPTY; i++) {
        CHECK(client_series_read(&s, EMPTY[i], message, sizeof message));
        char *text = draw(&s, 72, 20, false);
        CHECK_MSG(text == NULL, "case %zu was drawn", i);
        free(text);
        client_series_clear(&s);
    }
}

/* ------------------------------------------------------------------ report */

static const char JOB[] =
    "{\"id\": \"0a1b\", \"status\": \"successful\", \"progress\": 100, \"tags\": [\"demo\", \"x\\u001b[2J\"],"
    " \"created\": \"2024-01-02T03:04:05.678Z\", \"summary\": {\"outcome\": \"converged\","
    " \"method\": \"accelerated_restart\", \"operator\": \"condensed\", \"iterations\": 283, \"restarts\": 1,"
    " \"problem\": {\"kind\": \"scene\", \"d\": 660, \"m\": 30}, \"requested_error\": 1e-8,"
    " \"error\": {\"equations\": 9.1e-10, \"mesh\": 0.022, \"total\": 0.023, \"kind\": \"estimated\"},"
    " \"message\": \"\","
    " \"contact\": {\"candidates\": 30, \"kept\": 25, \"added\": 3, \"rounds\": 2, \"active\": 22,"
    " \"reaction_sum\": -10.513717, \"max_penetration\": 1e-12,"
    " \"force\": [0, -10.513717], \"max_pressure\": 0.37, \"area\": 110,"
    " \"max_pressure_at\": {\"node\": 7, \"x\": [36, 0.5]}},"
    " \"resultants\": {\"contacts\": [{\"on\": \"bottom\", \"force\": [0, 10.5], \"moment\": [1]}],"
    " \"supports\": [{\"on\": \"le\\u001bft\", \"force\": [-50, 4.5], \"moment\": [2]},"
    " {\"on\": \"top\", \"force\": [0, null], \"moment\": [3]}],"
    " \"loads\": {\"force\": [50, -15], \"moment\": [-3]}, \"imbalance\": 2.5e-12},"
    " \"warnings\": [{\"code\": \"large_rotation\", \"message\": \"element 84 turns\", \"value\": 0.13},"
    " {\"code\": \"large_strain\", \"message\": \"element 3 is strained\", \"value\": 0.06}],"
    " \"energy\": {\"primal\": -3.960818604e-3, \"dual\": -3.960818605e-3},"
    " \"certificate\": {\"relative_error\": 9.1e-10, \"absolute_error\": 8e-11, \"gap\": 3e-21,"
    " \"relative_residual\": {\"total\": 1e-9}},"
    " \"factor\": {\"cached\": true, \"ordering\": \"metis\", \"nnz\": 12345, \"bytes\": 200000, \"rcond\": 1e-5},"
    " \"cost\": {\"predicted\": {\"seconds\": 0.004}, \"actual\": {\"seconds\": 0.005}, \"considered\": ["
    "{\"operator\": \"condensed\", \"seconds\": 0.004, \"bytes\": 1e6, \"fits\": true},"
    "{\"operator\": \"factored\", \"seconds\": 0.02, \"bytes\": 9e9, \"fits\": false}]},"
    " \"timings_s\": {\"queue\": 0, \"factor\": 0.002, \"iterate\": 0.003, \"certify\": 0.000001, \"total\": 0.005}}}";

static char *summary_of(const json_t *job)
{
    char *out = NULL;
    size_t len = 0;
    FILE *memory = open_memstream(&out, &len);
    client_print_summary(memory, job);
    fclose(memory);
    return out;
}

/* Of answers that the mesh holds exactly, too. */
TEST(errors_have_two_digits)
{
    static const struct {
        double total, mesh;
        const char *text;
    } CASES[] = {{0.123, 0.1, "about 12 % in the energy norm: 10 % of it"},
                 {2.3e-7, 2.2e-7, "about 0.000023 % in the energy norm: 0.000022 % of it"},
                 {1.24e-12, 0, "about 1.2e-10 % in the energy norm: 0 % of it"}};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        json_t *job = json_loads(JOB, 0, NULL), *error = json_object_get(json_object_get(job, "summary"), "error");
        json_object_set_new(error, "total", json_real(CASES[i].total));
        json_object_set_new(error, "mesh", json_real(CASES[i].mesh));
        char *text = summary_of(job);
        CHECK_MSG(strstr(text, CASES[i].text), "%s in %s", CASES[i].text, text);
        free(text);
        json_decref(job);
    }
}

TEST(summary_says_everything_that_counts)
{
    static const char *const PARTS[] = {
        "0a1b",
        "converged: the certificate meets",
        "accelerated_restart, condensed operator, 283 iterations, 1 restart\n",
        "660 unknowns, 30 contact conditions",
        "22 of 30 candidates touch, on an area of 110; solved with 25",
        "; 3 added in 2 rounds\n",
        "sum -10.513717, force (0, -10.5137), largest pressure 0.37 at (36, 0.5)\n",
        "\nforces      contact bottom (0, 10.5)\n            support le?ft (-50, 4.5)\n",
        "            support top (0, unknown)\n            loads (50, -15)\n            imbalance 2.5e-12 of",
        "\nwarning     large_rotation: element 84 turns\nwarning     large_strain: element 3 is strained\n",
        "-0.003960818604 primal",
        "\nwhole error about 2.3 % in the energy norm: 2.2 % of it the mesh's, by estimate\n",
        "exact solution of these equations is within 9.1e-10 of this one",
        "norm\n            (asked for 1e-08: met)\n",
        "from the cache, metis ordering, 12345 entries, 0.2 MB",
        "4 ms predicted, 5 ms in fact; considered: condensed 4 ms, factored 20 ms (too much memory)\n",
        "5 ms: factor 2 ms, iterate 3 ms\n",
        "demo x?[2J\n",
    };
    json_t *job = json_loads(JOB, 0, NULL);
    char *text = summary_of(job);
    for (size_t i = 0; i < sizeof PARTS / sizeof *PARTS; i++)
        CHECK_MSG(strstr(text, PARTS[i]), "missing: %s", PARTS[i]);
    CHECK(strchr(text, '\033') == NULL);
    CHECK(!strstr(text, "assertions")); /* it has none */
    free(text);
    json_decref(job);
}

/* Each part of a summary may be absent, null or of another type: it is left out, and "nan" is never shown as a fact. */
TEST(summary_survives_missing_parts)
{
    static const char *const REPLACEMENTS[] = {"null", "[]", "\"text\"", "-1", "{}"};
    json_t *job = json_loads(JOB, 0, NULL);
    const char *key;
    json_t *value;
    json_object_foreach(json_object_get(job, "summary"), key, value)
    {
        for (size_t i = 0; i < sizeof REPLACEMENTS / sizeof *REPLACEMENTS; i++) {
            json_t *copy = json_deep_copy(job);
            json_t *replacement = json_loads(REPLACEMENTS[i], JSON_DECODE_ANY, NULL);
            json_object_set_new(json_object_get(copy, "summary"), key, replacement);
            char *text = summary_of(copy);
            CHECK_MSG(strstr(text, "nan") == NULL, "%s = %s:\n%s", key, REPLACEMENTS[i], text);
            free(text);
            json_decref(copy);
        }
    }
    json_decref(job);
}

TEST(summary_without_certificate_says_so)
{
    json_t *job = json_loads(JOB, 0, NULL);
    json_t *certificate = json_object_get(json_object_get(job, "summary"), "certificate");
    json_object_set_new(certificate, "relative_error", json_null());
    json_object_set_new(json_object_get(job, "summary"), "outcome", json_string("time_limit"));
    char *text = summary_of(job);
    CHECK(strstr(text, "nothing could be certified (asked for 1e-08: not met)") != NULL);
    CHECK(strstr(text, "the time ran out first") != NULL);
    free(text);
    json_decref(job);
}

/* What is met is what was asked for: not a whole error beside a quantity, nor what another number is short of. */
TEST(what_is_met_is_told_of_what_was_asked_for)
{
    static const struct {
        const char *changes, *says;
    } CASES[] = {
        {"{\"requested_error\": 0.05, \"total_error\": 0.18}", "total error about 0.18 (asked for 0.05: not met)"},
        {"{\"requested_error\": 0.2, \"total_error\": 0.18}", "total error about 0.18 (asked for 0.2: met)"},
        {"{\"requested_error\": 0.05, \"quantities\": [{\"name\": \"lift\"}], \"mesh\": {\"ladder\": []}}",
         "(asked for 0.05 of lift: met)"},
        {"{\"requested_error\": 0.05, \"quantities\": [{\"name\": \"lift\"}], \"mesh\": {\"ladder\": []},"
         " \"outcome\": \"mesh_limit\"}",
         "(asked for 0.05 of lift: not met)"},
        {"{\"outcome\": \"mesh_limit\"}", "(asked for 1e-08: met)"}};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        json_t *job = json_loads(JOB, 0, NULL), *changes = json_loads(CASES[i].changes, 0, NULL);
        json_object_update(json_object_get(job, "summary"), changes);
        char *text = summary_of(job);
        CHECK_MSG(strstr(text, CASES[i].says) != NULL, "%s:\n%s", CASES[i].says, text);
        free(text);
        json_decref(changes);
        json_decref(job);
    }
}

TEST(bounds_are_never_shown_smaller)
{
    static const struct {
        double bound;
        const char *text;
    } SHOWN[] = {{1.449e-8, "1.5e-08"}, {1.4e-8, "1.4e-08"}, {9.99e-3, "0.01"}, {0, "0"},
                 {0.95, "0.95"},        {123.4, "1.3e+02"}};
    char text[32];
    for (size_t i = 0; i < sizeof SHOWN / sizeof SHOWN[0]; i++)
        CHECK_STR(client_format_bound(text, SHOWN[i].bound), SHOWN[i].text);
    for (double bound = 1e-12; bound < 10; bound *= 1.0371)
        CHECK(strtod(client_format_bound(text, bound), NULL) >= bound && strtod(text, NULL) < 1.11 * bound);
}

TEST(exit_codes_follow_status_and_outcome)
{
    static const struct {
        const char *status, *outcome;
        client_exit code;
        bool ended;
    } CASES[] = {
        {"successful", "converged", CLIENT_OK, true},
        {"successful", "iteration_limit", CLIENT_NOT_CONVERGED, true},
        {"successful", "time_limit", CLIENT_NOT_CONVERGED, true},
        {"successful", "precision_limit", CLIENT_NOT_CONVERGED, true},
        {"successful", "paper_rule", CLIENT_NOT_CONVERGED, true},
        {"successful", "infeasible", CLIENT_INFEASIBLE, true},
        {"failed", "infeasible", CLIENT_INFEASIBLE, true},
        {"failed", "", CLIENT_JOB_FAILED, true},
        {"dismissed", "", CLIENT_DISMISSED, true},
        {"dismissed", "dismissed", CLIENT_DISMISSED, true},
        {"dismissed", "converged", CLIENT_DISMISSED, true},
        {"successful", "", CLIENT_NOT_CONVERGED, true},
        {"running", "", CLIENT_NOT_CONVERGED, false},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        json_t *job = json_pack("{s:s, s:{s:s}}", "status", CASES[i].status, "summary", "outcome", CASES[i].outcome);
        CHECK_INT(client_job_exit(job), CASES[i].code);
        CHECK_INT(client_job_ended(job), CASES[i].ended);
        json_decref(job);
    }
    CHECK(!client_job_ended(NULL));
}

static char *problem_text(long status, const char *json)
{
    char *out = NULL;
    size_t len = 0;
    json_t *problem = json ? json_loads(json, JSON_DECODE_ANY, NULL) : NULL;
    FILE *memory = open_memstream(&out, &len);
    client_print_problem(memory, status, problem);
    fclose(memory);
    json_decref(problem);
    return out;
}

TEST(problem_shows_pointer_and_line)
{
    char *text = problem_text(
        422, "{\"detail\": \"no number\", \"pointer\": \"/problem/K\", \"line\": 7, \"code\": \"format\"}");
    CHECK_STR(text, "uzawa: no number\n  at /problem/K, line 7\n  HTTP status 422, code format\n");
    free(text);
    text = problem_text(502, NULL);
    CHECK_STR(text, "uzawa: the server failed\n  HTTP status 502\n");
    free(text);
    text = problem_text(404, "[]");
    CHECK_STR(text, "uzawa: the server refused the request\n  HTTP status 404\n");
    free(text);
    text = problem_text(0, "{\"title\": \"Free body\", \"code\": \"free_body\", \"line\": 3}");
    CHECK_STR(text, "uzawa: Free body\n  at line 3\n  code free_body\n");
    free(text);
}
