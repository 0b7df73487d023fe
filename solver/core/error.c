#include "core/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const STATUS_NAMES[] = {
    [UZ_OK] = "ok",
    [UZ_ERR_MEMORY] = "out_of_memory",
    [UZ_ERR_ARGUMENT] = "bad_argument",
    [UZ_ERR_FORMAT] = "matrix_market_syntax",
    [UZ_ERR_UNSUPPORTED] = "matrix_market_unsupported",
    [UZ_ERR_SIZE] = "size_mismatch",
    [UZ_ERR_NOT_FINITE] = "not_finite",
    [UZ_ERR_RANGE] = "out_of_range",
    [UZ_ERR_NOT_SYMMETRIC] = "not_symmetric",
    [UZ_ERR_NOT_SPD] = "not_positive_definite",
    [UZ_ERR_FREE_BODY] = "free_body",
    [UZ_ERR_SCENE] = "bad_scene",
    [UZ_ERR_LIMIT] = "memory_limit",
    [UZ_ERR_CANCELLED] = "cancelled",
    [UZ_ERR_IO] = "io",
    [UZ_ERR_INTERNAL] = "internal",
};

const char *uz_status_name(uz_status status)
{
    size_t count = sizeof STATUS_NAMES / sizeof STATUS_NAMES[0];
    return (size_t)status < count ? STATUS_NAMES[status] : "unknown";
}

void uz_error_reset(uz_error *err)
{
    if (err)
        memset(err, 0, sizeof *err);
}

static void fill(uz_error *err, uz_status status, const char *where, int64_t line, const char *format, va_list args)
{
    if (!err || err->status != UZ_OK)
        return;
    err->status = status;
    err->line = line;
    snprintf(err->where, sizeof err->where, "%s", where ? where : "");
    vsnprintf(err->message, sizeof err->message, format, args);
}

uz_status uz_fail(uz_error *err, uz_status status, const char *where, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fill(err, status, where, 0, format, args);
    va_end(args);
    return status;
}

uz_status uz_fail_line(uz_error *err, uz_status status, int64_t line, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fill(err, status, "", line, format, args);
    va_end(args);
    return status;
}

uz_status uz_no_memory(uz_error *err, const char *what)
{
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %s", what);
}
