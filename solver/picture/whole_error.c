/* whole_error.c: what accuracy cost, as a diagram: the whole error over seconds, and over unknowns. */
#include "picture/plot.h"

#include <math.h>

/* Pixels: around the panels, above each, their height, and what is below with the numbers of x and its name. */
enum { LEFT = 66, RIGHT = 24, HEAD = 34, ABOVE = 28, TALL = 190, BELOW = 40 };

static void put_panel(uz_buffer *svg, const uz_error_curve *curve, const double *x, const char *name, double top,
                      int width)
{
    const uz_curve_of of = {.x = {x, curve->count, 1}, .y = {curve->error, curve->count, 1}, .minuend = NAN};
    const double levels[] = {curve->asked, curve->mesh};
    uz_range across = UZ_RANGE_NONE, up = UZ_RANGE_NONE;
    for (int64_t i = 0; i < curve->count; i++) {
        uz_range_take(&across, x[i], true);
        uz_range_take(&up, curve->error[i], true);
    }
    for (int k = 0; k < 2; k++)
        uz_range_take(&up, levels[k], true);
    uz_panel panel = uz_panel_make(LEFT, top, width - LEFT - RIGHT, TALL, across, up, true);
    uz_panel_log_x(&panel, across);
    uz_panel_put_axes(svg, &panel, curve->guaranteed ? "whole error, guaranteed" : "whole error, estimated", true);
    uz_panel_put_level(svg, &panel, curve->asked, "asked for", 1);
    uz_panel_put_level(svg, &panel, curve->mesh, "of the mesh", 2);
    uz_panel_put_curve(svg, &panel, &of, 0);
    if (curve->grids)
        uz_panel_put_rings(svg, &panel, &of, 0);
    uz_buffer_print(svg, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", width - RIGHT, top + TALL + 32,
                    name);
}

uz_status uz_picture_whole_error(char **svg, size_t *len, const uz_error_curve *curve, const uz_plot *how,
                                 uz_error *err)
{
    uz_plot plot = *how;
    uz_buffer text = {0};
    *svg = NULL;
    *len = 0;
    if (uz_plot_width(&plot.width, how, err) != UZ_OK)
        return UZ_ERR_ARGUMENT;
    plot.title = how->title ? how->title : "whole error";
    uz_plot_put_head(&text, &plot, HEAD + (curve->grids ? 2 : 1) * (ABOVE + TALL + BELOW));
    put_panel(&text, curve, curve->seconds, "seconds since the beginning", HEAD + ABOVE, plot.width);
    if (curve->grids)
        put_panel(&text, curve, curve->unknowns, "unknowns of each grid", HEAD + 2 * ABOVE + TALL + BELOW, plot.width);
    if (curve->count == 0)
        uz_buffer_print(&text, "<text x=\"%d\" y=\"%d\">nothing was recorded</text>\n", LEFT + 12, HEAD + ABOVE + 24);
    uz_buffer_print(&text, "</svg>\n");
    const uz_status status = uz_buffer_finish(svg, len, &text, err);
    uz_buffer_drop(&text);
    return status;
}
