/* Pictures of answers: what is drawn where, and that nothing is lost when something fails. */
#include "body_fixture.h"
#include "harness.h"
#include "picture/raster.h"
#include "scene_fixture.h"

#include <png.h>

/* A scene and its answer. */
typedef struct {
    uz_problem problem;
    uz_result *result;
    uz_field_source source;
} solved;

static solved solve_scene(uz_scene scene)
{
    solved s = {.problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene}};
    uz_settings settings = uz_settings_default();
    uz_error err = {0};
    CHECK_MSG(uz_solve(&s.result, &s.problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    s.source = (uz_field_source){.u = s.result->u,
                                 .r = s.result->r,
                                 .g = s.result->g,
                                 .n_u = s.result->n_nodes * s.result->mesh.dim,
                                 .m = s.result->m};
    return s;
}

static void drop(solved *s)
{
    uz_result_free(s->result);
    uz_problem_clear(&s->problem);
}

static char *draw(const solved *s, uz_picture how)
{
    char *svg = NULL;
    size_t len = 0;
    uz_error err = {0};
    CHECK_MSG(uz_picture_deformed(&svg, &len, &s->problem.scene, &s->source, &how, NULL, &err) == UZ_OK, "%s",
              err.message);
    CHECK(svg && strlen(svg) == len);
    return svg;
}

static int digit(char c)
{
    static const char DIGITS[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c ? strchr(DIGITS, c) : NULL;
    return at ? (int)(at - DIGITS) : -1;
}

/* The pixels of the PNG inside a picture. */
static unsigned char *pixels_of(const char *svg, int *width, int *height)
{
    const char *at = strstr(svg, "base64,");
    unsigned char *file = calloc(strlen(svg), 1), *pixels = NULL;
    size_t n = 0;
    png_image image = {.version = PNG_IMAGE_VERSION};
    for (at = at ? at + 7 : ""; digit(at[0]) >= 0; at += 4) {
        const int v = digit(at[0]) << 18 | digit(at[1]) << 12 | (digit(at[2]) & 63) << 6 | (digit(at[3]) & 63);
        file[n++] = (unsigned char)(v >> 16);
        file[n++] = (unsigned char)(v >> 8);
        file[n++] = (unsigned char)v;
    }
    CHECK(png_image_begin_read_from_memory(&image, file, n));
    image.format = PNG_FORMAT_RGBA;
    pixels = calloc(PNG_IMAGE_SIZE(image), 1);
    CHECK(png_image_finish_read(&image, NULL, pixels, 0, NULL));
    *width = (int)image.width;
    *height = (int)image.height;
    png_image_free(&image);
    free(file);
    return pixels;
}

/* How many pens are put down in the path that begins here. */
static int count_moves(const char *path)
{
    int n = 0;
    for (path = strstr(path, " d=\"") + 4; *path != '"'; path++)
        n += *path == 'M';
    return n;
}

/* The 60 x 20 body at 13.33 pixels a millimetre, less the margins; held on the left, pulled to the right. */
TEST(colours_stand_where_the_body_is)
{
    solved s = solve_scene(paper_scene(30, 10));
    int width, height;
    unsigned char low[3], high[3];
    char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_DISPLACEMENTS, .title = "a < b & \"c\""});
    unsigned char *pixels = pixels_of(svg, &width, &height);
    CHECK_INT(width, 900);
    CHECK(height > 300 && height < 450);
    uz_colour(low, 0);
    uz_colour(high, 1);
    long left = 0, right = 0, drawn = 0;
    for (int64_t i = 0; i < (int64_t)width * height; i++) {
        const unsigned char *p = pixels + 4 * i;
        const int x = (int)(i % width);
        drawn += p[3] == 255;
        left += p[3] && x < 70 && abs(p[0] - low[0]) < 12 && abs(p[1] - low[1]) < 25 && abs(p[2] - low[2]) < 25;
        right += p[3] && x > 820 && abs(p[0] - high[0]) < 60 && abs(p[1] - high[1]) < 30 && abs(p[2] - high[2]) < 30;
        CHECK(p[3] == 0 || (x >= 49 && x <= 851));
    }
    CHECK_MSG(left > 1000 && right > 500, "%ld and %ld pixels", left, right);
    /* Aspect 3: the body fills a third of its width squared. */
    CHECK_MSG(fabs((double)drawn / (800 * 800 / 3.0) - 1) < 0.15, "%ld pixels", drawn);
    CHECK(strstr(svg, "a &lt; b &amp; &quot;c&quot;") && !strstr(svg, "a < b"));
    free(pixels);
    free(svg);
    drop(&s);
}

/* Only a band along the side that touches has colours: yellow where it is pressed most, amid grey. */
TEST(the_pressure_stands_on_the_sides_of_contacts)
{
    solved s = solve_scene(paper_scene(30, 10));
    int width, height;
    unsigned char high[3], grey[3];
    char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_PRESSURE, .factor = 1});
    unsigned char *pixels = pixels_of(svg, &width, &height);
    uz_colour(high, 1);
    uz_colour(grey, NAN);
    long coloured = 0, most = 0, plain = 0;
    for (int64_t i = 0; i < (int64_t)width * height; i++) {
        const unsigned char *p = pixels + 4 * i;
        const bool gaudy = p[3] && (abs(p[0] - p[1]) > 20 || abs(p[1] - p[2]) > 20);
        coloured += gaudy;
        most += gaudy && abs(p[0] - high[0]) < 40 && abs(p[1] - high[1]) < 30 && abs(p[2] - high[2]) < 40;
        plain += p[3] && memcmp(p, grey, 3) == 0;
        CHECK(!gaudy || i / width > height - 75); /* the obstacle is below */
    }
    CHECK_MSG(coloured > 4000 && coloured < 8 * 800 && most > 100 && plain > 100000, "%ld, %ld and %ld pixels",
              coloured, most, plain);
    CHECK(strstr(svg, ">contact pressure: 0 to "));
    free(pixels);
    free(svg);
    drop(&s);
}

TEST(an_arrow_for_each_node_that_touches_and_the_obstacle)
{
    solved s = solve_scene(paper_scene(30, 10));
    char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_VON_MISES, .factor = 100});
    const char *push = strstr(svg, "class=\"push\""), *obstacle = strstr(svg, "class=\"obstacle\"");
    CHECK(push && obstacle && strstr(svg, "von Mises stress") && strstr(svg, "displacements \u00d7 100<") &&
          strstr(svg, "longest arrow: pressure 0.05"));
    /* Each arrow has a shaft and a head: two moves. */
    CHECK_INT(push ? count_moves(push) : 0, 2 * (int)s.result->summary.active);
    free(svg);
    svg = draw(&s, (uz_picture){.colour = UZ_FIELD_DISPLACEMENTS, .width = 300});
    CHECK(strstr(svg, "viewBox=\"0 0 300 "));
    free(svg);
    drop(&s);
}

/* The stress goes from 0.401 to 0.708 over 300 pixels; a millimetre has 13.33 pixels, or 3.33 in a narrow
 * picture, less where the body is drawn longer than it is. */
TEST(round_numbers_and_a_round_length)
{
    solved s = solve_scene(paper_scene(30, 10));
    char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_VON_MISES});
    const char *bar = strstr(svg, "v-6v3h");
    CHECK(strstr(svg, ">0.5</text>") && strstr(svg, ">0.6</text>") && strstr(svg, ">0.7</text>") &&
          !strstr(svg, ">0.4</text>"));
    CHECK(strstr(svg, ">von Mises stress: 0.401 to 0.708<"));
    CHECK(bar && fabs(atof(bar + 6) * 60 / (5 * 800) - 1) < 0.1 && strstr(svg, ">5</text>"));
    CHECK(strstr(svg, ">x</text>") && strstr(svg, ">y</text>") && !strstr(svg, ">z</text>"));
    free(svg);
    svg = draw(&s, (uz_picture){.colour = UZ_FIELD_PRESSURE, .width = 300});
    bar = strstr(svg, "v-6v3h");
    CHECK(bar && fabs(atof(bar + 6) * 60 / (20 * 200) - 1) < 0.1 && strstr(svg, ">20</text>"));
    /* What is said of the picture stands below what is said of the colours. */
    const char *colours = strstr(svg, ": 0 to "), *words = strstr(svg, "displacements \u00d7");
    int above = 0, below = 0;
    for (const char *at = svg; colours && words && (at = strstr(at, "y=\"")) && at < words; at++)
        *(at < colours ? &above : &below) = atoi(at + 3);
    CHECK_MSG(below > above + 10, "%d and %d", above, below);
    free(svg);
    drop(&s);
}

/* A node that came from 2e-5 above the plane would be drawn that much times the factor into it. */
TEST(what_touches_does_not_seem_to_overlap)
{
    uz_scene scene = box_scene(60, 20, 30, 10);
    add_support(&scene, "left", 0, 0);
    add_load(&scene, "top", 0, -0.05);
    add_load(&scene, "right", 0.5, 0);
    add_plane(&scene, "bottom", 0, -2e-5, 0, 1);
    solved s = solve_scene(scene);
    char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_DISPLACEMENTS});
    const char *told = strstr(svg, "displacements \u00d7 ");
    const double factor = told ? atof(told + strlen("displacements \u00d7 ")) : 0;
    CHECK(s.result->summary.active > 0);
    CHECK_MSG(factor >= 2000 && factor * 2e-5 < 0.005 * 70, "%g", factor);
    free(svg);
    drop(&s);
}

/* Tall, flat, far from the origin, not deformed at all, in other units: always a picture of bounded size. */
static int count_of(const char *text, const char *word)
{
    int n = 0;
    for (const char *at = strstr(text, word); at; at = strstr(at + 1, word))
        n++;
    return n;
}

/* Behind the body stand the obstacle, as an image of its own, and the twelve edges of the box. */
TEST(a_solid_stands_on_its_obstacle)
{
    static const uz_contact OBSTACLES[] = {
        {.on = "bottom", .kind = UZ_OBSTACLE_PLANE, .normal = {0, 1, 0}},
        {.on = "bottom", .kind = UZ_OBSTACLE_ROUND, .point = {1, -5, 1}, .radius = 5},
        {.on = "bottom", .kind = UZ_OBSTACLE_CYLINDER, .point = {1, -5, 0}, .normal = {0, 0, 1}, .radius = 5},
        {.on = "bottom", .kind = UZ_OBSTACLE_ROUND, .point = {1, 30, 1}, .radius = 30, .inside = true},
    };
    for (int k = 0; k < 4; k++) {
        uz_scene scene = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 2}, (int64_t[3]){3, 2, 3});
        scene.contacts[scene.n_contacts++] = OBSTACLES[k];
        body_hold(&scene, "top", 0, -1e-3, 0);
        solved s = solve_scene(scene);
        char *svg = draw(&s, (uz_picture){.colour = UZ_FIELD_VON_MISES, .factor = 1});
        int width, height;
        unsigned char *pixels = pixels_of(svg, &width, &height);
        long grey = 0;
        for (int64_t i = 0; i < (int64_t)width * height; i++)
            grey += pixels[4 * i + 3] == 255 && pixels[4 * i] == pixels[4 * i + 1] && pixels[4 * i] > 150;
        CHECK_MSG(grey > 40000, "obstacle %d: %ld grey pixels", k, grey);
        CHECK_INT(count_of(svg, "base64,"), 2);
        CHECK_INT(count_moves(strstr(svg, "class=\"before\"")), 4 * (3 + 2 + 3));
        free(pixels);
        /* It is seen from above, and before most of the arrows from below, but where it is seen through. */
        const int seen = count_moves(strstr(svg, "class=\"push\""));
        CHECK_INT(count_of(svg, "longest arrow"), seen > 0);
        free(svg);
        svg = draw(&s, (uz_picture){.colour = UZ_FIELD_PRESSURE, .factor = 1});
        const int all = count_moves(strstr(svg, "class=\"push\""));
        CHECK_MSG(all > 0 && seen < all / 2, "obstacle %d: %d of %d", k, seen, all);
        free(svg);
        drop(&s);
    }
}

/* Of a box every edge of its mesh is a line of its own in what is seen of it: three of its six sides from a corner. The
 * length of all of them is that of the grids there, and where pressure is the colour, of the bottom's and the box's. */
TEST(edges_are_lines)
{
    uz_scene scene = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 2}, (int64_t[3]){4, 2, 4});
    scene.contacts[scene.n_contacts++] = (uz_contact){.on = "bottom", .kind = UZ_OBSTACLE_PLANE, .normal = {0, 1, 0}};
    body_hold(&scene, "top", 0, -1e-3, 0);
    solved s = solve_scene(scene);
    uz_picture how = {.colour = UZ_FIELD_VON_MISES, .factor = 1};
    char *svg = draw(&s, how);
    const int shown = (4 * 5 + 4 * 5) + 2 * (4 * 3 + 2 * 5) - (4 + 4 + 2); /* three edges are of two sides each */
    CHECK_INT(count_moves(strstr(svg, "class=\"edge\"")), shown);
    free(svg);
    CHECK(uz_view_parse(&how.view, "below"));
    svg = draw(&s, how);
    CHECK_INT(count_moves(strstr(svg, "class=\"edge\"")), shown);
    free(svg);
    how = (uz_picture){.colour = UZ_FIELD_PRESSURE, .factor = 1};
    svg = draw(&s, how);
    CHECK_INT(count_moves(strstr(svg, "class=\"edge\"")), 2 * 4 * 5 + (4 * 4 + 4 * 4 + 4 * 2)); /* and the sharp ones */
    free(svg);
    drop(&s);
}

TEST(any_body_fits)
{
    const double size[4][2] = {{1e-6, 1e3}, {1e3, 1e-6}, {1e-9, 1e-9}, {60, 20}};
    for (int i = 0; i < 4; i++) {
        uz_scene scene = box_scene(size[i][0], size[i][1], 4, 4);
        scene.box.origin[0] = 5 * size[i][0];
        add_support(&scene, "left", 0, 0);
        if (i != 3)
            add_load(&scene, "right", 0, -1);
        add_plane(&scene, "bottom", 0, i == 2 ? -1 : 0, 1, 1);
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
        double *u = calloc(50, sizeof *u), *r = calloc(4, sizeof *r);
        const uz_field_source source = {.u = u, .r = r, .n_u = 50, .m = 4};
        char *svg = NULL;
        size_t len = 0;
        const uz_picture how = {.colour = UZ_FIELD_DISPLACEMENTS};
        for (int k = 0; i != 3 && k < 50; k++)
            u[k] = 1e-3 * size[i][1] * (k % 7);
        uz_error err = {0};
        CHECK_MSG(uz_picture_deformed(&svg, &len, &scene, &source, &how, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_MSG(len > 1000 && len < 600000, "%zu bytes", len);
        /* Around the image, whose letters mean nothing. */
        char *image = svg ? strstr(svg, "base64,") : NULL, *after = image ? strstr(image, "\"/>") : NULL;
        CHECK(after && !strstr(after, "nan") && !strstr(after, "inf"));
        if (image)
            *image = '\0';
        CHECK(svg && !strstr(svg, "nan") && !strstr(svg, "inf"));
        free(svg);
        free(u);
        free(r);
        uz_problem_clear(&problem);
    }
}

/* A box of 4 x 1 x 2 with its contact below: 4 by 1 from the front, 4 by 2 with z upwards, and its contact in front of
 * the eye from below. */
TEST(views_of_a_solid)
{
    uz_scene scene = body_scene(UZ_SOLID, "hex8", (double[3]){4, 1, 2}, (int64_t[3]){4, 2, 2});
    scene.contacts[scene.n_contacts++] = (uz_contact){.on = "bottom", .kind = UZ_OBSTACLE_PLANE, .normal = {0, 1, 0}};
    body_hold(&scene, "top", 0, -1e-3, 0);
    solved s = solve_scene(scene);
    static const struct {
        const char *name;
        bool z_up;
        double wide, tall;
    } LOOKS[] = {{"front", false, 4, 1}, {"front", true, 4, 2}, {"left", false, 2, 1},
                 {"right", true, 1, 2},  {"top", false, 4, 2},  {"bottom", true, 4, 1}};
    for (size_t k = 0; k < sizeof LOOKS / sizeof *LOOKS; k++) {
        uz_picture how = {.colour = UZ_FIELD_DISPLACEMENTS, .factor = 1, .z_up = LOOKS[k].z_up};
        int width, height, low[2] = {10000, 10000}, high[2] = {-1, -1};
        CHECK(uz_view_parse(&how.view, LOOKS[k].name));
        char *svg = draw(&s, how);
        char *body = strstr(strstr(svg, "class=\"before\""), "<image"); /* the obstacle comes before */
        unsigned char *pixels = pixels_of(body, &width, &height);
        for (int64_t i = 0; i < (int64_t)width * height; i++)
            for (int c = 0; c < 2 && pixels[4 * i + 3] > 0; c++) {
                const int at = (int)(c ? i / width : i % width);
                low[c] = at < low[c] ? at : low[c];
                high[c] = at > high[c] ? at : high[c];
            }
        const double ratio = (double)(high[0] - low[0]) / (high[1] - low[1]);
        CHECK_MSG(fabs(ratio * LOOKS[k].tall / LOOKS[k].wide - 1) < 0.02, "%s: %g", LOOKS[k].name, ratio);
        free(pixels);
        free(svg);
    }
    uz_picture how = {.colour = UZ_FIELD_VON_MISES, .factor = 1};
    char *above = draw(&s, how);
    CHECK(uz_view_parse(&how.view, "below") && !uz_view_parse(&how.view, "aside"));
    char *below = draw(&s, how);
    CHECK_INT(count_moves(strstr(below, "class=\"push\"")), 2 * 15);
    CHECK(count_moves(strstr(above, "class=\"push\"")) < 15);
    free(above);
    free(below);
    drop(&s);
}

static bool cancel(void *ctx)
{
    return ++*(int *)ctx > 0;
}

TEST(what_cannot_be_drawn_is_refused)
{
    solved s = solve_scene(paper_scene(30, 10));
    char *svg = (char *)1;
    size_t len = 1;
    int asked = 0;
    const uz_hooks hooks = {.ctx = &asked, .cancelled = cancel};
    const uz_picture good = {.colour = UZ_FIELD_VON_MISES}, wide = {.colour = UZ_FIELD_VON_MISES, .width = 5000},
                     strange = {.colour = UZ_FIELD_GAPS}, negative = {.colour = UZ_FIELD_VON_MISES, .factor = -1};
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &wide, NULL, NULL), UZ_ERR_ARGUMENT);
    CHECK(!svg && len == 0);
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &strange, NULL, NULL), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &negative, NULL, NULL), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &good, &hooks, NULL), UZ_ERR_CANCELLED);
    CHECK(asked > 0);
    s.source.n_u--;
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &good, NULL, NULL), UZ_ERR_SIZE);
    s.source.n_u++;
    s.result->u[17] = NAN;
    const uz_picture plain = {.colour = UZ_FIELD_DISPLACEMENTS};
    CHECK_INT(uz_picture_deformed(&svg, &len, &s.problem.scene, &s.source, &plain, NULL, NULL), UZ_ERR_NOT_FINITE);
    CHECK(!svg);
    drop(&s);
}
