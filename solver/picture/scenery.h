/* scenery.h: a deformed body, projected on a picture: the steps of uz_picture_deformed. */
#ifndef UZ_PICTURE_SCENERY_H
#define UZ_PICTURE_SCENERY_H

#include "post/parts.h"
#include "picture/raster.h"
#include "picture/skin.h"

/* Everything is drawn from this. Pixels have y downwards; depth grows towards the eye. */
typedef struct {
    const uz_scene *scene;
    const uz_body_model *model;
    const uz_field_source *answer;
    double factor;          /* of displacements */
    const double *value;    /* n_nodes: what is coloured */
    double low, high;       /* range of it */
    const char *what;       /* its name */
    bool is_length;         /* is it one? A stress otherwise */
    bool contacts_only;     /* `value` is there on sides of contacts alone, NaN elsewhere: they alone are coloured */
    const double *pressure; /* m: of each contact row, NaN where it has no area */
    double largest_push;    /* of these; at least 0 */
    double longest_arrow;   /* the largest pressure that has one */
    uz_view view;
    bool z_up;
    double axes[3][3]; /* rows: to the right, upwards, towards the eye */
    double scale;      /* pixels per length */
    double offset[2];  /* pixel = (offset[0] + scale * right, offset[1] - scale * up) */
    int width, height; /* of the part that the body is in */
    double extent;     /* size of the body */
} uz_scenery;

/* Are these the displacements and reactions of this model, and finite? Errors: UZ_ERR_SIZE, _NOT_FINITE. */
uz_status uz_scenery_check_answer(const uz_field_source *answer, const uz_body_model *model, uz_error *err);

/* axes, scale, offset, height and extent from the mesh, displacements and width. UZ_ERR_NOT_FINITE. */
uz_status uz_scenery_fit(uz_scenery *scenery, uz_error *err);

/* How many times as large displacements are drawn to be seen, but so that what touches does not look as if it
 * overlapped or stood apart: at least 1; it reads well. */
double uz_show_factor(const uz_scene *scene, const uz_body_model *model, const uz_field_source *answer);

/* The surface of the body in colour; of a solid with contacts_only nothing. UZ_ERR_CANCELLED. */
uz_status uz_scenery_paint(uz_raster *raster, const uz_scenery *scenery, const uz_skin *skin, const uz_hooks *hooks,
                           uz_error *err);

/* The sides of the contacts in colour: bands inside a plane's border, faces of a solid. UZ_ERR_SCENE. */
uz_status uz_scenery_paint_contacts(uz_raster *raster, const uz_scenery *scenery, uz_error *err);

/* Obstacles of solids, in grey. False: there are none. */
bool uz_scenery_paint_obstacles(uz_raster *raster, const uz_scenery *scenery);

/* SVG elements, each appended to the buffer. The outline before the deformation is the border of a plane or the sharp
 * edges of a solid. */
void uz_scenery_put_outline(uz_buffer *svg, const uz_scenery *scenery, const uz_skin_edges *edges);
/* Edges of elements, as far as the body, as it was painted, is not before them, where they are not so many that they
 * would hide its colours; of a solid with contacts_only its sharp edges, and those of the sides of contacts. */
void uz_scenery_put_edges(uz_buffer *svg, const uz_scenery *scenery, const uz_skin_edges *edges, const uz_raster *body);
void uz_scenery_put_obstacles(uz_buffer *svg, const uz_scenery *scenery); /* plane models */
void uz_scenery_put_axes(uz_buffer *svg, const uz_scenery *scenery);
/* Pressures, but for those whose arrows the body is before: a solid as it was painted; NULL: it is seen through. The
 * largest of those that are drawn; at least 0. */
double uz_scenery_put_arrows(uz_buffer *svg, const uz_scenery *scenery, const uz_raster *body);
/* The legend is below the picture, of this height in pixels. */
int uz_scenery_legend_height(const uz_scenery *scenery);
void uz_scenery_put_legend(uz_buffer *svg, const uz_scenery *scenery, const char *title);

#endif
