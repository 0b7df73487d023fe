/* problem.h: fills problem details with a formatted sentence. */
#ifndef SERVER_HTTP_PROBLEM_H
#define SERVER_HTTP_PROBLEM_H

#include "base/problem_details.h"

/* Returns false, so that a failing check ends in `return http_problem(...)`. */
_Bool http_problem(problem_details *out, int status, const char *code, const char *title, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

#endif
