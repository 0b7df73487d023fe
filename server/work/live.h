/* live.h: what is known of a solve while it runs: its convergence history, bounded, and its progress.
 *
 * One writer, the process that solves; readers are threads of the daemon. They share memory and no lock: the writer may
 * be killed at any instruction, and must not be able to hold up a reader. What changes is counted before and after
 * (a sequence lock: Boehm, "Can seqlocks get along with programming language memory models?", MSPC 2012); a reader that
 * met a change tries again, a bounded number of times, and then takes what it has: numbers to be shown, no answers. */
#ifndef SERVER_WORK_LIVE_H
#define SERVER_WORK_LIVE_H

#include "codec/codec.h"
#include "uzawa.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* Rows kept. When there are more, every second one goes and only iterations that are multiples of a doubled stride
 * come in, so that a run of any length takes this room. The full history comes with the result. */
#define LIVE_ROWS 4096

/* In words of 8 bytes. */
typedef struct {
    int64_t read;                         /* 0: the request was not read yet, nothing else is set */
    int64_t n_cases, current;             /* n_cases 0: the job has none; the one that runs */
    int64_t count, stride;                /* rows */
    int64_t thinned;                      /* times that rows went; odd: they are moving */
    int64_t any;                          /* 0: there is no latest row */
    double latest[CODEC_HISTORY_COLUMNS]; /* kept or not */
    double first, value, target;          /* of the measured error: at the start (0: none yet), now, at the end */
    int64_t max_iterations;
    double from, to; /* shares of the whole that what runs begins and ends with; 0, 0: it is the whole */
    /* The search for a grid: the one that is solved, from 1 (0: there is no search), its unknowns, the error of the one
     * before and what is asked for; when it is expected to end, on the monotonic clock (NaN: not known). */
    int64_t grid;
    double unknowns, grid_error, grid_asked, ends;
} live_state;

enum { LIVE_WORDS = sizeof(live_state) / 8 };

/* What is shared; all zero bytes are fine as a start. */
typedef struct {
    atomic_uint_fast64_t turn; /* odd: the words change */
    atomic_uint_fast64_t words[LIVE_WORDS];
    atomic_uint_fast64_t rows[LIVE_ROWS][CODEC_HISTORY_COLUMNS]; /* bits of doubles */
} live;

/* ---- the writer's side; from live_reset to live_begin nobody writes */
typedef struct {
    live *shared;
    live_state state;
    bool paper; /* the error measured is ||rho - r||, else the certified relative error */
} live_writer;

void live_begin(live_writer *w, live *shared, const uz_settings *settings, const uz_problem *problem);
/* A load case begins, of this part of the whole (0, 0: it is the whole): rows are its own from here on. */
void live_restart(live_writer *w, int64_t current, double from, double to);
/* Another grid begins, at this time on the monotonic clock. */
void live_grid(live_writer *w, const uz_grid_start *grid, double now);
void live_add(live_writer *w, const uz_history_row *row);

/* ---- the reader's side */
/* Before a job, when no writer lives. */
void live_reset(live *l);
live_state live_read(const live *l);
/* 0..100: 1 claimed, 5 read, 10 to 95 the iterations on a logarithmic scale of the error, from its first value to the
 * one asked for, or by their share of the largest number allowed where that is more; each of n load cases counts as an
 * nth of that. Never less than `before`. */
int live_progress(const live *l, int before);
/* The grid that a search for one solves on; now: on the monotonic clock. */
job_grid live_job_grid(const live *l, double now);
/* The kept rows with iteration > after, and the latest; the caller frees. False: no memory. */
bool live_rows(const live *l, int64_t after, double **rows, int64_t *count);

#endif
