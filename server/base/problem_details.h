/* problem_details.h: what a refused or failed request says (RFC 9457). Every layer of the server fills this one type;
 * codec/encode.c writes it and http/reply.c sends it. */
#ifndef SERVER_PROBLEM_DETAILS_H
#define SERVER_PROBLEM_DETAILS_H

#include <stdint.h>

typedef struct {
    int status;        /* HTTP status; 0: no problem */
    char code[48];     /* stable machine name: "json_syntax", "unknown_key", "not_found", ... */
    char title[80];    /* the same for every problem of this code */
    char detail[512];  /* this problem: what is wrong and what to do */
    char pointer[192]; /* JSON pointer into the request, "" if none */
    int64_t line;      /* line of the Matrix Market text or of the JSON text, 0 if none */
} problem_details;

/* Fills *out with a formatted sentence as its detail; what is no printable ASCII in it becomes '?'. Returns false, so
 * that a failing check ends in `return problem_fill(...)`. */
_Bool problem_fill(problem_details *out, int status, const char *code, const char *title, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

#endif
