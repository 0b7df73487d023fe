/* functional.h: quantities as functionals of the answer, and the problems whose answers weigh the error of the mesh. */
#ifndef UZ_POST_FUNCTIONAL_H
#define UZ_POST_FUNCTIONAL_H

#include "assembly/assembly.h"
#include "uzawa.h"

/* The adjoint is z = own u + times w, where w is the displacement under the nodal forces `load`, with supported dofs at
 * `held` and the rows in contact at N w = gap (functional.c). */
typedef struct {
    double found; /* the quantity's value of the answer */
    double blur;  /* by how much it may be off as nodes with sides within and without a window count in part */
    double own, times;
    double *load; /* n_nodes x dim */
    double *held; /* n_fixed */
    double *gap;  /* m */
    char why[96]; /* why the mesh's part can't be told; else "" */
} uz_functional;

/* Of an answer of large deformation, whose model is at its place: the body with its nodes there (uz_displaced), and the
 * forces of its loads there, n_nodes x dim. */
typedef struct {
    const uz_body_model *displaced;
    const double *load;
} uz_functional_place;

/* scene: with the loads of the case; u: n_nodes x dim; r: m; h (m), prescribed (n_fixed): those of the load; at: NULL
 * of small deformation. The adjoint is then z = times w, and takes the answer's own error `own` times. The caller
 * clears *out in every case. UZ_ERR_MEMORY; UZ_ERR_SCENE at `where`: no such group, no area in the window. */
uz_status uz_functional_make(uz_functional *out, const uz_quantity *quantity, const char *where,
                             const uz_body_model *model, const uz_scene *scene, const uz_result *answer,
                             const double *h, const double *prescribed, const uz_functional_place *at, uz_error *err);
/* depth (m): how deep each row's obstacle stands, in the mean, in the surface whose sides' nodes all press on it. Rows
 * keep nodes out of a round obstacle, and sides between them are chords: of the obstacle, and of the body where that is
 * round itself, of which bulge (m) is what its surface stands out of them. 0 of contacts between two. u (n_nodes x
 * dim): where the answer has the nodes, from where model->place has them, else its mesh; r: m. UZ_ERR_MEMORY. */
uz_status uz_contact_depth(double *depth, double *bulge, const uz_body_model *model, const uz_scene *scene,
                           const double *u, const double *r, uz_error *err);
void uz_functional_clear(uz_functional *functional);

#endif
