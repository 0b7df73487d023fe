/* row_turn_space.h: what row_turn.c asks for of solids. */
#ifndef UZ_ROW_TURN_SPACE_H
#define UZ_ROW_TURN_SPACE_H

#include "assembly/row_turn.h"

/* uz_row_turn_find of a solid, added to what *out has. Errors: UZ_ERR_MEMORY, UZ_ERR_SCENE (a side without area). */
uz_status uz_row_turn_in_space(uz_row_turn *out, const uz_body_model *base, const uz_body_model *rows,
                               const uz_scene *scene, const double *r, double least, uz_error *err);

#endif
