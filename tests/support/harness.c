#include "harness.h"

#include <stdarg.h>

static test_case *first, **tail = &first;
static int failures;        /* of the running test */
static const char *skipped; /* why the running test was skipped, or NULL */

void test_register(test_case *test)
{
    *tail = test;
    tail = &test->next;
}

void test_fail(const char *file, int line, const char *format, ...)
{
    va_list args;
    failures++;
    if (failures > 20)
        return;
    printf("# %s:%d: ", file, line);
    va_start(args, format);
    vprintf(format, args);
    va_end(args);
    printf("\n");
}

void test_skip(const char *why)
{
    skipped = why;
}

static const char *suite_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int main(int argc, char **argv)
{
    const char *suite = suite_name(argv[0]);
    int failed = 0;
    setvbuf(stdout, NULL, _IOLBF, 0);
    for (test_case *test = first; test; test = test->next) {
        if (argc > 1 && !strstr(test->name, argv[1]))
            continue;
        failures = 0;
        skipped = NULL;
        test->run();
        if (failures)
            printf("not ok %s.%s\n", suite, test->name);
        else if (skipped)
            printf("skip %s.%s: %s\n", suite, test->name, skipped);
        else
            printf("ok %s.%s\n", suite, test->name);
        failed += failures > 0;
    }
    return failed > 0;
}
