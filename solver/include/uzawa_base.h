/* uzawa_base.h: how a call of the library fails. Part of uzawa.h. */
#ifndef UZAWA_BASE_H
#define UZAWA_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------ errors */

/* How a call failed. */
typedef enum {
    UZ_OK = 0,
    UZ_ERR_MEMORY,        /* an allocation failed, or a size would overflow */
    UZ_ERR_ARGUMENT,      /* the caller broke this header's contract */
    UZ_ERR_FORMAT,        /* Matrix Market text is malformed: see line */
    UZ_ERR_UNSUPPORTED,   /* well formed, but a kind that is not solved here (complex, pattern, ...) */
    UZ_ERR_SIZE,          /* shapes do not agree */
    UZ_ERR_NOT_FINITE,    /* NaN or Inf in the input, or produced by overflow */
    UZ_ERR_RANGE,         /* a number so small that its products have no digits left */
    UZ_ERR_NOT_SYMMETRIC, /* K differs from K' */
    UZ_ERR_NOT_SPD,       /* K is not positive definite to working precision */
    UZ_ERR_FREE_BODY,     /* supports leave a rigid-body mode free */
    UZ_ERR_SCENE,         /* a scene that cannot be modelled: unknown group, inverted element, ... */
    UZ_ERR_LIMIT,         /* more memory than allowed */
    UZ_ERR_CANCELLED,     /* the cancel hook said so before there was an answer to return */
    UZ_ERR_IO,            /* reading or writing a file failed */
    UZ_ERR_INTERNAL       /* a bug: an invariant did not hold */
} uz_status;

/* What went wrong, for a person and for a program. */
typedef struct {
    uz_status status;
    char where[96];    /* which input: "K", "h", "/contacts/0/on" (JSON pointer into the problem); "" if none */
    int64_t line;      /* 1-based line of Matrix Market text, 0 if none */
    char message[512]; /* what is wrong and what to do, UTF-8, no trailing newline */
} uz_error;

/* Stable machine name of a status: "not_positive_definite", ... Never NULL. */
const char *uz_status_name(uz_status status);

#ifdef __cplusplus
}
#endif

#endif
