/* plot.h: one panel of a diagram in SVG: axes with ticks, and curves with no more points than can be seen. */
#ifndef UZ_PICTURE_PLOT_H
#define UZ_PICTURE_PLOT_H

#include "text/axis.h"
#include "text/buffer.h"
#include "uzawa.h"

/* The beginning of the file: size, colours of curves c0 to c7 in the theme, paper and title. */
void uz_plot_put_head(uz_buffer *svg, const uz_plot *how, int height);
/* The width that is asked for, by default 900; UZ_ERR_ARGUMENT where there is no such picture. */
uz_status uz_plot_width(int *width, const uz_plot *how, uz_error *err);

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
    uz_range x, y;   /* what the edges stand for; of logarithmic ones whole powers of ten */
    bool log, log_x; /* of y; of x */
} uz_panel;

/* y is widened to whole decades, or to ticks of a round step from 0 on. */
uz_panel uz_panel_make(double left, double top, double width, double height, uz_range x, uz_range y, bool log);
/* x, a range of positive numbers, becomes logarithmic, too, and goes to whole decades. */
void uz_panel_log_x(uz_panel *panel, uz_range x);

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
/* A ring at each point. */
void uz_panel_put_rings(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, int colour);
/* A dashed line at y over the whole width, and what it is; nothing where y has no place. */
void uz_panel_put_level(uz_buffer *svg, const uz_panel *panel, double y, const char *name, int colour);
double uz_curve_value(const uz_curve_of *curve, int64_t i);

#endif
