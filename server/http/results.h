/* results.h: what a job leaves behind: the parts that result, vtu and pictures share. */
#ifndef SERVER_HTTP_RESULTS_H
#define SERVER_HTTP_RESULTS_H

#include "http/fields.h"
#include "http/api.h"

/* What the store has, and what is computed from it. */
#define STORED ((unsigned)(UZ_FIELD_REACTIONS | UZ_FIELD_GAPS | UZ_FIELD_DISPLACEMENTS | UZ_FIELD_PRESSURE))
#define COMPUTED                                                                                                       \
    ((unsigned)(UZ_FIELD_CONTACT_STATUS | UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL | UZ_FIELD_VON_MISES |                  \
                UZ_FIELD_STRAIN | UZ_FIELD_STRESS_GAUSS))

/* The answer of an ended job never changes: its tag follows from which one it is and what is asked of it. True: the
 * client has it, and the reply says so. */
bool results_known(const http_request *rq, const job *j, http_reply *reply);

/* A job, or one of its cases. */
typedef struct {
    int64_t number;      /* 0: the job has no cases */
    const char *name;    /* NULL with it */
    const char *summary; /* JSON text */
    store_case *cases;   /* what the texts live in */
    size_t count;
} results_place;
/* name NULL: none is asked for. False with a reply, also where the job has cases and none is named; `what` each of them
 * has of its own. The caller clears *out in every case. */
bool results_one(results_place *out, api *context, const job *j, const char *name, const char *what, http_reply *reply);
void results_place_clear(results_place *place);

#endif
