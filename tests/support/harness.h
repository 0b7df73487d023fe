/* harness.h: a test is TEST(name) { ... } in any tests/unit/test_*.c; it registers itself before main runs.
 * Each file is one program. It prints "ok FILE.name", "not ok FILE.name" or "skip FILE.name: why" and exits non-zero
 * when a test failed. An argument runs only the tests whose name contains it. Programs that measure take
 * harness_measure.c in place of harness.c. */
#ifndef TESTS_HARNESS_H
#define TESTS_HARNESS_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct test_case {
    const char *name;
    void (*run)(void);
    struct test_case *next;
} test_case;

void test_register(test_case *test);
/* Records a failure of the running test and prints where; the test goes on. */
void test_fail(const char *file, int line, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* Has anything failed so far? Only of harness_measure.c: a test goes on after a failure, and ends "not ok". */
bool test_has_failed(void);
/* Marks the running test as skipped; return from it afterwards. */
void test_skip(const char *why);
/* "../shared/cases", or NULL where it is absent: tests that read it must skip. */
const char *test_cases_dir(void);
/* Reads a whole file; NUL-terminated, *len without the NUL. NULL if it cannot be read. Caller frees. */
char *test_read_file(const char *path, size_t *len);

#define TEST(id)                                                                                                       \
    static void test_##id(void);                                                                                       \
    static test_case case_##id = {#id, test_##id, NULL};                                                               \
    __attribute__((constructor)) static void register_##id(void)                                                       \
    {                                                                                                                  \
        test_register(&case_##id);                                                                                     \
    }                                                                                                                  \
    static void test_##id(void)

#define CHECK(condition)          ((condition) ? (void)0 : test_fail(__FILE__, __LINE__, "%s", #condition))
#define CHECK_MSG(condition, ...) ((condition) ? (void)0 : test_fail(__FILE__, __LINE__, __VA_ARGS__))
#define CHECK_STR(got, want)                                                                                           \
    (strcmp((got), (want)) == 0 ? (void)0 : test_fail(__FILE__, __LINE__, "got \"%s\", want \"%s\"", (got), (want)))
#define CHECK_INT(got, want)                                                                                           \
    ((long long)(got) == (long long)(want)                                                                             \
         ? (void)0                                                                                                     \
         : test_fail(__FILE__, __LINE__, #got " is %lld, want %lld", (long long)(got), (long long)(want)))
/* |got - want| <= tol * |want| */
#define CHECK_REL(got, want, tol)                                                                                      \
    (fabs((got) - (want)) <= (tol)*fabs(want)                                                                          \
         ? (void)0                                                                                                     \
         : test_fail(__FILE__, __LINE__, #got " is %.17g, want %.17g within %g relative", (double)(got),               \
                     (double)(want), (double)(tol)))

#endif
