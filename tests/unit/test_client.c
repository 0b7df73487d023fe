/* The client's parts that need no server: command line, tags, files, CSV, drawing, the summary in words. */
#include "harness.h"

#include "arguments.h"
#include "files.h"
#include "http.h"
#include "plot.h"
#include "report.h"
#include "series.h"
#include "tags.h"

#include <sys/stat.h>
#include <unistd.h>

/* ------------------------------------------------------------ command line */

#define MOST_WORDS 40

/* Parses "submit a.json --wait" split at blanks. The words live until the next call. */
static bool parse(client_options *out, const char *line, const char *env, char *message)
{
    static char text[1024];
    char *words[MOST_WORDS] = {"uzawa"};
    int count = 1;
    snprintf(text, sizeof text, "%s", line);
    for (char *word = strtok(text, " "); word && count < MOST_WORDS; word = strtok(NULL, " "))
        words[count++] = word;
    return client_arguments_parse(out, count, words, env, message, 256);
}

TEST(arguments_submit)
{
    client_options o;
    char message[256] = "";
    CHECK_MSG(parse(&o, "--server http://h:1 submit --wait --tag a f.json --tag=b -k key --timeout 2.5", NULL, message),
              "%s", message);
    CHECK_INT(o.command, CLIENT_SUBMIT);
    CHECK_STR(o.server, "http://h:1");
    CHECK_STR(o.operand, "f.json");
    CHECK_STR(o.key, "key");
    CHECK_INT(o.n_tags, 2);
    CHECK_STR(o.tags[0], "a");
    CHECK_STR(o.tags[1], "b");
    CHECK(o.wait && !o.json && !o.quiet);
    CHECK(o.timeout_s == 2.5);
}

TEST(arguments_defaults)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit -", NULL, message));
    CHECK_STR(o.server, "http://127.0.0.1:8080");
    CHECK_STR(o.operand, "-");
    CHECK(isinf(o.timeout_s));
    CHECK(o.retry_s < 0);
    CHECK(parse(&o, "list", "http://env:9", message));
    CHECK_STR(o.server, "http://env:9");
    CHECK(parse(&o, "list", "", message));
    CHECK_STR(o.server, "http://127.0.0.1:8080");
    CHECK(parse(&o, "list -s http://line:7", "http://env:9", message));
    CHECK_STR(o.server, "http://line:7");
}

TEST(arguments_end_of_options)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit -- --odd", NULL, message));
    CHECK_STR(o.operand, "--odd");
}

TEST(arguments_help_and_version_need_no_operand)
{
    client_options o;
    char message[256] = "";
    CHECK(parse(&o, "submit --help", NULL, message) && o.help && o.command == CLIENT_SUBMIT);
    CHECK(parse(&o, "-h", NULL, message) && o.help && o.command == CLIENT_HELP);
    CHECK(parse(&o, "--version", NULL, message) && o.version);
    CHECK(parse(&o, "help", NULL, message) && o.command == CLIENT_HELP);
}

/* A wrong line and a part of what must be said about it. */
TEST(arguments_refused)
{
    static const char *const CASES[][2] = {
        {"", "no command"},
        {"frobnicate", "unknown command"},
        {"submit", "FILE"},
        {"submit a b", "one operand too many"},
        {"list a", "takes no operand"},
        {"status", "ID"},
        {"submit a --frob", "--frob"},
        {"submit a --timeout", "wants a value"},
        {"submit a --timeout x", "--timeout"},
        {"submit a --timeout -1", "--timeout"},
        {"submit a --timeout nan", "--timeout"},
        {"submit a --timeout inf", "--timeout"},
        {"submit a --wait=yes", "takes no value"},
        {"submit a --tag=", "--tag"},
        {"submit a --key=", "--key"},
        {"list --wait", "does not take --wait"},
        {"status x --csv", "does not take --csv"},
        {"list --limit 0", "--limit"},
        {"list --limit 99999999999999999999", "--limit"},
        {"list --limit 3x", "--limit"},
        {"list --tag a --tag b", "one --tag"},
        {"history x --csv --plot", "choose one"},
        {"history x --width 3", "56 to 400"},
        {"submit a --tag=1 --tag=2 --tag=3 --tag=4 --tag=5 --tag=6 --tag=7 --tag=8 --tag=9 --tag=10 --tag=11 --tag=12 "
         "--tag=13 --tag=14 --tag=15 --tag=16 --tag=17",
         "at most 16"},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        client_options o;
        char message[256] = "";
        CHECK_MSG(!parse(&o, CASES[i][0], NULL, message), "accepted: %s", CASES[i][0]);
        CHECK_MSG(strstr(message, CASES[i][1]), "\"%s\" said: %s", CASES[i][0], message);
    }
}

TEST(help_has_a_page_for_each_command)
{
    for (int i = 0; i <= CLIENT_COMMANDS; i++) {
        char *text = NULL;
        size_t len = 0;
        FILE *memory = open_memstream(&text, &len);
        client_help_print(memory, (client_command)i);
        fclose(memory);
        CHECK(strncmp(text, "usage: uzawa ", 13) == 0);
        CHECK(strstr(text, client_command_name((client_command)i)) != NULL);
        free(text);
    }
}

/* -------------------------------------------------------------------- tags */

static char *with_tags(const char *body, const char *tag1, const char *tag2)
{
    const char *tags[2] = {tag1, tag2};
    client_buffer in = {0}, out;
    CHECK(client_buffer_append(&in, body, strlen(body)));
    CHECK(client_tags_add(&out, &in, tags, !tag1 ? 0 : tag2 ? 2 : 1));
    free(in.data);
    return out.data;
}

TEST(tags_are_added)
{
    static const char *const CASES[][2] = {
        {"{\"a\": 1}", "{\"tags\":[\"x\",\"y\"],\"a\": 1}"},
        {"{}", "{\"tags\":[\"x\",\"y\"]}"},
        {" {\n}", " {\"tags\":[\"x\",\"y\"]\n}"},
        {"{\"tags\": []}", "{\"tags\": [\"x\",\"y\"]}"},
        {"{\"tags\": [\"x\"], \"b\": 2}", "{\"tags\": [\"x\",\"y\"], \"b\": 2}"},
        {"{\"tags\": [\n\"z\"\n]}", "{\"tags\": [\"z\",\"x\",\"y\"]\n\n}"},
        {"{\"p\": {\"tags\": [1]}, \"q\": \"\\\"tags\\\": }\", \"tags\": [\"q\"]}",
         "{\"p\": {\"tags\": [1]}, \"q\": \"\\\"tags\\\": }\", \"tags\": [\"q\",\"x\",\"y\"]}"},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char *got = with_tags(CASES[i][0], "x", "y");
        CHECK_STR(got, CASES[i][1]);
        free(got);
    }
}

/* What is no object, or has tags that are no array, goes to the server as it is. */
TEST(tags_leave_what_they_do_not_understand)
{
    static const char *const CASES[] = {
        "",        "[1]",           "{",        "{\"a\"", "{\"a\":", "{\"tags\": 3}", "{\"tags\": [1}", "{\"a\\",
        "{\"tags", "{\"a\": [1, 2", "nonsense", "\"",     "{1}",     "{\"tags\":"};
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        char *got = with_tags(CASES[i], "x", NULL);
        CHECK_STR(got, CASES[i]);
        free(got);
    }
    char *same = with_tags("{\"a\": 1}", NULL, NULL);
    CHECK_STR(same, "{\"a\": 1}");
    free(same);
}

/* Every beginning of a request, copied to a block of just that size: a reader past the end is found by the sanitizer.
 */
TEST(tags_stay_inside_a_body_that_was_cut)
{
    static const char BODY[] = "{\"a\\\"\": [1, {\"b\": \"}\\\\\"}], \"tags\" : [\"z\", \"\\u0061\"] , \"c\": null}";
    const char *tags[] = {"x"};
    for (size_t len = 0; len < sizeof BODY; len++) {
        client_buffer in = {.data = malloc(len ? len : 1), .len = len}, out;
        memcpy(in.data, BODY, len);
        CHECK(client_tags_add(&out, &in, tags, 1));
        CHECK(out.data != NULL);
        free(in.data);
        free(out.data);
    }
}

TEST(tags_that_are_not_utf8_are_refused)
{
    const char *bad[] = {"\xff"};
    client_buffer in = {0}, out;
    CHECK(client_buffer_append(&in, "{}", 2));
    CHECK(!client_tags_add(&out, &in, bad, 1));
    CHECK(out.data == NULL);
    free(in.data);
}

/* ------------------------------------------------------------------- files */

TEST(files_are_written_whole)
{
    char folder[] = "/tmp/test_client_XXXXXX", path[64], missing[96], message[256] = "";
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/out", folder);
    snprintf(missing, sizeof missing, "%s/none/out", folder);
    CHECK(client_file_write(path, "old and long", 12, message, sizeof message));
    CHECK(client_file_write(path, "new", 3, message, sizeof message));
    client_buffer back;
    CHECK(client_file_read(&back, path, message, sizeof message));
    CHECK_INT(back.len, 3);
    CHECK_STR(back.data, "new");
    free(back.data);
    CHECK(!client_file_write(missing, "x", 1, message, sizeof message));
    CHECK(strstr(message, "cannot write") != NULL);
    CHECK(!client_file_read(&back, missing, message, sizeof message));
    CHECK(back.data == NULL);
    CHECK(!client_file_read(&back, folder, message, sizeof message));
    CHECK(client_file_write("/dev/null", "x", 1, message, sizeof message));
    unlink(path);
    CHECK(rmdir(folder) == 0); /* nothing half-written was left behind */
}

static char *safe(const char *text)
{
    char *out = NULL;
    size_t len = 0;
    FILE *memory = open_memstream(&out, &len);
    client_print_safe(memory, text);
    fclose(memory);
    return out;
}

TEST(text_from_elsewhere_cannot_steer_the_terminal)
{
    char *got = safe("a\033[31m\x07\x7f\n\xc2\x9bZ \xc3\xa4");
    CHECK_STR(got, "a?[31m????Z \xc3\xa4");
    free(got);
}

TEST(url_parts_are_escaped)
{
    client_buffer out = {0};
    CHECK(client_http_append_escaped(&out, "a/b?c=d&e #%\xc3\xa4~-._"));
    CHECK_STR(out.data, "a%2Fb%3Fc%3Dd%26e%20%23%25%C3%A4~-._");
    free(out.data);
}

TEST(server_url_is_checked)
{
    static const char *const BAD[] = {"",          "ftp://h", "127.0.0.1", "http://", "http://h?x=1", "http://h:99999",
                                      "http://a b"};
    char message[256];
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        client_http *http = client_http_open(BAD[i], message, sizeof message);
        CHECK_MSG(!http, "accepted \"%s\"", BAD[i]);
        client_http_close(http);
    }
    client_http *http = client_http_open("http://127.0.0.1:8080/", message, sizeof message);
    CHECK(http != NULL);
    client_http_close(http);
}

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
    " \"discretization_error\": 0.022, \"message\": \"\","
    " \"contact\": {\"candidates\": 30, \"active\": 22, \"reaction_sum\": -10.513717, \"max_penetration\": 1e-12,"
    " \"force\": [0, -10.513717], \"max_pressure\": 0.37},"
    " \"energy\": {\"primal\": -3.960818604e-3, \"dual\": -3.960818605e-3},"
    " \"certificate\": {\"relative_error\": 9.1e-10, \"absolute_error\": 8e-11, \"gap\": 3e-21,"
    " \"relative_residual\": {\"total\": 1e-9}},"
    " \"factor\": {\"cached\": true, \"ordering\": \"metis\", \"nnz\": 12345, \"bytes\": 200000, \"rcond\": 1e-5},"
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

TEST(summary_says_everything_that_counts)
{
    static const char *const PARTS[] = {
        "0a1b",
        "converged: the certificate meets",
        "accelerated_restart, condensed operator, 283 iterations, 1 restart\n",
        "660 unknowns, 30 contact conditions",
        "22 of 30 candidates touch",
        "sum -10.513717, force (0, -10.5137), largest pressure 0.37",
        "-0.003960818604 primal",
        "within 9.1e-10 of this one",
        "9 digits are certain (asked for 1e-08: met)",
        "off by about 0.022",
        "from the cache, metis ordering, 12345 entries, 0.2 MB",
        "5 ms: factor 2 ms, iterate 3 ms\n",
        "demo x?[2J\n",
    };
    json_t *job = json_loads(JOB, 0, NULL);
    char *text = summary_of(job);
    for (size_t i = 0; i < sizeof PARTS / sizeof *PARTS; i++)
        CHECK_MSG(strstr(text, PARTS[i]), "missing: %s", PARTS[i]);
    CHECK(strchr(text, '\033') == NULL);
    if (json_object_size(job) == 0)
        printf("%s", text);
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
