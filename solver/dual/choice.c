/* choice.c: the table of the forms of the dual operator, and the choice of one. */
#include "dual/form.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

/* In the order of preference among those that suit. */
const uz_dual_form *const uz_dual_forms[UZ_DUAL_FORMS] = {&uz_dual_condensed, &uz_dual_factored, &uz_dual_matrix_free,
                                                          &uz_dual_distributed};

const uz_dual_form *uz_dual_form_of(uz_operator op)
{
    int k = 0;
    while (k < UZ_DUAL_FORMS - 1 && uz_dual_forms[k]->can.op != op)
        k++;
    return uz_dual_forms[k];
}

enum { SMALL_BOUNDS = 128 };

uz_operator uz_dual_choose(const uz_csc *N, int64_t n_b, uz_operator asked)
{
    if (asked != UZ_OPERATOR_AUTO)
        return asked;
    uz_dual_shape shape = {N->cols, N->rows, n_b, N->rows > SMALL_BOUNDS && uz_csc_is_single(N)};
    int k = 0;
    while (k < UZ_DUAL_FORMS - 1 && !(uz_dual_forms[k]->suits && uz_dual_forms[k]->suits(&shape)))
        k++;
    return uz_dual_forms[k]->can.op;
}

uz_status uz_dual_contact_dofs(int64_t **dofs, int64_t *count, const uz_csc *N, uz_error *err)
{
    int64_t touched = 0;
    for (int64_t j = 0; j < N->cols; j++)
        touched += N->ptr[j + 1] > N->ptr[j];
    *dofs = uz_alloc(touched, sizeof **dofs);
    *count = 0;
    if (!*dofs)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld dofs", (long long)touched);
    for (int64_t j = 0; j < N->cols; j++)
        if (N->ptr[j + 1] > N->ptr[j])
            (*dofs)[(*count)++] = j;
    return UZ_OK;
}
