/* baseline.h: what has changed since another job. */
#ifndef CLIENT_BASELINE_H
#define CLIENT_BASELINE_H

#include "show/checks.h"
#include "commands/run.h"

/* Compares an ended job that has an answer with the baseline `id`, case by case where they have load cases: energy, sum
 * of the reactions, largest pressure and displacements may differ by `tolerance`, relative to the larger of the two,
 * and so may the sets of what touches, as a part of what touches in either. Adds a check for each. Fetches both
 * results, one case at a time. Not CLIENT_OK: one could not be had, said on s->err. */
client_exit client_baseline_compare(client_session *s, client_checks *to, const json_t *job, const char *id,
                                    double tolerance);

/* The same of two results (GET /v1/jobs/{id}/result with reactions, displacements and nodes). group: the load case. */
void client_baseline_results(client_checks *to, const char *group, const json_t *now, const json_t *then,
                             double tolerance);

#endif
