/* arrays.h: what all arrays for a viewer are made with: the body's own units, vertices, values in single precision. */
#ifndef UZ_PICTURE_ARRAYS_H
#define UZ_PICTURE_ARRAYS_H

#include "post/parts.h"

/* Origin and unit of an empty surface: the middle of the body and its size; ends of what it will have. */
void uz_surface_frame(uz_surface *s, const uz_mesh *mesh);
/* A vertex at x that moves by u, dim numbers each. */
void uz_surface_put(uz_surface *s, int64_t vertex, const double *x, const double *u);
/* The factor of the displacements, once all vertices are there. UZ_ERR_NOT_FINITE where they cannot be drawn. */
uz_status uz_surface_scale(uz_surface *s, const uz_scene *scene, const uz_body_model *model,
                           const uz_field_source *answer, uz_error *err);

/* value[place[i]], or value[i] with place NULL; NaN becomes -unit. UZ_ERR_MEMORY. */
uz_status uz_draw_values(uz_drawn *out, const double *value, const int64_t *place, int64_t count, uz_error *err);

#endif
