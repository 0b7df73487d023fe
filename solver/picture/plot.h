/* plot.h: one panel of a diagram in SVG: axes with ticks, and curves with no more points than can be seen. */
#ifndef UZ_PICTURE_PLOT_H
#define UZ_PICTURE_PLOT_H

#include "text/axis.h"
#include "text/buffer.h"

/* count numbers, `stride` doubles from one to the next. */
typedef struct {
    const double *at;
    int64_t count, stride;
} uz_column;
static inline double uz_column_at(uz_column c, int64_t i)
{
    return c.at[i * c.stride];
}

/* Where numbers go: x to left..left + width, y to top + height..top. */
typedef struct {
    double left, top, width, height;
    uz_range x, y; /* what the edges stand for; of a logarithmic y whole powers of ten */
    bool log;      /* of y */
} uz_panel;

/* y is widened to whole decades, or to ticks of a round step from 0 on. */
uz_panel uz_panel_make(double left, double top, double width, double height, uz_range x, uz_range y, bool log);

/* Frame, ticks with their numbers and lines through the panel, the name above it. x_numbers: below the ticks of x. */
void uz_panel_put_axes(uz_buffer *svg, const uz_panel *panel, const char *name, bool x_numbers);

/* y - offset (or offset - y where `below`) against x, as polylines: broken where there is nothing to draw, and of the
 * points in one column of pixels only the first, the lowest, the highest and the last, so that no peak is lost and the
 * text does not grow with the history. */
typedef struct {
    uz_column x, y;
    double minuend; /* the curve is minuend - y; NaN: y itself */
} uz_curve_of;
void uz_panel_put_curve(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, int colour);
/* A mark on the curve where flag is not 0: one in each column of pixels. */
void uz_panel_put_marks(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, uz_column flag, int colour);
double uz_curve_value(const uz_curve_of *curve, int64_t i);

#endif
