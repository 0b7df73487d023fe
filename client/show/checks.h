/* checks.h: what a pipeline wants to know of a job, one line each: whether it converged, what its assertions say, how
 * it compares with another. Printed, and written as JUnit (junit.h). */
#ifndef CLIENT_CHECKS_H
#define CLIENT_CHECKS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum {
    CLIENT_PASS,
    CLIENT_UNCERTAIN, /* as good as failed, but a finer answer may pass */
    CLIENT_FAIL,
    CLIENT_NO_ANSWER /* there was nothing to check */
} client_verdict;

/* All texts are its own; group: the load case, "" for none; text: what was found. */
typedef struct {
    client_verdict verdict;
    char *group, *name, *text;
} client_check;

/* Zero-initialise. failed: there was no memory for some check, and what is there is not the whole. compared: where the
 * comparison with a baseline begins, 0: there is none. */
typedef struct {
    client_check *item;
    size_t count, capacity, compared;
    bool failed;
} client_checks;

void client_checks_add(client_checks *to, client_verdict verdict, const char *group, const char *name,
                       const char *format, ...) __attribute__((format(printf, 5, 6)));
void client_checks_clear(client_checks *checks);
/* The worst verdict of checks[from..]; CLIENT_PASS of none. */
client_verdict client_checks_worst(const client_checks *checks, size_t from);

/* Whether the job ended with an answer as good as was asked for; and what became of the assertions in a summary of it.
 * group: as above. */
void client_checks_outcome(client_checks *to, const json_t *job);
void client_checks_assertions(client_checks *to, const json_t *summary, const char *group);

/* The checks from `from` on, a line each under a heading; nothing where there are none. */
void client_checks_print(FILE *to, const client_checks *checks, size_t from, const char *heading);

#endif
