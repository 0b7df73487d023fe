/* plot.h: a convergence history drawn with characters. */
#ifndef CLIENT_PLOT_H
#define CLIENT_PLOT_H

#include "show/series.h"

#include <stdbool.h>
#include <stdio.h>

typedef struct {
    int width, height; /* of the whole drawing in characters and lines; at least 24 x 8 */
    bool ascii;        /* plain ASCII, one point per character; else UTF-8 with Braille cells, 2 x 4 points each */
    bool colour;       /* ANSI colours */
} client_plot_style;

/* Draws log10 of the error bound (solid) and of the residual (dotted) over the iterations, restarts on the axis.
 * False: no memory, or nothing to draw (no row with a positive number); nothing was printed then. */
bool client_plot_print(FILE *to, const client_series *series, const client_plot_style *style);

#endif
