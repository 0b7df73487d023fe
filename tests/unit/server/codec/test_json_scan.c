/* in the ordinary build too, memory_stays: a sanitizer has memory of its own */
#include "codec/json.h"
#include "harness.h"
#include "sanitized.h"

#include <dirent.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* Scans a C string; returns the HTTP status of the refusal, 0 if it was taken. */
static int scan(json_tree *tree, const char *body, problem_details *problem)
{
    json_scan(tree, body, strlen(body), problem);
    return problem->status;
}

static int status_of(const char *body)
{
    json_tree tree;
    problem_details problem;
    int status = scan(&tree, body, &problem);
    json_clear(&tree);
    return status;
}

static void check_refusal(const char *body, int status, const char *code, const char *pointer)
{
    json_tree tree;
    problem_details problem;
    CHECK_MSG(scan(&tree, body, &problem) == status, "%s: status %d, want %d", body, problem.status, status);
    CHECK_STR(problem.code, code);
    CHECK_STR(problem.pointer, pointer);
    CHECK(problem.detail[0] && problem.title[0]);
    CHECK(!tree.root && !tree.blocks);
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
        json_tree tree;
        problem_details problem;
        if (!strstr(entry->d_name, ".json"))
            continue;
        snprintf(path, sizeof path, "%s/json/test_parsing/%s", test_cases_dir(), entry->d_name);
        char *body = test_read_file(path, &len);
        bool good = json_scan(&tree, body, len, &problem);
        bool no_json = !good && problem.status == 400;
        if (entry->d_name[0] == 'y')
            CHECK_MSG(!no_json, "%s refused: %s", entry->d_name, problem.detail);
        if (entry->d_name[0] == 'n')
            CHECK_MSG(no_json, "%s taken", entry->d_name);
        seen[entry->d_name[0] == 'y' ? 0 : entry->d_name[0] == 'n' ? 1 : 2]++;
        json_clear(&tree);
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
    json_tree tree;
    problem_details problem;
    CHECK_INT(scan(&tree, "{\"a\": 1,\n \"b\": [1, 2\n}", &problem), 400);
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
    CHECK(!json_scan(&tree, "[1\0]", 4, &problem) && problem.status == 400);
    CHECK(!json_scan(&tree, "[1]\0", 4, &problem) && problem.status == 400);
    CHECK(!json_scan(&tree, "[\"\0\"]", 5, &problem) && problem.status == 400);
}

TEST(every_prefix_is_refused)
{
    static const char BODY[] =
        "{\"a\": [1, -2.5e+3, true, false, null, \"x\\u00e9\\ud83d\\ude00\\n\"], \"b\": {\"c\": {}}}";
    CHECK_INT(status_of(BODY), 0);
    for (size_t n = 0; n + 1 < sizeof BODY; n++) {
        json_tree tree;
        problem_details problem;
        char *cut = malloc(n + 1); /* an exact block, so that a sanitizer sees a read beyond it */
        memcpy(cut, BODY, n);
        CHECK_MSG(n + 1 == sizeof BODY || !json_scan(&tree, cut, n, &problem), "prefix of %zu bytes taken", n);
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
    json_tree tree;
    problem_details problem;
    CHECK_INT(scan(&tree, body, &problem), 400);
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
    json_tree tree;
    problem_details problem;
    CHECK_INT(scan(&tree, "[\"\\\"\\\\\\/\\b\\f\\n\\r\\t\\u0041\\u00e9\\u20ac\\ud83d\\ude00\\u0000z\"]", &problem), 0);
    static const char WANT[] = "\"\\/\b\f\n\r\tA\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\0z";
    const json_value *text = &tree.root->items[0];
    CHECK_INT(text->count, sizeof WANT - 1);
    CHECK(memcmp(json_text(text), WANT, sizeof WANT) == 0);
    CHECK_INT(json_text_characters(text), 14);
    json_clear(&tree);
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

TEST(arrays_of_numbers)
{
    json_value room;
    for (int n = 1; n < 3 * JSON_SHORT_ARRAY; n = 2 * n + 1) {
        json_tree tree;
        problem_details problem;
        char *body = number_array(n);
        CHECK_INT(scan(&tree, body, &problem), 0);
        const json_value *array = tree.root;
        CHECK(json_is(array, JSON_IS_NUMBERS) && json_is_list(array) && array->columns == 0);
        CHECK_INT(json_size(array), n);
        CHECK_INT(array->is_long, n > JSON_SHORT_ARRAY);
        for (int i = 0; i < n; i++)
            CHECK(array->numbers[i] == i + 0.5 && json_item(array, (size_t)i, &room)->number == i + 0.5);
        CHECK(!json_item(array, (size_t)n, &room));
        double *taken = json_take_numbers(array); /* outlives the tree */
        json_clear(&tree);
        CHECK(taken && taken[n - 1] == n - 0.5);
        free(taken);
        if (n > 41) {
            strcpy(strstr(body, "40.5"), "40.x]");
            CHECK_INT(status_of(body), 400);
        }
        free(body);
    }
}

/* What is wrong with an array of numbers is told as of any other, unless it is long. */
TEST(messages_about_numbers)
{
    static const struct {
        const char *body, *says;
    } CASES[] = {{"[1,]", "a value was expected"},
                 {"[1,+2]", "a value was expected"},
                 {"[[1,2],]", "a value was expected"},
                 {"[[1,],[2,3]]", "a value was expected"},
                 {"[[1,2] [3,4]]", "a comma or ']' was expected"},
                 {"[01]", "a number is malformed"}};
    for (size_t i = 0; i < sizeof CASES / sizeof CASES[0]; i++) {
        json_tree tree;
        problem_details problem;
        CHECK_INT(scan(&tree, CASES[i].body, &problem), 400);
        CHECK_MSG(strstr(problem.detail, CASES[i].says), "%s: %s", CASES[i].body, problem.detail);
    }
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

TEST(tables_of_numbers)
{
    json_value room, inner;
    for (int n = 1; n < 3 * JSON_SHORT_ARRAY; n = 2 * n + 1) {
        json_tree tree;
        problem_details problem;
        char *body = table(n, "[0,1]"), pointer[40];
        CHECK_INT(scan(&tree, body, &problem), 0);
        const json_value *rows = tree.root;
        CHECK(json_is(rows, JSON_IS_NUMBERS) && rows->columns == 2);
        CHECK_INT(json_size(rows), n);
        for (int i = 0; i < n; i++)
            CHECK(rows->numbers[2 * i] == i && rows->numbers[2 * i + 1] == i + 1);
        const json_value *last = json_item(rows, (size_t)n - 1, &room);
        CHECK(json_is(last, JSON_IS_NUMBERS) && last->count == 2 && json_item(last, 1, &inner)->number == n);
        json_pointer(pointer, sizeof pointer, json_item(last, 1, &inner));
        CHECK_INT(atoi(pointer + 1), n - 1);
        CHECK_STR(strrchr(pointer, '/'), "/1");
        json_clear(&tree);
        free(body);
    }
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
        json_tree tree;
        problem_details problem;
        char *text = table(JSON_SHORT_ARRAY + 2, CASES[i].first);
        CHECK_MSG(scan(&tree, text, &problem) == CASES[i].status, "%s: %d %s", CASES[i].first, problem.status,
                  problem.detail);
        if (problem.status == 0)
            CHECK_MSG(json_is(tree.root, JSON_IS_ARRAY) && tree.root->count == JSON_SHORT_ARRAY + 2, "%s",
                      CASES[i].first);
        json_clear(&tree);
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
        for (int k = 0; k < JSON_SHORT_ARRAY + 5; k++)
            strcat(body, ",1");
        strcat(body, TAILS[i]);
        CHECK_MSG(status_of(body) == 400, "taken: ...%s", TAILS[i]);
    }
}

TEST(long_strings_stay_where_they_are)
{
    json_tree tree;
    problem_details problem;
    char body[4 * JSON_SHORT_TEXT] = "{\"K\": \"";
    size_t start = strlen(body);
    for (size_t i = 0; i <= JSON_SHORT_TEXT; i++)
        strcpy(body + start + 2 * i, "\\n");
    strcat(body, "\\u20ac\xc3\xa9\"}");
    CHECK_INT(scan(&tree, body, &problem), 0);
    const json_value *item = json_get(tree.root, "K");
    CHECK(json_is(item, JSON_IS_STRING) && item->is_long && item->text == body + start && !json_text(item));
    CHECK_INT(item->count, JSON_SHORT_TEXT + 1 + 5);
    CHECK_INT(json_text_characters(item), JSON_SHORT_TEXT + 1 + 2);
    char *text = json_copy_text(item);
    CHECK(text && text[0] == '\n' && text[JSON_SHORT_TEXT] == '\n');
    CHECK_STR(text + JSON_SHORT_TEXT + 1, "\xe2\x82\xac\xc3\xa9");
    free(text);
    json_clear(&tree);
}

TEST(numbers_beside_other_values)
{
    json_tree tree;
    problem_details problem;
    char *array = number_array(100), body[4096];
    snprintf(body, sizeof body, "[%s, 0, 0.0, \"0\", [0], {\"numbers\": 0}]", array);
    CHECK_INT(scan(&tree, body, &problem), 0);
    static const json_kind KINDS[] = {JSON_IS_NUMBERS, JSON_IS_NUMBER,  JSON_IS_NUMBER,
                                      JSON_IS_STRING,  JSON_IS_NUMBERS, JSON_IS_OBJECT};
    CHECK_INT(json_size(tree.root), sizeof KINDS / sizeof KINDS[0]);
    for (size_t i = 0; i < json_size(tree.root); i++)
        CHECK_INT(tree.root->items[i].kind, KINDS[i]);
    json_clear(&tree);
    free(array);
}

/* Every value knows where it stands. */
static void check_places(const json_value *value, int depth)
{
    for (size_t i = 0; i < json_size(value) && value->kind != JSON_IS_NUMBERS; i++) {
        CHECK(value->items[i].parent == value && depth < 10);
        check_places(&value->items[i], depth + 1);
    }
}

TEST(places)
{
    json_tree tree;
    problem_details problem;
    char pointer[40];
    CHECK_INT(scan(&tree, "{\"a\": [{\"b/c\": {}}, {\"~\": [true, [[]]]}], \"d\": {\"e\\u0007\": \"x\"}}", &problem),
              0);
    check_places(tree.root, 0);
    const json_value *last = &json_get(&json_get(tree.root, "a")->items[1], "~")->items[1];
    json_pointer(pointer, sizeof pointer, &last->items[0]);
    CHECK_STR(pointer, "/a/1/~0/1/0");
    json_pointer(pointer, sizeof pointer, json_get(&json_get(tree.root, "a")->items[0], "b/c"));
    CHECK_STR(pointer, "/a/0/b~1c");
    json_pointer(pointer, sizeof pointer, &json_get(tree.root, "d")->items[0]);
    CHECK_STR(pointer, "/d/e?");
    json_pointer(pointer, 6, &last->items[0]);
    CHECK_STR(pointer, "/a/1"); /* whole steps */
    json_clear(&tree);
}

/* Objects of many keys: each is found, and one that stands twice too. */
TEST(many_keys)
{
    enum { KEYS = 5000 };
    json_tree tree;
    problem_details problem;
    char *body = malloc(24 * KEYS + 64), *at = body, key[16];
    *at++ = '{';
    for (int i = 0; i < KEYS; i++)
        at += sprintf(at, "\"k%d\": %d, ", i * 7919 % KEYS, i);
    strcpy(at, "\"\": null}");
    CHECK_INT(scan(&tree, body, &problem), 0);
    CHECK_INT(json_size(tree.root), KEYS + 1);
    for (int i = 0; i < KEYS; i += 99) {
        snprintf(key, sizeof key, "k%d", i * 7919 % KEYS);
        CHECK(json_number(json_get(tree.root, key), -1) == i);
    }
    json_clear(&tree);
    for (int i = 0; i < KEYS; i += 777) {
        sprintf(at, "\"k%d\": 1e999, \"x\": 1e999}", i);
        CHECK_INT(scan(&tree, body, &problem), 422);
        CHECK_STR(problem.code, "duplicate_key"); /* the first refusal stays */
        CHECK_INT(atoi(problem.pointer + 2), i);
    }
    free(body);
}

TEST(what_is_the_same)
{
    static const char *const LIST[] = {"[]",        "{}",       "null",   "false",           "0",
                                       "[0]",       "[[0]]",    "\"\"",   "\"a\"",           "{\"a\": [1, \"x\"]}",
                                       "[1, [2]]",  "[1, [3]]", "[null]", "{\"b\": [1, 2]}", "[true]",
                                       "{\"a\": 1}"};
    enum { N = sizeof LIST / sizeof LIST[0] };
    json_tree trees[N], other;
    problem_details problem;
    for (size_t i = 0; i < N; i++)
        CHECK_INT(scan(&trees[i], LIST[i], &problem), 0);
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++)
            CHECK_MSG(json_same(trees[i].root, trees[j].root) == (i == j), "%s and %s", LIST[i], LIST[j]);
    CHECK_INT(scan(&other, "{\"a\": [1.0, \"\\u0078\"]}", &problem), 0);
    CHECK(json_same(trees[9].root, other.root) && json_same(NULL, NULL) && !json_same(NULL, other.root));
    json_clear(&other);
    for (size_t i = 0; i < N; i++)
        json_clear(&trees[i]);
}

/* The limit counts what is short one by one, and what is long as one. */
TEST(how_values_are_counted)
{
    static const struct {
        const char *item;
        int values;
    } CASES[] = {{"[1,2]", 3}, {"[[1,2],[3,4]]", 7}, {"{\"a\":[1]}", 3}, {"\"x\"", 1}, {"[[],[1]]", 4}};
    for (size_t k = 0; k < sizeof CASES / sizeof CASES[0]; k++) {
        /* [[0,0,...],item,item,...]: 1 + 1 + as many of the items as fit; a long array first keeps it from being a
         * table */
        const size_t len = strlen(CASES[k].item), most = (size_t)(JSON_MAX_VALUES - 2) / (size_t)CASES[k].values;
        char *body = malloc((len + 1) * (most + 2) + 1024), *at = body, *array = number_array(JSON_SHORT_ARRAY + 1);
        at += sprintf(at, "[%s", array);
        for (size_t i = 0; i < most; i++) {
            *at++ = ',';
            memcpy(at, CASES[k].item, len);
            at += len;
        }
        strcpy(at, "]");
        CHECK_MSG(status_of(body) == 0, "%s", CASES[k].item);
        *at++ = ',';
        sprintf(at, "%s]", CASES[k].item);
        CHECK_MSG(status_of(body) == 413, "%s", CASES[k].item);
        free(array);
        free(body);
    }
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
        json_tree tree;
        problem_details problem;
        getrusage(RUSAGE_SELF, &before);
        json_scan(&tree, body, len, &problem);
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

TEST(memory_stays_below_the_body)
{
    size_t len;
    char *body = big_body((size_t)16 << 20, &len);
    long peak = SANITIZED ? 0 : peak_of(body, len);
    CHECK(peak >= 0);
    CHECK_MSG(peak < (long)len, "%ld bytes beside a body of %zu", peak, len);
    free(body);
    if (SANITIZED)
        test_skip("a sanitizer's own memory would be counted");
}
