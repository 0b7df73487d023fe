/* row_turn.h: how the forces of contact rows between bodies change as the bodies move. */
#ifndef UZ_ROW_TURN_H
#define UZ_ROW_TURN_H

#include "assembly/assembly.h"
#include "core/hooks.h"
#include "linalg/linalg.h"

/* force: the derivative of N(u)' r in the free dofs, r fixed, d x d and not symmetric: rows of two surfaces
 * (assembly/mortar.h) are not the derivatives of one energy. gap: what the derivative of the gaps, m x d, is off -N, of
 * the pressed rows; it is small where these are closed all along. known: each row that is pressed has been found at all
 * places beside the one that there is; else there is neither. */
typedef struct {
    bool known;
    uz_entries force, gap;
} uz_row_turn;

/* Is there a contact between bodies? */
bool uz_has_pairs(const uz_scene *scene);

/* The row of a place of a contact; -1: there is none. Rows come contact by contact, places ascending, and so do those
 * that are asked for one after the other: *next is 0 at first, and where the search goes on. */
int64_t uz_next_row(int64_t *next, const uz_body_model *rows, int64_t contact, int64_t place);
/* Of the rows between bodies whose reaction (r: rows->m) is less than -least. rows: the body that `base` is, moved to a
 * place (uz_body_model_move); scene: with the contacts. stop (NULL: never) is asked at each
 * place in the plane; where it is due nothing is known. In space how parts of a face change is left out of both. The
 * caller clears *out in every case. UZ_ERR_MEMORY */
uz_status uz_row_turn_find(uz_row_turn *out, const uz_body_model *base, const uz_body_model *rows,
                           const uz_scene *scene, const double *r, double least, const uz_stop *stop, uz_error *err);
void uz_row_turn_clear(uz_row_turn *turn);
/* The whole of both along v (d), by a difference of the rows at one place more: force (d) and gap (m) are added to.
 * Pressed are all rows with r < 0. false in *known, with nothing added: a pressed row is not there, or no contact can
 * be found. UZ_ERR_MEMORY */
uz_status uz_row_turn_along(bool *known, double *force, double *gap, const uz_body_model *base,
                            const uz_body_model *rows, const uz_scene *scene, const double *r, const double *v,
                            uz_error *err);
/* y += A x; skew: that of the skew part of A alone. */
void uz_add_entries(double *y, const uz_entries *of, const double *x, bool skew);

/* *out: K (lower triangle) less the symmetric part of `turn` (NULL: none), with room for what stiffness along the rows
 * with r < -least adds; r NULL: for none. The caller clears *out. UZ_ERR_MEMORY */
uz_status uz_widen_by_rows(uz_csc *out, const uz_csc *K, const uz_csc *N, const double *r, double least,
                           const uz_row_turn *turn, uz_error *err);

#endif
