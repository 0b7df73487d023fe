/* triangular.c: what substitutions with the factor need, and its trailing block. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

uz_factor_workspace *uz_factor_workspace_new(void)
{
    uz_factor_workspace *ws = uz_alloc_zero(1, sizeof *ws);
    if (ws && !uz_cholmod_start(&ws->common)) {
        free(ws);
        ws = NULL;
    }
    return ws;
}

void uz_factor_workspace_free(uz_factor_workspace *ws)
{
    if (!ws)
        return;
    cholmod_l_finish(&ws->common);
    uz_free_all(ws->panel, ws);
}

void uz_factor_permute(const uz_factor *factor, double *permuted, const double *x)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    for (int64_t k = 0; k < factor->n; k++)
        permuted[k] = x[perm[k]];
}

void uz_factor_unpermute(const uz_factor *factor, double *x, const double *permuted)
{
    const SuiteSparse_long *perm = factor->L.Perm;
    for (int64_t k = 0; k < factor->n; k++)
        x[perm[k]] = permuted[k];
}

uz_status uz_factor_solve(const uz_factor *factor, uz_factor_workspace *ws, double *x, const double *b, double *room,
                          uz_error *err)
{
    uz_factor_permute(factor, room, b);
    uz_status status = uz_factor_solve_one(factor, ws, room, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(factor, ws, room, false, err);
    uz_factor_unpermute(factor, x, room);
    return status;
}

uz_status uz_need_panel(uz_factor_workspace *ws, size_t need, uz_error *err)
{
    if (ws->panel && need <= ws->panel_size)
        return UZ_OK;
    free(ws->panel);
    ws->panel = uz_alloc((int64_t)need, sizeof *ws->panel);
    ws->panel_size = ws->panel ? need : 0;
    return ws->panel ? UZ_OK : uz_no_memory(err, "a substitution");
}

/* The elimination tree of several unconnected bodies is a forest and its postorder may put one body's contact dofs
 * before another body's interior. That is harmless: all that is needed is that the columns of the last dofs reach only
 * rows of last dofs, which is checked here. */
uz_status uz_factor_last_block(const uz_factor *factor, double *block, int64_t *order, int64_t *where, uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *s = L->s, *perm = L->Perm;
    const int64_t n_last = factor->info.n_last, *last = factor->info.last;
    int64_t count = 0, *rank = uz_alloc(factor->n, sizeof *rank);
    if (!rank)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld dofs", (long long)factor->n);
    for (int64_t k = 0; k < factor->n; k++) /* the place of position k among the last dofs, -1 for the others */
        rank[k] = -1;
    for (int64_t i = 0; i < n_last; i++)
        rank[factor->analysis->position[last[i]]] = 0;
    for (int64_t k = 0; k < factor->n; k++) {
        if (rank[k] < 0)
            continue;
        rank[k] = count;
        order[count] = perm[k];
        where[count++] = k;
    }
    memset(block, 0, (size_t)n_last * (size_t)n_last * sizeof *block);
    bool ok = true;
    for (size_t k = 0; ok && k < L->nsuper; k++) { /* a supernode: columns from super[k] on, rows, values by column */
        const int64_t columns = super[k + 1] - super[k], rows = pi[k + 1] - pi[k];
        for (int64_t j = 0; ok && j < columns; j++) {
            const double *values = (const double *)L->x + px[k] + j * rows;
            const int64_t column = rank[super[k] + j];
            for (int64_t i = j; ok && column >= 0 && i < rows; i++) {
                const int64_t row = rank[s[pi[k] + i]];
                ok = row >= 0 || values[i] == 0.0; /* else an interior dof comes after a contact dof it couples to */
                if (row >= 0)
                    block[row + column * n_last] = values[i];
            }
        }
    }
    free(rank);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_INTERNAL, "", "the contact dofs are not last in the elimination");
}
