#include "show/plot.h"
#include "text/axis.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the history */

static const char *const NAMES[CLIENT_COLUMNS] = {"iteration", "error_bound", "residual_total", "restart"};

void client_series_clear(client_series *series)
{
    for (int i = 0; i < CLIENT_COLUMNS; i++)
        free(series->column[i]);
    *series = (client_series){0};
}

static const char *next_line(const char *line)
{
    line += strcspn(line, "\r\n");
    return line + strspn(line, "\r\n");
}

bool client_series_read(client_series *out, const char *csv, char *message, size_t size)
{
    int place[CLIENT_COLUMNS];
    client_series series = {0};
    *out = series;
    for (int i = 0; i < CLIENT_COLUMNS; i++) {
        const char *cell = csv;
        place[i] = -1;
        for (int at = 0; place[i] < 0; at++) {
            const size_t len = strcspn(cell, ",\r\n");
            if (len == strlen(NAMES[i]) && memcmp(cell, NAMES[i], len) == 0)
                place[i] = at;
            if (cell[len] != ',')
                break;
            cell += len + 1;
        }
        if (place[i] < 0) {
            snprintf(message, size, "the history has no column \"%s\"", NAMES[i]);
            return false;
        }
    }
    const char *line = next_line(csv);
    size_t lines = 1;
    for (const char *at = line; *at; at = next_line(at))
        lines++;
    for (int i = 0; i < CLIENT_COLUMNS; i++) {
        series.column[i] = calloc(lines, sizeof(double));
        if (!series.column[i]) {
            snprintf(message, size, "no memory");
            client_series_clear(&series);
            return false;
        }
    }
    for (; *line; line = next_line(line), series.count++)
        for (int i = 0; i < CLIENT_COLUMNS; i++) { /* NaN where there is no number */
            const char *cell = line;
            for (int at = 0; cell && at < place[i]; at++) {
                cell += strcspn(cell, ",\r\n");
                cell = *cell == ',' ? cell + 1 : NULL;
            }
            char *end = NULL;
            const bool truth = cell && strncmp(cell, "true", 4) == 0;
            const double value = cell && !truth ? strtod(cell, &end) : NAN;
            const bool number = end && end != cell && strchr(",\r\n", *end);
            series.column[i][series.count] = truth ? 1 : number ? value : (double)NAN;
        }
    *out = series;
    return true;
}

/* ---- the drawing */

#define MARGIN       10 /* characters left of the first cell, the axis included */
#define LEGEND_WIDTH 56
#define MOST_DECADES 40 /* smaller values are drawn at the bottom */

enum { SOLID = 1, DOTTED = 2 }; /* bits of a point */

/* The drawing area: cells of sx x sy points. */
typedef struct {
    int cols, rows, sx, sy;
    int across, down;      /* points: cols sx, rows sy */
    unsigned char *points; /* down x across */
    bool decades;          /* what is drawn are logarithms, over iterations */
    double low, high;      /* at bottom and top: decades or numbers */
    double first, last;    /* at the left and the right edge */
    unsigned travelled;    /* points passed by the lines so far */
    const client_plot_style *style;
} canvas;

static bool begin(canvas *c)
{
    c->cols = c->style->width - MARGIN;
    c->rows = c->style->height - 3;
    c->sx = c->style->ascii ? 1 : 2;
    c->sy = c->style->ascii ? 1 : 4;
    c->across = c->cols * c->sx;
    c->down = c->rows * c->sy;
    c->points = c->cols > 0 && c->rows > 0 ? calloc((size_t)c->across, (size_t)c->down) : NULL;
    return c->points != NULL;
}

static int across(const canvas *c, double at)
{
    return (int)lround((at - c->first) / (c->last - c->first) * (c->across - 1));
}

/* 0 is the top. */
static int down(const canvas *c, double value)
{
    double part = (c->high - value) / (c->high - c->low);
    return (int)lround(fmin(fmax(part, 0), 1) * (c->down - 1));
}

/* A dotted line is two points on, two off along its path, so that the two lines differ without colour too. */
static void set_point(canvas *c, int x, int y, unsigned char mark)
{
    if (mark == DOTTED && c->sx > 1 && c->travelled % 4 >= 2)
        return;
    c->points[(size_t)y * (size_t)c->across + (size_t)x] |= mark;
}

/* Lines between numbers that are there. */
static void draw_line(canvas *c, const double *x, const double *y, size_t count, unsigned char mark)
{
    int previous[2] = {0, 0};
    bool have_previous = false;
    for (size_t i = 0; i < count; i++) {
        if (!uz_axis_has(y[i], c->decades) || !(x[i] >= c->first && x[i] <= c->last)) {
            have_previous = false;
            continue;
        }
        int here[2] = {across(c, x[i]), down(c, c->decades ? log10(y[i]) : y[i])};
        const int *from = have_previous ? previous : here;
        const int dx = here[0] - from[0], dy = here[1] - from[1];
        const int steps = abs(dx) > abs(dy) ? abs(dx) : abs(dy);
        set_point(c, from[0], from[1], mark);
        for (int k = 1; k <= steps; k++) {
            const double part = (double)k / steps;
            c->travelled++;
            set_point(c, from[0] + (int)lround(part * dx), from[1] + (int)lround(part * dy), mark);
        }
        memcpy(previous, here, sizeof here);
        have_previous = true;
    }
}

static void print_marked(FILE *to, const client_plot_style *style, unsigned marks, const char *text)
{
    const char *colour = marks & SOLID ? "\033[36m" : "\033[33m";
    if (style->colour && marks)
        fprintf(to, "%s%s\033[0m", colour, text);
    else
        fputs(text, to);
}

static int format_place(char text[24], const canvas *c, double at)
{
    return snprintf(text, 24, c->decades ? "%.0f" : "%.3g", at);
}

/* Centred under its tick, as long as it fits between column `used` and column `end`. Returns the columns used. */
static int print_place(FILE *to, const canvas *c, double at, int used, int end)
{
    char text[24];
    int len = format_place(text, c, at);
    int start = MARGIN + across(c, at) / c->sx - (at > c->first ? len / 2 : 0);
    bool last = at >= c->last;
    if (last)
        start = end - len;
    if (start < used || start + len > end)
        return used;
    return used + fprintf(to, "%*s%s", start - used, "", text);
}

static double step_of_decades(double least)
{
    static const int STEPS[] = {1, 2, 3, 5, 10, 20};
    for (size_t i = 0; i < sizeof STEPS / sizeof *STEPS; i++)
        if (STEPS[i] >= least)
            return STEPS[i];
    return MOST_DECADES;
}

/* What is written beside a row; false: nothing. Steps between labels are the smallest that leave each two rows of its
 * own. */
static bool label_row(char label[24], const canvas *c, int row)
{
    const double least = 2 * ((c->high - c->low) / c->rows),
                 step = c->decades ? step_of_decades(least) : uz_round_step(least);
    for (double k = floor(c->high / step); k * step >= c->low; k--)
        if (down(c, k * step) / c->sy == row) {
            snprintf(label, 24, c->decades ? "1e%+03.0f" : "%.3g", k == 0 ? 0 : k * step);
            return true;
        }
    return false;
}

/* The lines of the drawing: in the margin the label that falls into the row, if any; then the cells. */
static void print_rows(FILE *to, const canvas *c)
{
    /* Bit of each point of a Braille cell, by row and column (Unicode 15, section 21.1). */
    static const unsigned BRAILLE[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    const bool ascii = c->style->ascii;
    for (int row = 0; row < c->rows; row++) {
        char label[24];
        if (label_row(label, c, row))
            fprintf(to, "%*s %s", MARGIN - 2, label, ascii ? "+" : "┤");
        else
            fprintf(to, "%*s%s", MARGIN - 1, "", ascii ? "|" : "│");
        for (int col = 0; col < c->cols; col++) {
            unsigned bits = 0, marks = 0; /* marks: which lines pass through the cell */
            for (int y = 0; y < c->sy; y++)
                for (int x = 0; x < c->sx; x++) {
                    const size_t at = (size_t)(row * c->sy + y) * (size_t)c->across + (size_t)(col * c->sx + x);
                    marks |= c->points[at];
                    bits |= c->points[at] ? BRAILLE[y][x] : 0;
                }
            char braille[4] = {(char)0xe2, (char)(0xa0 | bits >> 6), (char)(0x80 | (bits & 0x3f)), '\0'};
            const char *plain = marks & SOLID ? "*" : marks & DOTTED ? "." : " ";
            print_marked(to, c->style, marks, ascii ? plain : bits ? braille : " ");
        }
        fputc('\n', to);
    }
}

/* The axis with its ticks and, of a history (NULL: none), the restarts, and the labels below it. */
static void print_axis(FILE *to, const canvas *c, const client_series *s)
{
    const bool ascii = c->style->ascii;
    /* Between labels: 1, 2 or 5 times a power of ten, about one label for 14 cells. */
    const double wide = (c->last - c->first) * 14 / c->cols, step = uz_round_step(c->decades ? fmax(wide, 1) : wide),
                 first = ceil(c->first / step) * step;
    char text[24];
    fprintf(to, "%*s%s", MARGIN - 1, "", ascii ? "+" : "└");
    for (int col = 0; col < c->cols; col++) {
        bool restart = false, label = false;
        for (size_t i = 0; s && i < s->count && !restart; i++)
            restart = s->column[CLIENT_RESTART][i] > 0 && s->column[CLIENT_ITERATION][i] <= c->last &&
                      across(c, s->column[CLIENT_ITERATION][i]) / c->sx == col;
        for (double at = first; at <= c->last && !label; at += step)
            label = across(c, at) / c->sx == col;
        if (restart)
            fputs(ascii ? "^" : "▲", to);
        else if (label)
            fputs(ascii ? "+" : "┬", to);
        else
            fputs(ascii ? "-" : "─", to);
    }
    fputc('\n', to);
    int end = MARGIN + c->cols, room = format_place(text, c, c->last) + 2;
    int used = fprintf(to, "%*s ", MARGIN - 1, s ? "iteration" : "");
    for (double at = first; at < c->last; at += step)
        used = print_place(to, c, at, used, end - room);
    print_place(to, c, c->last, used, end);
    fputc('\n', to);
}

bool client_plot_print(FILE *to, const client_series *series, const client_plot_style *style)
{
    canvas c = {.style = style, .decades = true};
    /* The iterations and decades that the drawing must hold. */
    uz_range values = UZ_RANGE_NONE;
    for (size_t i = 0; i < series->count; i++) {
        const double at = series->column[CLIENT_ITERATION][i];
        for (int k = CLIENT_ERROR_BOUND; k <= CLIENT_RESIDUAL; k++) {
            const double value = series->column[k][i];
            if (!uz_axis_has(value, true) || !isfinite(at) || at < 0)
                continue;
            uz_range_take(&values, value, true);
            c.last = fmax(c.last, at);
        }
    }
    if (values.low > values.high || !begin(&c))
        return false;
    const uz_range decades = uz_range_decades(values);
    c.high = decades.high;
    c.low = fmax(decades.low, c.high - MOST_DECADES);
    c.last = fmax(c.last, 1);
    const double *at = series->column[CLIENT_ITERATION];
    draw_line(&c, at, series->column[CLIENT_RESIDUAL], series->count, DOTTED);
    draw_line(&c, at, series->column[CLIENT_ERROR_BOUND], series->count, SOLID);
    const bool narrow = style->width < LEGEND_WIDTH;
    fprintf(to, "%*s", narrow ? 0 : MARGIN, "");
    print_marked(to, style, SOLID, style->ascii ? "**" : "⠒⠒");
    fputs(narrow ? " bound " : " error bound   ", to);
    print_marked(to, style, DOTTED, style->ascii ? ".." : "⠑⠡");
    fputs(narrow ? " residual\n" : " KKT residual   ", to);
    if (!narrow)
        fprintf(to, "%s restart\n", style->ascii ? "^" : "▲");
    print_rows(to, &c);
    print_axis(to, &c, series);
    free(c.points);
    return true;
}

bool client_plot_curve(FILE *to, const double *x, const double *y, size_t count, const char *names,
                       const client_plot_style *style)
{
    canvas c = {.style = style};
    uz_range wide = {0, 0}, high = {0, 0};
    bool any = false;
    for (size_t i = 0; i < count; i++) {
        if (!uz_axis_has(x[i], false) || !uz_axis_has(y[i], false))
            continue;
        uz_range_take(&wide, x[i], false);
        uz_range_take(&high, y[i], false);
        any = true;
    }
    if (!any || !begin(&c))
        return false;
    c.first = wide.low;
    c.last = wide.high > wide.low ? wide.high : wide.low + 1;
    c.low = high.low;
    c.high = high.high > high.low ? high.high : high.low + 1;
    draw_line(&c, x, y, count, SOLID);
    const bool narrow = MARGIN + (int)strlen(names) > style->width;
    fprintf(to, "%*s%.*s\n", narrow ? 0 : MARGIN, "", style->width, names);
    print_rows(to, &c);
    print_axis(to, &c, NULL);
    free(c.points);
    return true;
}
