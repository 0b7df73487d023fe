/* series.h: a convergence history as columns of numbers, read from the service's CSV. */
#ifndef CLIENT_SERIES_H
#define CLIENT_SERIES_H

#include <stdbool.h>
#include <stddef.h>

typedef enum { CLIENT_ITERATION, CLIENT_ERROR_BOUND, CLIENT_RESIDUAL, CLIENT_RESTART, CLIENT_COLUMNS } client_column;

typedef struct {
    size_t count;
    double *column[CLIENT_COLUMNS]; /* count each; NaN: no number there */
} client_series;

/* Reads CSV with a header line that names at least iteration, error_bound, residual_total and restart, in any order
 * among others. False: message says why. The caller clears *out. */
bool client_series_read(client_series *out, const char *csv, char *message, size_t size);
void client_series_clear(client_series *series);

#endif
