/* live.h: what is known of a solve while it runs: its convergence history, bounded, and its progress.
 * Not locked: the worker's lock guards it. */
#ifndef SERVER_WORK_LIVE_H
#define SERVER_WORK_LIVE_H

#include "codec/codec.h"
#include "uzawa.h"

#include <stdbool.h>
#include <stdint.h>

/* Rows kept. When there are more, every second one goes and only iterations that are multiples of a doubled stride
 * come in, so that a run of any length takes this room. The full history comes with the result. */
#define LIVE_ROWS 4096

typedef struct {
    double (*rows)[CODEC_HISTORY_COLUMNS]; /* LIVE_ROWS of them, allocated when the first one comes */
    int64_t count, stride;
    uz_history_row latest; /* kept or not */
    bool any;              /* latest is set */
    bool paper;            /* progress by ||rho - r||, else by the certified relative error */
    double first, target;  /* of that measure: at the start (0: none yet) and where the solve ends */
    int64_t max_iterations;
    const uz_problem *problem; /* whose case runs; NULL: none runs */
    int64_t current;           /* the case that runs */
    double from, to;           /* shares of the whole that what runs begins and ends with; 0, 0: it is the whole */
    int progress;              /* the largest reported yet */
} live;

void live_reset(live *l); /* keeps the room; {0} at first */
void live_clear(live *l);
void live_begin(live *l, const uz_settings *settings, const uz_problem *problem);
/* The next load case begins: rows are its own from here on. */
void live_case(live *l, int64_t i);
/* What comes next is this part of the whole, all its load cases over again. */
void live_part(live *l, double from, double to);
void live_add(live *l, const uz_history_row *row);

/* 0..100, never less than before: 1 claimed, 5 read, 10 to 95 the iterations on a logarithmic scale of the error, from
 * its first value to the one asked for, or by their share of the largest number allowed where that is more; each of n
 * load cases counts as an nth of that. */
int live_progress(live *l);

/* The kept rows with iteration > after, and the latest; the caller frees. False: no memory. */
bool live_rows(const live *l, int64_t after, double **rows, int64_t *count);

#endif
