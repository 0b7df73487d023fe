/* The strict Matrix Market reader: right verdicts with the right line, right values in any order, no trust in sizes. */
#include "harness.h"
#include "uzawa.h"

#include <ftw.h>

/* ------------------------------------------------------------- edge cases from elsewhere */

typedef struct {
    char path[200], status[40];
    long long line;
} verdict;

static verdict verdicts[400];
static int n_verdicts;

static void load_verdicts(void)
{
    size_t len;
    char *text = test_read_file("tests/data/mm_edge_verdicts.txt", &len), *rest = text, *line;
    n_verdicts = 0;
    CHECK(text != NULL);
    while (text && (line = strsep(&rest, "\n")) != NULL) {
        verdict *v = &verdicts[n_verdicts];
        if (line[0] != '#' && n_verdicts < 400 && sscanf(line, "%199s %39s %lld", v->path, v->status, &v->line) == 3)
            n_verdicts++;
    }
    free(text);
}

static void check_verdict(const verdict *v, const char *text, size_t len)
{
    uz_csc A;
    uz_mm_info info;
    uz_error err = {0};
    uz_status status = uz_mm_read(&A, &info, text, len, 0, &err);
    CHECK_MSG(strcmp(uz_status_name(status), v->status) == 0 && err.line == v->line,
              "%s: %s at line %lld, want %s at line %lld (%s)", v->path, uz_status_name(status), (long long)err.line,
              v->status, v->line, err.message);
    CHECK(status == UZ_OK || (A.ptr == NULL && info.rows == 0 && err.message[0]));
    uz_csc_clear(&A);
}

/* Returns how many of the listed files stand under `root`. */
static int check_folder(const char *root)
{
    int present = 0;
    load_verdicts();
    for (int k = 0; k < n_verdicts; k++) {
        char path[512];
        size_t len;
        int length = snprintf(path, sizeof path, "%s/%s", root, verdicts[k].path);
        char *text = length < (int)sizeof path ? test_read_file(path, &len) : NULL;
        if (!text)
            continue;
        present++;
        check_verdict(&verdicts[k], text, len);
        free(text);
    }
    return present;
}

TEST(samples_get_the_right_verdict)
{
    CHECK(check_folder("tests/data/mm") >= 30);
}

static int files_seen;

static int count_file(const char *path, const struct stat *st, int type, struct FTW *where)
{
    (void)path, (void)st, (void)where;
    files_seen += type == FTW_F;
    return 0;
}

TEST(every_edge_case_gets_the_right_verdict)
{
    char root[256];
    const char *cases = test_cases_dir();
    if (!cases) {
        test_skip("no folder ../shared/cases");
        return;
    }
    snprintf(root, sizeof root, "%s/mm_edge", cases);
    files_seen = 0;
    nftw(root, count_file, 8, FTW_PHYS);
    CHECK_INT(check_folder(root), n_verdicts);
    CHECK_INT(n_verdicts, files_seen);
}

/* ------------------------------------------------------------- single mistakes */

#define GENERAL   "%%MatrixMarket matrix coordinate real general\n"
#define SYMMETRIC "%%MatrixMarket matrix coordinate real symmetric\n"
#define INTEGER   "%%MatrixMarket matrix coordinate integer general\n"
#define ARRAY     "%%MatrixMarket matrix array real general\n"
#define TRIANGLE  "%%MatrixMarket matrix array real symmetric\n"

static const struct {
    const char *text;
    uz_status status;
    int64_t line;
} MISTAKES[] = {
    {"", UZ_ERR_FORMAT, 1},
    {"\n" GENERAL "1 1 0\n", UZ_ERR_FORMAT, 1},
    {"\xef\xbb\xbf" GENERAL "1 1 0\n", UZ_ERR_FORMAT, 1},
    {"%%MatrixMarketmatrix coordinate real general\n1 1 0\n", UZ_ERR_FORMAT, 1},
    {"%%MatrixMarket matrix coordinate real general extra\n1 1 0\n", UZ_ERR_FORMAT, 1},
    {"%%MatrixMarket matrix coordinate real generally\n1 1 0\n", UZ_ERR_FORMAT, 1},
    {"%%MatrixMarket matrix coordinate\nreal general\n1 1 0\n", UZ_ERR_FORMAT, 1},
    {"%%MatrixMarket matrix coordinate real skew-symmetric\n1 1 0\n", UZ_ERR_UNSUPPORTED, 1},
    {"%%MatrixMarket matrix coordinate complex hermitian\n1 1 0\n", UZ_ERR_UNSUPPORTED, 1},
    {"%%MatrixMarket matrix array pattern general\n1 1\n", UZ_ERR_FORMAT, 1},
    {GENERAL, UZ_ERR_FORMAT, 1},
    {GENERAL "%\n\n", UZ_ERR_FORMAT, 3},
    {GENERAL "1 1\n", UZ_ERR_FORMAT, 2},
    {GENERAL "1 1 0 0\n", UZ_ERR_FORMAT, 2},
    {GENERAL "+1 1 0\n", UZ_ERR_FORMAT, 2},
    {GENERAL "1.0 1 0\n", UZ_ERR_FORMAT, 2},
    {GENERAL "1e0 1 0\n", UZ_ERR_FORMAT, 2},
    {GENERAL "9223372036854775807 1 0\n", UZ_ERR_FORMAT, 2},
    {GENERAL "99999999999999999999999 1 0\n", UZ_ERR_FORMAT, 2},
    {ARRAY "2 2 4\n1\n2\n3\n4\n", UZ_ERR_FORMAT, 2},
    {SYMMETRIC "2 3 1\n1 1 1\n", UZ_ERR_FORMAT, 2},
    {SYMMETRIC "2 2 4\n1 1 1\n2 1 1\n2 2 1\n1 2 1\n", UZ_ERR_FORMAT, 2},
    {SYMMETRIC "2 2 2\n1 1 1\n1 2 1\n", UZ_ERR_FORMAT, 4},
    {GENERAL "2 2 1\n0 1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 0 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n3 1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 3 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n-1 1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 18446744073709551617 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1,1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 \n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1 % ok?\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1.5.5\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1d5\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1,5\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 0x1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 information\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1 1 1e309\n", UZ_ERR_NOT_FINITE, 3},
    {GENERAL "2 2 1\n1 1 -1e309\n", UZ_ERR_NOT_FINITE, 3},
    {GENERAL "2 2 1\n1 1 NaN\n", UZ_ERR_NOT_FINITE, 3},
    {GENERAL "2 2 1\n1 1 nan(1)\n", UZ_ERR_NOT_FINITE, 3},
    {GENERAL "2 2 1\n1 1 -Infinity\n", UZ_ERR_NOT_FINITE, 3},
    {INTEGER "2 2 1\n1 1 1.0\n", UZ_ERR_FORMAT, 3},
    {INTEGER "2 2 1\n1 1 1e2\n", UZ_ERR_FORMAT, 3},
    {INTEGER "2 2 1\n1 1 inf\n", UZ_ERR_NOT_FINITE, 3},
    {GENERAL "2 2 2\n1 1 1\n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 2\n1 1 1", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 2\n1 1 1\n%\n\n", UZ_ERR_FORMAT, 5},
    {GENERAL "2 2 1\n1 1 1\n\n%\n2 2 1\n", UZ_ERR_FORMAT, 6},
    {GENERAL "2 2 1\n1 1 1\nx", UZ_ERR_FORMAT, 4},
    {GENERAL "2 2 5\n1 1 1\n", UZ_ERR_FORMAT, 2},
    {GENERAL "2 2 2\n1 1 1\n1 1 1\n", UZ_ERR_FORMAT, 4},
    {GENERAL "2 2 3\n2 2 1\n1 1 1\n2 2 1\n", UZ_ERR_FORMAT, 5},
    {GENERAL "9 9 5\n9 9 1\n\n1 1 1\n%\n9 9 2\n2 2 1\n1 1 2\n", UZ_ERR_FORMAT, 7},
    {ARRAY "2 1\n1 2\n", UZ_ERR_FORMAT, 3},
    {ARRAY "2 1\n1\n", UZ_ERR_FORMAT, 3},
    {ARRAY "2 1\n1\n2\n3\n", UZ_ERR_FORMAT, 5},
    {ARRAY "2 1\n1\n-\n", UZ_ERR_FORMAT, 4},
    {TRIANGLE "2 2\n1\n2\n3\n4\n", UZ_ERR_FORMAT, 6},
    {GENERAL "2 2 1\r1 1 1\r", UZ_ERR_FORMAT, 2},
    {GENERAL "2 2 1\n1 1 1\r \n", UZ_ERR_FORMAT, 3},
    {GENERAL "2 2 1\n1\v1 1\n", UZ_ERR_FORMAT, 3},
    /* sizes that the text cannot hold */
    {GENERAL "1000000 1000000 999999999999\n1 1 1\n", UZ_ERR_FORMAT, 3},
    {ARRAY "1000000000 1\n1\n", UZ_ERR_FORMAT, 3},
    {ARRAY "3037000500 3037000500\n1\n", UZ_ERR_LIMIT, 2},
    {ARRAY "4000000000000000000 1000\n1\n", UZ_ERR_LIMIT, 2},
    {GENERAL "2147483648 2 1\n1 1 1\n", UZ_ERR_LIMIT, 2},
    {TRIANGLE "9000000000000000000 9000000000000000000\n1\n", UZ_ERR_LIMIT, 2},
    {GENERAL "1 9223372036854775806 1\n1 1 1\n", UZ_ERR_LIMIT, 2},
};

TEST(each_mistake_is_refused_with_its_line)
{
    for (size_t k = 0; k < sizeof MISTAKES / sizeof MISTAKES[0]; k++) {
        verdict v = {.line = MISTAKES[k].line};
        snprintf(v.path, sizeof v.path, "mistake %zu \"%.60s\"", k, strchr(MISTAKES[k].text, '\n') ?: "");
        snprintf(v.status, sizeof v.status, "%s", uz_status_name(MISTAKES[k].status));
        check_verdict(&v, MISTAKES[k].text, strlen(MISTAKES[k].text));
    }
}

TEST(nul_bytes_are_refused_everywhere)
{
    static const char text[] = GENERAL "% a comment\n2 2 1\n\n1 1 1\n\n% end\n";
    char copy[sizeof text];
    for (size_t at = 0; at < sizeof text - 1; at++) {
        uz_csc A;
        memcpy(copy, text, sizeof text);
        copy[at] = '\0';
        CHECK_MSG(uz_mm_read(&A, NULL, copy, sizeof text - 1, 0, NULL) == UZ_ERR_FORMAT, "NUL at byte %zu", at);
        uz_csc_clear(&A);
    }
    uz_csc A;
    CHECK_INT(uz_mm_read(&A, NULL, text, sizeof text, 0, NULL), UZ_ERR_FORMAT); /* behind the last line */
    CHECK_INT(uz_mm_read(&A, NULL, NULL, 0, 0, NULL), UZ_ERR_FORMAT);
}

/* Every beginning of a text, in a block of exactly its length: refused, and nothing is read behind it. */
TEST(cut_texts_are_refused)
{
    static const char text[] =
        "%%MatrixMarket matrix coordinate real general\r\n%x\r\n3 3 2\r\n1 1 1.25e1\r\n3 2 -7\r\n";
    size_t whole = strlen(text);
    for (size_t len = 0; len <= whole; len++) {
        char *cut = malloc(len + (len == 0));
        uz_csc A;
        uz_error err = {0};
        if (!cut)
            return;
        memcpy(cut, text, len);
        uz_status status = uz_mm_read(&A, NULL, cut, len, 0, &err);
        CHECK_MSG(status == (len + 2 >= whole ? UZ_OK : UZ_ERR_FORMAT), "%zu bytes: %s", len, err.message);
        CHECK(status == UZ_OK || (err.line >= 1 && err.line <= 5));
        uz_csc_clear(&A);
        free(cut);
    }
}

/* ------------------------------------------------------------- values and order */

static void check_values(const char *text, int64_t rows, int64_t cols, const double *dense, uz_mm_symmetry symmetry)
{
    double got[64] = {0};
    uz_csc A;
    uz_mm_info info;
    uz_error err = {0};
    CHECK_MSG(uz_mm_read(&A, &info, text, strlen(text), 0, &err) == UZ_OK, "%s", err.message);
    CHECK(A.rows == rows && A.cols == cols && info.rows == rows && info.cols == cols && info.symmetry == symmetry);
    for (int64_t j = 0; j < A.cols; j++) {
        for (int64_t k = A.ptr[j]; k < A.ptr[j + 1]; k++) {
            CHECK(k == A.ptr[j] || A.idx[k] > A.idx[k - 1]);
            got[A.idx[k] + j * rows] = A.val[k];
        }
    }
    for (int64_t k = 0; k < rows * cols; k++)
        CHECK_MSG(got[k] == dense[k], "number %lld is %g, want %g", (long long)k, got[k], dense[k]);
    uz_csc_clear(&A);
}

TEST(values_stand_where_they_belong)
{
    const double a[6] = {1, 0, -2.5, 0, 1e-3, 0};
    check_values(GENERAL "3 2 3\n1 1 1\n3 1 -2.5\n2 2 1e-3\n", 3, 2, a, UZ_MM_GENERAL);
    check_values(GENERAL "3 2 3\n2 2 .001\n3 1 -25.e-1\n1 1 +1\n", 3, 2, a, UZ_MM_GENERAL);
    check_values("%%matrixmarket\tMATRIX Coordinate  REAL\tGeneral \r\n\r\n% c\r\n\t3 2\t3\r\n\r\n 1 1 1\r\n3 1 -2.5 "
                 "\r\n%\r\n2  2\t1E-03",
                 3, 2, a, UZ_MM_GENERAL);
    check_values(ARRAY "3 2\n1\n0\n-2.5\n0\n1e-3\n0\n", 3, 2, a, UZ_MM_GENERAL);
    const double lower[4] = {4, -1, 0, 5};
    check_values(SYMMETRIC "2 2 3\n1 1 4\n2 1 -1\n2 2 5\n", 2, 2, lower, UZ_MM_SYMMETRIC);
    check_values(TRIANGLE "2 2\n4\n-1\n5\n", 2, 2, lower, UZ_MM_SYMMETRIC);
    check_values(INTEGER "2 2 3\n0002 2 5\n02 1 -1\n1 01 +4\n", 2, 2, lower, UZ_MM_GENERAL);
}

TEST(zeros_are_kept_and_info_is_filled)
{
    const char *text = INTEGER "2 2 2\n1 1 0\n2 2 -0\n";
    uz_csc A;
    uz_mm_info info;
    CHECK_INT(uz_mm_read(&A, &info, text, strlen(text), 0, NULL), UZ_OK);
    CHECK(info.integer && info.format == UZ_MM_COORDINATE && info.entries == 2);
    CHECK(A.ptr[2] == 2 && A.val[0] == 0.0 && signbit(A.val[1]));
    uz_csc_clear(&A);
}

static uint64_t state = 0x9e3779b97f4a7c15u;

static int64_t random_below(int64_t n)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (int64_t)((state >> 33) % (uint64_t)n);
}

/* A full matrix written in a random order of its places, some of them left out. */
static void check_shuffled(int64_t rows, int64_t cols, int64_t keep)
{
    int64_t total = rows * cols, *order = malloc((size_t)total * sizeof *order);
    char *text = malloc((size_t)keep * 32 + 100);
    uz_csc A;
    uz_error err = {0};
    if (!order || !text)
        return;
    for (int64_t k = 0; k < total; k++)
        order[k] = k;
    int length = sprintf(text, "%s%lld %lld %lld\n", GENERAL, (long long)rows, (long long)cols, (long long)keep);
    for (int64_t k = 0; k < keep; k++) {
        int64_t other = k + random_below(total - k), place = order[other];
        order[other] = order[k];
        length += sprintf(text + length, "%lld %lld %lld\n", (long long)(place % rows) + 1,
                          (long long)(place / rows) + 1, (long long)place);
    }
    CHECK_MSG(uz_mm_read(&A, NULL, text, (size_t)length, 0, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(A.ptr ? A.ptr[cols] : -1, keep);
    for (int64_t j = 0; A.ptr && j < cols; j++) {
        for (int64_t k = A.ptr[j]; k < A.ptr[j + 1]; k++) {
            CHECK(A.val[k] == (double)(A.idx[k] + j * rows));
            CHECK(k == A.ptr[j] || A.idx[k] > A.idx[k - 1]);
        }
    }
    uz_csc_clear(&A);
    free(order);
    free(text);
}

TEST(any_order_of_entries_is_sorted)
{
    check_shuffled(1, 1, 1);
    check_shuffled(5000, 1, 5000);
    check_shuffled(1, 3000, 2000);
    check_shuffled(333, 7, 2000);
    for (int k = 0; k < 200; k++) {
        int64_t rows = 1 + random_below(40), cols = 1 + random_below(6);
        check_shuffled(rows, cols, 1 + random_below(rows * cols));
    }
}

/* The sort takes no room by the number of rows. */
TEST(rows_may_be_far_more_than_entries)
{
    const char *text = GENERAL "2147483647 2 3\n2147483647 1 1\n5 1 2\n7 2 3\n";
    uz_csc A;
    CHECK_INT(uz_mm_read(&A, NULL, text, strlen(text), 0, NULL), UZ_OK);
    CHECK(A.idx && A.idx[0] == 4 && A.idx[1] == 2147483646 && A.val[1] == 1.0);
    uz_csc_clear(&A);
}

TEST(memory_is_bounded_as_asked)
{
    const char *text = GENERAL "10 100 1\n1 1 1\n";
    size_t need = 101 * 8 + 16;
    uz_csc A;
    uz_error err = {0};
    CHECK_INT(uz_mm_read(&A, NULL, text, strlen(text), need, NULL), UZ_OK);
    uz_csc_clear(&A);
    CHECK_INT(uz_mm_read(&A, NULL, text, strlen(text), need - 1, &err), UZ_ERR_LIMIT);
    CHECK_INT(err.line, 2);
}

/* ------------------------------------------------------------- vectors */

static void check_vector(const char *text, int64_t want_n, const double *want)
{
    double *x;
    int64_t n;
    uz_error err = {0};
    CHECK_MSG(uz_mm_read_vector(&x, &n, text, strlen(text), 0, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(n, want_n);
    for (int64_t k = 0; x && k < n; k++)
        CHECK(x[k] == want[k]);
    free(x);
}

TEST(vectors_stand_or_lie_full_or_sparse)
{
    const double x[4] = {0, 1.5, 0, -2};
    check_vector(ARRAY "4 1\n0\n1.5\n0\n-2\n", 4, x);
    check_vector(ARRAY "1 4\n0\n1.5\n0\n-2\n", 4, x);
    check_vector(GENERAL "4 1 2\n4 1 -2\n2 1 1.5\n", 4, x);
    check_vector(GENERAL "1 4 2\n1 4 -2\n1 2 1.5\n", 4, x);
    check_vector(TRIANGLE "1 1\n1.5\n", 1, x + 1);
    check_vector(ARRAY "0 1\n", 0, x);
    check_vector(GENERAL "0 1 0\n", 0, x);
}

/* One more than the largest length would not fit into the count of what is needed. */
TEST(vector_of_the_largest_length_is_refused)
{
    const char *text[2] = {GENERAL "9223372036854775806 1 1\n1 1 1\n", GENERAL "1 9223372036854775806 1\n1 1 1\n"};
    for (int i = 0; i < 2; i++) {
        double *x;
        int64_t n;
        uz_error err = {0};
        CHECK_INT(uz_mm_read_vector(&x, &n, text[i], strlen(text[i]), 0, &err), UZ_ERR_LIMIT);
        CHECK(!x && err.line == 2);
    }
}

TEST(what_is_no_vector_is_refused)
{
    const char *text = ARRAY "% c\n2 2\n1\n2\n3\n4\n", *huge = GENERAL "1000000000 1 1\n5 1 1\n";
    double stale = 0.0, *x = &stale;
    int64_t n = 7;
    uz_error err = {0};
    CHECK_INT(uz_mm_read_vector(&x, &n, text, strlen(text), 0, &err), UZ_ERR_SIZE);
    CHECK(x == NULL && n == 0 && err.line == 3);
    CHECK_INT(uz_mm_read_vector(&x, &n, huge, strlen(huge), 0, &err), UZ_ERR_LIMIT);
    CHECK(x == NULL && n == 0 && err.line == 2);
    CHECK_INT(uz_mm_read_vector(&x, &n, ARRAY "2 1\n1\nx\n", strlen(ARRAY "2 1\n1\nx\n"), 0, &err), UZ_ERR_FORMAT);
    CHECK(x == NULL && n == 0 && err.line == 4);
}
