/* contract.h: what has changed since another job. */
#ifndef CLIENT_CONTRACT_H
#define CLIENT_CONTRACT_H

#include "commands/run.h"

/* Compares two results (GET /v1/jobs/{id}/result with reactions, displacements and nodes): energy, sum of the
 * reactions, largest pressure and displacements may differ by `tolerance`, relative to the larger of the two, and so
 * may the sets of what touches, as a part of what touches in either. Adds a check for each. group: the load case. */
void client_baseline_results(client_checks *to, const char *group, const json_t *now, const json_t *then,
                             double tolerance);

#endif
