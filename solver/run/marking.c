#include "run/marking.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "finite/mesh_error.h"
#include "obstacle/obstacle.h"
#include "run/results.h"
#include "scene/bisect.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdlib.h>

#define BULK  0.5
#define LEAST 0.05 /* one more grid is worth its while */
#define AIM   0.95 /* missing it by a hair would take another grid */
#define NEAR  0.5  /* left of the error: from then on triangles are halved once */

typedef struct {
    double share;
    int64_t element;
} indicator;

/* The largest first; of equal ones the first element. */
static int by_share(const void *a, const void *b)
{
    const indicator *x = a, *y = b;
    return x->share > y->share ? -1 : x->share < y->share ? 1 : (x->element > y->element) - (x->element < y->element);
}

/* Twice the integral of pressure times gap over the sides that may touch, to which both belong as functions between
 * their nodes: what it adds to the square of the error, beside that of the stress. room: 2 n_nodes zeros, left so. */
static void add_contact(double *eta2, double *room, const uz_body_model *body, const uz_scene *scene,
                        const uz_result *result)
{
    double *pressure = room, *gap = room + body->mesh.n_nodes;
    const uz_mesh_info *rows = &result->mesh;
    for (int64_t k = 0; k < 2 * scene->n_contacts && result->pressure && rows->contact_of; k++) {
        const uz_contact *contact = &scene->contacts[k / 2];
        const bool with = k % 2 == 1;
        const uz_group *group = with && contact->kind != UZ_OBSTACLE_BODY
                                    ? NULL
                                    : uz_mesh_group(&body->mesh, with ? contact->with : contact->on, "", NULL);
        for (int64_t i = 0; i < result->m && group; i++)
            if (rows->contact_of[i] == k / 2) { /* a node may have several rows */
                const int64_t node = rows->contact_node[i];
                pressure[node] = fmax(pressure[node], result->pressure[i]);
                gap[node] = fmax(gap[node], result->g[i]);
            }
        for (int64_t i = body->mesh.n_given; i < body->mesh.n_nodes && group && body->mesh.hangs; i++)
            if (body->mesh.hangs[i]) { /* nodes without rows */
                pressure[i] = fmax(0, uz_mesh_value_amid(&body->mesh, i, pressure, 1));
                gap[i] = fmax(0, uz_mesh_value_amid(&body->mesh, i, gap, 1));
            }
        for (int64_t f = 0; group && f < group->n_faces; f++) {
            uz_side side;
            double xyz[3 * UZ_FACE_NODES], sum[2] = {0}, same = 0;
            int64_t node[UZ_FACE_NODES];
            uz_body_side(&side, xyz, node, body, group->face[f]);
            for (int a = 0; a < side.nodes; a++) {
                sum[0] += pressure[node[a]];
                sum[1] += gap[node[a]];
                same += pressure[node[a]] * gap[node[a]];
            }
            if (sum[0] > 0 && sum[1] > 0) /* the mean of what is linear between two corners, or three */
                eta2[group->face[f].element] +=
                    2 * uz_side_area(&side) * (sum[0] * sum[1] - same) / (double)(side.nodes * (side.nodes + 1));
        }
        for (int64_t i = 0; i < result->m && group; i++)
            pressure[rows->contact_node[i]] = gap[rows->contact_node[i]] = 0;
        for (int64_t i = 0; i < body->mesh.n_nodes && body->mesh.hangs; i++)
            pressure[i] = gap[i] = 0;
    }
}

/* Is an obstacle nearer to a side, displaced by u, than that is long? */
static uz_status look_near(bool *near, const uz_obstacle *obstacle, const uz_body_model *body, uz_face face,
                           const double *u, uz_error *err)
{
    uz_side side;
    double xyz[3 * UZ_FACE_NODES], length = 0, least = INFINITY;
    int64_t node[UZ_FACE_NODES];
    uz_status status = UZ_OK;
    uz_body_side(&side, xyz, node, body, face);
    for (int a = 0; a < side.nodes && status == UZ_OK; a++) {
        uz_gap gap;
        double x[3] = {0};
        for (int c = 0; c < side.dim; c++)
            x[c] = xyz[side.dim * a + c] + u[side.dim * node[a] + c];
        for (int b = 0; b < a; b++)
            length = fmax(length, sqrt(uz_distance2(xyz + side.dim * a, xyz + side.dim * b, side.dim)));
        status = uz_obstacle_gap(&gap, obstacle, x, err);
        least = fmin(least, status == UZ_OK ? gap.gap : INFINITY);
        if (status == UZ_ERR_SCENE) { /* in its very middle */
            uz_error_reset(err);
            status = UZ_OK;
            least = 0;
        }
    }
    *near = least < length;
    return status;
}

/* An obstacle stands in the body, or its sides have gone past it: it is smaller than they are, and what strains say of
 * the mesh has no part in it. The elements of sides that are near get a share beyond all others. */
static uz_status add_obstacles(indicator *all, bool *any, const uz_body_model *body, const uz_problem *problem,
                               int64_t of_case, const uz_result *result, uz_error *err)
{
    const uz_scene scene = uz_scene_of_case(problem, of_case);
    const uz_summary *s = &result->summary;
    const bool stands_in = s->geometry.kind == UZ_KINEMATICS_FINITE && s->outcome == UZ_MESH_LIMIT && result->u;
    uz_status status = UZ_OK;
    for (int64_t k = 0; stands_in && k < scene.n_contacts && status == UZ_OK; k++) {
        const uz_contact *contact = &scene.contacts[k];
        const uz_group *group = uz_mesh_group(&body->mesh, contact->on, "/contacts", NULL);
        uz_obstacle *obstacle = NULL;
        if (contact->kind == UZ_OBSTACLE_BODY || contact->kind == UZ_OBSTACLE_PLANE || !group)
            continue;
        status = uz_obstacle_new(&obstacle, contact, k, scene.model, err);
        for (int64_t f = 0; f < group->n_faces && status == UZ_OK; f++) {
            bool near;
            status = look_near(&near, obstacle, body, group->face[f], result->u, err);
            if (status != UZ_OK || !near)
                continue;
            all[group->face[f].element].share = INFINITY;
            *any = true;
        }
        uz_obstacle_free(obstacle);
    }
    return status;
}

/* Of cases beside others: the square of the error that is asked for, which of a quantity is of second order already. */
static double weight_of(const uz_result *result)
{
    const uz_summary *s = &result->summary;
    const double error = fmin(uz_asked_error(s), 1e6);
    return s->evaluation->asked > 0 ? error : error * error;
}

uz_status uz_mark_elements(int64_t **list, int64_t *n, const uz_body_model *body, const uz_problem *problem,
                           uz_result *const *results, double left, bool subdivided, uz_error *err)
{
    const int64_t n_elements = body->mesh.n_elements, n_cases = problem->n_cases > 0 ? problem->n_cases : 1;
    const uz_element_type *type = uz_element_type_of((uz_element_kind)body->mesh.kind[0]);
    const int order = type->nodes > type->corners ? 2 : 1;
    indicator *all = uz_alloc(n_elements, sizeof *all);
    double *eta2 = uz_alloc(n_elements, sizeof *eta2), *room = uz_alloc_zero(2 * body->mesh.n_nodes, sizeof *room),
           sum = 0, part = 0;
    int64_t count = 0;
    bool done = all && eta2 && room, squared = false, proved = false; /* is the error one of second order? */
    for (int64_t e = 0; e < n_elements && done; e++)
        all[e] = (indicator){0, e};
    for (int64_t i = 0; i < n_cases && done; i++) {
        const uz_scene scene = uz_scene_of_case(problem, i);
        squared = squared || (results[i]->evaluation && results[i]->evaluation->asked > 0);
        const double *known = results[i]->evaluation ? results[i]->evaluation->share : NULL;
        proved = proved || results[i]->summary.guarantee.proved;
        double seen = 0;
        if (uz_has_no_answer(&results[i]->summary))
            continue;
        for (int64_t e = 0; e < n_elements && known; e++)
            all[e].share = fmax(all[e].share, known[e] * weight_of(results[i]));
        if (known)
            continue;
        const bool large = results[i]->summary.geometry.kind == UZ_KINEMATICS_FINITE;
        double error = large ? (double)NAN : uz_estimate_mesh_error(eta2, NULL, body, &scene, results[i]->u);
        if (large)
            done =
                uz_finite_mesh_error(&error, eta2, body, &scene, results[i]->free_strain, results[i]->u, NULL) == UZ_OK;
        else
            done = !isnan(error);
        for (int64_t e = 0; e < n_elements; e++)
            seen += eta2[e];
        add_contact(eta2, room, body, &scene, results[i]);
        if (!(seen > 0) || !isfinite(error))
            continue;
        for (int64_t e = 0; e < n_elements; e++)
            all[e].share = fmax(all[e].share, eta2[e] * error * error / seen);
    }
    bool stands_in = false;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < n_cases && done && status == UZ_OK; i++)
        status = add_obstacles(all, &stands_in, body, problem, i, results[i], err);
    for (int64_t e = 0; e < n_elements && done; e++)
        sum += isfinite(all[e].share) ? all[e].share : 0;
    if (done)
        qsort(all, (size_t)n_elements, sizeof *all, by_share);
    const bool every = left >= 1 && !stands_in;
    const bool once = !every && body->mesh.dim == 2 && !subdivided && (squared ? sqrt(left) : left) > NEAR;
    /* what is bisected once along each direction keeps 4^-order of the square of its error, of triangles that are
     * halved 2^-order; what else is in intervals by estimate, of the ends of contacts, falls faster */
    const double kept = squared ? (proved ? AIM : 1) * left : AIM * AIM * left * left,
                 needed = (1 - kept) / (1 - pow(once ? 2 : 4, -order)), bulk = fmin(BULK, fmax(LEAST, needed)) * sum;
    while (done && count < n_elements &&
           (every || (stands_in ? isinf(all[count].share) : part < bulk && all[count].share > 0)))
        part += all[count++].share;
    int64_t *grown = done && status == UZ_OK && count > 0 ? uz_realloc(*list, *n + 3 + count, sizeof *grown) : NULL;
    if (grown) {
        *list = grown;
        if (*n == 0 && subdivided)
            grown[(*n)++] = UZ_SUBDIVIDED;
        if (once)
            grown[(*n)++] = UZ_HALVED_ONCE;
        grown[(*n)++] = count;
        for (int64_t i = 0; i < count; i++)
            grown[(*n)++] = all[i].element;
    }
    done = done && (grown || count == 0);
    uz_free_all(all, eta2, room);
    return status != UZ_OK ? status
           : done          ? UZ_OK
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to choose among %lld elements", (long long)n_elements);
}
