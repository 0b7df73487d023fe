/* leverage.c: how much farther forces may be off than the energy norm.
 *
 * A stress s that is left out changes the force of a support by s : grad(v) of any v that is 1 there and 0 where else
 * the body is held, best by the v of least energy S: by the norm of s times sqrt(S) at most, which is sqrt(2 U S) / F
 * as much of the largest force F as the norm of s is of the answer's. Of a thick body that is about 1; of a strip that
 * is held at both ends and bends, along which any stretch pulls, about a quarter of L / h. S is taken for that of a
 * strip from one holder to the next, pulled along it, or bent across it: E A / l (c^2 + (h / l)^2), c the part of the
 * way l between them that is along the force. What holds the body in one place only passes loads on, whatever is left
 * out. */
#include "post/balance.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "post/parts.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A normal has a part along an axis that counts. */
#define ALONG 0.1

/* What holds some nodes along some axes, and the box around these. */
typedef struct {
    bool along[3], any;
    double low[3], high[3];
} holder;

static void add_place(holder *to, const double *x, int dim)
{
    for (int c = 0; c < dim; c++) {
        to->low[c] = to->any ? fmin(to->low[c], x[c]) : x[c];
        to->high[c] = to->any ? fmax(to->high[c], x[c]) : x[c];
    }
    to->any = true;
}

static void find_support(holder *to, const uz_body_model *model, const uz_support *support)
{
    const uz_mesh *mesh = &model->mesh;
    const uz_group *group = support->kind == UZ_SUPPORT_SPRING ? NULL : uz_mesh_group(mesh, support->on, "", NULL);
    const double size = sqrt(uz_dot3(support->normal, support->normal));
    for (int64_t i = 0; group && i < uz_group_node_count(mesh, group); i++)
        add_place(to, mesh->xyz + mesh->dim * uz_group_node_at(group, i), mesh->dim);
    for (int c = 0; c < mesh->dim && group; c++)
        to->along[c] =
            support->kind == UZ_SUPPORT_NORMAL ? fabs(support->normal[c]) > ALONG * size : !isnan(support->u[c]);
}

static void find_contacts(holder *of, const uz_body_model *model, const double *r)
{
    const uz_mesh_info *info = &model->info;
    const int dim = model->mesh.dim;
    for (int64_t row = 0; row < model->m; row++) {
        holder *to = &of[info->contact_of[row]];
        if (model->law->kind->active(model->law, NULL, &r[row], 1) == 0)
            continue;
        add_place(to, model->mesh.xyz + dim * info->contact_node[row], dim);
        for (int c = 0; c < dim; c++)
            to->along[c] = to->along[c] || fabs(info->contact_normal[dim * row + c]) > ALONG;
    }
}

/* The largest sqrt(c^2 + (h / l)^2) / l of two holders. */
static double of_pair(const holder *a, const holder *b, const uz_body_model *model, double thick, double least)
{
    const int dim = model->mesh.dim;
    double way[3] = {0}, most = 0;
    for (int c = 0; c < dim; c++)
        way[c] = fmax(0, fmax(a->low[c] - b->high[c], b->low[c] - a->high[c]));
    const double length = sqrt(uz_dot3(way, way)), l = fmax(length, least), flat = fmin(1, thick / l);
    for (int c = model->kind == UZ_AXISYMMETRIC; c < dim; c++) { /* around the ring a radial force sums to nothing */
        const double part = length > 0 ? way[c] / length : 1;
        if (a->along[c] && b->along[c])
            most = fmax(most, sqrt(part * part + flat * flat) / l);
    }
    return most;
}

/* Supports of one group hold the body in one place, however many say it. */
static bool is_one_group(const uz_scene *scene, int64_t i, int64_t j)
{
    return i < scene->n_supports && j < scene->n_supports && strcmp(scene->supports[i].on, scene->supports[j].on) == 0;
}

/* Loads may hold each other, and what is left for supports is rounding. */
static double largest_force(const uz_evaluation *e)
{
    double most = UZ_LEAST_FORCE * e->loads_size;
    for (int64_t k = 0; k < e->n_supports; k++)
        most = fmax(most, sqrt(uz_dot3(e->supports[k].force, e->supports[k].force)));
    for (int64_t k = 0; k < e->n_contacts; k++)
        most = fmax(most, sqrt(uz_dot3(e->contacts[k].force, e->contacts[k].force)));
    return most;
}

uz_status uz_force_leverage(double *out, const uz_body_model *model, const uz_scene *scene, const uz_evaluation *e,
                            const double *r, double buckling, uz_error *err)
{
    const int64_t n = scene->n_supports + scene->n_contacts;
    /* h / L, and the least distance that counts: next to each other, supports are as stiff as a sector between them */
    const double slender = sqrt(5 * buckling), thick = slender * model->mesh.extent,
                 least = sqrt(slender / 3) * model->mesh.extent;
    const double force = largest_force(e);
    double most = 0;
    holder *of = uz_alloc_zero(n, sizeof *of);
    if (!of)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for what holds the body");
    for (int64_t k = 0; k < scene->n_supports; k++)
        find_support(&of[k], model, &scene->supports[k]);
    find_contacts(of + scene->n_supports, model, r);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i && of[i].any; j++)
            if (of[j].any && !is_one_group(scene, i, j))
                most = fmax(most, of_pair(&of[i], &of[j], model, thick, least));
    free(of);
    *out = force > 0 ? most * sqrt(2 * e->strain_energy) / force : 0;
    return UZ_OK;
}
