/* error.h: how the library's functions report a failed call. */
#ifndef UZ_CORE_ERROR_H
#define UZ_CORE_ERROR_H

#include "uzawa.h"

/* Fills *err (may be NULL) and returns status, so that a failing function ends in `return uz_fail(...)`.
 * An *err that already holds a failure is left alone: the innermost cause wins. Callers of the public API may pass
 * an uninitialised uz_error: public entry points call uz_error_reset first. */
uz_status uz_fail(uz_error *err, uz_status status, const char *where, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* The same with the line of a Matrix Market text. */
uz_status uz_fail_line(uz_error *err, uz_status status, int64_t line, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* UZ_ERR_MEMORY: "no memory for <what>". */
uz_status uz_no_memory(uz_error *err, const char *what);

void uz_error_reset(uz_error *err);

#endif
