/* balance.h: resultants of loads, contacts and supports, and the energy that they store. */
#ifndef UZ_FIELDS_BALANCE_H
#define UZ_FIELDS_BALANCE_H

#include "assembly/assembly.h"
#include "post/interpenetration.h"
#include "uzawa.h"

/* What is known of a body that its stiffness at rest does not tell: forces by node (n_nodes x dim), of its elements and
 * springs and of its loads, and its strain energy, with theirs. Moments are then about places of the model's nodes
 * where these are, and springs are spread over the sides of `rest`, the body before anything moves. */
typedef struct {
    const double *inner, *load;
    double energy;
    const uz_body_model *rest;
} uz_balance_known;

/* Fills out->contacts, supports, loads, loads_size, imbalance and both energies; the names and zeros are there.
 * u: n_nodes x dim; r: m; scene: with the loads of the case; known: NULL: all follows from the stiffness; twice: u'K u
 * of the elements as of uz_mesh_look, NaN: it is to be computed. */
uz_status uz_balance_forces(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                            const double *r, const uz_balance_known *known, double twice, uz_error *err);

/* Contact with a rigid obstacle that is narrower than the mesh can tell (coarse.c), of the scene's contacts the worst.
 */
typedef struct {
    int64_t contact, sides, node; /* sides: how many it touches; contact -1: there is none; node: one of a side there */
    double depth;                 /* > 0: the obstacle stands so deep in a side that has no row inside */
    double part;                  /* else the part of the contact's force that it carries */
} uz_coarse_contact;
uz_status uz_find_coarse_contact(uz_coarse_contact *out, const uz_body_model *model, const uz_scene *scene,
                                 const double *u, const double *r, uz_error *err);

/* How far from its obstacle the body is where a contact with it presses and touches nowhere, else 0: rows of middles
 * have a share of their ends' gaps off them (contact_rows.c), and where sides are long against the obstacle's radius
 * one may press from afar. *row: the nearest that does, of the farthest such contact. r, g: m; overlap: n_contacts. */
double uz_pressed_apart(int64_t *row, const uz_body_model *model, const uz_overlap *overlap, int64_t n_contacts,
                        const double *r, const double *g);
#define UZ_WARN_APART "pressed_apart"

/* Adds to the warnings of result->evaluation what makes the answer doubtful. Reads its overlap and approach, and the
 * summary's geometry.sliding and discretization_error. coarse, look: of the answer. */
uz_status uz_find_doubts(uz_result *result, const uz_body_model *model, const uz_scene *scene,
                         const uz_coarse_contact *coarse, const uz_mesh_look *look, uz_error *err);
/* Those of them that are about the mesh alone, of an answer of large deformation. */
void uz_doubt_mesh(uz_result *result, const uz_body_model *model, const uz_scene *scene);
/* Warns where bodies of large deformation pass through each other, or themselves, under this part of the load. */
void uz_doubt_interpenetration(uz_evaluation *out, const uz_interpenetration *passed, int dim, double load);
/* Of an answer whose mesh is told to be off by more than was known then: coarse_mesh tells as much. */
void uz_doubt_coarse_mesh(uz_evaluation *out, double mesh_error);
/* The same of one that does not bear the whole load once its elements are divided. */
void uz_doubt_unborne(uz_evaluation *out);
/* *part: about how much of the forces of the answer u small deformation leaves out: squares of its gradient in the
 * strains, by the energy norm; stress that turns with the body, along u; strains and rotations in the law itself,
 * weighted by the energy U. Relative to its energy norm, and 1 where U is 0, as of warmth that nothing holds; and what
 * the mean stress does to a strip that bends, see nonlinear.c (buckling: uz_least_buckling_strain), or to forces
 * (leverage: uz_force_leverage). NaN: elements have incompatible modes, which large deformation has not. UZ_ERR_MEMORY.
 */
uz_status uz_measure_nonlinear(double *part, const uz_body_model *model, const double *u, double energy,
                               double buckling, double leverage, uz_error *err);
/* *out: sqrt(2 U S) / F over the root of the body's stiffness integral E dV, see leverage.c: the error of a force, in
 * parts of the largest, over the part of the energy norm that is left out. 0: nothing holds the body against itself.
 * e: forces and strain energy of the answer with reactions r. UZ_ERR_MEMORY. */
uz_status uz_force_leverage(double *out, const uz_body_model *model, const uz_scene *scene, const uz_evaluation *e,
                            const double *r, double buckling, uz_error *err);
/* The strain from which on a strip as flat as the body may buckle, by Euler. */
double uz_least_buckling_strain(const uz_body_model *model);
/* Warns that small deformation is off by `error` (uz_small) under a linear law. */
void uz_doubt_deformation(uz_evaluation *out, const uz_small *small);
/* The warning large_strain of an answer u of small deformation, once there is one of large deformation, at_large, of
 * this scene: it says what stress is off by in the element's middle, or is taken back where neither that nor the whole
 * body, by `small`, is off by more than it may be. */
void uz_doubt_strain(uz_evaluation *out, const uz_small *small, const uz_body_model *model, const uz_scene *finite,
                     const double *u, const double *at_large);
/* Warns that there was no `lacked` (memory, time) to find out; the answer has its measure (uz_evaluation.nonlinear). */
void uz_doubt_uncompared(uz_evaluation *out, const char *lacked);
/* Takes the warning `sliding` back, which turned out to be without ground, and warns of overlap that it had explained.
 */
void uz_drop_sliding(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene);

/* Beyond the first, answers with their contacts as they are before anything moves have the second. */
#define UZ_MOST_SLIDING 0.05
/* Under the linear law: dofs up to which small deformation is compared with large, which takes seconds at most. */
enum { UZ_MOST_COMPARED = 20000 };
/* Less than this of uz_measure_nonlinear is no large deformation. */
#define UZ_SURELY_SMALL 0.02
/* The least force that others are parts of, in uz_evaluation.loads_size. */
#define UZ_LEAST_FORCE 0.01
/* Of what forces may be off by, at most, less is surely small. */
#define UZ_SURELY_HELD  0.04
#define UZ_WARN_SLIDING "sliding"
#define UZ_WARN_COARSE  "coarse_contact"
#define UZ_WARN_OVERLAP "overlap"
/* Has a warning with this code been given? NULL has none. */
bool uz_is_warned(const uz_evaluation *of, const char *code);

/* *sliding: uz_geometry.sliding of an answer with its contacts as they are before anything moves; approach: of
 * overlap.h. NaN of a model at a place. */
uz_status uz_measure_sliding(double *sliding, const uz_body_model *model, const uz_scene *scene, const double *u,
                             const double *r, double approach, uz_error *err);

#endif
