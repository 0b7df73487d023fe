/* problem.h: how the codec fills problem_details. */
#ifndef SERVER_CODEC_PROBLEM_H
#define SERVER_CODEC_PROBLEM_H

#include "codec/json.h"

#include <stdbool.h>
#include <stddef.h>

/* Overwrites *out; the title follows from the code, the pointer from the place in the request, NULL: the whole of it.
 * A detail that does not fit is cut after a whole character. */
void problem_set(problem_details *out, int status, const char *code, const json_value *at, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* Appends to the detail, within its size. */
void problem_add(problem_details *out, const char *format, ...) __attribute__((format(printf, 2, 3)));

bool problem_no_memory(problem_details *out); /* 503; returns false */

/* Writes text[0..len) in double quotes for a person to read: control characters become '?', a long text is shortened
 * with "..." after a whole character. */
void problem_quote(char *out, size_t size, const char *text, size_t len);

#endif
