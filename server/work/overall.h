/* overall.h: what the answers of many load cases come to together. */
#ifndef SERVER_WORK_OVERALL_H
#define SERVER_WORK_OVERALL_H

#include "codec/codec.h"
#include "uzawa.h"

/* results: n = problem->n_cases >= 1 of them. The summary is that of the worst case (the worst outcome; of those the
 * largest bound), so that whoever reads outcome and relative_error of a job and nothing else never takes it for better
 * than it is, with: the largest relative error of all, iterations, restarts and times over all cases, the first case's
 * factor, and a message that counts. counts->worst points into the problem. */
void overall_summary(uz_summary *out, codec_cases *counts, uz_result *const *results, const uz_problem *problem);

#endif
