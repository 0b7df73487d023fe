/* harness_measure.c: the harness of programs that measure (tests/figures, tests/theory). They share fixtures with the
 * tests, and what those find wrong is told here, where stdout belongs to the table. */
#include "harness.h"

#include <stdarg.h>

static int failures;

void test_fail(const char *file, int line, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fprintf(stderr, "%s:%d: ", file, line);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    failures++;
}

bool test_has_failed(void)
{
    return failures > 0;
}
