#include "codec/json_doc.h"
#include "harness.h"
#include "sanitized.h"

#include <dirent.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* Scans a C string; returns the HTTP status of the refusal, 0 if it was taken. */
static int scan(json_doc *doc, const char *body, problem_details *problem)
{
    json_scan(doc, body, strlen(body), problem);
    return problem->status;
}

static int status_of(const char *body)
{
    json_doc doc;
    problem_details problem;
    int status = scan(&doc, body, &problem);
    json_doc_clear(&doc);
    return status;
}

static void check_refusal(const char *body, int status, const char *code, const char *pointer)
{
    json_doc doc;
    problem_details problem;
    CHECK_MSG(scan(&doc, body, &problem) == status, "%s: status %d, want %d", body, problem.status, status);
    CHECK_STR(problem.code, code);
    CHECK_STR(problem.pointer, pointer);
    CHECK(problem.detail[0] && problem.title[0]);
    CHECK(!doc.root && !doc.lifted);
}

TEST(suite)
{
    char path[512];
    int seen[3] = {0};
    if (!test_cases_dir()) {
        test_skip("../shared/cases is not here");
        return;
    }
    snprintf(path, sizeof path, "%s/json/test_parsing", test_cases_dir());
    DIR *dir = opendir(path);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        size_t len;
        json_doc doc;
        problem_details problem;
        if (!strstr(entry->d_name, ".json"))
            continue;
        snprintf(path, sizeof path, "%s/json/test_parsing/%s", test_cases_dir(), entry->d_name);
        char *body = test_read_file(path, &len);
        bool good = json_scan(&doc, body, len, &problem);
        bool no_json = !good && problem.status == 400;
        if (entry->d_name[0] == 'y')
            CHECK_MSG(!no_json, "%s refused: %s", entry->d_name, problem.detail);
        if (entry->d_name[0] == 'n')
            CHECK_MSG(no_json, "%s taken", entry->d_name);
        seen[entry->d_name[0] == 'y' ? 0 : entry->d_name[0] == 'n' ? 1 : 2]++;
        json_doc_clear(&doc);
        free(body);
    }
    if (dir)
        closedir(dir);
    CHECK_INT(seen[0], 95);
    CHECK_INT(seen[1], 188);
    CHECK_INT(seen[2], 35);
}

TEST(syntax_errors_have_line_and_byte)
{
    json_doc doc;
    problem_details problem;
    CHECK_INT(scan(&doc, "{\"a\": 1,\n \"b\": [1, 2\n}", &problem), 400);
    CHECK_STR(problem.code, "json_syntax");
    CHECK_INT(problem.line, 3);
    CHECK_MSG(strstr(problem.detail, "byte 21") && strstr(problem.detail, "'}'"), "%s", problem.detail);
    check_refusal("", 400, "json_syntax", "");
    check_refusal(" \n", 400, "json_syntax", "");
    check_refusal("{} {}", 400, "json_syntax", "");
    check_refusal("\xef\xbb\xbf{}", 400, "json_syntax", "");
    check_refusal("[NaN]", 400, "json_syntax", "");
    check_refusal("[-Infinity]", 400, "json_syntax", "");
    check_refusal("[0x10]", 400, "json_syntax", "");
    CHECK(!json_scan(&doc, "[1\0]", 4, &problem) && problem.status == 400);
    CHECK(!json_scan(&doc, "[1]\0", 4, &problem) && problem.status == 400);
    CHECK(!json_scan(&doc, "[\"\0\"]", 5, &problem) && problem.status == 400);
}

TEST(every_prefix_is_refused)
{
    static const char BODY[] =
        "{\"a\": [1, -2.5e+3, true, false, null, \"x\\u00e9\\ud83d\\ude00\\n\"], \"b\": {\"c\": {}}}";
    CHECK_INT(status_of(BODY), 0);
    for (size_t n = 0; n + 1 < sizeof BODY; n++) {
        json_doc doc;
        problem_details problem;
        char *cut = malloc(n + 1); /* an exact block, so that a sanitizer sees a read beyond it */
        memcpy(cut, BODY, n);
        CHECK_MSG(n + 1 == sizeof BODY || !json_scan(&doc, cut, n, &problem), "prefix of %zu bytes taken", n);
        CHECK_INT(problem.status, 400);
        free(cut);
    }
}

TEST(duplicate_keys)
{
    check_refusal("{\"a\": 1, \"a\": 2}", 422, "duplicate_key", "/a");
    check_refusal("{\"x\": [0, {\"a/b\": 1, \"a\\u002fb\": 2}]}", 422, "duplicate_key", "/x/1/a~1b");
    check_refusal("{\"a\": 1, \"a\": 2", 400, "json_syntax", "");
    check_refusal("{\"\": 1, \"\": 2}", 422, "duplicate_key", "/");
    CHECK_INT(status_of("{\"a\": {\"a\": {\"a\": 1}}, \"a\\u0000\": 2}"), 0);
}

TEST(numbers_beyond_double)
{
    check_refusal("{\"a\": [1, 1e400]}", 422, "number_out_of_range", "/a/1");
    check_refusal("-1e999999999999", 422, "number_out_of_range", "");
    check_refusal("[1e400", 400, "json_syntax", "");
    CHECK_INT(status_of("[1e-400, 1.7976931348623157e308, -0]"), 0);
}

TEST(depth)
{
    char body[2 * JSON_MAX_DEPTH + 4] = "";
    memset(body, '[', JSON_MAX_DEPTH);
    memset(body + JSON_MAX_DEPTH, ']', JSON_MAX_DEPTH);
    CHECK_INT(status_of(body), 0);
    memset(body, '[', JSON_MAX_DEPTH + 1);
    memset(body + JSON_MAX_DEPTH + 1, ']', JSON_MAX_DEPTH + 1);
    json_doc doc;
    problem_details problem;
    CHECK_INT(scan(&doc, body, &problem), 400);
    CHECK_STR(problem.code, "json_depth");
}

TEST(utf8)
{
    CHECK_INT(status_of("[\"\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\"]"), 0);
    CHECK_INT(status_of("[\"\xc0\xaf\"]"), 400);         /* overlong */
    CHECK_INT(status_of("[\"\xe0\x9f\xbf\"]"), 400);     /* overlong */
    CHECK_INT(status_of("[\"\xed\xa0\x80\"]"), 400);     /* surrogate */
    CHECK_INT(status_of("[\"\xf4\x90\x80\x80\"]"), 400); /* above U+10FFFF */
    CHECK_INT(status_of("[\"\xe2\x82\"]"), 400);
    CHECK_INT(status_of("[\"\\ud800\"]"), 400);
    CHECK_INT(status_of("[\"\\ud800\\u0041\"]"), 400);
    CHECK_INT(status_of("[\"\\udc00\"]"), 400);
}

TEST(escapes)
{
    json_doc doc;
    problem_details problem;
    CHECK_INT(scan(&doc, "[\"\\\"\\\\\\/\\b\\f\\n\\r\\t\\u0041\\u00e9\\u20ac\\ud83d\\ude00\\u0000z\"]", &problem), 0);
    static const char WANT[] = "\"\\/\b\f\n\r\tA\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\0z";
    const json_t *text = json_array_get(doc.root, 0);
    CHECK_INT(json_string_length(text), sizeof WANT - 1);
    CHECK(memcmp(json_string_value(text), WANT, sizeof WANT - 1) == 0);
    json_doc_clear(&doc);
}

/* "[0.5, 1.5, ...]" with n numbers; the caller frees. */
static char *number_array(int n)
{
    char *body = malloc((size_t)n * 16 + 8), *at = body;
    at += sprintf(at, "[");
    for (int i = 0; i < n; i++)
        at += sprintf(at, "%s%d.5", i ? " ,\n" : "", i);
    sprintf(at, "]");
    return body;
}

TEST(long_arrays_are_lifted)
{
    json_doc doc;
    problem_details problem;
    char *longest = number_array(JSON_LIFT_NUMBERS), *lifted = number_array(JSON_LIFT_NUMBERS + 1);
    CHECK_INT(scan(&doc, longest, &problem), 0);
    CHECK_INT(json_array_size(doc.root), JSON_LIFT_NUMBERS);
    CHECK_INT(doc.n_lifted, 0);
    json_doc_clear(&doc);
    CHECK_INT(scan(&doc, lifted, &problem), 0);
    const json_lifted *item = json_doc_lifted(&doc, doc.root);
    CHECK(item && !item->is_text);
    CHECK_INT(item ? item->count : 0, JSON_LIFT_NUMBERS + 1);
    for (int i = 0; item && i < item->count; i++)
        CHECK(item->numbers[i] == i + 0.5);
    json_doc_clear(&doc);
    strcpy(strstr(lifted, "40.5"), "40.x]");
    CHECK_INT(status_of(lifted), 400);
    free(longest);
    free(lifted);
}

/* "[first,[0,1],[1,2],...]" of `rows` rows; the caller frees. */
static char *table(int rows, const char *first)
{
    char *text = malloc(32 * (size_t)rows + 64), *at = text + sprintf(text, "[%s", first);
    for (int i = 1; i < rows; i++)
        at += sprintf(at, ",[%d, %d]", i, i + 1);
    strcpy(at, "]");
    return text;
}

TEST(long_tables_are_lifted)
{
    json_doc doc;
    problem_details problem;
    char *longest = table(JSON_LIFT_NUMBERS, "[0,1]"), *lifted = table(JSON_LIFT_NUMBERS + 1, "[0,1]");
    CHECK_INT(scan(&doc, longest, &problem), 0);
    CHECK_INT(doc.n_lifted, 0);
    json_doc_clear(&doc);
    CHECK_INT(scan(&doc, lifted, &problem), 0);
    const json_lifted *item = json_doc_lifted(&doc, doc.root);
    CHECK(item && !item->is_text && item->count == JSON_LIFT_NUMBERS + 1 && item->columns == 2);
    for (int i = 0; item && i < item->count; i++)
        CHECK(item->numbers[2 * i] == i && item->numbers[2 * i + 1] == i + 1);
    json_doc_clear(&doc);
    free(longest);
    free(lifted);
}

/* What only looks like a table at first is read as any array, or refused as one. */
TEST(tables_that_are_none)
{
    static const struct {
        const char *first;
        int status;
    } CASES[] = {{"[0]", 0},       {"[0,1,2]", 0},   {"[]", 0},     {"[ ]", 0},      {"5", 0},
                 {"[0,[1]]", 0},   {"[0,\"x\"]", 0}, {"[0,]", 400}, {"[0 1]", 400},  {"[,0]", 400},
                 {"[0,1],,", 400}, {"[0,1e]", 400},  {"[0,1", 400}, {"[0,1]]", 400}, {"[1e999,0]", 422}};
    for (size_t i = 0; i < sizeof CASES / sizeof CASES[0]; i++) {
        json_doc doc;
        problem_details problem;
        char *text = table(JSON_LIFT_NUMBERS + 2, CASES[i].first);
        CHECK_MSG(scan(&doc, text, &problem) == CASES[i].status, "%s: %d %s", CASES[i].first, problem.status,
                  problem.detail);
        if (problem.status == 0)
            CHECK_MSG(doc.n_lifted == 0 && json_array_size(doc.root) == JSON_LIFT_NUMBERS + 2, "%s", CASES[i].first);
        json_doc_clear(&doc);
        free(text);
    }
}

TEST(malformed_number_arrays)
{
    static const char *const TAILS[] = {",]",   ",1 2]", ",01]", ",1.]", ",1e]", ",-]",
                                        ",+1]", ",.5]",  ",1",   "1]]",  ",--1]"};
    char body[512];
    for (size_t i = 0; i < sizeof TAILS / sizeof TAILS[0]; i++) {
        strcpy(body, "[1");
        for (int k = 0; k < JSON_LIFT_NUMBERS + 5; k++)
            strcat(body, ",1");
        strcat(body, TAILS[i]);
        CHECK_MSG(status_of(body) == 400, "taken: ...%s", TAILS[i]);
    }
}

TEST(long_strings_are_lifted)
{
    json_doc doc;
    problem_details problem;
    char body[3 * JSON_LIFT_TEXT_LEN] = "{\"K\": \"";
    size_t start = strlen(body);
    for (size_t i = 0; i <= JSON_LIFT_TEXT_LEN; i++)
        strcpy(body + start + 2 * i, "\\n");
    strcat(body, "\"}");
    CHECK_INT(scan(&doc, body, &problem), 0);
    const json_lifted *item = json_doc_lifted(&doc, json_object_get(doc.root, "K"));
    CHECK(item && item->is_text);
    CHECK_INT(item ? item->len : 0, JSON_LIFT_TEXT_LEN + 1);
    CHECK(item && item->text[0] == '\n' && item->text[item->len - 1] == '\n' && item->text[item->len] == '\0');
    json_doc_clear(&doc);
}

TEST(placeholders_cannot_be_forged)
{
    json_doc doc;
    problem_details problem;
    char *array = number_array(100), body[4096];
    snprintf(body, sizeof body, "[%s, 0, 0.0, \"0\", [0], {\"lifted\": 0}]", array);
    CHECK_INT(scan(&doc, body, &problem), 0);
    CHECK_INT(doc.n_lifted, 1);
    CHECK(json_doc_lifted(&doc, json_array_get(doc.root, 0)) != NULL);
    for (size_t i = 1; i < json_array_size(doc.root); i++)
        CHECK(json_doc_lifted(&doc, json_array_get(doc.root, i)) == NULL);
    CHECK(json_is_real(json_array_get(doc.root, 1)));
    json_doc_clear(&doc);
    free(array);
}

TEST(too_many_values)
{
    size_t n = JSON_MAX_VALUES + 10;
    char *body = malloc(3 * n + 3);
    for (size_t i = 0; i < n; i++)
        memcpy(body + 1 + 3 * i, "[],", 3);
    body[0] = '[';
    strcpy(body + 3 * n, "]");
    check_refusal(body, 413, "too_many_values", "/199999");
    free(body);
}

/* Resident memory that a scan of body adds at its peak, in bytes; measured in a child. */
static long peak_of(const char *body, size_t len)
{
    int pipe_ends[2];
    long peak = -1;
    if (pipe(pipe_ends) != 0)
        return -1;
    pid_t child = fork();
    if (child == 0) {
        struct rusage before, after;
        json_doc doc;
        problem_details problem;
        getrusage(RUSAGE_SELF, &before);
        json_scan(&doc, body, len, &problem);
        getrusage(RUSAGE_SELF, &after);
        peak = problem.status ? -1 : 1024 * (after.ru_maxrss - before.ru_maxrss);
        _exit(write(pipe_ends[1], &peak, sizeof peak) != sizeof peak);
    }
    if (read(pipe_ends[0], &peak, sizeof peak) != sizeof peak)
        peak = -1;
    waitpid(child, NULL, 0);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
    return peak;
}

/* {"K": "1 1 1.5\n1 1 1.5\n...", "p": [0.12345678,0.12345678,...]}, half of each. */
static char *big_body(size_t size, size_t *len)
{
    char *body = malloc(size + 256);
    size_t at = (size_t)sprintf(body, "{\"K\": \"");
    while (at < size / 2) {
        memcpy(body + at, "1 1 1.5\\n", 9);
        at += 9;
    }
    at += (size_t)sprintf(body + at, "\", \"p\": [0");
    while (at < size) {
        memcpy(body + at, ",0.12345678", 11);
        at += 11;
    }
    *len = at + (size_t)sprintf(body + at, "]}");
    return body;
}

TEST(memory_stays_below_twice_the_body)
{
    size_t len;
    char *body = big_body((size_t)16 << 20, &len);
    long peak = SANITIZED ? 0 : peak_of(body, len);
    CHECK(peak >= 0);
    CHECK_MSG(peak < 2 * (long)len, "%ld bytes beside a body of %zu", peak, len);
    free(body);
    if (SANITIZED)
        test_skip("a sanitizer's own memory would be counted");
}
