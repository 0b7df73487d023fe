#include "picture/plot.h"

#include <math.h>

/* Room for a number on either axis. */
enum { ROOM_X = 90, ROOM_Y = 26 };

static double step_of(uz_range range, double length, double room, bool log)
{
    const double step = uz_round_step((range.high - range.low) / fmax(1.0, floor(length / room)));
    return log ? fmax(1.0, ceil(step)) : step;
}

uz_panel uz_panel_make(double left, double top, double width, double height, uz_range x, uz_range y, bool log)
{
    if (!(x.low <= x.high))
        x = (uz_range){0.0, 1.0};
    if (!(x.high > x.low))
        x.high = x.low + 1.0;
    if (!(y.low <= y.high))
        y = (uz_range){log ? 0.1 : 0.0, 1.0};
    if (log) { /* exponents from here on */
        y = uz_range_decades(y);
    } else {
        y = (uz_range){0.0, fmax(1.0, y.high)};
        const double step = fmax(1.0, step_of(y, height, ROOM_Y, false));
        y.high = step * ceil(y.high / step);
    }
    return (uz_panel){left, top, width, height, x, y, log};
}

static double across(const uz_panel *panel, double x)
{
    return panel->left + panel->width * ((x - panel->x.low) / (panel->x.high - panel->x.low));
}

/* y: an exponent on a logarithmic axis. */
static double up(const uz_panel *panel, double y)
{
    return panel->top + panel->height * ((panel->y.high - y) / (panel->y.high - panel->y.low));
}

/* What has no place (not finite, or not positive on a logarithmic axis) has none: false. */
static bool place(double *px, double *py, const uz_panel *panel, double x, double y)
{
    if (!isfinite(x) || !uz_axis_has(y, panel->log))
        return false;
    *px = across(panel, x);
    *py = up(panel, panel->log ? log10(y) : y);
    return true;
}

void uz_panel_put_axes(uz_buffer *svg, const uz_panel *panel, const char *name, bool x_numbers)
{
    uz_buffer_print(svg, "<text class=\"title\" x=\"%.1f\" y=\"%.1f\">", panel->left, panel->top - 6);
    uz_buffer_put_escaped(svg, name);
    uz_buffer_print(svg, "</text>\n");
    double step = step_of(panel->x, panel->width, ROOM_X, false);
    const double foot = panel->top + panel->height;
    for (int64_t k = (int64_t)ceil(panel->x.low / step - 1e-9); k <= (int64_t)floor(panel->x.high / step + 1e-9); k++) {
        const double x = across(panel, (double)k * step);
        uz_buffer_print(svg, "<path class=\"grid\" d=\"M%.2f %.2fV%.2f\"/>", x, panel->top, foot);
        if (x_numbers)
            uz_buffer_print(svg, "<text class=\"x\" x=\"%.2f\" y=\"%.1f\" text-anchor=\"middle\">%.10g</text>", x,
                            foot + 15, (double)k * step);
    }
    step = step_of(panel->y, panel->height, ROOM_Y, panel->log);
    for (double k = ceil(panel->y.low / step - 1e-9); k <= floor(panel->y.high / step + 1e-9); k++) {
        const double y = up(panel, k * step);
        uz_buffer_print(svg,
                        "<path class=\"grid\" d=\"M%.2f %.2fH%.2f\"/><text class=\"y\" x=\"%.1f\" y=\"%.2f\" "
                        "text-anchor=\"end\">%s%.6g</text>",
                        panel->left, y, panel->left + panel->width, panel->left - 6, y + 4, panel->log ? "1e" : "",
                        k * step + 0.0);
    }
    uz_buffer_print(svg, "\n<rect class=\"frame\" x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\"/>\n",
                    panel->left, panel->top, panel->width, panel->height);
}

double uz_curve_value(const uz_curve_of *curve, int64_t i)
{
    const double y = uz_column_at(curve->y, i);
    return isnan(curve->minuend) ? y : curve->minuend - y;
}

typedef struct {
    double x, y;
} point;

/* The points of one column of pixels: first, lowest, highest, last, in the order in which they came. */
typedef struct {
    uz_buffer *svg;
    int colour;
    bool drawing;  /* a polyline is open */
    int64_t drawn; /* points in it */
    double column; /* NaN: none */
    int64_t count, lowest_at, highest_at;
    point first, lowest, highest, last;
} pen;

static void put_point(pen *p, point at)
{
    if (!p->drawing)
        uz_buffer_print(p->svg, "<polyline class=\"curve c%d\" points=\"", p->colour);
    uz_buffer_print(p->svg, "%s%.2f,%.2f", p->drawing ? " " : "", at.x, at.y);
    p->drawing = true;
    p->drawn++;
    p->last = at;
}

static void put_column(pen *p)
{
    if (p->count == 0)
        return;
    const bool low_first = p->lowest_at <= p->highest_at;
    const int64_t early = low_first ? p->lowest_at : p->highest_at, late = low_first ? p->highest_at : p->lowest_at;
    const point last = p->last;
    put_point(p, p->first);
    if (early > 0 && early < p->count - 1)
        put_point(p, low_first ? p->lowest : p->highest);
    if (late > early && late < p->count - 1)
        put_point(p, low_first ? p->highest : p->lowest);
    if (p->count > 1)
        put_point(p, last);
    p->count = 0;
}

/* A line of one point is drawn as a dot: its two ends are round. */
static void lift(pen *p)
{
    put_column(p);
    if (p->drawing && p->drawn == 1)
        put_point(p, p->last);
    if (p->drawing)
        uz_buffer_print(p->svg, "\"/>\n");
    p->drawing = false;
    p->drawn = 0;
    p->column = NAN;
}

void uz_panel_put_curve(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, int colour)
{
    pen p = {.svg = svg, .colour = colour, .column = NAN};
    bool gap = false;
    for (int64_t i = 0; i < curve->x.count && !svg->failed; i++) {
        point at;
        if (!place(&at.x, &at.y, panel, uz_column_at(curve->x, i), uz_curve_value(curve, i))) {
            gap = true; /* one within a column of pixels is too small to see */
            continue;
        }
        const bool same = floor(at.x) >= p.column && floor(at.x) <= p.column;
        if (!same && gap)
            lift(&p);
        else if (!same)
            put_column(&p);
        p.column = floor(at.x);
        gap = false;
        if (p.count == 0) {
            p.first = p.lowest = p.highest = at;
            p.lowest_at = p.highest_at = 0;
        }
        if (at.y > p.lowest.y) { /* down the paper */
            p.lowest = at;
            p.lowest_at = p.count;
        }
        if (at.y < p.highest.y) {
            p.highest = at;
            p.highest_at = p.count;
        }
        p.last = at;
        p.count++;
    }
    lift(&p);
}

void uz_panel_put_marks(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, uz_column flag, int colour)
{
    double column = NAN;
    bool any = false;
    for (int64_t i = 0; i < curve->x.count && !svg->failed; i++) {
        point at;
        if (!(uz_column_at(flag, i) > 0.0) ||
            !place(&at.x, &at.y, panel, uz_column_at(curve->x, i), uz_curve_value(curve, i)) ||
            (floor(at.x) >= column && floor(at.x) <= column))
            continue;
        column = floor(at.x);
        if (!any)
            uz_buffer_print(svg, "<path class=\"restart c%d\" d=\"", colour);
        any = true;
        uz_buffer_print(svg, "M%.2f %.2fl-3.5 -7h7z", at.x, at.y - 2);
    }
    if (any)
        uz_buffer_print(svg, "\"/>\n");
}
