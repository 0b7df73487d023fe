/* raster.h: triangles with a depth, as pixels. */
#ifndef UZ_PICTURE_RASTER_H
#define UZ_PICTURE_RASTER_H

#include "text/buffer.h"

/* Pixel (x, y) is at y * width + x, row 0 at the top; its centre has the coordinates x + 0.5, y + 0.5. */
typedef struct {
    int width, height;
    unsigned char *rgba; /* 4 bytes a pixel; all zero: nothing drawn */
    float *depth;        /* of what is drawn: larger is nearer */
} uz_raster;

typedef struct {
    double x, y, z; /* pixels; z towards the eye */
    double value;   /* in [0, 1]: the colour; NaN: grey */
} uz_raster_point;

uz_status uz_raster_init(uz_raster *raster, int width, int height, uz_error *err);
void uz_raster_clear(uz_raster *raster);

/* Nothing is drawn any more. */
void uz_raster_wipe(uz_raster *raster);

/* Colour and depth are linear over the triangle. light: 1 as it is, 0 black. What is not finite is left out. */
void uz_raster_triangle(uz_raster *raster, const uz_raster_point corner[3], double light);
/* Is what is drawn at this pixel nearer than the point, by more than `lift` pixels? */
bool uz_raster_hides(const uz_raster *raster, const uz_raster_point *point, double lift);
/* The same for a point of a line on what is drawn: of a face that is seen from its side a pixel beside it may be as far
 * as the line. */
bool uz_raster_hides_line(const uz_raster *raster, const uz_raster_point *point, double lift);

/* Colour of a value in [0, 1], red, green, blue. */
void uz_colour(unsigned char rgb[3], double value);

/* Appends the pixels as an <image>, in base64 of a PNG file. UZ_ERR_MEMORY. */
uz_status uz_raster_put_image(uz_buffer *svg, const uz_raster *raster, uz_error *err);

#endif
