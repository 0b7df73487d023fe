/* warnings.c: does the answer fit the assumptions it was computed under? Strains and rotations are taken to be small,
 * normals and the places where bodies meet to be those of the undeformed body. */
#include "post/balance.h"

#include "core/vector3.h"
#include "linalg/pieces.h"
#include "post/parts.h"
#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

/* A rotation by w makes strains of w^2 / 2 that are not there: at 0.1 half a per cent. */
static const double MOST_ROTATION = 0.1, MOST_STRAIN = 0.05, MOST_TURN = 0.05;
/* The least cosine between normals that point the same way: not those of faces along the obstacle. */
static const double AWAY = 0.1;

/* In parts of the approach: of facets (five sides across a contact of curves leave 2 %), and of an overlap. Answers
 * that are right leave 1 % of overlap, wrong ones more than a quarter. */
static const double MOST_FACETS = 0.05, MOST_OVERLAP = 0.1;
/* Of the reaction at a node: what goes to other nodes than the one that it meets. */
static const double MOST_MISMATCH = 0.05;

/* By how much of itself the largest pressure may stand out from the mean around it. In press fits, sleeves and balls of
 * all elements, whose pressure is the same everywhere, the largest was off by about twice as much: of 303, all but 7 of
 * the 155 that stand out by more were off by 3 % and more, and those of the others without another warning by 4.4 % at
 * most. */
static const double MOST_PEAK = 0.02;

/* Poisson's ratio from which on plain linear elements are much too stiff: on Cook's membrane in plane strain quad4 has
 * 17 % too little energy there (element/stiffness.c). */
static const double LOCKS = 0.45;

/* Error of the mesh, relative in the energy norm, from which on the answer describes another body. */
static const double COARSE_MESH = 0.1;

/* Part of the contact forces that springs of a stabilizer may bear before the body is not the one without them. */
static const double MOST_STABILIZED = 1e-3;

#define STRAINED "large_strain"
/* Strains that make of a stress another one by about twice as much: of less, what turns is all that is to be seen. */
#define LEAST_STRAINED 0.02
/* The slope of u without which nothing is strained or turns by so much. */
#define STEEP (0.25 * fmin(MOST_STRAIN, MOST_ROTATION))
/* Less stress than this part of what such strains take is none: of what is warm and free. */
#define LEAST_STRESS 1e-3

#define DEGREES (180 / 3.14159265358979323846)

typedef struct {
    const uz_body_model *model;
    const uz_scene *scene;
    const double *u, *r;
    double sliding, mesh_error, steep2; /* steep2: of uz_mesh_look, NaN where it did not look */
    uz_evaluation *out;
} doubts;

__attribute__((format(printf, 4, 5))) static void warn(uz_evaluation *out, const char *code, double value,
                                                       const char *format, ...)
{
    enum { MOST = sizeof out->warnings / sizeof out->warnings[0] };
    va_list args;
    if (out->n_warnings == MOST)
        return;
    uz_warning *w = &out->warnings[out->n_warnings++];
    w->value = value;
    snprintf(w->code, sizeof w->code, "%s", code);
    va_start(args, format);
    vsnprintf(w->message, sizeof w->message, format, args);
    va_end(args);
}

/* ---- strain and rotation */

/* Is there a slope whose square is more than this, as the threads that share the elements see it. */
typedef struct {
    const uz_mesh *mesh;
    const double *u;
    double square;
    atomic_bool found;
} steepness;

static bool is_element_steep(const uz_mesh *mesh, const double *u, double square, int64_t e)
{
    const int dim = mesh->dim;
    const double *x = mesh->xyz;
    const int64_t first = mesh->node[mesh->first[e]] * dim;
    bool found = false;
    for (int64_t k = mesh->first[e] + 1; k < mesh->first[e + 1]; k++) {
        const int64_t i = mesh->node[k] * dim;
        found = found || uz_distance2(u + i, u + first, dim) > square * uz_distance2(x + i, x + first, dim);
    }
    return found;
}

static void look_for_steep(void *ctx, int64_t begin, int64_t end)
{
    steepness *s = ctx;
    bool found = false;
    for (int64_t e = begin; e < end && !found; e++)
        found = is_element_steep(s->mesh, s->u, s->square, e);
    if (found)
        s->found = true;
}

/* Does u change by more than `slope` over some distance between an element's first node and the others? Every strain
 * and rotation shows in that, if not in full. Where all elements are equal boxes with nodes at their corners only the
 * range of u over the shortest edge may tell that it does not. */
static bool is_steep(const doubts *d, double slope)
{
    const uz_mesh *mesh = &d->model->mesh;
    const int dim = mesh->dim;
    const double *u = d->u;
    double range2 = 0, shortest = INFINITY;
    if (!isnan(d->steep2))
        return d->steep2 > slope * slope;
    for (int c = 0; c < dim && mesh->uniform; c++) {
        double least = u[c], most = u[c];
        for (int64_t i = c; i < mesh->n_nodes * dim; i += dim) {
            least = u[i] < least ? u[i] : least;
            most = u[i] > most ? u[i] : most;
        }
        range2 += (most - least) * (most - least);
        shortest = fmin(shortest, mesh->cell[c]);
    }
    if (mesh->uniform && sqrt(range2) / shortest < 0.99 * slope)
        return false;
    steepness of = {.mesh = mesh, .u = u, .square = slope * slope};
    uz_by_pieces(look_for_steep, &of, mesh->n_elements);
    return of.found;
}

/* The largest principal strain, in absolute value, and the rotation in an element's middle. */
static void look_at_element(double *strained, double *turned, const uz_field_body *body, const double *u, int64_t e)
{
    const uz_mesh *mesh = &body->model->mesh;
    double xyz[3 * UZ_ELEMENT_NODES], ue[UZ_ELEMENT_DOFS], strain[UZ_ELEMENT_STRESSES] = {0}, principal[3];
    int nodes;
    const int64_t *node = uz_mesh_element(mesh, e, &nodes);
    uz_element element;
    uz_element_motion motion;
    uz_field_state state;
    uz_body_element(&element, xyz, body->model, e);
    const double *point = uz_element_type_of(uz_element_type_of(element.kind)->linear)->centre;
    for (int a = 0; a < nodes; a++)
        memcpy(ue + a * mesh->dim, u + node[a] * mesh->dim, (size_t)mesh->dim * sizeof *u);
    uz_element_move(&motion, &element, ue);
    uz_element_strain(strain, &motion, point);
    uz_field_state_of_strain(&state, body->model->kind, uz_element_material(body->model, e),
                             body->free_strain ? body->free_strain[e] : 0, strain);
    uz_principal(principal, state.strain, body->components);
    *strained = fmax(fabs(principal[0]), fabs(principal[2]));
    /* |curl u| / 2 */
    double grad[UZ_ELEMENT_NODES][3], G[3][3] = {{0}};
    uz_element_gradients(grad, &element, point);
    for (int a = 0; a < nodes; a++)
        for (int i = 0; i < mesh->dim; i++)
            for (int j = 0; j < mesh->dim; j++)
                G[i][j] += ue[a * mesh->dim + i] * grad[a][j];
    const double x = G[2][1] - G[1][2], y = G[0][2] - G[2][0], z = G[1][0] - G[0][1];
    *turned = 0.5 * sqrt(x * x + y * y + z * z);
}

/* The first element that has the most of something. */
typedef struct {
    double value;
    int64_t element;
} most_of;

static void take_more(most_of *to, double value, int64_t element)
{
    if (value > to->value || (value == to->value && element < to->element))
        *to = (most_of){value, element};
}

typedef struct {
    const doubts *d;
    uz_field_body body;
    double square;         /* of the slope without which an element is not looked at */
    pthread_mutex_t mutex; /* of what follows */
    most_of strain, rotation;
} elements_look;

static void look_at_some(void *ctx, int64_t begin, int64_t end)
{
    elements_look *look = ctx;
    const double *u = look->d->u;
    most_of strain = {0}, rotation = {0};
    for (int64_t e = begin; e < end; e++) {
        double here, turn;
        if (!is_element_steep(&look->d->model->mesh, u, look->square, e))
            continue;
        look_at_element(&here, &turn, &look->body, u, e);
        take_more(&strain, here, e);
        take_more(&rotation, turn, e);
    }
    pthread_mutex_lock(&look->mutex);
    take_more(&look->strain, strain.value, strain.element);
    take_more(&look->rotation, rotation.value, rotation.element);
    pthread_mutex_unlock(&look->mutex);
}

static void look_at_elements(elements_look *look, const doubts *d)
{
    const double slope = STEEP;
    *look = (elements_look){
        .d = d,
        .body = {.scene = d->scene, .model = d->model, .components = d->model->mesh.dim == 2 ? 4 : 6},
        .square = slope * slope,
        .mutex = PTHREAD_MUTEX_INITIALIZER,
    };
    uz_by_pieces(look_at_some, look, d->model->mesh.n_elements);
}

static void doubt_elements(const doubts *d)
{
    elements_look look;
    look_at_elements(&look, d);
    const double rotation = look.rotation.value, strain = look.strain.value;
    if (rotation > MOST_ROTATION)
        warn(d->out, "large_rotation", rotation,
             "element %lld turns by %.2g rad; small rotations were assumed, and beyond %g they are not small",
             (long long)look.rotation.element, rotation, MOST_ROTATION);
    if (strain > MOST_STRAIN)
        warn(d->out, STRAINED, strain,
             "element %lld is strained by %.2g; small strains were assumed, and beyond %g they are not small",
             (long long)look.strain.element, strain, MOST_STRAIN);
}

/* Could uz_measure_nonlinear come to anything? Gradients are at most about four times the slope that is_steep finds,
 * and the body's energy norm is known. */
static bool may_be_nonlinear(const doubts *d, double buckling, double leverage)
{
    const uz_mesh *mesh = &d->model->mesh;
    const bool ring = d->model->kind == UZ_AXISYMMETRIC;
    const double U = d->out->strain_energy, size = uz_mesh_size(mesh);
    double stiffest = 0, depth = mesh->dim == 3 ? size : d->model->thickness, around = 0;
    for (int64_t k = 0; k < d->model->n_materials; k++)
        stiffest = fmax(stiffest, uz_most_stiffness(d->model->materials[k].lame));
    for (int64_t i = 0; ring && i < mesh->n_nodes; i++) {
        const double r = mesh->xyz[2 * i];
        depth = fmax(depth, 2 * acos(-1) * r);
        around = fmax(around, r > 0 ? fabs(d->u[2 * i]) / r : 0); /* on the axis it is a slope */
    }
    const double most = sqrt(stiffest * size * size * depth);
    const double least = 0.25 * fmin(UZ_SURELY_SMALL, leverage > 0 ? UZ_SURELY_HELD / (leverage * most) : INFINITY);
    const double steep = 0.25 * fmin(UZ_SURELY_SMALL * buckling, fmin(least, sqrt(2 * least * sqrt(2 * U) / most)));
    return around > steep || is_steep(d, steep); /* where U is 0, of whatever is not flat: warmth may have done it */
}

/* Small deformation takes a turn for a x r, which stretches what turns by a^2 / 2. */
static void look_at_turns(const doubts *d)
{
    for (int64_t k = 0; k < d->scene->n_supports && !uz_is_finite_answer(d->scene); k++) {
        const uz_support *support = &d->scene->supports[k];
        const double angle = uz_support_angle(support);
        if ((uz_support_turns(support) || support->kind == UZ_SUPPORT_RIGID) && angle > MOST_TURN)
            warn(d->out, "large_rotation", angle,
                 "support %lld rotates \"%.63s\" by %.2g rad, which small deformation takes for %.2g %% of stretch: "
                 "take a law of finite strain and the kinematics \"finite\"",
                 (long long)k, support->on, angle, 100 * (hypot(1, angle) - 1));
    }
}

/* Where stress is asked for it may be off by about the strain at its largest, however little that is of the body. */
static void look_at_peak_stress(const doubts *d)
{
    const uz_mesh *mesh = &d->model->mesh;
    const uz_peak *peak = &d->out->von_mises;
    double shear = 0;
    for (int64_t e = 0; e < mesh->n_elements && d->out->stressed && d->out->nonlinear < UZ_SURELY_SMALL; e++) {
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        for (int a = 0; a < nodes; a++)
            if (node[a] == peak->node)
                shear = fmax(shear, uz_element_material(d->model, e)->lame.mu);
    }
    if (shear > 0)
        d->out->nonlinear = fmax(d->out->nonlinear, peak->value / (2 * shear));
}

/* Of materials with directions there is no answer of finite strain that this one could be compared with. */
static void look_at_small_only(const doubts *d)
{
    bool general = false;
    for (int64_t k = 0; k < d->model->n_materials; k++)
        general = general || d->model->materials[k].lame.general;
    if (general && d->out->nonlinear > UZ_MOST_SLIDING)
        warn(d->out, "large_deformation", d->out->nonlinear,
             "small deformation errs by some %.2g %% as rotations are large, and orthotropic materials have no other: "
             "put less load on it",
             100 * d->out->nonlinear);
}

void uz_doubt_deformation(uz_evaluation *out, const uz_small *small)
{
    if (isfinite(small->error))
        warn(out, "large_deformation", small->error,
             "small deformation errs by %.3g %% in %s as rotations and strains are large: take the law neo_hooke, or "
             "st_venant_kirchhoff where strains stay small",
             100 * small->error, small->in);
    else
        warn(out, "large_deformation", small->error,
             "with rotations taken into account (st_venant_kirchhoff) nothing is stable beyond %.3g of the load: take "
             "that law, or neo_hooke",
             small->load);
}

/* Takes those with this code back; were there any? */
static bool drop(uz_evaluation *out, const char *code)
{
    int kept = 0;
    for (int i = 0; i < out->n_warnings; i++)
        if (strcmp(out->warnings[i].code, code) != 0)
            out->warnings[kept++] = out->warnings[i];
    const bool dropped = kept < out->n_warnings;
    out->n_warnings = kept;
    return dropped;
}

/* In an element's middle: what the stress of u is off by, of Cauchy's, relative. */
static double stress_error(const uz_field_body *body, const double *u, const double *at_large, int64_t e)
{
    const uz_body_model *model = body->model;
    const uz_element_type *kind = uz_element_type_of((uz_element_kind)model->mesh.kind[e]);
    uz_scene scene = *body->scene;
    uz_field_body small = *body;
    uz_field_points points = {.count = 1};
    uz_field_state state[2]; /* large, small */
    double off = 0, all = 0;
    scene.kinematics = UZ_KINEMATICS_FIXED;
    small.scene = &scene;
    memcpy(points.point[0], uz_element_type_of(kind->linear)->centre, sizeof points.point[0]);
    for (int k = 0; k < 2; k++) {
        uz_field_points_init(&points, k == 0 ? body : &small, k == 0 ? at_large : u);
        uz_field_points_states(&state[k], &points, e);
    }
    for (int c = 0; c < body->components; c++) {
        const double stress = state[0].stress[c], apart = stress - state[1].stress[c];
        off += (c < 3 ? 1 : 2) * apart * apart;
        all += (c < 3 ? 1 : 2) * stress * stress;
    }
    const double stiff = uz_most_stiffness(uz_element_material(model, e)->lame), *strain = state[1].strain;
    return sqrt(off) / fmax(sqrt(all), LEAST_STRESS * stiff * sqrt(uz_dot3(strain, strain)));
}

void uz_doubt_strain(uz_evaluation *out, const uz_small *small, const uz_body_model *model, const uz_scene *finite,
                     const double *u, const double *at_large)
{
    const doubts d = {.model = model, .scene = finite, .u = u, .steep2 = NAN, .out = out};
    elements_look look;
    look_at_elements(&look, &d);
    const int64_t e = look.strain.element;
    const bool told = drop(out, STRAINED);
    if (look.strain.value < LEAST_STRAINED)
        return;
    const uz_field_body body = {
        .scene = finite, .model = model, .components = look.body.components, .free_strain = finite->free_strain};
    const double error = stress_error(&body, u, at_large, e);
    if ((told ? fmax(error, small->error) : error) > UZ_MOST_SLIDING)
        warn(out, STRAINED, look.strain.value,
             "element %lld is strained by %.2g: small deformation errs by %.2g %% in the stress of its middle, by "
             "%.2g %% in %s of the body",
             (long long)e, look.strain.value, 100 * error, 100 * small->error, small->in);
}

void uz_doubt_uncompared(uz_evaluation *out, const char *lacked)
{
    warn(out, "large_deformation", out->nonlinear,
         "small deformation leaves out some %.2g %% of the forces, and there was no %s to compare it with large "
         "deformation: use a coarser mesh to find out",
         100 * out->nonlinear, lacked);
}

/* ---- contact */

void uz_doubt_interpenetration(uz_evaluation *out, const uz_interpenetration *passed, int dim, double load)
{
    char at[80], when[48] = "";
    if (!(passed->depth > 0))
        return;
    snprintf(at, sizeof at, dim == 2 ? "(%.4g, %.4g)" : "(%.4g, %.4g, %.4g)", passed->at[0], passed->at[1],
             passed->at[2]);
    if (load < 1)
        snprintf(when, sizeof when, "under %.4g of the load ", load);
    warn(out, "interpenetration", passed->part,
         "%sthe body stands %.3g deep in itself, or one of its parts in another, at %s: name these sides as a contact",
         when, passed->depth, at);
}

/* The deepest that a node begins in the other body, in lengths of the face that it meets. */
static double deepest_overlap(int64_t *node, const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    double most = 0;
    for (int64_t row = 0; row < model->m; row++) {
        const uz_contact_sites *sites = &model->sites[model->info.contact_of[row]];
        const int64_t i = model->row_place[row];
        int64_t corner[UZ_FACE_NODES];
        const int count = sites->first ? uz_mesh_face(corner, mesh, sites->face[i]) : 0;
        double face = 0; /* its longest distance between nodes */
        for (int a = 0; a < count; a++)
            for (int b = 0; b < a; b++)
                face = fmax(face, uz_distance2(mesh->xyz + corner[a] * mesh->dim, mesh->xyz + corner[b] * mesh->dim,
                                               mesh->dim));
        face = sqrt(face);
        if (face > 0 && -sites->gap[i] > most * face) {
            most = -sites->gap[i] / face;
            *node = model->info.contact_node[row];
        }
    }
    return most;
}

/* The least cosine between the faces' normals and the obstacle's, which points to where the body may be: where none is
 * against it the faces look away from the obstacle, and never meet it. -1: no faces. */
static double turned_away(const doubts *d, const uz_obstacle *obstacle, const uz_contact *contact)
{
    const uz_mesh *mesh = &d->model->mesh;
    const int dim = mesh->dim;
    const uz_group *group = uz_mesh_group(mesh, contact->on, "", NULL);
    const bool faces = group && group->kind == UZ_GROUP_FACES && group->n_faces > 0;
    const double size = sqrt(uz_dot3(contact->normal, contact->normal));
    double least = faces ? 1 : -1;
    for (int64_t i = 0; faces && i < group->n_faces && least > AWAY; i++) {
        /* Out of the body, in the middle of a face, and that place. */
        const uz_face face = group->face[i];
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[face.element]);
        const int corners = type->side[face.side].corners;
        double n[3], middle[3] = {0}, side[2][3] = {{0}}, along = 0;
        int64_t node[UZ_FACE_NODES];
        uz_gap there;
        uz_mesh_face(node, mesh, face);
        for (int a = 0; a < corners; a++)
            for (int c = 0; c < dim; c++)
                middle[c] += mesh->xyz[node[a] * dim + c] / corners;
        for (int c = 0; c < dim; c++) {
            side[0][c] = mesh->xyz[node[1] * dim + c] - mesh->xyz[node[0] * dim + c];
            side[1][c] = dim == 3 ? mesh->xyz[node[2] * dim + c] - mesh->xyz[node[0] * dim + c] : 0;
        }
        if (dim == 2)
            side[1][2] = 1; /* the element on the left */
        for (int c = 0; c < 3; c++)
            n[c] = side[0][(c + 1) % 3] * side[1][(c + 2) % 3] - side[0][(c + 2) % 3] * side[1][(c + 1) % 3];
        const double area = sqrt(uz_dot3(n, n));
        for (int c = 0; c < 3; c++)
            n[c] /= area;
        if (obstacle && uz_obstacle_gap(&there, obstacle, middle, NULL) != UZ_OK)
            return -1;
        for (int c = 0; c < mesh->dim; c++)
            along += n[c] * (obstacle ? there.normal[c] : contact->normal[c] / size);
        least = fmin(least, along);
    }
    return least;
}

/* Facets that stand for a curve which is not quite known, or that were taken for corners. */
static void look_at_surfaces(const doubts *d)
{
    for (int64_t i = 0; i < d->out->n_surfaces; i++) {
        const uz_contact_surface *s = &d->out->surfaces[i];
        if (s->free_form)
            warn(d->out, "free_form", s->largest_turn / DEGREES,
                 "\"%.30s\" is on no plane, sphere, cylinder, cone or torus: peaks of the pressure there are not to be "
                 "trusted",
                 s->group);
        if (s->corners > 0)
            warn(d->out, "feature_angle", s->corner_turn / DEGREES,
                 "sides of \"%.30s\" turn by up to %.3g degrees (nodes: %lld), taken for corners: of a curve, raise "
                 "feature_angle",
                 s->group, s->corner_turn, (long long)s->corners);
    }
}

static uz_status look_at_contact(const doubts *d, const uz_coarse_contact *coarse, uz_error *err)
{
    int64_t behind = -1, node = 0;
    double away = 0;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < d->scene->n_contacts && behind < 0 && status == UZ_OK; k++) {
        const uz_contact *contact = &d->scene->contacts[k];
        uz_obstacle *obstacle = NULL;
        if (contact->kind == UZ_OBSTACLE_BODY)
            continue;
        if (contact->kind != UZ_OBSTACLE_PLANE)
            status = uz_obstacle_new(&obstacle, contact, k, d->scene->model, err);
        const double least = status == UZ_OK ? turned_away(d, obstacle, contact) : -1;
        if (least > AWAY) {
            behind = k;
            away = least;
        }
        uz_obstacle_free(obstacle);
    }
    if (coarse->contact >= 0 && coarse->depth > 0)
        warn(d->out, UZ_WARN_COARSE, (double)coarse->sides,
             "the obstacle of contact %lld stands %.3g deep in %lld sides between nodes, as at %lld, and meets no "
             "resistance there; use finer sides, or rows inside",
             (long long)coarse->contact, coarse->depth, (long long)coarse->sides, (long long)coarse->node);
    else if (coarse->contact >= 0)
        warn(d->out, UZ_WARN_COARSE, (double)coarse->sides,
             "%.0f %% of the force of contact %lld act where it is narrower than three sides (%lld touch, as at node "
             "%lld): pressure depends on the mesh there; refine it",
             100 * coarse->part, (long long)coarse->contact, (long long)coarse->sides, (long long)coarse->node);
    if (behind >= 0)
        warn(d->out, "obstacle_behind", away,
             "all faces of contact %lld look away from its obstacle and never meet it; its normal must point to the "
             "body",
             (long long)behind);
    if (d->sliding > UZ_MOST_SLIDING)
        warn(d->out, UZ_WARN_SLIDING, d->sliding,
             "where the surfaces have moved to, gaps and normals are off by %.2g of the approach or radians; "
             "\"kinematics\": \"moving\" takes them there",
             d->sliding);
    const double depth = deepest_overlap(&node, d->model);
    if (depth > 1)
        warn(d->out, "deep_overlap", depth,
             "node %lld begins %.2g lengths of the face that it meets deep in the other body: another face may be the "
             "one "
             "that it should meet",
             (long long)node, depth);
    return status;
}

/* ---- what the rows leave out */

/* Nodes against faces do not pass the patch test where the meshes do not match: the pressure goes up and down by 5 to
 * 30 per cent however fine they are. */
static void look_at_mismatch(const doubts *d, int64_t k, int64_t *row)
{
    const uz_mesh_info *info = &d->model->info;
    const uz_law *law = d->model->law;
    const uz_contact_sites *sites = &d->model->sites[k];
    const uz_contact *contact = &d->scene->contacts[k];
    double most = 0;
    for (; *row < d->model->m && info->contact_of[*row] == k; ++*row) {
        const int64_t i = d->model->row_place[*row];
        double largest = 0;
        if (contact->kind != UZ_OBSTACLE_BODY || contact->between != UZ_CONTACT_NODES ||
            law->kind->active(law, NULL, &d->r[*row], 1) == 0)
            continue;
        for (int64_t j = sites->first[i]; j < sites->first[i + 1]; j++)
            largest = fmax(largest, sites->weight[j]);
        most = fmax(most, 1 - largest);
    }
    if (most > MOST_MISMATCH)
        warn(d->out, "nodes_against_faces", most,
             "nodes of \"%.30s\" press between nodes of \"%.30s\": pressures go up and down by 5 to 30 %%, also on "
             "finer meshes; use surfaces",
             contact->on, contact->with);
}

/* Before an obstacle of triangles: how far those that are pressed on may be from the curve that they stand for. */
static uz_status look_at_triangles(const doubts *d, int64_t k, uz_error *err)
{
    const uz_body_model *model = d->model;
    const uz_contact *contact = &d->scene->contacts[k];
    const uz_law *law = model->law;
    uz_obstacle *obstacle = NULL;
    double most = 0;
    const uz_status status =
        contact->kind == UZ_OBSTACLE_SURFACE ? uz_obstacle_new(&obstacle, contact, k, d->scene->model, err) : UZ_OK;
    for (int64_t row = 0; row < model->m && obstacle; row++) {
        double x[3];
        uz_gap there;
        if (model->info.contact_of[row] != k || law->kind->active(law, NULL, &d->r[row], 1) == 0)
            continue;
        for (int c = 0; c < 3; c++) {
            const int64_t i = model->info.contact_node[row] * 3 + c;
            x[c] = model->mesh.xyz[i] + d->u[i];
        }
        if (uz_obstacle_gap(&there, obstacle, x, NULL) == UZ_OK)
            most = fmax(most, there.facets);
    }
    uz_obstacle_free(obstacle);
    if (most > MOST_FACETS * d->out->approach)
        warn(d->out, "facets", most / d->out->approach,
             "triangles of the obstacle of contact %lld are off the curve that they stand for by about %.2g, with an "
             "approach of %.2g: take a finer file",
             (long long)k, most, d->out->approach);
    return status;
}

bool uz_is_warned(const uz_evaluation *of, const char *code)
{
    for (int i = 0; of && i < of->n_warnings; i++)
        if (strcmp(of->warnings[i].code, code) == 0)
            return true;
    return false;
}

/* Have warnings with one of these codes been given? */
static bool is_said(const uz_evaluation *out, const char *const code[], int codes)
{
    for (int j = 0; j < codes; j++)
        if (uz_is_warned(out, code[j]))
            return true;
    return false;
}

/* Overlap that nothing else explains. */
static void look_at_overlap(const doubts *d, int64_t k)
{
    static const char *const REASONS[] = {"facets",        UZ_WARN_COARSE,  "free_form",
                                          "feature_angle", UZ_WARN_SLIDING, "deep_overlap"};
    const uz_overlap *o = &d->out->overlap[k];
    const double approach = d->out->approach;
    const bool explained = is_said(d->out, REASONS, sizeof REASONS / sizeof REASONS[0]);
    if (o->depth > fmax(MOST_OVERLAP * approach, 1e-9 * d->model->mesh.extent) && !explained)
        warn(
            d->out, UZ_WARN_OVERLAP, o->depth / (approach > 0 ? approach : o->side),
            "the surfaces of contact %lld stand %.2g deep in each other, with an approach of %.2g: what is between the "
            "rows is not resisted; refine there",
            (long long)k, o->depth, approach);
}

/* Is it a quad4 or hex8 that could bend, but does not? Each keeps one strain across a side, and Poisson's ratio makes
 * of what it lacks a stress that presses on free ends: the last cells bulge, the flatter they are the more. */
static bool could_bend(const doubts *d, int64_t e)
{
    const uz_element_kind kind = (uz_element_kind)d->model->mesh.kind[e];
    const double poisson = uz_element_material(d->model, e)->poisson;
    const uz_model model = d->model->kind;
    return uz_resolve_formulation(d->model->formulation, kind, model, poisson) == UZ_FORMULATION_STANDARD &&
           uz_resolve_formulation(UZ_FORMULATION_INCOMPATIBLE, kind, model, poisson) != UZ_FORMULATION_STANDARD;
}

/* Of two bodies: the largest pressure against the mean of the rows at its node and at those that share an element with
 * it. A smooth pressure on a mesh that can follow it hardly stands out; at a corner, or at the free end of flat linear
 * elements that bend, it is as large as the elements are small. */
static void look_at_peak(const doubts *d, const double *pressure)
{
    enum { MOST_NEAR = 512 };
    static const char *const TOLD[] = {"free_form", "facets", "nodes_against_faces", "overlap"};
    const uz_mesh *mesh = &d->model->mesh;
    const uz_mesh_info *info = &d->model->info;
    int64_t near[MOST_NEAR], contact = -1;
    int n = 0, rows = 0;
    bool stiff = false;
    double peak = 0, sum = 0;
    for (int64_t row = 0; row < d->model->m; row++)
        if (info->contact_node[row] == d->out->peak_node && pressure[row] > peak) {
            peak = pressure[row];
            contact = info->contact_of[row];
        }
    if (contact < 0 || d->scene->contacts[contact].kind != UZ_OBSTACLE_BODY || is_said(d->out, TOLD, 4))
        return;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        bool there = false;
        for (int a = 0; a < nodes && !there; a++)
            there = node[a] == d->out->peak_node;
        stiff = stiff || (there && could_bend(d, e));
        for (int a = 0; a < nodes && there; a++) {
            bool known = n == MOST_NEAR;
            for (int i = 0; i < n && !known; i++)
                known = near[i] == node[a];
            if (!known)
                near[n++] = node[a];
        }
    }
    for (int64_t row = 0; row < d->model->m; row++)
        for (int i = 0; i < n && info->contact_of[row] == contact; i++)
            if (info->contact_node[row] == near[i] && isfinite(pressure[row])) {
                sum += pressure[row];
                rows++;
            }
    const double stands_out = rows > 0 ? 1 - sum / (rows * peak) : 0;
    if (stands_out > MOST_PEAK)
        warn(d->out, "pressure_peak", stands_out,
             "the largest pressure, at node %lld, stands out by %.2g %% from the mean around it, and may be off by "
             "twice as much: refine there%s",
             (long long)d->out->peak_node, 100 * stands_out, stiff ? ", or use incompatible_modes" : "");
}

static void look_at_apart(const doubts *d, const double *g)
{
    int64_t row = -1;
    const double apart = uz_pressed_apart(&row, d->model, d->out->overlap, d->scene->n_contacts, d->r, g);
    if (row < 0)
        return;
    const double side = sqrt(d->model->info.contact_area[row]);
    warn(d->out, UZ_WARN_APART, apart / side,
         "contact %lld touches nowhere and presses from %.2g away, as sides are long against the obstacle's radius: "
         "use a finer mesh there",
         (long long)d->model->info.contact_of[row], apart);
}

/* ---- mesh */

/* All forces of the stabilizer's springs are at most its stiffness times the largest displacement, as the shares of
 * nodes add up to 1. The answer is that of a body without them whose loads have these forces, too. */
static void look_at_stabilizer(const doubts *d)
{
    const int dim = d->model->mesh.dim;
    double largest = 0, pressed = 0;
    if (!(d->scene->stabilizer > 0))
        return;
    for (int64_t a = 0; a < d->model->mesh.n_nodes; a++) {
        const double *u = d->u + a * dim;
        largest = fmax(largest, hypot(hypot(u[0], u[1]), dim == 3 ? u[2] : 0));
    }
    for (int64_t i = 0; i < d->model->m; i++)
        pressed += fabs(d->r[i]);
    const double part = pressed > 0 ? d->scene->stabilizer * largest / pressed : 1;
    warn(d->out, "stabilized", part,
         "springs of %.3g were added: the answer is that to loads that differ by at most %.2g of the contact forces%s",
         d->scene->stabilizer, part, part > MOST_STABILIZED ? "; hold what is pushed where nothing holds it" : "");
}

/* In place of the one that there is. */
static void warn_of_mesh(uz_evaluation *out, double mesh_error, const char *text)
{
    const int n = out->n_warnings;
    int at = 0;
    while (at < n && strcmp(out->warnings[at].code, "coarse_mesh") != 0)
        at++;
    out->n_warnings = at;
    warn(out, "coarse_mesh", mesh_error, "%s", text);
    out->n_warnings = at < n ? n : out->n_warnings;
}

/* What is stored beside springs, in parts of the whole, that is told from rounding. */
static const double LEAST_STORED = 1e-14;

/* Soft springs store so much that a stress of which nothing is right is a small part of all. What they are off by
 * themselves is then more than that, and says nothing of it. */
void uz_doubt_coarse_mesh(uz_evaluation *out, double mesh_error)
{
    char text[sizeof out->warnings[0].message];
    const double stored = out->spring_energy / out->strain_energy, all = mesh_error * mesh_error,
                 rest = fmax(0, 1 - all), square = fmax(0, all - rest * 0.5 * out->spring_error / out->strain_energy),
                 own = rest * fmax(0, 1 - stored),
                 error = stored > 0 && own + square >= LEAST_STORED ? fmax(mesh_error, sqrt(square / (own + square)))
                                                                    : mesh_error;
    if (!(error >= COARSE_MESH) || !isfinite(error))
        return;
    snprintf(text, sizeof text,
             "the mesh itself is off by about %.2g %% in the energy norm%s: refine it, above all near contacts and "
             "corners",
             100 * error, error > mesh_error ? ", without what springs store" : "");
    warn_of_mesh(out, error, text);
}

void uz_doubt_unborne(uz_evaluation *out)
{
    warn_of_mesh(out, 1,
                 "the same mesh with all elements divided has no stable answer under the whole load, or none was found "
                 "in as many steps as that is worth, so that nothing says how far off this one is: refine it");
}

static void look_at_mesh(const doubts *d)
{
    const uz_mesh *mesh = &d->model->mesh;
    uz_doubt_coarse_mesh(d->out, d->mesh_error);
    double poisson = 0;
    int64_t stiff = 0;
    for (int64_t e = 0; e < mesh->n_elements && d->model->kind != UZ_PLANE_STRESS; e++) {
        /* Is it linear, of its own strain, and kept from changing its volume in all directions? */
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        const uz_element_type *type = uz_element_type_of(kind);
        const double here = uz_element_material(d->model, e)->poisson;
        if (here >= LOCKS && here > poisson && type->nodes == type->corners &&
            uz_resolve_formulation(d->model->formulation, kind, d->model->kind, here) == UZ_FORMULATION_STANDARD) {
            poisson = here;
            stiff = e;
        }
    }
    if (poisson > 0)
        warn(d->out, "locking", poisson,
             "element %lld (%s) has Poisson's ratio %.5g: plain linear elements are too stiff there; use %s",
             (long long)stiff, uz_element_name((uz_element_kind)mesh->kind[stiff]), poisson,
             mesh->dim == 2 ? "quad4 with bbar, tri6 or quad8" : "hex8 with bbar, or tet10");
    if (mesh->n_unused > 0)
        warn(
            d->out, "unused_nodes", (double)mesh->n_unused,
            "%lld nodes of the file belong to no element and are left out; the others are numbered anew in their order",
            (long long)mesh->n_unused);
}

void uz_doubt_mesh(uz_result *result, const uz_body_model *model, const uz_scene *scene)
{
    const doubts d = {.model = model,
                      .scene = scene,
                      .u = result->u,
                      .r = result->r,
                      .mesh_error = result->summary.discretization_error,
                      .steep2 = NAN,
                      .out = result->evaluation};
    look_at_stabilizer(&d);
    look_at_mesh(&d);
}

void uz_drop_sliding(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene)
{
    const doubts d = {.model = model, .scene = scene, .steep2 = NAN, .out = out};
    const bool dropped = drop(out, UZ_WARN_SLIDING);
    for (int64_t k = 0; k < scene->n_contacts && dropped; k++)
        look_at_overlap(&d, k);
}

uz_status uz_find_doubts(uz_result *result, const uz_body_model *model, const uz_scene *scene,
                         const uz_coarse_contact *coarse, const uz_mesh_look *look, uz_error *err)
{
    const uz_summary *s = &result->summary;
    const doubts d = {.model = model,
                      .scene = scene,
                      .u = result->u,
                      .r = result->r,
                      .sliding = s->geometry.sliding,
                      .mesh_error = s->discretization_error,
                      .steep2 = look->steep2,
                      .out = result->evaluation};
    look_at_apart(&d, result->g); /* first: the outcome goes by it, and there is room for so many warnings alone */
    if (is_steep(&d, STEEP))
        doubt_elements(&d);
    uz_status status = UZ_OK;
    d.out->nonlinear = NAN;
    if (scene->kinematics == UZ_KINEMATICS_AUTO && uz_has_finite_model(scene, &model->mesh) &&
        (uz_has_finite_law(scene) || model->d <= UZ_MOST_COMPARED)) {
        const double buckling = uz_least_buckling_strain(model);
        double leverage = 0;
        d.out->nonlinear = 0;
        status = uz_force_leverage(&leverage, model, scene, d.out, result->r, buckling, err);
        if (status == UZ_OK && may_be_nonlinear(&d, buckling, leverage))
            status = uz_measure_nonlinear(&d.out->nonlinear, model, result->u, d.out->strain_energy, buckling, leverage,
                                          err);
    }
    if (status != UZ_OK)
        return status;
    look_at_small_only(&d);
    look_at_peak_stress(&d);
    look_at_turns(&d);
    look_at_stabilizer(&d);
    look_at_mesh(&d);
    look_at_surfaces(&d);
    status = look_at_contact(&d, coarse, err);
    for (int64_t k = 0, row = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        const uz_overlap *o = &d.out->overlap[k];
        const double approach = d.out->approach, scale = fmax(approach, o->depth);
        look_at_mismatch(&d, k, &row);
        if (scene->contacts[k].kind == UZ_OBSTACLE_BODY && o->facets_left > MOST_FACETS * scale)
            warn(d.out, "facets", o->facets_left / scale,
                 "facets of contact %lld are off their smooth surface by %.2g, with an approach of %.2g and an overlap "
                 "of %.2g; smooth, or refine",
                 (long long)k, o->facets_left, approach, o->depth);
        status = look_at_triangles(&d, k, err);
        look_at_overlap(&d, k);
    }
    look_at_peak(&d, result->pressure);
    return status;
}
