/* held.c: what each of several supports does of the force at a node that they hold.
 *
 * With the directions d_i that they hold there R = sum of a_i d_i. Where the directions are independent there is one
 * such a; else the one of least norm, a_i = d_i . G^+ R with G = sum of d_i d_i' and its pseudo-inverse G^+, which does
 * not depend on the order in which they are named: two that hold the same direction bear half each. */
#include "post/parts.h"

#include "assembly/parts.h"
#include "core/vector3.h"

#include <math.h>
#include <string.h>

enum { DIM = 3 };

/* The directions (unit vectors) that a support holds. Returns how many. */
static int directions(double d[DIM][DIM], const uz_support *support, int dim)
{
    double u[DIM] = {NAN, NAN, NAN};
    int n = 0;
    memset(d, 0, DIM * sizeof *d);
    if (uz_support_is_inclined(d[0], support, dim))
        return 1;
    uz_support_values(u, support, dim);
    for (int c = 0; c < dim; c++)
        if (!isnan(u[c]))
            d[n++][c] = 1;
    return n;
}

void uz_held_part(double out[3], const uz_support *support, int dim, const double v[3])
{
    double d[DIM][DIM];
    const int n = directions(d, support, dim);
    for (int c = 0; c < DIM; c++)
        out[c] = 0;
    for (int i = 0; i < n; i++) {
        const double along = uz_dot3(d[i], v);
        for (int c = 0; c < DIM; c++)
            out[c] += along * d[i][c];
    }
}

/* q (orthonormal, n of them) becomes a basis with d, too, unless it is one already. */
static void extend(double q[DIM][DIM], int *n, const double d[DIM])
{
    double rest[DIM] = {d[0], d[1], d[2]};
    for (int pass = 0; pass < 2; pass++) /* twice: orthogonal to rounding (Giraud et al., Numer. Math. 101 (2005) 87) */
        for (int i = 0; i < *n; i++) {
            const double s = uz_dot3(rest, q[i]);
            for (int c = 0; c < DIM; c++)
                rest[c] -= s * q[i][c];
        }
    const double length = sqrt(uz_dot3(rest, rest));
    if (*n == DIM || length <= UZ_DEPENDENT)
        return;
    for (int c = 0; c < DIM; c++)
        q[*n][c] = rest[c] / length;
    ++*n;
}

void uz_held_share(double out[3], const uz_scene *scene, int dim, const int32_t *support, int64_t count,
                   const double v[3])
{
    double q[DIM][DIM], d[DIM][DIM], G[DIM][DIM], y[DIM], sum[DIM] = {0};
    int n = 0;
    for (int64_t s = 0; s < count; s++)
        for (int i = 0, of = directions(d, &scene->supports[support[s]], dim); i < of; i++)
            extend(q, &n, d[i]);
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++)
            G[i][j] = 0;
        for (int64_t s = 0; s < count; s++) {
            double part[DIM];
            uz_held_part(part, &scene->supports[support[s]], dim, q[j]);
            for (int i = 0; i < n; i++)
                G[i][j] += uz_dot3(q[i], part);
        }
        y[j] = uz_dot3(q[j], v);
    }
    for (int j = 0; j < n; j++) /* G in that basis, which is positive definite */
        for (int i = j + 1; i < n; i++) {
            const double times = G[i][j] / G[j][j];
            for (int k = j; k < n; k++)
                G[i][k] -= times * G[j][k];
            y[i] -= times * y[j];
        }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            y[i] -= G[i][k] * y[k];
        y[i] /= G[i][i];
        for (int c = 0; c < DIM; c++)
            sum[c] += y[i] * q[i][c];
    }
    memcpy(out, sum, sizeof sum);
}

uz_status uz_list_held(uz_csc *out, const uz_mesh *mesh, const uz_scene *scene, uz_error *err)
{
    uz_entries all = {.n = 0};
    for (int64_t s = 0; s < scene->n_supports; s++) {
        const uz_support *support = &scene->supports[s];
        const uz_group *group = support->kind == UZ_SUPPORT_SPRING ? NULL : uz_mesh_group(mesh, support->on, "", NULL);
        for (int64_t i = 0; group && i < uz_group_node_count(mesh, group); i++)
            uz_entries_add(&all, s, uz_group_node_at(group, i), 0);
    }
    return uz_csc_from_entries(out, scene->n_supports, mesh->n_nodes, &all, err);
}
