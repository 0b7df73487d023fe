/* triangles.c: surfaces of triangles from files: what their formats share, and corners that are meant to be one. */
#include "io/triangles.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

static const struct {
    const char *name;
    uz_status (*read)(triangles_in *in, const char *text, size_t len);
} READERS[] = {
    {"stl", triangles_stl_read},
    {"obj", triangles_obj_read},
};

void uz_triangles_clear(uz_triangles *triangles)
{
    uz_free_all(triangles->x, triangles->y, triangles->z);
    memset(triangles, 0, sizeof *triangles);
}

/* ---- what readers use */

uz_status triangles_add(triangles_in *in, const double corner[3][3], int64_t line)
{
    uz_triangles *t = in->out;
    const int64_t have = 3 * t->n;
    if (in->max_bytes > 0 && 3 * sizeof(double) * (size_t)(have + 3) > in->max_bytes)
        return line > 0 ? uz_fail_line(in->err, UZ_ERR_LIMIT, line, "the surface takes more memory than allowed")
                        : uz_fail(in->err, UZ_ERR_LIMIT, "", "the surface takes more memory than allowed");
    if (have + 3 > in->room) {
        int64_t room[3] = {in->room, in->room, in->room};
        if (!uz_grow(&t->x, have, 3, &room[0], sizeof *t->x) || !uz_grow(&t->y, have, 3, &room[1], sizeof *t->y) ||
            !uz_grow(&t->z, have, 3, &room[2], sizeof *t->z))
            return uz_no_memory(in->err, "the triangles of a surface");
        in->room = room[0];
    }
    for (int k = 0; k < 3; k++) {
        t->x[have + k] = corner[k][0];
        t->y[have + k] = corner[k][1];
        t->z[have + k] = corner[k][2];
    }
    t->n++;
    return UZ_OK;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

bool triangles_next_line(triangles_text *text)
{
    while (text->next < text->end) {
        const char *from = text->next, *newline = memchr(from, '\n', (size_t)(text->end - from));
        text->line_end = newline ? newline : text->end;
        text->next = newline ? newline + 1 : text->end;
        text->number++;
        while (from < text->line_end && is_blank(*from))
            from++;
        text->line = from;
        if (from < text->line_end)
            return true;
    }
    text->line = text->line_end = text->end;
    return false;
}

bool triangles_word(const char **word, size_t *len, triangles_text *text)
{
    while (text->line < text->line_end && is_blank(*text->line))
        text->line++;
    *word = text->line;
    while (text->line < text->line_end && !is_blank(*text->line))
        text->line++;
    *len = (size_t)(text->line - *word);
    return *len > 0;
}

bool triangles_is(const char *word, size_t len, const char *what)
{
    size_t i = 0;
    for (; i < len && what[i]; i++) /* what: small letters */
        if ((word[i] >= 'A' && word[i] <= 'Z' ? word[i] + ('a' - 'A') : word[i]) != what[i])
            return false;
    return i == len && !what[i];
}

uz_status triangles_reals(double x[3], triangles_text *text, const char *what, uz_error *err)
{
    for (int k = 0; k < 3; k++) {
        const char *word;
        size_t len;
        if (!triangles_word(&word, &len, text))
            return uz_fail_line(err, UZ_ERR_FORMAT, text->number, "%s has 3 numbers, not %d", what, k);
        if (uz_parse_double(&x[k], word, len) != len) {
            char shown[25];
            size_t used = 0;
            for (; used < len && used < sizeof shown - 1; used++)
                shown[used] = word[used] >= ' ' && word[used] <= '~' ? word[used] : '?';
            shown[used] = '\0';
            return uz_fail_line(err, UZ_ERR_FORMAT, text->number, "%s: a number was expected, found \"%s\"", what,
                                shown);
        }
        if (!isfinite(x[k]))
            return uz_fail_line(err, UZ_ERR_NOT_FINITE, text->number, "%s: a coordinate is not a finite number", what);
    }
    return UZ_OK;
}

/* ---- corners that are meant to be one */

/* In parts of the largest extent: numbers of single precision are known to 1e-7 of their size. */
#define SAME_CORNER 1e-6

/* Corners by cells of a grid, twice as wide as what is one: a corner's like is in one of eight cells. */
typedef struct {
    const uz_triangles *t;
    double low[3], reach; /* what is no farther apart is one */
    int64_t slots;        /* a power of two */
    int64_t *first;       /* slots: a corner; -1: none */
    int64_t *next;        /* 3 n: of the same slot */
} corner_grid;

static int64_t slot_of(const corner_grid *grid, const int64_t cell[3])
{
    uint64_t hash = 0;
    for (int c = 0; c < 3; c++)
        hash = (hash ^ (uint64_t)cell[c]) * 0x9E3779B97F4A7C15u;
    return (int64_t)((hash >> 20) & (uint64_t)(grid->slots - 1));
}

static int64_t find_corner(int64_t cell[3], const corner_grid *grid, int64_t corner)
{
    const uz_triangles *t = grid->t;
    const double at[3] = {t->x[corner], t->y[corner], t->z[corner]}, width = 2 * grid->reach;
    int64_t beside[3];
    for (int c = 0; c < 3; c++) {
        const double place = (at[c] - grid->low[c]) / width;
        cell[c] = (int64_t)place;
        beside[c] = cell[c] + (place - (double)cell[c] < 0.5 ? -1 : 1);
    }
    for (int k = 0; k < 8; k++) {
        const int64_t look[3] = {k & 1 ? beside[0] : cell[0], k & 2 ? beside[1] : cell[1], k & 4 ? beside[2] : cell[2]};
        for (int64_t i = grid->first[slot_of(grid, look)]; i >= 0; i = grid->next[i]) {
            const double off[3] = {t->x[i] - at[0], t->y[i] - at[1], t->z[i] - at[2]};
            if (off[0] * off[0] + off[1] * off[1] + off[2] * off[2] <= grid->reach * grid->reach)
                return i;
        }
    }
    return -1;
}

/* Each corner goes to the first one that is the same; the triangles that have no three corners then are left out. */
static uz_status join_corners(uz_triangles *t, uz_error *err)
{
    double *const x[3] = {t->x, t->y, t->z};
    corner_grid grid = {.t = t, .slots = 1};
    int64_t kept = 0;
    for (int c = 0; c < 3; c++) {
        double high = x[c][0];
        grid.low[c] = x[c][0];
        for (int64_t i = 0; i < 3 * t->n; i++) {
            grid.low[c] = fmin(grid.low[c], x[c][i]);
            high = fmax(high, x[c][i]);
        }
        grid.reach = fmax(grid.reach, SAME_CORNER * (high - grid.low[c]));
    }
    if (!(grid.reach > 0) || !isfinite(grid.reach / SAME_CORNER))
        return uz_fail(err, grid.reach > 0 ? UZ_ERR_NOT_FINITE : UZ_ERR_FORMAT, "",
                       grid.reach > 0 ? "the surface is larger than numbers are" : "all corners are at one place");
    while (grid.slots < 3 * t->n)
        grid.slots *= 2;
    grid.first = uz_alloc(grid.slots, sizeof *grid.first);
    grid.next = uz_alloc(3 * t->n, sizeof *grid.next);
    if (!grid.first || !grid.next) {
        uz_free_all(grid.first, grid.next);
        return uz_no_memory(err, "the corners of a surface");
    }
    for (int64_t i = 0; i < grid.slots; i++)
        grid.first[i] = -1;
    for (int64_t i = 0; i < 3 * t->n; i++) {
        int64_t cell[3];
        const int64_t like = find_corner(cell, &grid, i);
        if (like >= 0) {
            for (int c = 0; c < 3; c++)
                x[c][i] = x[c][like];
            continue;
        }
        const int64_t slot = slot_of(&grid, cell);
        grid.next[i] = grid.first[slot];
        grid.first[slot] = i;
    }
    uz_free_all(grid.first, grid.next);
    for (int64_t i = 0; i < t->n; i++) {
        bool same[3] = {true, true, true};
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                same[k] = same[k] && x[c][3 * i + k] == x[c][3 * i + (k + 1) % 3];
        if (same[0] || same[1] || same[2])
            continue;
        for (int c = 0; c < 3; c++)
            memmove(x[c] + 3 * kept, x[c] + 3 * i, 3 * sizeof *x[c]);
        kept++;
    }
    t->left_out = t->n - kept;
    t->n = kept;
    return kept > 0 ? UZ_OK : uz_fail(err, UZ_ERR_FORMAT, "", "no triangle of the surface has an area");
}

uz_status uz_triangles_read(uz_triangles *out, const char *format, const char *text, size_t len, size_t max_bytes,
                            uz_error *err)
{
    triangles_in in = {.out = out, .max_bytes = max_bytes, .err = err};
    uz_status (*read)(triangles_in * in, const char *text, size_t len) = NULL;
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < sizeof READERS / sizeof READERS[0] && !read; i++)
        if (strcmp(READERS[i].name, format) == 0)
            read = READERS[i].read;
    if (!read)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "", "surfaces of the format \"%.32s\" are not read", format);
    uz_status status = read(&in, text, len);
    if (status == UZ_OK && out->n == 0)
        status = uz_fail(err, UZ_ERR_FORMAT, "", "there are no triangles in the file");
    if (status == UZ_OK)
        status = join_corners(out, err);
    if (status != UZ_OK)
        uz_triangles_clear(out);
    return status;
}
