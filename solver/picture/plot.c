#include "picture/plot.h"

#include "core/error.h"

#include <math.h>

enum { WIDTH = 900, LEFT = 66 }; /* pixels; of the title */

static const char LIGHT[] = "text{font:12px system-ui,sans-serif;fill:#333}.title{font-weight:600}.paper{fill:#fff}"
                            ".grid{fill:none;stroke:#e3e6ea}.frame{fill:none;stroke:#9aa0a8}"
                            ".curve{fill:none;stroke-width:1.5;stroke-linejoin:round;stroke-linecap:round}"
                            ".curve.c0{stroke:#1864ab}.curve.c1{stroke:#c2255c}.curve.c2{stroke:#2b8a3e}"
                            ".curve.c3{stroke:#d9480f}.curve.c4{stroke:#6741d9}.curve.c5{stroke:#0b7285}"
                            ".curve.c6{stroke:#846358}.curve.c7{stroke:#5c636a}"
                            ".restart.c0{fill:#1864ab}.restart.c1{fill:#c2255c}.restart.c2{fill:#2b8a3e}"
                            ".restart.c3{fill:#d9480f}.restart.c4{fill:#6741d9}.restart.c5{fill:#0b7285}"
                            ".restart.c6{fill:#846358}.restart.c7{fill:#5c636a}.level{stroke-dasharray:6 4}";
static const char DARK[] = "text{fill:#d5d9de}.paper{fill:#16181c}.grid{stroke:#2b3036}.frame{stroke:#6b727b}"
                           ".curve.c0{stroke:#74c0fc}.curve.c1{stroke:#faa2c1}.curve.c2{stroke:#8ce99a}"
                           ".curve.c3{stroke:#ffc078}.curve.c4{stroke:#b197fc}.curve.c5{stroke:#66d9e8}"
                           ".curve.c6{stroke:#d0bfa5}.curve.c7{stroke:#adb5bd}"
                           ".restart.c0{fill:#74c0fc}.restart.c1{fill:#faa2c1}.restart.c2{fill:#8ce99a}"
                           ".restart.c3{fill:#ffc078}.restart.c4{fill:#b197fc}.restart.c5{fill:#66d9e8}"
                           ".restart.c6{fill:#d0bfa5}.restart.c7{fill:#adb5bd}";

uz_status uz_plot_width(int *width, const uz_plot *how, uz_error *err)
{
    *width = how->width != 0 ? how->width : WIDTH;
    if (*width < 300 || *width > 4000)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "the width of a diagram must lie in 300 to 4000, it is %d", *width);
    return UZ_OK;
}

void uz_plot_put_head(uz_buffer *svg, const uz_plot *how, int height)
{
    uz_buffer_print(svg,
                    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
                    "role=\"img\">\n<title>",
                    how->width, height, how->width, height);
    uz_buffer_put_escaped(svg, how->title);
    uz_buffer_print(svg, "</title>\n");
    uz_buffer_print(svg, "<style>");
    uz_buffer_put(svg, LIGHT, sizeof LIGHT - 1);
    if (how->theme == UZ_THEME_AUTO)
        uz_buffer_print(svg, "@media(prefers-color-scheme:dark){");
    if (how->theme != UZ_THEME_LIGHT)
        uz_buffer_put(svg, DARK, sizeof DARK - 1);
    uz_buffer_print(svg, "%s</style>\n", how->theme == UZ_THEME_AUTO ? "}" : "");
    uz_buffer_print(svg, "<rect class=\"paper\" width=\"%d\" height=\"%d\"/>\n<text class=\"title\" x=\"%d\" y=\"22\">",
                    how->width, height, LEFT);
    uz_buffer_put_escaped(svg, how->title);
    uz_buffer_print(svg, "</text>\n");
}

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
    return (uz_panel){left, top, width, height, x, y, log, false};
}

void uz_panel_log_x(uz_panel *panel, uz_range x)
{
    panel->x = x.low <= x.high ? uz_range_decades(x) : (uz_range){0.0, 1.0};
    panel->log_x = true;
}

/* x: an exponent on a logarithmic axis. */
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
    if (!uz_axis_has(x, panel->log_x) || !uz_axis_has(y, panel->log))
        return false;
    *px = across(panel, panel->log_x ? log10(x) : x);
    *py = up(panel, panel->log ? log10(y) : y);
    return true;
}

void uz_panel_put_axes(uz_buffer *svg, const uz_panel *panel, const char *name, bool x_numbers)
{
    uz_buffer_print(svg, "<text class=\"title\" x=\"%.1f\" y=\"%.1f\">", panel->left, panel->top - 6);
    uz_buffer_put_escaped(svg, name);
    uz_buffer_print(svg, "</text>\n");
    double step = step_of(panel->x, panel->width, ROOM_X, panel->log_x);
    const double foot = panel->top + panel->height;
    for (int64_t k = (int64_t)ceil(panel->x.low / step - 1e-9); k <= (int64_t)floor(panel->x.high / step + 1e-9); k++) {
        const double x = across(panel, (double)k * step);
        uz_buffer_print(svg, "<path class=\"grid\" d=\"M%.2f %.2fV%.2f\"/>", x, panel->top, foot);
        if (x_numbers)
            uz_buffer_print(svg, "<text class=\"x\" x=\"%.2f\" y=\"%.1f\" text-anchor=\"middle\">%s%.10g</text>", x,
                            foot + 15, panel->log_x ? "1e" : "", (double)k * step);
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

void uz_panel_put_rings(uz_buffer *svg, const uz_panel *panel, const uz_curve_of *curve, int colour)
{
    for (int64_t i = 0; i < curve->x.count && !svg->failed; i++) {
        point at;
        if (place(&at.x, &at.y, panel, uz_column_at(curve->x, i), uz_curve_value(curve, i)))
            uz_buffer_print(svg, "<circle class=\"curve c%d\" cx=\"%.2f\" cy=\"%.2f\" r=\"3\"/>\n", colour, at.x, at.y);
    }
}

void uz_panel_put_level(uz_buffer *svg, const uz_panel *panel, double y, const char *name, int colour)
{
    if (!uz_axis_has(y, panel->log))
        return;
    const double at = up(panel, panel->log ? log10(y) : y), right = panel->left + panel->width;
    uz_buffer_print(svg,
                    "<path class=\"curve c%d level\" d=\"M%.2f %.2fH%.2f\"/><text x=\"%.2f\" y=\"%.2f\" "
                    "text-anchor=\"end\">",
                    colour, panel->left, at, right, right - 6, at - 5);
    uz_buffer_put_escaped(svg, name);
    uz_buffer_print(svg, "</text>\n");
}
