/* milestones.h: when a run first established each bound on its error, noted where the bounds are made anyway. */
#ifndef UZ_MILESTONES_H
#define UZ_MILESTONES_H

#include "uzawa.h"

typedef struct uz_milestones {
    uz_trade trade;
    double base, since; /* seconds of the solve, and uz_seconds() when they were read */
    int reached;        /* the first of the steps that is not noted yet */
    bool partial;       /* some of the contact rows are left out: bounds are about the others */
} uz_milestones;

void uz_milestones_init(uz_milestones *d, bool partial);
/* The solve has taken so many seconds until now; in a block the clock stands still while others have their turn. */
void uz_milestones_resume(uz_milestones *d, double spent_s);
/* The iterations ended, for now. */
void uz_milestones_pause(uz_milestones *d);
/* What a bound is of. */
typedef enum {
    UZ_MILESTONE_OF_ITERATION,
    /* The certificate of the answer that the iterations gave, in a partial run on the rows kept. Bounds of theirs below
     * it are taken back: the original data do not confirm them. */
    UZ_MILESTONE_OF_CERTIFICATE,
    /* The first certificate about all rows of a partial run. With c its bound and b that of an iterate on the rows
     * kept, whose solution is within c of that on all rows, the iterate is within b (1 + c) + c: what was noted stands
     * where that is enough. */
    UZ_MILESTONE_OF_ALL_ROWS
} uz_milestone_of;
/* A bound on the relative error. d NULL: nobody keeps it. */
void uz_milestones_note(uz_milestones *d, uz_milestone_of of, double bound, int64_t iterations, int64_t applications);
/* What is above this bound stands; NaN: nothing. */
void uz_milestones_drop(uz_milestones *d, double bound);

/* So many seconds went before. */
void uz_trade_shift(uz_trade *trade, double seconds);

#endif
