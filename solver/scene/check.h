/* check.h: shared by the checks of a scene. */
#ifndef UZ_SCENE_CHECK_H
#define UZ_SCENE_CHECK_H

#include "scene/mesh.h"

enum { UZ_CHECK_POINTER = 96 };

/* "/materials/0/poisson"; key NULL: "/materials/0". Returns `where`. UZ_PLACE: in memory of the block that it stands
 * in. */
const char *uz_check_place(char where[UZ_CHECK_POINTER], const char *list, int64_t i, const char *key);
#define UZ_PLACE(list, i, key) uz_check_place((char[UZ_CHECK_POINTER]){""}, list, i, key)

/* The group `on` of an item, with at least one node; NULL: refused, at UZ_PLACE(list, i, key). */
const uz_group *uz_check_group(const uz_mesh *mesh, const char *on, const char *list, int64_t i, const char *key,
                               uz_error *err);
/* The same, and it must be made of faces. remedy: what to name instead. */
const uz_group *uz_check_sides(const uz_mesh *mesh, const char *on, const char *list, int64_t i, const char *key,
                               const char *remedy, uz_error *err);
/* Each of dim components must be finite; key is "traction", "obstacle/plane/point", ... */
uz_status uz_check_vector(const double *v, int dim, const char *list, int64_t i, const char *key, uz_error *err);
uz_status uz_check_number(double value, const char *list, int64_t i, const char *key, uz_error *err);

/* Radians; a group that turns by more in small deformation would be stretched by more than an eighth. */
#define UZ_MOST_LINEAR_TURN 0.5
/* Group, directions and values of support i; groups and directions of contact i, whose sides no
 * contact before it may have named for each other. */
uz_status uz_check_support(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err);
uz_status uz_check_contact(const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err);
/* What finite kinematics have no model for, and laws that need them (check_finite.c): of the body, and of its loads. */
/* Finite kinematics may be what it is solved with. */
bool uz_may_be_finite(const uz_scene *scene);
uz_status uz_check_finite_body(const uz_scene *scene, uz_error *err);
uz_status uz_check_finite_loads(const uz_scene *scene, const uz_mesh *mesh, uz_error *err);
/* Does a temperature do anything to it? */
bool uz_expands(const uz_material *material);
uz_status uz_check_materials(const uz_scene *scene, const uz_mesh *mesh, uz_error *err);

/* Solids that are or may become ones of finite kinematics: not more dofs than those have. The groups of supports are
 * there. */
uz_status uz_check_finite_size(const uz_scene *scene, const uz_mesh *mesh, uz_error *err);

#endif
