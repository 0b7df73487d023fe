/* scene.h: what a scene must satisfy, each refusal with the JSON pointer of the culprit. */
#ifndef UZ_SCENE_SCENE_H
#define UZ_SCENE_SCENE_H

#include "scene/mesh.h"
#include "uzawa.h"

/* Model, thickness, materials, the groups and directions of supports, the groups and normals of contacts: whatever
 * K and N are built from. Errors: UZ_ERR_SCENE, _NOT_FINITE. */
uz_status uz_scene_check_body(const uz_scene *scene, const uz_mesh *mesh, uz_error *err);

/* What one case adds: loads, prescribed values, the obstacles' points. Supports and contacts are checked here too: the
 * scene may come with a body that was built from another one. */
uz_status uz_scene_check_load(const uz_scene *scene, const uz_mesh *mesh, uz_error *err);

/* Has it a law of finite strain, so that its kinematics are finite, or auto chooses between them and fixed ones? */
bool uz_has_finite_law(const uz_scene *scene);
/* Is an answer to it one of finite kinematics? Where auto chose them, that has a place. */
bool uz_is_finite_answer(const uz_scene *scene);
/* Is there a model of large deformation for it, with laws of finite strain? (check_finite.c) */
bool uz_has_finite_model(const uz_scene *scene, const uz_mesh *mesh);

/* Of solids: the certificate's factor is one within an envelope. */
#define UZ_MOST_FINITE_DOFS 20000

/* Radians: a rotation by more than half a turn, and some room for rounding, is another one. */
#define UZ_MOST_TURN 3.1

/* Does it turn its group? */
bool uz_support_turns(const uz_support *support);
/* By how much, in radians; what is free of a rigid group's rotation (NaN) counts as none. */
double uz_support_angle(const uz_support *support);

/* normal / ||normal||, whatever its length. A component that is zero but for rounding becomes zero: it would make a
 * contact row out of noise. False where there is no direction (zero, NaN, Inf). */
bool uz_unit_normal(double out[3], const double normal[3], int dim);

/* SHA-256 of a mesh in numbers, hex: the one that it has, or of what its arrays say. "": there is no memory for it. */
void uz_given_digest(char hex[65], const uz_given_mesh *mesh);

#endif
