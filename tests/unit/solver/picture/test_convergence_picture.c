/* The diagram of a history: its lines are read back through the numbers at its ticks, as a person would. */
#include "harness.h"
#include "uzawa.h"

enum { COLUMNS = 7 };
typedef struct {
    double *x; /* count x COLUMNS */
    int64_t count;
} table;

enum { ITERATION, SECONDS, DUAL, RESIDUAL, BOUND, CONTACTS, RESTART };

static table make_table(int64_t count)
{
    table t = {calloc((size_t)(count * COLUMNS) + 1, sizeof(double)), count};
    for (int64_t i = 0; i < count; i++) {
        double *row = t.x + i * COLUMNS;
        row[ITERATION] = (double)i;
        row[SECONDS] = 1e-5 * (double)(i + 1);
        row[DUAL] = -1.0 - exp(-0.05 * (double)i);
        row[RESIDUAL] = 3e-2 * exp(-0.02 * (double)i) * (1.5 + sin(0.3 * (double)i));
        row[BOUND] = i < 3 ? INFINITY : 0.7 * exp(-0.025 * (double)i);
        row[CONTACTS] = (double)(20 + i % 5);
        row[RESTART] = i % 60 == 59;
    }
    return t;
}

static uz_curve curve_of(const table *t, const char *name)
{
    const double *x = t->x;
    return (uz_curve){name,         x + ITERATION, x + SECONDS, x + DUAL, x + RESIDUAL, x + BOUND,
                      x + CONTACTS, x + RESTART,   t->count,    COLUMNS,  NAN};
}

static char *draw_with(const uz_curve *curves, int n, const uz_plot *how, size_t *len)
{
    char *svg = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_picture_convergence(&svg, len, curves, n, how, &err) == UZ_OK, "%s", err.message);
    CHECK(svg && strlen(svg) == *len);
    return svg;
}

static char *draw(const table *t, uz_plot how)
{
    size_t len;
    const uz_curve curve = curve_of(t, "a run");
    return draw_with(&curve, 1, &how, &len);
}

/* ---- reading */

/* value = a + b pixel, for the logarithm where `log`. */
typedef struct {
    double a, b;
    bool log;
} scale;

static const char *panel_at(const char *svg, int panel)
{
    char id[24];
    snprintf(id, sizeof id, "id=\"panel%d\"", panel);
    const char *at = strstr(svg, id);
    CHECK(at != NULL);
    return at;
}

/* From the first and the last number at an axis of a panel ("x" or "y"). */
static scale read_scale(const char *svg, int panel, const char *axis)
{
    char tag[32];
    double pixel[2] = {0}, value[2] = {0};
    int n = 0;
    const char *at = panel_at(svg, panel), *end = strstr(at, "</g>");
    snprintf(tag, sizeof tag, "<text class=\"%s\"", axis);
    bool log = false;
    for (at = strstr(at, tag); at && at < end; at = strstr(at + 1, tag)) {
        const char *key = strstr(at, *axis == 'x' ? " x=\"" : " y=\""), *text = strchr(at, '>');
        const int to = n++ == 0 ? 0 : 1;
        pixel[to] = strtod(key + 4, NULL) - (*axis == 'y' ? 4.0 : 0.0); /* text stands on its line */
        value[to] = strtod(text + 1, NULL);
        log = *axis == 'y' && strncmp(text, ">1e", 3) == 0;
        if (log)
            value[to] = log10(value[to]);
    }
    CHECK_MSG(n >= 2, "%d numbers at %s of panel %d", n, axis, panel);
    const double b = (value[1] - value[0]) / (pixel[1] - pixel[0]);
    return (scale){value[0] - b * pixel[0], b, log};
}

static double read_back(scale s, double pixel)
{
    const double value = s.a + s.b * pixel;
    return s.log ? pow(10.0, value) : value;
}

typedef struct {
    double *x, *y;
    int count, lines;
} points;

/* All points of a curve in a panel, in pixels. */
static points read_points(const char *svg, int panel, int colour)
{
    char tag[64];
    points p = {calloc(100000, sizeof(double)), calloc(100000, sizeof(double)), 0, 0};
    const char *at = panel_at(svg, panel), *end = strstr(at, "</g>");
    snprintf(tag, sizeof tag, "<polyline class=\"curve c%d\" points=\"", colour);
    for (at = strstr(at, tag); at && at < end; at = strstr(at, tag)) {
        p.lines++;
        for (at += strlen(tag); *at != '"' && p.count < 100000; p.count++) {
            char *next;
            p.x[p.count] = strtod(at, &next);
            p.y[p.count] = strtod(next + 1, &next);
            at = next + strspn(next, " ");
        }
    }
    return p;
}

static void drop(points *p)
{
    free(p->x);
    free(p->y);
}

static int count_of(const char *text, const char *part)
{
    int n = 0;
    for (text = strstr(text, part); text; text = strstr(text + 1, part))
        n++;
    return n;
}

/* ---- tests */

/* Every row of a short history stands where the ticks say, within a hundredth of a pixel. */
static void check_values(const table *t, const char *svg, int panel, const double *y, double minuend)
{
    const scale sx = read_scale(svg, 3, "x"), sy = read_scale(svg, panel, "y");
    points p = read_points(svg, panel, 0);
    int drawn = 0;
    for (int64_t i = 0; i < t->count; i++) {
        const double value = isnan(minuend) ? y[i * COLUMNS] : minuend - y[i * COLUMNS];
        if (!isfinite(value) || (sy.log && value <= 0.0))
            continue;
        CHECK(drawn < p.count);
        CHECK_MSG(fabs(read_back(sx, p.x[drawn]) - t->x[i * COLUMNS]) < 2e-2 * fabs(sx.b) + 1e-3, "row %lld",
                  (long long)i);
        if (sy.log)
            CHECK_REL(read_back(sy, p.y[drawn]), value, 0.01);
        else
            CHECK(fabs(read_back(sy, p.y[drawn]) - value) < 0.02);
        drawn++;
    }
    CHECK_INT(drawn, p.count);
    CHECK_INT(p.lines, 1);
    drop(&p);
}

TEST(lines_read_back_as_the_history)
{
    table t = make_table(200);
    char *svg = draw(&t, (uz_plot){.title = "a < b & \"c\""});
    double best = -INFINITY;
    for (int64_t i = 0; i < t.count; i++)
        best = fmax(best, t.x[i * COLUMNS + DUAL]);
    check_values(&t, svg, 0, t.x + DUAL, best);
    check_values(&t, svg, 1, t.x + RESIDUAL, NAN);
    check_values(&t, svg, 2, t.x + BOUND, NAN);
    check_values(&t, svg, 3, t.x + CONTACTS, NAN);
    CHECK(strstr(svg, "a &lt; b &amp; &quot;c&quot;") && !strstr(svg, "a < b"));
    CHECK_INT(count_of(svg, "-7h7z") - 1, 2 * 3); /* three restarts in two panels, and the legend's */
    CHECK(strstr(svg, "prefers-color-scheme:dark"));
    free(svg);
    free(t.x);
}

TEST(seconds_run_along_the_bottom_where_asked)
{
    table t = make_table(50);
    char *svg = draw(&t, (uz_plot){.x = UZ_PLOT_SECONDS, .width = 1200});
    const scale sx = read_scale(svg, 3, "x");
    points p = read_points(svg, 1, 0);
    CHECK_INT(p.count, 50);
    for (int i = 0; i < p.count; i++)
        CHECK_REL(read_back(sx, p.x[i]), 1e-5 * (i + 1), 0.01);
    CHECK(strstr(svg, "seconds since") && strstr(svg, "width=\"1200\""));
    drop(&p);
    free(svg);
    free(t.x);
}

/* A million rows: a text of bounded size, in which each peak is still where it was. */
TEST(long_histories_keep_their_peaks)
{
    table t = make_table(1000000);
    for (int64_t i = 0; i < t.count; i++)
        t.x[i * COLUMNS + RESIDUAL] = 1e-3;
    static const int64_t PEAK[] = {5, 123457, 500000, 999998};
    for (size_t k = 0; k < sizeof PEAK / sizeof PEAK[0]; k++)
        t.x[PEAK[k] * COLUMNS + RESIDUAL] = k % 2 ? 1e-6 : 1e2;
    size_t len;
    const uz_curve curve = curve_of(&t, "long");
    const uz_plot how = {.width = 900};
    char *svg = draw_with(&curve, 1, &how, &len);
    CHECK_MSG(len < 900 * 4 * 8 * 16, "%zu bytes", len);
    const scale sx = read_scale(svg, 3, "x"), sy = read_scale(svg, 1, "y");
    points p = read_points(svg, 1, 0);
    for (size_t k = 0; k < sizeof PEAK / sizeof PEAK[0]; k++) {
        const double want = k % 2 ? 1e-6 : 1e2;
        bool found = false;
        for (int i = 0; i < p.count; i++)
            found = found || (fabs(read_back(sx, p.x[i]) - (double)PEAK[k]) < 0.02 * fabs(sx.b) &&
                              fabs(read_back(sy, p.y[i]) / want - 1.0) < 0.01);
        CHECK_MSG(found, "the peak at %lld", (long long)PEAK[k]);
    }
    for (int i = 1; i < p.count; i++)
        CHECK(p.x[i] >= p.x[i - 1]);
    CHECK(p.lines == 1 && p.count < 4 * 900);
    CHECK_MSG(count_of(svg, "-7h7z") < 2 * 900, "%d marks", count_of(svg, "-7h7z"));
    drop(&p);
    free(svg);
    free(t.x);
}

/* Holes are holes: numbers that are none, zeros and negative numbers break a line and are no reason to fail. */
TEST(what_has_no_logarithm_is_left_out)
{
    table t = make_table(40);
    static const double WRONG[] = {NAN, INFINITY, -INFINITY, 0.0, -1.0};
    for (int64_t i = 10; i < 15; i++)
        t.x[i * COLUMNS + RESIDUAL] = WRONG[i - 10];
    t.x[20 * COLUMNS + RESIDUAL] = NAN;
    t.x[22 * COLUMNS + RESIDUAL] = NAN; /* row 21 stands alone */
    t.x[39 * COLUMNS + ITERATION] = NAN;
    t.x[5 * COLUMNS + DUAL] = NAN;
    char *svg = draw(&t, (uz_plot){.width = 600});
    points p = read_points(svg, 1, 0);
    CHECK_INT(p.lines, 4);
    CHECK_INT(p.count, 40 - 5 - 2 - 1 + 1); /* the lone row is a line of two equal points */
    CHECK(!strstr(svg, "nan") && !strstr(svg, "inf\"") && !strstr(svg, ",inf"));
    drop(&p);
    free(svg);
    for (int64_t i = 0; i < t.count * COLUMNS; i++)
        t.x[i] = i % 2 ? NAN : INFINITY;
    svg = draw(&t, (uz_plot){.width = 300});
    CHECK(!strstr(svg, "nan") && !strstr(svg, "<polyline"));
    free(svg);
    free(t.x);
}

TEST(extreme_numbers_find_a_place)
{
    table t = make_table(4);
    static const double WILD[] = {1e308, 1e-308, 5e-324, 1.0};
    for (int64_t i = 0; i < 4; i++) {
        t.x[i * COLUMNS + RESIDUAL] = WILD[i];
        t.x[i * COLUMNS + BOUND] = WILD[i];
        t.x[i * COLUMNS + ITERATION] = 9e15 + (double)i;
        t.x[i * COLUMNS + CONTACTS] = 1e12;
    }
    char *svg = draw(&t, (uz_plot){.theme = UZ_THEME_DARK});
    points p = read_points(svg, 1, 0);
    CHECK(p.count >= 2 && strlen(svg) < 100000);
    for (int i = 0; i < p.count; i++)
        CHECK(p.x[i] >= 0 && p.x[i] <= 900 && p.y[i] >= 0 && p.y[i] <= 900);
    drop(&p);
    free(svg);
    free(t.x);
}

TEST(short_histories_are_drawn)
{
    table t = make_table(1);
    char *svg = draw(&t, (uz_plot){.width = 900});
    points p = read_points(svg, 1, 0);
    CHECK(p.lines == 1 && p.count == 2 && p.x[0] == p.x[1] && p.y[0] == p.y[1]);
    CHECK(!strstr(svg, "no iterations"));
    drop(&p);
    free(svg);
    t.count = 0;
    svg = draw(&t, (uz_plot){.theme = UZ_THEME_LIGHT});
    CHECK(strstr(svg, "no iterations yet") && !strstr(svg, "<polyline") && !strstr(svg, "dark"));
    CHECK(strstr(svg, "</svg>"));
    free(svg);
    free(t.x);
}

TEST(curves_of_several_runs_share_the_axes)
{
    table t[UZ_CURVES];
    uz_curve curves[UZ_CURVES];
    const uz_plot how = {.width = 900};
    size_t len;
    for (int k = 0; k < UZ_CURVES; k++) {
        t[k] = make_table(50 * (k + 1));
        curves[k] = curve_of(&t[k], k % 2 ? NULL : "x & y");
    }
    char *svg = draw_with(curves, UZ_CURVES, &how, &len);
    const scale sx = read_scale(svg, 3, "x");
    for (int k = 0; k < UZ_CURVES; k++) {
        points p = read_points(svg, 1, k);
        CHECK_REL(read_back(sx, p.x[p.count - 1]), (double)(50 * (k + 1) - 1), 0.01);
        drop(&p);
        free(t[k].x);
    }
    CHECK_INT(count_of(svg, "x &amp; y"), UZ_CURVES / 2);
    free(svg);
}

TEST(arguments_are_checked)
{
    table t = make_table(3);
    const uz_curve good = curve_of(&t, NULL);
    uz_curve bad = good;
    bad.stride = 0;
    char *svg;
    size_t len;
    uz_error err;
    CHECK_INT(uz_picture_convergence(&svg, &len, &good, 1, &(uz_plot){.width = 299}, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_convergence(&svg, &len, &good, 1, &(uz_plot){.width = 4001}, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_convergence(&svg, &len, &good, 0, &(uz_plot){.width = 0}, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_convergence(&svg, &len, &good, UZ_CURVES + 1, &(uz_plot){.width = 0}, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_convergence(&svg, &len, &bad, 1, &(uz_plot){.width = 0}, &err), UZ_ERR_ARGUMENT);
    CHECK(!svg && len == 0);
    free(t.x);
}
