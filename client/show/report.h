/* report.h: the service's JSON said in words. */
#ifndef CLIENT_REPORT_H
#define CLIENT_REPORT_H

#include "local/exit_codes.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* The value at a path of object keys, "certificate.residual.e1"; NULL if it is not there. Borrowed. */
const json_t *client_json_at(const json_t *object, const char *path);
/* The number there, NaN if there is none; the text there, "" if there is none. */
double client_json_number(const json_t *object, const char *path);
const char *client_json_text(const json_t *object, const char *path);

bool client_job_ended(const json_t *job);
/* How a pipeline is told about an ended job. */
client_exit client_job_exit(const json_t *job);

/* A job's state; its tags and times; no summary. */
void client_print_job(FILE *to, const json_t *job);
/* Its tags, safe for a terminal, with the separator between them. */
void client_print_tags(FILE *to, const json_t *job, const char *separator);
/* A cell of a table: at most `width` characters of the text, safe for a terminal, filled up with blanks to that, and
 * two more. */
void client_print_cell(FILE *to, const char *text, int width);
/* A cell of CSV: in quotes, those inside doubled (RFC 4180). */
void client_print_quoted(FILE *to, const char *text);
/* What came of an ended job, about 15 lines. Parts that the job lacks are left out. */
void client_print_summary(FILE *to, const json_t *job);
/* A line for each load case of a result. */
void client_print_cases(FILE *to, const json_t *result);
/* Problem details (RFC 9457) with all mistakes that they list, or a plain line about the status where the reply has
 * none. */
void client_print_problem(FILE *to, long http_status, const json_t *problem);

/* A request that was only checked: "valid: 660 unknowns, ...", with the label before it where there is one. */
void client_print_valid(FILE *to, const char *label, const json_t *valid);

/* "12.3 ms"; buffer of at least 16. */
const char *client_format_seconds(char *buffer, size_t size, double seconds);
/* An upper bound with two digits, never shown smaller than it is; "inf" and "nan" as they are. */
const char *client_format_bound(char buffer[32], double bound);
/* A summary's whole error: a bound, "about 0.022" of an estimate, "unknown". */
const char *client_format_error(char buffer[32], const json_t *summary);
/* A quantity of a summary: "force 12.3 within 0.2 (1.6 %), by estimate; 12.5 on this mesh". */
enum { CLIENT_QUANTITY = 256 };
const char *client_format_quantity(char buffer[CLIENT_QUANTITY], const json_t *quantity);

#endif
