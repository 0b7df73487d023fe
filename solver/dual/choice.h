/* choice.h: the forms of the dual operator that there are, what each can do, and which one to take. */
#ifndef UZ_DUAL_CHOICE_H
#define UZ_DUAL_CHOICE_H

#include "uzawa.h"

/* What a form of the operator needs, and what it can do. */
typedef struct {
    uz_operator op;
    bool needs_factor; /* it is made from a factor of K, else from a uz_amg */
    bool contact_last; /* a factor whose order ends with the contact dofs serves it best */
    bool exact;        /* it solves to rounding; else within the aim, each solve the nearer the closer r is to that of
                        * the last apply, and with a bound on what is left in every answer */
    bool cheap_steps;  /* solve_active works on the contact only: a step costs little beside a linear solve */
    bool asked_for;    /* only by name, never by AUTO */
    bool lanes;        /* several loads with one pass over the factor: block.h */
    bool begin_near;   /* a displacement near the answer saves it a part of the solve */
} uz_dual_abilities;

typedef struct uz_dual_form uz_dual_form; /* form.h */
enum { UZ_DUAL_FORMS = 4 };
/* In the order of preference of uz_dual_choose. */
extern const uz_dual_form *const uz_dual_forms[UZ_DUAL_FORMS];
/* By its name, not AUTO. */
const uz_dual_form *uz_dual_form_of(uz_operator op);

/* The form that AUTO stands for, among those with a factor, from the sizes (n_b: dofs that N touches) and whether
 * each row bounds one dof. */
uz_operator uz_dual_choose(const uz_csc *N, int64_t n_b, uz_operator asked);

/* The dofs that N touches, ascending; the caller frees *dofs. */
uz_status uz_dual_contact_dofs(int64_t **dofs, int64_t *count, const uz_csc *N, uz_error *err);

#endif
