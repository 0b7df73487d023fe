/* balance.c: what acts on the body, and whether it balances.
 *
 * At a node that supports hold, f_int = f_loads + f_contact - k u + R: the elements' forces less everything known is
 * what the supports do. Only elements that touch such nodes are looked at. Everywhere else equilibrium is the solver's
 * matter, so that the sum of all forces and moments is what its residual comes to. */
#include "post/balance.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/pieces.h"
#include "post/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DIM = 3, MOST_KE = UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS };

typedef struct {
    const uz_body_model *model, *rest; /* rest: before anything moves */
    const uz_scene *scene;
    const double *u, *r;
    uz_evaluation *out;
    int dim;
    double *load, *contact, *inner; /* n_nodes x dim; inner: f_int where it is wanted */
    bool *held, *wanted;            /* n_nodes; wanted: held, or other nodes bear what acts there */
    uz_csc supports;                /* by columns: which of them hold each node */
    double centre[DIM];
    double force[DIM], moment[DIM]; /* of everything, the moment about the centre: the first node */
    double size;
} balance;

/* `to` NULL: only to the sum of everything. */
static void add_force(balance *b, uz_resultant *to, int64_t node, const double *force)
{
    double x[DIM] = {0}, arm[DIM] = {0}, f[DIM] = {0};
    for (int c = 0; c < b->dim; c++) {
        f[c] = force[c];
        x[c] = b->model->mesh.xyz[node * b->dim + c];
        arm[c] = x[c] - b->centre[c];
        b->force[c] += f[c];
        b->size += fabs(f[c]);
        if (to && (c > 0 || b->model->kind != UZ_AXISYMMETRIC)) /* around the ring a radial force sums to nothing */
            to->force[c] += f[c];
    }
    double about[2][DIM]; /* the moments about the centre and about the origin */
    uz_cross3(about[0], arm, f);
    uz_cross3(about[1], x, f);
    for (int c = 0; c < DIM && b->model->kind != UZ_AXISYMMETRIC; c++) {
        b->moment[c] += about[0][c];
        if (to)
            to->moment[c] += about[1][c];
    }
}

/* ---- contact */

/* The obstacle pushes along its normal by -r; another part of the body is pushed back. */
static void add_contacts(balance *b)
{
    const uz_body_model *model = b->model;
    const uz_mesh_info *info = &model->info;
    for (int64_t row = 0; row < model->m; row++) {
        const int64_t k = info->contact_of[row], node = info->contact_node[row], place = model->row_place[row];
        const uz_contact_sites *sites = model->sites && model->sites[k].first ? &model->sites[k] : NULL;
        const int of = sites && sites->of ? sites->of[place] : UZ_SLAVE_ON;
        const uz_inner_place *inner = uz_row_inner(model, row);
        double f[DIM] = {0};
        for (int c = 0; c < b->dim; c++)
            f[c] = -b->r[row] * info->contact_normal[row * b->dim + c];
        for (int a = 0; a < (inner ? inner->nodes : 1); a++) {
            const int64_t at = inner ? inner->node[a] : node;
            double part[DIM] = {0};
            for (int c = 0; c < b->dim; c++) {
                part[c] = (inner ? inner->share[a] : 1) * f[c];
                b->contact[at * b->dim + c] += part[c];
            }
            add_force(b, of & UZ_SLAVE_ON ? &b->out->contacts[k] : NULL, at, part);
        }
        for (int64_t j = sites ? sites->first[place] : 0; sites && j < sites->first[place + 1]; j++) {
            double back[DIM] = {0};
            for (int c = 0; c < b->dim; c++) {
                back[c] = -sites->weight[j] * f[c];
                b->contact[sites->node[j] * b->dim + c] += back[c];
            }
            add_force(b, of & UZ_MASTER_ON ? &b->out->contacts[k] : NULL, sites->node[j], back);
        }
    }
}

/* ---- supports */

/* The springs of all supports: -k u. */
static uz_status add_springs(balance *b, uz_error *err)
{
    const uz_mesh *mesh = &b->model->mesh;
    uz_status status = UZ_OK;
    double *share = NULL;
    for (int64_t s = 0; s < b->scene->n_supports && status == UZ_OK && b->model->spring; s++) {
        const uz_support *support = &b->scene->supports[s];
        if (support->kind != UZ_SUPPORT_SPRING)
            continue;
        if (!share && !(share = uz_alloc(mesh->n_nodes, sizeof *share))) {
            status = uz_no_memory(err, "the forces of springs");
            break;
        }
        const uz_group *group = uz_mesh_group(mesh, support->on, "/supports", err);
        memset(share, 0, (size_t)mesh->n_nodes * sizeof *share);
        status = group ? uz_spread_over_group(share, b->rest, group, true, "/supports", err) : UZ_ERR_SCENE;
        for (int64_t a = 0; a < mesh->n_nodes && status == UZ_OK; a++) {
            double f[DIM] = {0};
            for (int c = 0; c < b->dim; c++)
                f[c] = support->spring[c] > 0 ? -fmax(0, share[a]) * support->spring[c] * b->u[a * b->dim + c] : 0;
            if (share[a] > 0)
                add_force(b, &b->out->supports[s], a, f);
        }
    }
    free(share);
    return status;
}

static void find_wanted(void *ctx, int64_t begin, int64_t end)
{
    const balance *b = ctx;
    for (int64_t a = begin; a < end; a++) {
        b->held[a] = b->supports.ptr[a] < b->supports.ptr[a + 1];
        b->wanted[a] = b->held[a] || uz_mesh_hangs(&b->model->mesh, a) || uz_is_tied(b->model, a);
    }
}

enum { AT_ONCE = 2048, PART = 64 }; /* elements */

/* Elements that touch such nodes, as the threads that share them see them: which they are, and what some of them do to
 * their nodes. */
typedef struct {
    const balance *b;
    bool *touches; /* n_elements */
    double *force; /* AT_ONCE x UZ_ELEMENT_DOFS */
    int count;
    int64_t element[AT_ONCE];
} touching;

static void look_for_touching(void *ctx, int64_t begin, int64_t end)
{
    const touching *x = ctx;
    const uz_mesh *mesh = &x->b->model->mesh;
    for (int64_t e = begin; e < end; e++) {
        bool touches = false;
        for (int64_t k = mesh->first[e]; k < mesh->first[e + 1]; k++)
            touches = touches || x->b->wanted[mesh->node[k]];
        x->touches[e] = touches;
    }
}

static void find_forces(void *ctx, int part)
{
    const touching *x = ctx;
    const balance *b = x->b;
    const uz_body_model *model = b->model;
    const uz_mesh *mesh = &model->mesh;
    const bool alike = mesh->uniform && model->kind != UZ_AXISYMMETRIC;
    const uz_body_material *made = NULL; /* of which ke is */
    uz_element element;
    double xyz[3 * UZ_ELEMENT_NODES], ke[MOST_KE];
    for (int s = part * PART; s < x->count && s < (part + 1) * PART; s++) {
        const int64_t e = x->element[s];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        if (!alike || made != uz_element_material(model, e)) {
            uz_body_element(&element, xyz, model, e);
            uz_element_stiffness(ke, &element);
            made = uz_element_material(model, e);
        }
        const int dim = b->dim, n = count * dim;
        for (int i = 0; i < n; i++) {
            double sum = 0;
            for (int j = 0; b->wanted[node[i / dim]] && j < n; j++)
                sum += ke[i * n + j] * b->u[node[j / dim] * dim + j % dim];
            x->force[(int64_t)s * UZ_ELEMENT_DOFS + i] = sum;
        }
    }
}

static void add_forces(balance *b, touching *x)
{
    uz_aside_share(find_forces, x, (x->count + PART - 1) / PART);
    for (int s = 0; s < x->count; s++) {
        int count;
        const int64_t *node = uz_mesh_element(&b->model->mesh, x->element[s], &count);
        for (int i = 0; i < count * b->dim; i++) {
            const double force = x->force[(int64_t)s * UZ_ELEMENT_DOFS + i];
            if (!b->wanted[node[i / b->dim]])
                continue;
            b->inner[node[i / b->dim] * b->dim + i % b->dim] += force;
            b->size += fabs(force);
        }
    }
    x->count = 0;
}

/* f_int where it is wanted, of the elements that touch such nodes. */
static uz_status add_elements(balance *b, uz_error *err)
{
    const int64_t n = b->model->mesh.n_elements;
    touching x = {.b = b,
                  .touches = uz_alloc(n, sizeof *x.touches),
                  .force = uz_alloc(AT_ONCE * UZ_ELEMENT_DOFS, sizeof *x.force)};
    const bool ok = x.touches && x.force;
    if (ok)
        uz_by_pieces(look_for_touching, &x, n);
    for (int64_t e = 0; ok && e < n; e++) {
        if (x.touches[e])
            x.element[x.count++] = e;
        if (x.count == AT_ONCE || e + 1 == n)
            add_forces(b, &x);
    }
    uz_free_all(x.touches, x.force);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld elements", (long long)n);
}

/* Forces at hanging nodes go to those that they lie amid, in what is left to supports by node. */
static void leave_hanging(balance *b)
{
    const uz_mesh *mesh = &b->model->mesh;
    for (int64_t a = mesh->n_given; a < mesh->n_nodes && mesh->hangs; a++) {
        const int64_t *from;
        const double *share;
        const int count = mesh->hangs[a] ? uz_mesh_amid(&from, &share, mesh, a) : 0;
        for (int k = 0; k < count * b->dim; k++) {
            const int64_t own = a * b->dim + k % b->dim, to = from[k / b->dim] * b->dim + k % b->dim;
            const double spring = b->model->spring ? b->model->spring[own] * b->u[own] : 0;
            b->inner[to] += share[k / b->dim] * (b->inner[own] + spring);
            b->load[to] += share[k / b->dim] * b->load[own];
            b->contact[to] += share[k / b->dim] * b->contact[own];
        }
    }
}

/* And those at slaves of ties to their masters. */
static void leave_tied(balance *b)
{
    const uz_csc *tied = &b->model->tied.share;
    for (int64_t a = 0; tied->ptr && a < b->model->mesh.n_nodes; a++) {
        double inner[DIM] = {0}, load[DIM] = {0}, contact[DIM] = {0};
        if (!uz_is_tied(b->model, a))
            continue;
        for (int c = 0; c < b->dim; c++) {
            const int64_t i = a * b->dim + c;
            inner[c] = b->inner[i] + (b->model->spring ? b->model->spring[i] * b->u[i] : 0);
            load[c] = b->load[i];
            contact[c] = b->contact[i];
        }
        uz_tied_part(inner, b->model, a);
        uz_tied_part(load, b->model, a);
        uz_tied_part(contact, b->model, a);
        for (int64_t q = tied->ptr[a]; q < tied->ptr[a + 1]; q++)
            for (int c = 0; c < b->dim; c++) {
                const int64_t to = (int64_t)tied->idx[q] * b->dim + c;
                b->inner[to] += tied->val[q] * inner[c];
                b->load[to] += tied->val[q] * load[c];
                b->contact[to] += tied->val[q] * contact[c];
            }
    }
}

/* What the supports do at a node, each along its own directions; what is left over is the residual of free dofs. */
static void add_reaction(balance *b, int64_t node)
{
    const int64_t first = b->supports.ptr[node], count = b->supports.ptr[node + 1] - first;
    const uz_rigid_group *rigid = uz_rigid_group_of(b->model, node);
    double R[DIM] = {0}, share[DIM];
    for (int c = 0; c < b->dim; c++) {
        const int64_t i = node * b->dim + c;
        R[c] = b->inner[i] - b->load[i] - b->contact[i] + (b->model->spring ? b->model->spring[i] * b->u[i] : 0);
    }
    if (rigid) {
        add_force(b, &b->out->supports[rigid->support], node, R);
        return;
    }
    for (int pass = 0; pass < (count > 1 ? 3 : 1); pass++) { /* again of the rest: directions may be nearly the same */
        uz_held_share(share, b->scene, b->dim, b->supports.idx + first, count, R);
        for (int64_t i = first; i < first + count; i++) {
            double f[DIM];
            uz_held_part(f, &b->scene->supports[b->supports.idx[i]], b->dim, share);
            add_force(b, &b->out->supports[b->supports.idx[i]], node, f);
            for (int c = 0; c < DIM; c++)
                R[c] -= f[c];
        }
    }
}

/* ---- all together */

/* A ring pushes its parts apart and is whole: only the axial sum must vanish. */
static double imbalance(const balance *b)
{
    const bool ring = b->model->kind == UZ_AXISYMMETRIC;
    double largest = 0;
    for (int c = ring ? 1 : 0; c < (ring ? 2 : DIM); c++)
        largest = fmax(largest, fmax(fabs(b->force[c]), fabs(b->moment[c]) / b->model->mesh.extent));
    return b->size > 0 ? largest / b->size : 0;
}

/* With thermal strain e: 1/2 (strain - e)' C (strain - e) = 1/2 u'K u - u'f + 1/2 e' C e, f the thermal forces.
 * work: u'f; own: the last term; kept: of what plane strain holds across the plane. */
static uz_status thermal_energy(double *work, double *own, double *kept, const balance *b, uz_error *err)
{
    uz_field_body body = {.scene = b->scene};
    uz_status status = uz_field_body_init(&body, b->scene, b->model, err);
    const uz_mesh *mesh = &b->model->mesh;
    for (int64_t e = 0; e < mesh->n_elements && status == UZ_OK && body.free_strain; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES], strain[UZ_ELEMENT_STRESSES], f[UZ_ELEMENT_DOFS] = {0},
                                                                       stress[UZ_ELEMENT_STRESSES];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        if (body.free_strain[e] == 0)
            continue;
        uz_body_element(&element, xyz, b->model, e);
        uz_thermal_strain(strain, element.model, element.lame, body.free_strain[e]);
        uz_element_add_thermal_load(f, &element, strain);
        for (int i = 0; i < count * b->dim; i++)
            *work += f[i] * b->u[node[i / b->dim] * b->dim + i % b->dim];
        uz_elastic_stress(stress, element.model, element.lame, strain);
        for (int i = 0; i < uz_stress_count(element.model); i++)
            *own += 0.5 * stress[i] * strain[i] * uz_element_volume(&element);
        *kept += uz_kept_energy(element.model, element.lame, body.free_strain[e]) * uz_element_volume(&element);
    }
    uz_field_body_clear(&body);
    return status;
}

/* The forces of elements where they are wanted, as they are known with those of springs. */
static void take_inner(balance *b, const double *inner)
{
    for (int64_t i = 0; i < b->model->mesh.n_nodes * b->dim; i++) {
        if (!b->wanted[i / b->dim])
            continue;
        b->inner[i] = inner[i] - (b->model->spring ? b->model->spring[i] * b->u[i] : 0);
        b->size += fabs(inner[i]);
    }
}

/* How many of these dofs supports move, or do not hold though they have no number. */
static double count_carried(void *ctx, int64_t begin, int64_t end)
{
    const balance *b = ctx;
    const uz_body_model *model = b->model;
    int64_t count = 0;
    for (int64_t i = begin; i < end; i++)
        if (b->u[i] != 0)
            count += (model->dof[i] < 0 && model->dof[i] != UZ_NO_DOF) ||
                     (model->n_rigid > 0 && uz_is_rigid(model, i / b->dim));
    return (double)count;
}

static double spring_energy(const balance *b)
{
    const uz_body_model *model = b->model;
    double energy = 0;
    for (int64_t i = 0; i < model->mesh.n_nodes * b->dim && model->spring; i++)
        energy += 0.5 * model->spring[i] * b->u[i] * b->u[i];
    return energy;
}

/* twice: as of uz_balance_forces. */
static uz_status energy_of(double *energy, balance *b, double twice, uz_error *err)
{
    /* Supports move the body, or do not hold it: then most of u may be rigid motion. */
    const uz_body_model *model = b->model;
    const bool carried = model->n_modes > 0 || uz_sum_by_pieces(count_carried, b, model->mesh.n_nodes * b->dim) > 0;
    if (carried || isnan(twice))
        return uz_strain_energy(energy, model, b->u, carried, err);
    *energy = 0.5 * twice + spring_energy(b);
    return UZ_OK;
}

/* How rigid groups have moved, linearly or (large) as they are turned, and the moments about their points there. */
static void tell_groups(balance *b, bool large)
{
    const uz_body_model *model = b->rest;
    for (int64_t g = 0; g < model->n_rigid; g++) {
        const uz_rigid_group *group = &model->rigid[g];
        uz_resultant *to = &b->out->supports[group->support];
        double at[DIM] = {group->point[0], group->point[1], group->point[2]}, across[DIM], R[3 * DIM];
        to->rigid = true;
        if (large) {
            uz_rigid_place(to->moved, R, model, group, b->u);
            uz_rotation_vector(to->turned, R);
        } else {
            uz_rigid_motion(to->moved, to->turned, model, group, NULL, b->u);
        }
        for (int c = 0; c < DIM && large; c++)
            at[c] += to->moved[c];
        uz_cross3(across, at, to->force);
        for (int c = 0; c < DIM && model->kind != UZ_AXISYMMETRIC; c++)
            to->about[c] = to->moment[c] - across[c];
        memcpy(to->point, group->point, sizeof to->point);
    }
}

static bool make_room(balance *b, int64_t n)
{
    b->load = uz_alloc(n * b->dim, sizeof *b->load); /* is written as a whole */
    b->contact = uz_alloc_zero(n * b->dim, sizeof *b->contact);
    b->inner = uz_alloc_zero(n * b->dim, sizeof *b->inner);
    b->held = uz_alloc(n, sizeof *b->held);
    b->wanted = uz_alloc(n, sizeof *b->wanted);
    return b->load && b->contact && b->inner && b->held && b->wanted;
}

uz_status uz_balance_forces(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                            const double *r, const uz_balance_known *known, double twice, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes, dim = model->mesh.dim;
    balance b = {.model = model,
                 .rest = known ? known->rest : model,
                 .scene = scene,
                 .u = u,
                 .r = r,
                 .out = out,
                 .dim = model->mesh.dim};
    double *force = model->row_ends ? uz_alloc(model->m, sizeof *force) : NULL;
    double expanding = 0, expanded = 0, energy = 0, work = 0; /* work: of all loads, the thermal forces included */
    uz_status status = UZ_OK;
    if (!make_room(&b, n))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces on %lld nodes", (long long)n);
    else if (model->row_ends && !force)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld contact rows", (long long)model->m);
    if (status != UZ_OK)
        goto done;
    if (force) {
        uz_row_forces(force, model, r);
        b.r = force;
    }
    memcpy(b.centre, model->mesh.xyz, (size_t)dim * sizeof *b.centre);
    add_contacts(&b);
    if (known)
        memcpy(b.load, known->load, (size_t)(n * dim) * sizeof *b.load);
    else
        status = uz_nodal_loads(b.load, model, scene, err);
    for (int64_t a = 0; a < n && status == UZ_OK; a++) {
        const double *f = b.load + a * dim;
        double square = 0;
        if (f[0] == 0 && f[1] == 0 && (dim == 2 || f[2] == 0))
            continue;
        for (int64_t c = 0; c < dim; c++) {
            work += f[c] * u[a * dim + c];
            square += f[c] * f[c];
        }
        out->loads_size += sqrt(square);
        add_force(&b, &out->loads, a, f);
    }
    if (status == UZ_OK)
        status = uz_list_held(&b.supports, &model->mesh, scene, err);
    if (status == UZ_OK)
        uz_by_pieces(find_wanted, &b, n);
    if (status == UZ_OK && known)
        take_inner(&b, known->inner);
    else if (status == UZ_OK)
        status = add_elements(&b, err);
    if (status == UZ_OK) {
        leave_hanging(&b);
        leave_tied(&b);
    }
    for (int64_t a = 0; a < n && status == UZ_OK; a++)
        if (b.held[a] && !uz_mesh_hangs(&model->mesh, a))
            add_reaction(&b, a);
    if (status == UZ_OK)
        tell_groups(&b, known != NULL);
    if (status == UZ_OK)
        status = add_springs(&b, err);
    if (status == UZ_OK && !known)
        status = thermal_energy(&expanding, &expanded, &out->kept_energy, &b, err);
    if (known)
        energy = known->energy;
    else if (status == UZ_OK) /* not from the work of the forces: what they leave over works along with the body */
        status = energy_of(&energy, &b, twice, err);
    out->spring_energy = spring_energy(&b);
    double stored;
    if (status == UZ_OK)
        out->spring_error = uz_spring_error(NULL, &stored, model, scene, u, 2 * (energy - out->spring_energy));
    out->strain_energy = energy - expanding + expanded;
    out->potential_energy = energy - work + expanded;
    out->imbalance = imbalance(&b);
done:
    uz_free_all(force, b.load, b.contact, b.inner, b.held, b.wanted);
    uz_csc_clear(&b.supports);
    return status;
}
