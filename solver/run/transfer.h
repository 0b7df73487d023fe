/* transfer.h: the contact of one grid, or at one place of a body, as the start of the next. */
#ifndef UZ_ADAPTIVE_TRANSFER_H
#define UZ_ADAPTIVE_TRANSFER_H

#include "assembly/assembly.h"
#include "uzawa.h"

/* Reactions for the contact rows of `fine`: the pressure of the result on box `coarse`, interpolated from its nodes,
 * times the area of each row. coarse NULL: the mesh of `fine` is refined by bisection from that of the result. Contacts
 * are those of one scene. *out NULL and UZ_OK: the result has no pressure. The caller frees with uz_state_free. */
uz_status uz_transfer_start(uz_state **out, const uz_result *result, const uz_box *coarse, const uz_body_model *fine,
                            uz_error *err);

/* Reactions for the contact rows of a body at another place: those of the result at the same nodes, in the order in
 * which a contact has rows there; of a result without a mesh those of the same rows, if there are as many. whole: a
 * state that can be stored, which says nothing but these reactions. *out NULL and UZ_OK: the result has none. The
 * caller frees with uz_state_free. */
uz_status uz_carry_start(uz_state **out, const uz_result *result, const uz_mesh_info *there, int64_t m, bool whole,
                         uz_error *err);

/* What is by nodes, n_nodes x stride, at those of a mesh that is refined from theirs. NULL: no memory. */
double *uz_carry_nodal(const uz_mesh *finer, const double *value, int64_t n_nodes, int stride);
/* Displacements u of the nodes of box `from`, at those of another mesh of the same box: linear along each axis between
 * the corners of its cells. NULL: no memory. The caller frees it. */
double *uz_carry_box(const uz_mesh *to, const uz_box *from, const double *u);

#endif
