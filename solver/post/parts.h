/* parts.h: what the fields of an answer are made from. */
#ifndef UZ_FIELDS_PARTS_H
#define UZ_FIELDS_PARTS_H

#include "assembly/strain_group.h"
#include "element/element.h"
#include "uzawa.h"

enum { UZ_FIELD_COMPONENTS = 6 }; /* most components of a stress */

/* A scene's body as far as fields need it. */
typedef struct {
    const uz_scene *scene;
    const uz_body_model *model; /* mesh and contact rows; neither K nor N is read */
    int components;             /* of a stress: 4 or 6 */
    const double *free_strain;  /* n_elements: expansion times rise of temperature; NULL: none has any */
    double *own;                /* what of it is the body's: NULL where the scene knows it */
} uz_field_body;

/* Borrows scene and model. UZ_ERR_MEMORY; the caller clears *out in every case. */
uz_status uz_field_body_init(uz_field_body *out, const uz_scene *scene, const uz_body_model *model, uz_error *err);
void uz_field_body_clear(uz_field_body *body);

/* Stress and strain (tensors, components of uz_fields) at a point. */
typedef struct {
    double stress[UZ_FIELD_COMPONENTS], strain[UZ_FIELD_COMPONENTS];
} uz_field_state;
/* From the strains of the model (see element.h; room for UZ_ELEMENT_STRESSES), of which free_strain has no stress;
 * shear strains are halved in place. */
void uz_field_state_of_strain(uz_field_state *out, uz_model model, const uz_body_material *material, double free_strain,
                              double *strain);

/* The same local points of elements of one kind, a few elements at a time. count and point are the caller's. */
typedef struct {
    int count;
    double point[UZ_ELEMENT_GAUSS][3];
    const uz_field_body *body;
    const double *u;
    uz_strain_group group; /* the elements at hand, which follow each other */
    double volume;         /* of the last element that was asked for; 0: none was */
} uz_field_points;
void uz_field_points_init(uz_field_points *out, const uz_field_body *body, const double *u);
void uz_field_points_states(uz_field_state *state, uz_field_points *points, int64_t element);

/* Nodal averages, n_nodes x components each; either may be NULL. UZ_ERR_CANCELLED, _MEMORY. */
uz_status uz_field_recover(double *stress, double *strain, const uz_field_body *body, const double *u,
                           const uz_hooks *hooks, uz_error *err);

/* The part of it for nodes around which all elements are linear: see patches.c. done: n_nodes, zeroed; 1 where a node
 * has its values, the others are left as they are. */
uz_status uz_field_fit_patches(double *stress, double *strain, unsigned char *done, const uz_field_body *body,
                               const double *u, const uz_hooks *hooks, uz_error *err);

/* At the Gauss points of every element: which element, where (x dim), stress (x components). */
int64_t uz_field_gauss_count(const uz_field_body *body);
uz_status uz_field_gauss(double *element, double *point, double *stress, const uz_field_body *body, const double *u,
                         const uz_hooks *hooks, uz_error *err);

/* uz_fields_compute on a body that is there. */
uz_status uz_fields_of_body(uz_fields *out, const uz_field_body *body, const uz_field_source *answer, unsigned which,
                            const uz_hooks *hooks, uz_error *err);

/* Of a stress with 4 or 6 components: the largest first. */
void uz_principal(double principal[3], const double *stress, int components);
double uz_von_mises(const double *stress, int components);

/* The largest stress of an answer, if the scene wants to know, as the field has it: see peak_stress.c. Fills stressed,
 * von_mises and used. UZ_ERR_MEMORY. */
uz_status uz_find_peak_stress(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                              uz_error *err);

/* Pressure of each contact row from the reactions r (m): see contact_pressure.c. NaN where the contact has no area. */
uz_status uz_contact_pressure(double *pressure, const uz_body_model *model, const uz_scene *scene, const double *r,
                              uz_error *err);
/* nodal (n_nodes): the pressure on the surfaces, NaN where there is none. Of several rows at a node the largest; on the
 * other body's side the mean of the rows that push on the node, weighted with what each gives it, so that a uniform
 * pressure is found exactly and none lies outside of those of the rows. UZ_ERR_MEMORY, _SCENE. */
uz_status uz_nodal_pressure(double *nodal, const uz_body_model *model, const uz_scene *scene, const double *pressure,
                            uz_error *err);

/* *out: n_supports x n_nodes, by columns: which supports, springs left out, hold each node. The caller clears it. */
uz_status uz_list_held(uz_csc *out, const uz_mesh *mesh, const uz_scene *scene, uz_error *err);
/* Where these supports hold a node, none of a rigid group, each does uz_held_part of uz_held_share of the force v there
 * (held.c). Both are symmetric matrices times v: the first is the sum of d d' over the directions that it holds, the
 * second the pseudo-inverse of their sum over the supports. out may be v. */
void uz_held_part(double out[3], const uz_support *support, int dim, const double v[3]);
void uz_held_share(double out[3], const uz_scene *scene, int dim, const int32_t *support, int64_t count,
                   const double v[3]);
#endif
