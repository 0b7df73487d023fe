/* progress.h: how a job that runs is getting on, on stderr: one line that is written over on a terminal, else a line
 * every few seconds and for each change of its status. */
#ifndef CLIENT_PROGRESS_H
#define CLIENT_PROGRESS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#define CLIENT_PROGRESS_SAMPLES 32

typedef struct {
    FILE *to;
    bool shown, live;
    double start, said; /* client_clock: of the first line, of the last one */
    char status[16], last_status[16];
    double percent;                      /* NAN: not known, as the following */
    double iteration, bound, relative;   /* of the best answer held: certified, and about over the answer's own size */
    double first;                        /* relative at the first row */
    double grid, grid_error, grid_asked; /* of a job that looks for a mesh: number; error before it, and wanted */
    double grid_ends;                    /* when that is expected, by client_clock */
    int samples;                         /* the last of (seconds, log relative), as a ring */
    double at[CLIENT_PROGRESS_SAMPLES], value[CLIENT_PROGRESS_SAMPLES];
} client_progress;

client_progress client_progress_new(FILE *to, bool wanted, bool quiet);
/* Takes what a job says of itself, and shows it. */
void client_progress_show(client_progress *progress, const json_t *job);
/* The same of a progress event of the stream: progress, iteration, dual_objective, error_bound. */
void client_progress_row(client_progress *progress, const json_t *event);
/* The live line again, for the time that passes and a terminal that has another width now. */
void client_progress_redraw(client_progress *progress);
/* Wipes the live line, so that the summary begins on a clean one. */
void client_progress_end(client_progress *progress);

/* Seconds until the end: of a search for a mesh what the service says; else by how the error falls, or by the per cents
 * where it does not; NAN: cannot be told. */
double client_progress_left(const client_progress *progress, double now);

/* Characters across: of the terminal behind the stream, else $COLUMNS, else `otherwise`. */
int client_columns(FILE *stream, int otherwise);

#endif
