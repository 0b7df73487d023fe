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

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The sine of the angle between directions of which one is held and the other is not. */
#define ALONG 0.1

/* Where two holders are next to each other is looked for in so many steps. */
enum { STEPS = 16 };

/* What holds some nodes along some directions, which the first `dims` of q span. */
typedef struct {
    const char *on; /* the group of supports, NULL: it is a contact */
    int64_t *node;
    int64_t n;
    int dims;
    double q[3][3];
} holder;

static void add_direction(holder *to, const double *n, const uz_body_model *model)
{
    double rest[3] = {0};
    for (int c = model->kind == UZ_AXISYMMETRIC; c < model->mesh.dim; c++) /* around the ring radial forces sum to 0 */
        rest[c] = n[c];
    for (int k = 0; k < to->dims; k++) {
        const double part = uz_dot3(rest, to->q[k]);
        for (int c = 0; c < 3; c++)
            rest[c] -= part * to->q[k][c];
    }
    if (to->dims == model->mesh.dim || sqrt(uz_dot3(rest, rest)) <= ALONG)
        return;
    uz_unit3(rest);
    memcpy(to->q[to->dims++], rest, sizeof rest);
}

/* Supports of one group hold the body in one place, however many say it. False: no memory. */
static bool find_support(holder *of, int64_t *n, const uz_body_model *model, const uz_support *support)
{
    const uz_group *group = uz_mesh_group(&model->mesh, support->on, "", NULL);
    int64_t at = 0;
    double normal[3] = {0};
    if (!group || support->kind == UZ_SUPPORT_SPRING)
        return true;
    while (at < *n && strcmp(of[at].on, support->on) != 0)
        at++;
    holder *to = &of[at];
    if (at == *n) {
        to->on = support->on;
        to->n = uz_group_node_count(&model->mesh, group);
        to->node = uz_alloc(to->n, sizeof *to->node);
        for (int64_t i = 0; i < to->n && to->node; i++)
            to->node[i] = uz_group_node_at(group, i);
        ++*n;
    }
    if (support->kind == UZ_SUPPORT_NORMAL && uz_unit_normal(normal, support->normal, model->mesh.dim))
        add_direction(to, normal, model);
    for (int c = 0; c < model->mesh.dim && support->kind != UZ_SUPPORT_NORMAL; c++) {
        const double axis[3] = {c == 0, c == 1, c == 2};
        if (!isnan(support->u[c]))
            add_direction(to, axis, model);
    }
    return to->node != NULL;
}

/* By the rows that press; their mean direction first, and others where the surface turns. False: no memory. */
static bool find_contacts(holder *of, const uz_body_model *model, const double *r, int64_t contacts)
{
    const uz_mesh_info *info = &model->info;
    const int dim = model->mesh.dim;
    double *mean = uz_alloc_zero(contacts, 3 * sizeof *mean);
    bool room = mean != NULL;
    for (int pass = 0; pass < 3 && room; pass++) {
        for (int64_t row = 0; row < model->m; row++) {
            const int64_t k = info->contact_of[row];
            const double *n = info->contact_normal + dim * row;
            if (model->law->kind->active(model->law, NULL, &r[row], 1) == 0)
                continue;
            if (pass == 1)
                of[k].node[of[k].n] = info->contact_node[row];
            of[k].n += pass < 2;
            for (int c = 0; c < dim && pass == 0; c++)
                mean[3 * k + c] += n[c];
            if (pass == 2)
                add_direction(&of[k], n, model);
        }
        for (int64_t k = 0; k < contacts && pass == 0 && room; k++) {
            of[k].node = uz_alloc(of[k].n, sizeof *of[k].node);
            room = of[k].node != NULL;
            of[k].n = 0;
            if (uz_unit3(mean + 3 * k) > 0)
                add_direction(&of[k], mean + 3 * k, model);
        }
    }
    free(mean);
    return room;
}

/* The node of a holder that is farthest along `way`. */
static const double *farthest(const holder *of, const uz_mesh *mesh, const double *way, double sign)
{
    const double *found = NULL;
    double most = -INFINITY;
    for (int64_t i = 0; i < of->n; i++) {
        const double *x = mesh->xyz + mesh->dim * of->node[i];
        double along = 0;
        for (int c = 0; c < mesh->dim; c++)
            along += sign * way[c] * x[c];
        if (along > most) {
            most = along;
            found = x;
        }
    }
    return found;
}

/* How far the hulls of two holders are apart, and along what (unit): by steps to the point of least norm of their
 * difference (E. G. Gilbert, SIAM J. Control 4 (1966) 61-80), each of which has a plane between them. */
static double distance(double along[3], const holder *a, const holder *b, const uz_mesh *mesh)
{
    double way[3] = {0}, most = 0;
    for (int c = 0; c < mesh->dim; c++) {
        for (int64_t i = 0; i < a->n; i++)
            way[c] -= mesh->xyz[mesh->dim * a->node[i] + c] / (double)a->n;
        for (int64_t i = 0; i < b->n; i++)
            way[c] += mesh->xyz[mesh->dim * b->node[i] + c] / (double)b->n;
    }
    for (int step = 0; step < STEPS; step++) {
        const double size = sqrt(uz_dot3(way, way));
        if (!(size > 0))
            break;
        const double *from = farthest(a, mesh, way, 1), *to = farthest(b, mesh, way, -1);
        double off[3] = {0}, turn[3];
        for (int c = 0; c < mesh->dim; c++)
            off[c] = to[c] - from[c];
        const double apart = uz_dot3(way, off) / size;
        for (int c = 0; c < 3; c++) {
            along[c] = apart > most ? way[c] / size : along[c];
            turn[c] = off[c] - way[c];
        }
        most = fmax(most, apart);
        const double part = fmin(1, -uz_dot3(way, turn) / uz_dot3(turn, turn));
        if (!(part > 1e-6))
            break;
        for (int c = 0; c < 3; c++)
            way[c] += part * turn[c];
    }
    return most;
}

/* The square of what a holder has of a direction. */
static double held(const holder *of, const double d[3])
{
    double sum = 0;
    for (int k = 0; k < of->dims; k++)
        sum += uz_dot3(of->q[k], d) * uz_dot3(of->q[k], d);
    return sum;
}

/* sqrt(c^2 + (h / l)^2) / l of two holders. */
static double of_pair(const holder *a, const holder *b, const uz_body_model *model, double thick, double least)
{
    double along[3] = {0}, both = 0;
    for (int k = 0; k < a->dims; k++)
        both += held(b, a->q[k]);
    both = fmin(1, both);
    if (!(both > ALONG * ALONG))
        return 0;
    const double length = distance(along, a, b, &model->mesh), l = fmax(length, least), flat = fmin(1, thick / l);
    const double part = length > 0 ? held(a, along) * held(b, along) : both;
    return sqrt(part + flat * flat * both) / l;
}

/* Of a group whatever supports hold it by; loads may hold each other, and what is left for supports is rounding. */
static double largest_force(const uz_scene *scene, const uz_evaluation *e)
{
    double most = UZ_LEAST_FORCE * e->loads_size;
    for (int64_t k = 0; k < e->n_supports; k++) {
        double sum[3] = {0};
        for (int64_t i = 0; i < e->n_supports; i++) {
            const bool same = i == k || (i < scene->n_supports && k < scene->n_supports &&
                                         strcmp(scene->supports[i].on, scene->supports[k].on) == 0);
            for (int c = 0; c < 3 && same; c++)
                sum[c] += e->supports[i].force[c];
        }
        most = fmax(most, sqrt(uz_dot3(sum, sum)));
    }
    for (int64_t k = 0; k < e->n_contacts; k++)
        most = fmax(most, sqrt(uz_dot3(e->contacts[k].force, e->contacts[k].force)));
    return most;
}

uz_status uz_force_leverage(double *out, const uz_body_model *model, const uz_scene *scene, const uz_evaluation *e,
                            const double *r, double buckling, uz_error *err)
{
    const int64_t most_holders = scene->n_supports + scene->n_contacts;
    /* h / L, and the least distance that counts: next to each other, supports are as stiff as a sector between them */
    const double size = uz_mesh_size(&model->mesh), slender = sqrt(5 * buckling), thick = slender * size,
                 least = sqrt(slender / 3) * size;
    const double force = largest_force(scene, e);
    double most = 0;
    int64_t n = 0;
    holder *of = uz_alloc_zero(most_holders, sizeof *of);
    bool room = of != NULL;
    for (int64_t k = 0; k < scene->n_supports && room; k++)
        room = find_support(of, &n, model, &scene->supports[k]);
    room = room && find_contacts(of + n, model, r, scene->n_contacts);
    n += scene->n_contacts;
    for (int64_t i = 0; i < n && room; i++)
        for (int64_t j = 0; j < i && of[i].n > 0; j++)
            if (of[j].n > 0)
                most = fmax(most, of_pair(&of[i], &of[j], model, thick, least));
    for (int64_t k = 0; k < most_holders && of; k++)
        free(of[k].node);
    free(of);
    if (!room)
        return uz_no_memory(err, "what holds the body");
    *out = force > 0 ? most * sqrt(2 * e->strain_energy) / force : 0;
    return UZ_OK;
}
