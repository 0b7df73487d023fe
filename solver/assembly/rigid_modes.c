/* rigid_modes.c: which rigid-body motions supports and springs leave to the parts of the body, and whether obstacles,
 * or parts that are held, stand in the way of those. */
#include "assembly/parts.h"

#include "assembly/body_parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "assembly/pressed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The first part that is free names its motions. */
static uz_status refuse_free(const uz_parts *parts, const char *who, uz_error *err)
{
    char names[300] = "", name[160], which[96] = "";
    double mode[UZ_MOTIONS][UZ_MOTIONS];
    const uz_part *p = parts->list, *end = parts->list + parts->count;
    while (p < end && p->rank == parts->motions)
        p++;
    if (p == end)
        return UZ_OK;
    const int n = uz_free_motions(mode, parts, p);
    for (int i = 0; i < n; i++) {
        const size_t used = strlen(names);
        uz_name_part_motion(name, sizeof name, parts, p, mode[i], false);
        snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", name);
    }
    if (parts->count > 1)
        snprintf(which, sizeof which, " of the part with node %lld", (long long)p->node);
    return uz_fail(err, UZ_ERR_FREE_BODY, "/supports", "%s leave %s%s free; hold it by further supports, or stabilize",
                   who, names, which);
}

uz_status uz_check_rigid_modes(const uz_body_model *model, uz_error *err)
{
    uz_parts parts;
    uz_status status = uz_find_parts(&parts, model, err);
    if (status == UZ_OK)
        status = refuse_free(&parts, "the supports", err);
    uz_parts_clear(&parts);
    return status;
}

/* -------------------------------------------------------------- parts that lean on parts */

static uz_status hold_by_bodies(uz_parts *parts, const uz_body_model *model, const double *z, int64_t n, uz_error *err)
{
    double *rows = uz_alloc_zero(model->m * n, sizeof *rows), *basis = uz_alloc(n * n, sizeof *basis);
    if (!rows || !basis) {
        free(rows);
        free(basis);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid-body modes", (long long)n);
    }
    const uz_csc *N = &model->N; /* rows (m x n) = N Z, each of length 1 or 0 */
    for (int64_t k = 0; k < n; k++)
        for (int64_t j = 0; j < model->d; j++)
            for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
                rows[N->idx[q] * n + k] += N->val[q] * z[k * model->d + j];
    for (int64_t i = 0; i < model->m; i++) {
        double square = 0;
        for (int64_t k = 0; k < n; k++)
            square += rows[i * n + k] * rows[i * n + k];
        for (int64_t k = 0; k < n; k++)
            rows[i * n + k] *= square > UZ_DEPENDENT * UZ_DEPENDENT ? 1 / sqrt(square) : 0;
    }
    /* The rows of N together hold what they span of all modes; what is left goes back to the parts. Gram and
     * Schmidt, as there are few modes. basis: n x n. */
    int64_t rank = 0, all, first = 0;
    for (int64_t i = 0; i < model->m && rank < n; i++) {
        memcpy(basis + rank * n, rows + i * n, (size_t)n * sizeof *basis);
        rank += uz_reject_rows(basis + rank * n, basis, rank, n);
    }
    all = rank;
    for (int64_t k = 0; k < n && all < n; k++) {
        memset(basis + all * n, 0, (size_t)n * sizeof *basis);
        basis[all * n + k] = 1;
        all += uz_reject_rows(basis + all * n, basis, all, n);
    }
    for (int64_t i = 0; i < parts->count; i++) {
        /* what of part i moves in the null space, rows rank .. all of basis: the rest of its motions counts as held */
        double mode[UZ_MOTIONS][UZ_MOTIONS], free_rows[UZ_MOTIONS][UZ_MOTIONS];
        uz_part *p = &parts->list[i];
        const int own = uz_free_motions(mode, parts, p);
        int moving = 0;
        for (int64_t r = rank; r < all; r++) {
            double q[UZ_MOTIONS] = {0};
            for (int k = 0; k < own; k++)
                for (int c = 0; c < UZ_MOTIONS; c++)
                    q[c] += basis[r * n + first + k] * mode[k][c];
            uz_extend_rows(free_rows, &moving, q);
        }
        int total = moving;
        for (int k = 0; k < parts->motions; k++)
            uz_extend_rows(free_rows, &total, parts->unit[k]);
        first += parts->motions - p->rank;
        p->rank = total - moving;
        memcpy(p->held, free_rows[moving], (size_t)p->rank * sizeof free_rows[0]);
    }
    free(rows);
    free(basis);
    return UZ_OK;
}

/* What the motions of its part make of a rigid group's own. */
static void set_rigid_modes(double *z, const uz_parts *parts, const uz_body_model *model, const uz_rigid_group *group)
{
    double mode[UZ_MOTIONS][UZ_MOTIONS], at[3], t[3], w[3];
    for (int64_t i = 0, column = 0; i < parts->count; i++) {
        const uz_part *p = &parts->list[i];
        const int own = uz_free_motions(mode, parts, p);
        uz_place_in_part(at, p, &model->mesh, group->anchor[0]);
        for (int c = 0; c < model->mesh.dim; c++)
            at[c] += (group->point[c] - model->mesh.xyz[group->anchor[0] * model->mesh.dim + c]) / uz_part_size(p);
        for (int k = 0; k < own; k++, column++) {
            if (parts->of[group->anchor[0]] != i)
                continue;
            uz_cross3(t, mode[k] + 3, at);
            for (int c = 0; c < 3; c++) {
                t[c] += mode[k][c];
                w[c] = mode[k][3 + c] / uz_part_size(p);
            }
            uz_set_motion(z + column * model->d, model, group, t, w);
        }
    }
}

uz_status uz_rigid_modes(double **modes, int64_t *count, const uz_body_model *model, uz_error *err)
{
    const int dim = model->mesh.dim;
    uz_parts parts;
    double mode[UZ_MOTIONS][UZ_MOTIONS], *z = NULL;
    int64_t n = 0;
    *modes = NULL;
    *count = 0;
    uz_status status = uz_find_parts(&parts, model, err);
    for (int64_t i = 0; status == UZ_OK && i < parts.count; i++)
        n += parts.motions - parts.list[i].rank;
    if (n > 0 && !(z = uz_alloc_zero(n * model->d, sizeof *z)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid-body modes", (long long)n);
    /* every motion that is left, as columns of z (d x n): displacements of the free dofs */
    for (int64_t i = 0, at = 0; status == UZ_OK && i < parts.count; i++) {
        const int own = uz_free_motions(mode, &parts, &parts.list[i]);
        for (int k = 0; k < own && at < n; k++, at++)
            for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
                double u[3], local[3], at_node[3];
                if (parts.of[a] != i)
                    continue;
                uz_place_in_part(at_node, &parts.list[i], &model->mesh, a);
                uz_cross3(u, mode[k] + 3, at_node);
                for (int c = 0; c < 3; c++)
                    u[c] += mode[k][c];
                uz_to_frame(local, model, a, u);
                for (int c = 0; c < dim; c++)
                    if (model->dof[a * dim + c] >= 0)
                        z[at * model->d + model->dof[a * dim + c]] = local[c];
            }
    }
    for (int64_t g = 0; status == UZ_OK && g < model->n_rigid; g++)
        set_rigid_modes(z, &parts, model, &model->rigid[g]);
    if (status == UZ_OK && n > 0 && (model->n_pair_rows > 0 || model->follow.first)) {
        status = hold_by_bodies(&parts, model, z, n, err);
    } else if (status == UZ_OK) {
        /* An obstacle stands in the way of one combination of the motions of its part, from one side. */
        for (int64_t i = 0; i < model->m; i++)
            uz_hold_part(&parts, &model->mesh, model->info.contact_node[i],
                         model->info.contact_normal + i * model->mesh.dim);
    }
    if (status == UZ_OK)
        status = refuse_free(&parts, model->m > 0 ? "the supports and obstacles" : "the supports", err);
    uz_parts_clear(&parts);
    if (status == UZ_OK) {
        *modes = z;
        *count = n;
    } else {
        free(z);
    }
    return status;
}

/* Loads this small beside those that balance in a mode are rounding. */
#define BALANCED 1e-9

uz_status uz_check_pressed(const uz_body_model *model, const double *p, uz_error *err)
{
    uz_pressing how = UZ_PRESSED_ON;
    uz_parts parts;
    char motion[240] = "a rigid motion";
    double *y = uz_alloc_zero(model->n_modes, sizeof *y);
    if (!y)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid-body modes", (long long)model->n_modes);
    uz_status status = uz_load_on_modes(&how, y, model->modes, model->n_modes, &model->N, p, BALANCED, true, err);
    if (status == UZ_OK && how != UZ_PRESSED_ON) {
        double mode[UZ_MOTIONS][UZ_MOTIONS], largest = 0;
        const bool known = uz_find_parts(&parts, model, NULL) == UZ_OK;
        for (int64_t i = 0, at = 0; known && i < parts.count; i++) { /* of the part that it moves most */
            double q[UZ_MOTIONS] = {0}, square = 0;
            const int own = uz_free_motions(mode, &parts, &parts.list[i]);
            for (int k = 0; k < own; k++, at++)
                for (int c = 0; c < UZ_MOTIONS; c++)
                    q[c] += y[at] * mode[k][c];
            for (int c = 0; c < UZ_MOTIONS; c++)
                square += q[c] * q[c];
            if (square <= largest)
                continue;
            largest = square;
            uz_name_part_motion(motion, sizeof motion, &parts, &parts.list[i], q, true);
            const size_t used = strlen(motion);
            if (parts.count > 1)
                snprintf(motion + used, sizeof motion - used, " of the part with node %lld",
                         (long long)parts.list[i].node);
        }
        uz_parts_clear(&parts);
        status = uz_fail(err, UZ_ERR_FREE_BODY, "/loads",
                         how == UZ_PUSHED_AWAY
                             ? "the loads push the body away: %s; no obstacle or support stands in its way. Hold it by "
                               "a support or a spring, turn the load, or add the obstacle"
                             : "the loads do not press the body on: %s costs nothing; only an obstacle could hold it. "
                               "Hold it by a support or a spring, or press it on",
                         motion);
    }
    free(y);
    return status;
}
