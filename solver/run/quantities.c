/* quantities.c: where a quantity's value for the body itself is, by estimate.
 *
 *     answer u_h -> value on this mesh (post/functional.c)
 *     adjoint z_h: one solve on the factor that is there, the rows in contact held as equations
 *     a(e_u, e_z) = 1/4 (|e_u + e_z|^2 - |e_u - e_z|^2), each square by the recovered stresses
 *     depth: what obstacles that stand in sides between their nodes come to, by the adjoint's reactions
 *     springs: what those at nodes do otherwise than those that are spread over sides
 *     value = found + a(e_u, e_z) + depth + springs, within parts of these, of |e_u| |e_z| summed over elements, and of
 *             what the ends of contacts leave
 *
 * The product knows of thin stacks what their jumps hide (assembly/thin_elements.h).
 *
 * Where a mesh is refined for it, elements are told what each has of that.
 *
 * The parts cover the errors of generated scenes (tests/extremes/generated_quantities.py; docs/accuracy.md has the
 * figures). To these comes what the certificate leaves of the equations: |z|_K times its bound, and the
 * residual in z. */
#include "run/quantities.h"

#include "assembly/thin_elements.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "post/balance.h"
#include "post/functional.h"
#include "run/problem.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Parts of the half width: of the estimate, of what depths and ends of contacts come to. */
#define OF_ESTIMATE 0.5
#define OF_DEPTH    0.5 /* also of springs at nodes */
#define OF_END      0.1
/* ... and of the product of the norms of both errors at least, where elements say less. */
#define OF_PRODUCT 0.5
/* An element stands out whose part of the sum of products is more than so many times the mean. */
#define OUTSTANDING 3
/* ... of forces of contacts, whose rows in contact the adjoint takes for known: what a finer mesh changes of them is of
 * second order, and on coarse meshes a part of all the rest; where temperature presses the body into its obstacles it
 * is more than that; of all other quantities. */
#define OF_CONTACT 1.6
#define OF_HEAT    2.5
#define OF_OTHER   1.3
/* ... times this of large deformation, where what stress does to turning parts and terms of third order are left out:
 * of 120 generated scenes true values were as far off as 1.36 times what was told without. So is what equations leave,
 * which is known to first order: of parts that were pulled, off by a tenth, energies were off by 1.3 times as much. */
#define OF_LARGE 1.5
/* ... and of the value times the square of the mesh's error: of a force that balance alone makes all but known, the
 * rest is of second order. */
#define OF_SECOND 1e-2
/* Of the square of what the equations leave, in the energy of that. */
#define OF_ITSELF 1.5

/* Solves that are not exact go on to this part of the adjoint's norm, or to this part of what the mesh leaves of it,
 * which is taken to be as much as of the answer: where that is more. */
#define SOLVED   1e-6
#define OF_MESH  1e-2
#define ROUGHEST 1e-3

/* Of large deformation: gaps that are less, in the body's size, may be none. */
#define ROUNDING 1e-9

typedef struct {
    const uz_quantity_work *work;
    const uz_result *answer;
    double *p;                       /* d */
    double *h, *y, *g;               /* rows of the dual */
    double *of_rows, *depth, *bulge; /* the model's rows: y; uz_contact_depth; ... */
    double *slip;            /* ... how far the adjoint leaves those that do not press from where it holds the others */
    int64_t *row_of;         /* n_nodes: a row that stands at the node, -1: none does */
    bool *active, *pressing; /* rows of the dual; the model's */
    double *z, *w;           /* n_nodes x dim; w: room of d as well */
    double own;              /* what the answer's error has in the adjoint's, of large deformation */
    double *free_strain;
    bool coarse;
    double own_error;    /* |e_u|^2 */
    double aim;          /* of solves for z, in parts of its norm */
    double *of_elements; /* 3 n_elements: |e_u|^2 of each; of u plus and less z */
    double *least[2];    /* n_elements: no less of u, of z; NULL: nothing is known (assembly/thin_elements.h) */
} adjoint;

/* The estimate of |e_u + times e_z|^2, and what each element has of it. */
static uz_status errors_of(double *energy, double *of_elements, adjoint *x, double times, uz_error *err)
{
    const uz_body_model *model = x->work->model;
    const uz_quantity_large *place = x->work->place;
    if (place)
        return place->errors(place->of, energy, of_elements, x->z, 1 + times * x->own, times, err);
    for (int64_t i = 0; i < model->mesh.n_nodes * model->mesh.dim && times != 0; i++)
        x->w[i] = x->answer->u[i] + times * x->z[i];
    return uz_mesh_error_energy(energy, of_elements, model, x->free_strain, times != 0 ? x->w : x->answer->u, err);
}

/* ... where stacks of elements tell it of u, or of an adjoint: under these parts of the loads and of the strain of the
 * temperatures. */
static uz_status least_of(double **least, adjoint *x, const double *nodal, double loads, double warmth, uz_error *err)
{
    const int64_t n = x->work->model->mesh.n_elements;
    double *strain = x->free_strain && warmth != 0 ? uz_alloc(n, sizeof *strain) : NULL;
    const uz_strain_source from = {.model = x->work->model, .nodal = nodal, .free_strain = strain};
    *least = NULL;
    if (x->free_strain && warmth != 0 && !strain)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the strains of %lld elements", (long long)n);
    for (int64_t e = 0; e < n && strain; e++)
        strain[e] = warmth * x->free_strain[e];
    const uz_status status = x->work->place ? UZ_OK : uz_thin_elements_errors(least, x->work->scene, &from, loads, err);
    free(strain);
    return status;
}

static double own_error_of(const adjoint *x, int64_t element)
{
    return fmax(x->of_elements[element], x->least[0] ? x->least[0][element] : 0);
}

static uz_status begin(adjoint *x, uz_error *err)
{
    const uz_body_model *model = x->work->model;
    const uz_quantity_large *place = x->work->place;
    const int64_t n = model->mesh.n_nodes * model->mesh.dim, m = place ? 0 : x->work->dual->m;
    x->p = uz_alloc(model->d, sizeof *x->p);
    x->h = uz_alloc(m, sizeof *x->h);
    x->y = uz_alloc_zero(m, sizeof *x->y);
    x->g = uz_alloc(m, sizeof *x->g);
    x->of_rows = uz_alloc(model->m, sizeof *x->of_rows);
    x->depth = uz_alloc(model->m, sizeof *x->depth);
    x->bulge = uz_alloc(model->m, sizeof *x->bulge);
    x->slip = uz_alloc(model->m, sizeof *x->slip);
    x->row_of = uz_alloc(model->mesh.n_nodes, sizeof *x->row_of);
    x->active = uz_alloc_zero(m, sizeof *x->active);
    x->pressing = uz_alloc_zero(model->m, sizeof *x->pressing);
    x->z = uz_alloc(n, sizeof *x->z);
    x->w = uz_alloc(n, sizeof *x->w);
    x->of_elements = uz_alloc_zero(3 * model->mesh.n_elements, sizeof *x->of_elements);
    if (!x->p || !x->h || !x->y || !x->g || !x->of_rows || !x->depth || !x->bulge || !x->slip || !x->row_of ||
        !x->active || !x->pressing || !x->z || !x->w || !x->of_elements)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the quantities of %lld nodes",
                       (long long)model->mesh.n_nodes);
    memset(x->row_of, 0xff, (size_t)model->mesh.n_nodes * sizeof *x->row_of);
    for (int64_t i = 0; i < model->m; i++)
        if (!uz_row_inner(model, i))
            x->row_of[model->info.contact_node[i]] = i;
    uz_status status = uz_free_strains(&x->free_strain, model, x->work->scene, err);
    if (place) /* where it is */
        memset(x->w, 0, (size_t)n * sizeof *x->w);
    if (status == UZ_OK)
        status = uz_contact_depth(x->depth, x->bulge, place ? place->place.displaced : model, x->work->scene,
                                  place ? x->w : x->answer->u, x->answer->r, err);
    if (status == UZ_OK)
        status = errors_of(&x->own_error, x->of_elements, x, 0, err);
    if (status == UZ_OK)
        status = least_of(&x->least[0], x, x->answer->u, 1, 1, err);
    for (int64_t e = 0; e < model->mesh.n_elements && status == UZ_OK; e++)
        x->own_error += own_error_of(x, e) - x->of_elements[e];
    const double strain = x->answer->evaluation->strain_energy;
    x->aim = fmax(SOLVED, fmin(ROUGHEST, strain > 0 ? OF_MESH * sqrt(x->own_error / strain) : 0));
    return status;
}

/* y with D_AA y = g0_A by conjugate gradients, where the form of the operator has no exact solve or rows depend on each
 * other. *solved false: it does not get there. */
static uz_status iterate(adjoint *x, bool *solved, uz_dual_load *load, uz_error *err)
{
    enum { MOST_STEPS = 500 };
    const int64_t m = load->dual->m;
    double *r = uz_alloc(m, sizeof *r), *s = uz_alloc(m, sizeof *s), *Ds = uz_alloc(m, sizeof *Ds), rr = 0, aim;
    uz_status status = r && s && Ds ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)m);
    for (int64_t i = 0; i < m && status == UZ_OK; i++) {
        x->y[i] = 0;
        r[i] = s[i] = x->active[i] ? load->g0[i] : 0;
        rr += r[i] * r[i];
    }
    aim = x->aim * x->aim * rr;
    *solved = !(rr > 0);
    for (int step = 0; step < MOST_STEPS && status == UZ_OK && !*solved && !uz_stop_is_due(x->work->stop); step++) {
        double sDs = 0, next = 0;
        status = uz_dual_load_apply(load, Ds, s, err);
        for (int64_t i = 0; i < m && status == UZ_OK; i++)
            sDs += x->active[i] ? s[i] * Ds[i] : 0;
        if (!(sDs > 0))
            break;
        for (int64_t i = 0; i < m; i++) {
            x->y[i] += rr / sDs * s[i];
            r[i] -= x->active[i] ? rr / sDs * Ds[i] : 0;
            next += r[i] * r[i];
        }
        for (int64_t i = 0; i < m; i++)
            s[i] = r[i] + next / rr * s[i];
        rr = next;
        *solved = rr <= aim;
    }
    uz_free_all(r, s, Ds);
    return status;
}

/* w and of_rows, on the factor that is there. */
static uz_status solve_on_factor(adjoint *x, bool *solved, const uz_functional *of, uz_error *err)
{
    const uz_quantity_work *work = x->work;
    const uz_body_model *model = work->model;
    const int64_t m = work->dual->m;
    const uz_candidates *rows = work->rows && work->rows->in ? work->rows : NULL;
    uz_dual_load *load = NULL;
    uz_active_end ended;
    int64_t count = 0;
    for (int64_t i = 0, k = 0; i < model->m; i++) { /* rows left out do not press */
        if (rows && !rows->in[i])
            continue;
        x->active[k] = x->pressing[i];
        x->h[k] = x->pressing[i] ? of->gap[i] : INFINITY;
        count += x->pressing[i];
        k++;
    }
    uz_gather_nodal(x->p, model, of->load);
    uz_csc_gaxpy(x->p, &model->K_fixed, -1, of->held);
    if (work->weight) { /* springs that the rows in contact leave without force */
        for (int64_t i = 0; i < model->m; i++)
            x->of_rows[i] = x->pressing[i] ? work->weight[i] * of->gap[i] : 0;
        uz_csc_gaxpy_t(x->p, &model->N, 1, x->of_rows);
    }
    uz_status status = uz_dual_load_create(&load, work->dual, work->K, x->p, x->h, err);
    if (status == UZ_OK) {
        load->equations = true;
        status = uz_dual_load_aim(load, x->aim, work->stop, err);
    }
    memset(x->y, 0, (size_t)m * sizeof *x->y);
    *solved = count == 0;
    if (status == UZ_OK && !*solved) {
        status = uz_dual_load_solve_active(load, &ended, x->y, x->g, x->active, err);
        *solved = ended == UZ_ACTIVE_SOLVED;
        if (status == UZ_OK && !*solved)
            status = iterate(x, solved, load, err);
    }
    if (status == UZ_OK)
        status = uz_dual_load_recover(load, x->w, x->y, false, err);
    for (int64_t i = 0, k = 0; i < model->m && status == UZ_OK; i++) { /* back to the model's rows */
        const bool in = !rows || rows->in[i];
        x->of_rows[i] = in ? x->y[k] * work->dual->row_scale[k] : 0;
        k += in;
    }
    uz_dual_load_free(load);
    return status;
}

/* z: the adjoint's displacement by node; of large deformation without what the answer's own error has in it, which is
 * no displacement's. *solved false: there is none. */
static uz_status solve(adjoint *x, bool *solved, const uz_functional *of, uz_error *err)
{
    const uz_body_model *model = x->work->model;
    const uz_quantity_large *place = x->work->place;
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    model->law->kind->active(model->law, x->pressing, x->answer->r, model->m);
    const uz_status status = place ? place->solve(place->of, solved, x->w, x->of_rows, x->pressing, of, err)
                                   : solve_on_factor(x, solved, of, err);
    if (status != UZ_OK || !*solved)
        return status;
    for (int64_t i = 0; i < model->m; i++)
        x->slip[i] = of->gap[i];
    uz_csc_gaxpy(x->slip, &model->N, -1, x->w);
    uz_recover_nodal(x->z, model, x->w, of->held);
    x->own = place ? of->own : 0;
    for (int64_t i = 0; i < n; i++)
        x->z[i] = (place ? 0 : of->own * x->answer->u[i]) + of->times * x->z[i];
    return UZ_OK;
}

/* Of z and u: half of their squares in the energy norm. */
static uz_status find_norms(double *norm, double *strain, adjoint *x, uz_error *err)
{
    const uz_body_model *model = x->work->model;
    const uz_quantity_large *place = x->work->place;
    if (place) {
        for (int64_t i = 0; i < model->mesh.n_nodes * model->mesh.dim; i++)
            x->w[i] = x->own * x->answer->u[i] + x->z[i];
        *strain = x->answer->evaluation->strain_energy;
        return place->energy(place->of, norm, x->w, err);
    }
    const uz_status status = uz_strain_energy(norm, model, x->z, true, err);
    return status == UZ_OK ? uz_strain_energy(strain, model, x->answer->u, true, err) : status;
}

/* What obstacles that stand in sides between their nodes come to, by the adjoint's reactions; or sides in what they
 * stand for. */
static double depth_shift(const adjoint *x, const uz_functional *of, const double *depth)
{
    double sum = 0;
    for (int64_t i = 0; i < x->work->model->m; i++)
        sum += depth[i] * x->of_rows[i];
    return of->times * sum;
}

/* Where a body turns on its springs those at the ends of sides hold it too well. With a_h for a with springs at nodes,
 * l(u) - l(u_h) has f(z_h) - a(u_h, z_h) = (a_h - a)(u_h, z_h) besides a(e_u, e_z). */
static double spring_shift(const adjoint *x)
{
    const uz_body_model *model = x->work->model;
    const double *u = x->answer->u, own = x->work->place ? x->own : 0;
    const double along = uz_spring_excess(NULL, model, x->work->scene, u, x->z);
    return own != 0 ? along + own * uz_spring_excess(NULL, model, x->work->scene, u, u) : along;
}

/* What the end of a contact amid a side leaves open: of each side with rows that press and others that do not, what it
 * would come to if the open ones were closed by force, or the pressing ones let go. -> part, of its element, and sum.
 */
static double end_error(double *part, const adjoint *x)
{
    const uz_body_model *model = x->work->model;
    const uz_mesh *mesh = &model->mesh;
    double sum = 0;
    for (int64_t k = 0; k < x->work->scene->n_contacts; k++)
        for (int other = 0; other < 2; other++) {
            const uz_contact *contact = &x->work->scene->contacts[k];
            const bool body = contact->kind == UZ_OBSTACLE_BODY;
            const uz_group *group =
                other && !body ? NULL : uz_mesh_group(mesh, other ? contact->with : contact->on, "", NULL);
            for (int64_t f = 0; group && f < group->n_faces; f++) {
                int64_t node[UZ_FACE_NODES];
                const int count = uz_mesh_face(node, mesh, group->face[f]);
                double gap = 0, slip = 0, y = 0, r = 0;
                for (int a = 0; a < count; a++) {
                    const int64_t i = x->row_of[node[a]];
                    if (i < 0 || model->info.contact_of[i] != k)
                        continue;
                    if (x->pressing[i]) {
                        y = fmax(y, fabs(x->of_rows[i]));
                        r = fmax(r, fabs(x->answer->r[i]));
                    } else {
                        gap = fmax(gap, fmax(0, x->answer->g[i]));
                        slip = fmax(slip, fabs(x->slip[i]));
                    }
                }
                sum += OF_END * (y * gap + r * slip);
                part[group->face[f].element] += OF_END * (y * gap + r * slip);
            }
        }
    return sum;
}

/* Of the sums K u, by their largest terms, in the adjoint: all that is left of forces that are known from balance. */
static double rounding_of(const adjoint *x)
{
    const uz_body_model *model = x->work->model;
    double sum = 0;
    for (int64_t i = 0; i < model->mesh.n_nodes * model->mesh.dim; i++) {
        const int64_t j = model->dof[i];
        sum += j >= 0 ? fabs(x->z[i] * model->K.val[model->K.ptr[j]] * x->answer->u[i]) : 0;
    }
    return DBL_EPSILON * sum;
}

/* No row presses, and the nearest obstacle is no farther than displacements may be off: is there contact? */
static bool is_about_to_touch(const adjoint *x, double mesh_error)
{
    const uz_body_model *model = x->work->model;
    double nearest = INFINITY, farthest = 0;
    for (int64_t i = 0; i < model->m; i++)
        nearest = fmin(nearest, x->answer->g[i]);
    for (int64_t i = 0; i < model->mesh.n_nodes * model->mesh.dim; i++)
        farthest = fmax(farthest, fabs(x->answer->u[i]));
    return x->answer->summary.active == 0 && nearest <= mesh_error * farthest;
}

/* Of |e_u| |e_z|, what is taken of an element's part, and of what that has beyond OUTSTANDING times the mean. Beside
 * corners where stress is singular an estimate is as small as 0.74 of the error of linear elements, 0.67 of those of
 * eight and twenty nodes, 0.47 of six and ten (docs/theory.md): a product of two, times the square of one over it, and
 * clamped ends of contacts need as much again. Of quadratic plane elements the few at a corner have most of the sum
 * then; where elements have about as much as others, as of smooth fields and of meshes that were refined where the
 * error is, they need far less. Coarse solids have edges all over. */
static void product_factors(double factor[2], uz_element_kind kind)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const bool plane = kind == UZ_TRI6 || kind == UZ_QUAD8;
    if (type->nodes == type->corners)
        factor[0] = factor[1] = 1.7;
    else if (kind == UZ_TRI6 || kind == UZ_TET10) {
        factor[0] = plane ? 2.4 : 7;
        factor[1] = plane ? 10 : 7;
    } else {
        factor[0] = plane ? 1.5 : 3;
        factor[1] = plane ? 5 : 3;
    }
}

/* |e_u| |e_z|, summed over elements with their factors: what is far off in the one need not be where the other is. Rows
 * of contacts may change on finer meshes, which no element's own part knows: it is no less than of a part of the
 * product of the norms, and of all of that where temperature presses the body into its obstacles. scale: z's. -> part,
 * which is room for three of each element and has what it is made of: each element's; where errors are at different
 * places, of what the product of the norms falls by with its own. */
static double product_of_errors(double *part, const adjoint *x, double scale)
{
    const int64_t n = x->work->model->mesh.n_elements;
    double *other = part + n, sum = 0, weighted = 0, square[2] = {0}, factor[2] = {0};
    for (int64_t e = 0; e < n; e++) {
        const double own = own_error_of(x, e);
        other[e] =
            fmax(x->least[1] ? scale * scale * x->least[1][e] : 0, 0.5 * (part[e] + other[e]) - x->of_elements[e]);
        part[e] = sqrt(own * other[e]);
        sum += part[e];
        square[0] += own;
        square[1] += other[e];
    }
    const double usual = OUTSTANDING * sum / (double)n, norms = sqrt(square[0] * square[1]);
    for (int64_t e = 0; e < n; e++) {
        product_factors(factor, (uz_element_kind)x->work->model->mesh.kind[e]);
        part[e] = factor[0] * fmin(part[e], usual) + factor[1] * fmax(0, part[e] - usual);
        weighted += part[e];
    }
    const double least = (x->free_strain ? 1 : OF_PRODUCT) * norms;
    const double whole = (sum > 0 ? weighted * fmax(1, least / sum) : factor[1] * least) / scale;
    for (int64_t e = 0; e < n; e++)
        part[e] = sum > OF_PRODUCT * norms ? whole * part[e] / weighted
                  : norms > 0              ? whole * (own_error_of(x, e) / square[0] + other[e] / square[1]) / 2
                                           : 0;
    return whole;
}

/* Where to refine for the quantity that is asked for? */
static bool steers(const adjoint *x, const uz_quantity_found *out)
{
    return out == x->answer->evaluation->quantities && x->work->settings->quantity_error > 0 &&
           x->work->problem->scene.refine;
}

/* part: of the half width, by element. second: what of it falls with the square of the answer's own error. */
static uz_status keep_shares(const adjoint *x, const double *part, double second, uz_error *err)
{
    uz_evaluation *e = x->answer->evaluation;
    const int64_t n = x->work->model->mesh.n_elements;
    double sum = 0;
    double *share = uz_alloc(n, sizeof *share);
    if (!share)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the errors of %lld elements", (long long)n);
    for (int64_t i = 0; i < n; i++) {
        share[i] = part[i] + (x->own_error > 0 ? second * own_error_of(x, i) / x->own_error : 0);
        sum += share[i];
    }
    for (int64_t i = 0; i < n && sum > 0; i++)
        share[i] /= sum;
    e->share = share;
    return UZ_OK;
}

static uz_status estimate(uz_quantity_found *out, adjoint *x, const uz_functional *of, uz_error *err)
{
    const uz_body_model *model = x->work->model;
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double norm = 0, strain = 0, length = 0, both[2] = {0};
    bool solved = false;
    const bool energy = out->kind == UZ_QUANTITY_STRAIN_ENERGY; /* its z is u/2, with w for the temperatures, less w */
    const bool pressed =
        x->work->scene->n_contacts > 0 && (out->kind == UZ_QUANTITY_CONTACT_FORCE ||
                                           out->kind == UZ_QUANTITY_REACTION || out->kind == UZ_QUANTITY_MEAN_PRESSURE);
    uz_status status = solve(x, &solved, of, err);
    if (status != UZ_OK)
        return status;
    if (!solved) {
        snprintf(out->why, sizeof out->why, "the rows in contact could not be held for its adjoint problem");
        return UZ_OK;
    }
    status = find_norms(&norm, &strain, x, err);
    const double scale = norm > 0 && strain > 0 ? sqrt(strain / norm) : 1; /* both of one size */
    for (int k = 0; k < 2 && status == UZ_OK; k++)
        status =
            errors_of(&both[k], x->of_elements + (k + 1) * model->mesh.n_elements, x, k == 0 ? scale : -scale, err);
    free(x->least[1]);
    x->least[1] = NULL;
    if (status == UZ_OK)
        status = least_of(&x->least[1], x, x->z, energy ? 0.5 : 0, energy ? -0.5 : 0, err);
    if (status != UZ_OK)
        return status;
    const double share = strain > 0 ? fmin(1, x->own_error / strain) : 0; /* the square of the mesh's error, about */
    if (pressed && is_about_to_touch(x, sqrt(share))) {
        snprintf(out->why, sizeof out->why, "no row presses, and the mesh can't tell whether one of them should");
        return UZ_OK;
    }
    for (int64_t i = 0; i < n; i++)
        length = hypot(length, x->z[i]);
    const double depth = depth_shift(x, of, x->depth), bulge = depth_shift(x, of, x->bulge);
    const double shift = norm > 0 ? (both[0] - both[1]) / (4 * scale) : 0, spring = spring_shift(x);
    const double of_kind = !pressed ? OF_OTHER : x->free_strain ? OF_HEAT : OF_CONTACT;
    const double times = of_kind * (x->work->place ? OF_LARGE : 1);
    double *part = x->of_elements + model->mesh.n_elements;
    if (!(norm > 0)) /* z is 0: what is left of differences is rounding of u's own */
        memset(part, 0, (size_t)model->mesh.n_elements * sizeof *part);
    const double product = norm > 0 ? product_of_errors(part, x, scale) : 0;
    out->mesh = OF_ESTIMATE * fabs(shift) + product + OF_DEPTH * (fabs(depth) + fabs(spring)) + fabs(bulge) +
                end_error(part, x) + of->blur;
    double whole = fabs(out->found); /* a reaction may be what large forces leave of each other */
    for (int64_t i = 0; i < model->m && out->kind == UZ_QUANTITY_REACTION; i++)
        whole += fabs(x->answer->r[i]);
    if (steers(x, out))
        status = keep_shares(x, part, OF_SECOND * share * whole / times, err);
    if (status != UZ_OK || out->why[0])
        return status;
    out->mesh = times * out->mesh + OF_SECOND * share * whole;
    /* where z is a rigid motion, of forces that are in balance, the residual at free nodes is what is left */
    const uz_certificate *left = &x->answer->summary.certificate;
    out->equations = x->work->place
                         ? OF_LARGE * sqrt(2 * fmax(0, norm)) * x->work->place->left
                         : sqrt(2 * fmax(0, norm)) * left->absolute_error + length * left->residual.e1 + rounding_of(x);
    if (x->work->place && of->times < 0 && !energy) /* a force: z moves what is held, and its norm is no bound */
        out->equations += length * x->work->place->forces;
    if (x->work->place && energy) /* what is left works along itself, too */
        out->equations += OF_ITSELF * x->work->place->left * x->work->place->left;
    const double half = out->mesh + out->equations;
    if (!isfinite(half) || !isfinite(shift)) {
        snprintf(out->why, sizeof out->why, "nothing bounds what the equations leave of it");
        return UZ_OK;
    }
    out->value = out->found + shift + depth + spring;
    out->low = out->value - half;
    out->high = out->value + half;
    return UZ_OK;
}

/* Is a contact narrower than the mesh can tell? Of large deformation no warning says so. */
static uz_status find_coarse(adjoint *x, uz_error *err)
{
    uz_coarse_contact found = {.contact = -1};
    uz_status status = UZ_OK;
    if (x->work->place)
        status = uz_find_coarse_contact(&found, x->work->model, x->work->scene, x->answer->u, x->answer->r, err);
    x->coarse = found.contact >= 0 || uz_is_warned(x->answer->evaluation, UZ_WARN_COARSE);
    return status;
}

/* Why no quantity of the answer can have an interval; NULL: they can. */
static const char *why_none(const adjoint *x)
{
    const uz_quantity_work *work = x->work;
    const uz_summary *s = &x->answer->summary;
    const bool overlap = (work->place && s->finite.least_gap < -ROUNDING * work->model->mesh.extent) ||
                         uz_is_warned(x->answer->evaluation, UZ_WARN_OVERLAP);
    if (x->coarse)
        return "the mesh can't tell how wide the contact is (coarse_contact)";
    if (overlap && s->active == 0)
        return "surfaces stand in each other, and no row of a contact presses";
    return work->place ? work->place->why : work->dual ? NULL : "no rows are proved to hold the body";
}

uz_status uz_find_quantities(uz_result *answer, const uz_quantity_work *work, uz_error *err)
{
    uz_evaluation *e = answer->evaluation;
    adjoint x = {.work = work, .answer = answer};
    const uz_quantity_large *place = work->place;
    const int64_t n = work->problem->n_quantities;
    if (!e || n == 0)
        return UZ_OK;
    e->quantities = uz_alloc_zero(n, sizeof *e->quantities);
    if (!e->quantities)
        return uz_fail(err, UZ_ERR_MEMORY, "/quantities", "no memory for %lld quantities", (long long)n);
    uz_status status = work->dual || place ? begin(&x, err) : UZ_OK;
    if (status == UZ_OK)
        status = find_coarse(&x, err);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        const uz_quantity *asked = &work->problem->quantities[i];
        uz_quantity_found *out = &e->quantities[i];
        uz_functional of = {.found = 0};
        char where[UZ_QUANTITY_POINTER];
        uz_quantity_place(where, work->problem, i, asked->kind == UZ_QUANTITY_MEAN_PRESSURE ? "window" : "on");
        *out = (uz_quantity_found){.kind = asked->kind, .low = NAN, .high = NAN, .mesh = NAN, .equations = NAN};
        memcpy(out->name, asked->name, sizeof out->name);
        status = uz_functional_make(&of, asked, where, work->model, work->scene, answer, work->h, work->prescribed,
                                    place ? &place->place : NULL, err);
        out->value = out->found = of.found;
        memcpy(out->why, of.why, sizeof out->why);
        const bool coarse = x.coarse && !out->why[0];
        if (!out->why[0] && why_none(&x))
            snprintf(out->why, sizeof out->why, "%s", why_none(&x));
        /* an interval has to wait for a finer mesh, and where that is to be finer its adjoint tells */
        const bool solvable = place ? !place->why : work->dual != NULL;
        if (status == UZ_OK && (!out->why[0] || (coarse && solvable && steers(&x, out))))
            status = estimate(out, &x, &of, err);
        uz_functional_clear(&of);
        e->n_quantities = i + 1;
    }
    e->asked = work->settings->quantity_error;
    uz_free_all(x.least[0], x.least[1], x.p, x.h, x.y, x.g, x.of_rows, x.depth, x.bulge, x.slip, x.z, x.w,
                x.free_strain, x.active, x.row_of, x.pressing, x.of_elements);
    return status;
}
