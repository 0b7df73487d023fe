/* progress.h: a line about a job that runs, on stderr. */
#ifndef CLIENT_PROGRESS_H
#define CLIENT_PROGRESS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

typedef struct {
    FILE *to;
    bool shown, live; /* live: one line that is written over (a terminal); else a line for each change */
    double start;     /* client_clock */
    char last[32];
} client_progress;

client_progress client_progress_new(FILE *to, bool wanted, bool quiet);
void client_progress_show(client_progress *progress, const json_t *job);
/* Wipes the live line, so that the summary begins on a clean one. */
void client_progress_end(client_progress *progress);

#endif
