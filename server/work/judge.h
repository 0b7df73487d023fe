/* judge.h: what became of a request's assertions. */
#ifndef SERVER_WORK_JUDGE_H
#define SERVER_WORK_JUDGE_H

#include "codec/codec.h"

/* Adds to a summary of this service (malloc'ed, replaced) what became of the request's assertions, as `assertions` and
 * `assertions_passed`; without assertions it stays as it is. name: of the case that the summary is of, NULL: the job
 * has none. all: n_assertions findings that begin zeroed, which gather those of every case; NULL where there are none.
 * whole: the summary is that of all cases together, once each of them was judged. False: no memory. */
bool judge(char **summary, const codec_request *request, const char *name, bool whole, codec_finding *all);

#endif
