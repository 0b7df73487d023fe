/* plot.h: curves drawn with characters: a convergence history, read from the service's CSV as columns of numbers, and
 * one number over another. */
#ifndef CLIENT_PLOT_H
#define CLIENT_PLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum { CLIENT_ITERATION, CLIENT_ERROR_BOUND, CLIENT_RESIDUAL, CLIENT_RESTART, CLIENT_COLUMNS } client_column;

typedef struct {
    size_t count;
    double *column[CLIENT_COLUMNS]; /* count each; NaN: no number there */
} client_series;

/* Reads CSV with a header line that names at least iteration, error_bound, residual_total and restart, in any order
 * among others. False: message says why. The caller clears *out. */
bool client_series_read(client_series *out, const char *csv, char *message, size_t size);
void client_series_clear(client_series *series);

typedef struct {
    int width, height; /* of the whole drawing in characters and lines; at least 24 x 8 */
    bool ascii;        /* plain ASCII, one point per character; else UTF-8 with Braille cells, 2 x 4 points each */
    bool colour;       /* ANSI colours */
} client_plot_style;

/* Draws log10 of the error bound (solid) and of the residual (dotted) over the iterations, restarts on the axis.
 * False: no memory, or nothing to draw (no row with a positive number); nothing was printed then. */
bool client_plot_print(FILE *to, const client_series *series, const client_plot_style *style);

/* Draws y over x (count each) as a line from point to point in their order, zero on both axes, under a line that names
 * them. False: as above, where no point has two numbers. */
bool client_plot_curve(FILE *to, const double *x, const double *y, size_t count, const char *names,
                       const client_plot_style *style);

#endif
