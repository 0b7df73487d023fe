#include "run/rows.h"

#include "core/alloc.h"
#include "core/error.h"
#include "element/element_type.h"
#include "scene/scene.h"

#include <math.h>
#include <string.h>

/* With fewer rows than these there is nothing to save; and nothing worth another certificate where more than this part
 * of them stays. */
enum { FEW_ROWS = 512 };
#define MOST_KEPT 0.75

/* ---------------------------------------------------------------- how many rows there may be */

static double box_nodes(const uz_box *box, const char *on)
{
    static const char *const sides[] = {"left", "right", "bottom", "top", "back", "front"};
    uz_element_kind kind = UZ_QUAD4;
    double nodes = 1;
    int across = -1;
    const bool known = uz_element_parse(&kind, box->element);
    const uz_element_type *type = uz_element_type_of(kind);
    const bool middles = !known || type->nodes > type->corners;
    for (int k = 0; k < 6; k++)
        if (strcmp(on, sides[k]) == 0)
            across = k / 2;
    for (int axis = 0; axis < box->dim && axis < 3; axis++)
        nodes *= axis == across ? 1 : (middles ? 2 : 1) * (double)box->cells[axis] + 1;
    return nodes;
}

/* Several groups may have one name. */
static double given_nodes(const uz_given_mesh *mesh, const char *on)
{
    double nodes = 0;
    bool found = false;
    for (int64_t i = 0; i < mesh->n_groups; i++) {
        const uz_given_group *group = &mesh->groups[i];
        if (strcmp(on, group->name) != 0)
            continue;
        found = true;
        nodes += (double)(group->n_nodes + (group->n_faces > 0 ? group->face_first[group->n_faces] : 0));
        if (group->n_elements > 0)
            return (double)mesh->n_nodes;
    }
    return found ? fmin(nodes, (double)mesh->n_nodes) : (double)mesh->n_nodes;
}

bool uz_may_omit_rows(const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    double rows = 0;
    if (problem->kind != UZ_PROBLEM_SCENE || scene->all_candidates)
        return false;
    for (int64_t k = 0; k < scene->n_contacts; k++)
        rows += (scene->contacts[k].kind == UZ_OBSTACLE_PLANE ? 1 : 3) * /* sides may have one more each */
                (scene->source == UZ_MESH_GIVEN ? given_nodes(&scene->given, scene->contacts[k].on)
                                                : box_nodes(&scene->box, scene->contacts[k].on));
    return rows > FEW_ROWS;
}

/* ---------------------------------------------------------------- the choice */

uz_status uz_choose_rows(uz_candidates *rows, const double *h, int64_t m, const uz_mesh_info *info,
                         const uz_scene *scene, const uz_candidates *wanted, uz_error *err)
{
    *rows = (uz_candidates){.m = m, .count = m};
    if (m <= FEW_ROWS || scene->all_candidates)
        return UZ_OK;
    double square = 0, most = 0;
    for (int axis = 0; axis < info->dim; axis++) { /* the diagonal of the box around the body */
        double low = INFINITY, high = -INFINITY;
        for (int64_t i = 0; i < info->n_nodes; i++) {
            const double at = info->xyz[i * info->dim + axis];
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        square += (high - low) * (high - low);
    }
    for (int64_t i = 0; i < scene->n_supports;
         i++) { /* the farthest that one pushes nodes, and perhaps the whole body */
        const uz_support *s = &scene->supports[i];
        double u = 0;
        const bool rigid = s->kind == UZ_SUPPORT_RIGID;
        for (int c = 0; c < info->dim && (s->kind == UZ_SUPPORT_COMPONENTS || rigid); c++)
            u = isnan(s->u[c]) ? u : hypot(u, s->u[c]);
        if (uz_support_turns(s) || rigid) { /* no node is farther from what it turns about than this */
            double away = 0;
            for (int c = 0; c < info->dim && info->n_nodes > 0; c++)
                away = hypot(away, info->xyz[c] - s->about[c]);
            for (int c = 0; c < 3; c++)
                u += isnan(s->turn[c]) ? 0 : (away + sqrt(square)) * fabs(s->turn[c]);
        }
        most = fmax(most, s->kind == UZ_SUPPORT_NORMAL ? fabs(s->value) : u);
    }
    uz_status status = uz_candidates_first(rows, h, m, UZ_CANDIDATES_REACH * sqrt(square) + most, err);
    if (status == UZ_OK && wanted && wanted->in && wanted->m == m)
        status = uz_candidates_add(rows, wanted, err);
    if (status == UZ_OK && (double)rows->count <= MOST_KEPT * (double)m)
        return UZ_OK;
    uz_candidates_clear(rows);
    *rows = (uz_candidates){.m = m, .count = m};
    return status;
}

/* ---------------------------------------------------------------- sets */

static uz_status make_set(uz_candidates *set, int64_t m, uz_error *err)
{
    if (set->in)
        return UZ_OK;
    *set = (uz_candidates){.m = m, .in = uz_alloc_zero(m, 1)};
    return set->in ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact candidates", (long long)m);
}

static void include(uz_candidates *set, int64_t i)
{
    set->count += !set->in[i];
    set->in[i] = 1;
}

uz_status uz_candidates_add(uz_candidates *to, const uz_candidates *from, uz_error *err)
{
    const uz_status status = make_set(to, from->m, err);
    for (int64_t i = 0; i < from->m && status == UZ_OK; i++)
        if (from->in[i])
            include(to, i);
    return status;
}

uz_status uz_candidates_add_start(uz_candidates *to, const uz_state *start, uz_error *err)
{
    const double *forces[] = {start->r, start->rho, start->best_r, start->anchor};
    const uz_status status = make_set(to, start->m, err);
    for (size_t k = 0; k < sizeof forces / sizeof forces[0] && status == UZ_OK; k++)
        for (int64_t i = 0; i < start->m && forces[k]; i++)
            if (forces[k][i] != 0)
                include(to, i);
    return status;
}

bool uz_candidates_has(const uz_candidates *a, const uz_candidates *b)
{
    for (int64_t i = 0; b->in && a->in && i < b->m; i++)
        if (b->in[i] && !a->in[i])
            return false;
    return true;
}
