/* results.h: what is left of a solve, whoever made it. */
#ifndef UZ_RESULTS_H
#define UZ_RESULTS_H

#include "assembly/assembly.h"
#include "methods/method.h"
#include "post/ahead.h"
#include "uzawa.h"

static inline bool uz_has_no_answer(const uz_summary *s)
{
    return s->outcome == UZ_INFEASIBLE || s->outcome == UZ_OUT_OF_REACH || s->outcome == UZ_UNHELD;
}
/* Of the free dofs u (d; may be result->u) of an answer with m rows: displacements by node, mesh, forces, pressures.
 * ahead: as uz_evaluate takes it. Errors: UZ_ERR_MEMORY. */
uz_status uz_describe_scene(uz_result *result, const uz_body_model *model, const uz_scene *scene, const double *u,
                            const double *prescribed, int64_t m, uz_ahead *ahead, uz_error *err);
/* There is no answer: nothing that looks like one may be left. */
void uz_blank_answer(uz_result *result);
/* One of n cases that was refused as UZ_UNHELD takes no answer from the others: *status becomes UZ_OK, but where all of
 * them are, which is refused as the first one was. unheld, first: how many there were before, and why; 0 at first. */
void uz_pass_unheld(uz_status *status, int64_t *unheld, uz_error *first, const uz_result *result, int64_t n,
                    uz_error *err);
/* Does a contact press that touches nowhere (UZ_WARN_APART)? */
bool uz_is_pressed_apart(const uz_summary *s);
/* An answer that converged, but has such a contact, ends as UZ_MESH_LIMIT. */
void uz_judge_contact(uz_result *result);
/* An answer that converged, but on a mesh that leaves the first quantity a wider interval than was asked for, ends as
 * UZ_MESH_LIMIT. */
void uz_judge_quantity(uz_result *result);
/* Was a guarantee asked for, of the quantity that the accuracy is about, else of the whole error, and not found? */
bool uz_is_unproved(const uz_summary *s);
/* The summary's message: one sentence on an outcome that is not `converged`. end: of the method. */
void uz_explain_outcome(uz_result *result, uz_end end);

#endif
