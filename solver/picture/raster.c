/* raster.c: scan conversion by edge functions and a depth buffer (Pineda, "A parallel algorithm for polygon
 * rasterization", SIGGRAPH 1988). */
#include "picture/raster.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_raster_init(uz_raster *raster, int width, int height, uz_error *err)
{
    const int64_t pixels = (int64_t)width * height;
    *raster = (uz_raster){.width = width, .height = height};
    raster->rgba = uz_alloc(pixels, 4);
    raster->depth = uz_alloc(pixels, sizeof *raster->depth);
    if (!raster->rgba || !raster->depth)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a picture of %d x %d pixels", width, height);
    uz_raster_wipe(raster);
    return UZ_OK;
}

void uz_raster_wipe(uz_raster *raster)
{
    const int64_t pixels = (int64_t)raster->width * raster->height;
    memset(raster->rgba, 0, 4 * (size_t)pixels);
    for (int64_t i = 0; i < pixels; i++)
        raster->depth[i] = -INFINITY;
}

void uz_raster_clear(uz_raster *raster)
{
    uz_free_all(raster->rgba, raster->depth);
    memset(raster, 0, sizeof *raster);
}

/* Nine of the colours of viridis (S. van der Walt and N. Smith, 2015, CC0): equal steps look equal, in grey too. */
void uz_colour(unsigned char rgb[3], double value)
{
    enum { STEPS = 8 };
    static const unsigned char VIRIDIS[STEPS + 1][3] = {{68, 1, 84},    {71, 44, 122},  {59, 81, 139},
                                                        {44, 113, 142}, {33, 144, 141}, {39, 173, 129},
                                                        {92, 200, 99},  {170, 220, 50}, {253, 231, 37}};
    if (isnan(value)) {
        rgb[0] = rgb[1] = rgb[2] = 210;
        return;
    }
    const double at = fmin(fmax(value, 0), 1) * STEPS;
    const int i = at < STEPS ? (int)at : STEPS - 1;
    for (int c = 0; c < 3; c++)
        rgb[c] = (unsigned char)lrint(VIRIDIS[i][c] + (at - i) * (VIRIDIS[i + 1][c] - VIRIDIS[i][c]));
}

static void set_pixel(uz_raster *raster, int64_t at, double z, const unsigned char rgb[3], double light)
{
    if (!((float)z > raster->depth[at]))
        return;
    raster->depth[at] = (float)z;
    for (int c = 0; c < 3; c++)
        raster->rgba[4 * at + c] = (unsigned char)lrint(light * rgb[c]);
    raster->rgba[4 * at + 3] = 255;
}

/* Beyond this many pixels nothing is drawn: coordinates of pixels are ints. */
#define FAR 1e8

/* Twice the signed area of a, b and the point (x, y). */
static double edge(const uz_raster_point *a, const uz_raster_point *b, double x, double y)
{
    return (b->x - a->x) * (y - a->y) - (b->y - a->y) * (x - a->x);
}

/* First and last pixel of a range of coordinates within 0..size - 1. */
static void clip_range(int *low, int *high, double a, double b, double c, int size)
{
    *low = (int)fmax(floor(fmin(a, fmin(b, c))), 0);
    *high = (int)fmin(ceil(fmax(a, fmax(b, c))), size - 1);
}

void uz_raster_triangle(uz_raster *raster, const uz_raster_point p[3], double light)
{
    int x0, x1, y0, y1;
    const double area = edge(&p[0], &p[1], p[2].x, p[2].y);
    if (!isfinite(area) || area == 0 || !(fabs(p[0].x) + fabs(p[1].x) + fabs(p[2].x) < FAR) ||
        !(fabs(p[0].y) + fabs(p[1].y) + fabs(p[2].y) < FAR))
        return;
    clip_range(&x0, &x1, p[0].x, p[1].x, p[2].x, raster->width);
    clip_range(&y0, &y1, p[0].y, p[1].y, p[2].y, raster->height);
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            unsigned char rgb[3];
            const double w0 = edge(&p[1], &p[2], x + 0.5, y + 0.5) / area;
            const double w1 = edge(&p[2], &p[0], x + 0.5, y + 0.5) / area, w2 = 1 - w0 - w1;
            if (w0 < -1e-9 || w1 < -1e-9 || w2 < -1e-9)
                continue;
            uz_colour(rgb, w0 * p[0].value + w1 * p[1].value + w2 * p[2].value);
            set_pixel(raster, (int64_t)y * raster->width + x, w0 * p[0].z + w1 * p[1].z + w2 * p[2].z, rgb, light);
        }
}

/* The pixel of a point, -1: it is outside, or nothing is drawn there. */
static int64_t drawn_at(const uz_raster *raster, double x, double y)
{
    if (!(x >= 0 && y >= 0 && x < raster->width && y < raster->height))
        return -1;
    const int64_t at = (int64_t)y * raster->width + (int64_t)x;
    return raster->rgba[4 * at + 3] > 0 ? at : -1;
}

bool uz_raster_hides(const uz_raster *raster, const uz_raster_point *point, double lift)
{
    const int64_t at = drawn_at(raster, point->x, point->y);
    return at >= 0 && raster->depth[at] > point->z + lift;
}

bool uz_raster_hides_line(const uz_raster *raster, const uz_raster_point *point, double lift)
{
    static const int BESIDE[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    bool hidden = uz_raster_hides(raster, point, lift);
    for (int k = 0; k < 4 && hidden; k++) {
        const int64_t at = drawn_at(raster, point->x + BESIDE[k][0], point->y + BESIDE[k][1]);
        hidden = at < 0 || raster->depth[at] > point->z + lift;
    }
    return hidden;
}

uz_status uz_raster_put_image(uz_buffer *svg, const uz_raster *raster, uz_error *err)
{
    png_alloc_size_t len = 0;
    unsigned char *file = NULL;
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)raster->width,
                       .height = (png_uint_32)raster->height,
                       .format = PNG_FORMAT_RGBA};
    uz_status status = UZ_OK;
    /* The first call only tells the length, the second writes. */
    if (!png_image_write_to_memory(&image, NULL, &len, 0, raster->rgba, 0, NULL) ||
        !(file = uz_alloc((int64_t)len, 1)) || !png_image_write_to_memory(&image, file, &len, 0, raster->rgba, 0, NULL))
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a picture of %d x %d pixels", raster->width, raster->height);
    uz_buffer_print(svg, "<image width=\"%d\" height=\"%d\" href=\"data:image/png;base64,", raster->width,
                    raster->height);
    if (status == UZ_OK)
        uz_buffer_put_base64(svg, file, len);
    uz_buffer_print(svg, "\"/>\n");
    png_image_free(&image);
    free(file);
    return status;
}
