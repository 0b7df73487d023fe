/* The error estimate and the stresses, which take several elements at a time, against those that take one element after
 * the other, by the functions on single elements; and the strains that both rest on. */
#include "assembly/assembly.h"
#include "assembly/thin_elements.h"
#include "body_fixture.h"
#include "core/alloc.h"
#include "element/strain_lanes.h"
#include "element_mesh.h"
#include "post/parts.h"
#include "random_scene.h"

enum { NODES = UZ_ELEMENT_NODES, POINTS = UZ_ELEMENT_GAUSS, STRESSES = UZ_ELEMENT_STRESSES, LANES = UZ_STRAIN_LANES };

/* ------------------------------------------------------------------ strains */

/* Of plane elements, of solids. */
static const uz_model MODELS[2][3] = {{UZ_PLANE_STRESS, UZ_PLANE_STRAIN, UZ_AXISYMMETRIC},
                                      {UZ_SOLID, UZ_SOLID, UZ_SOLID}};

/* Four elements of one kind, each bent in its own way; the first of a ring stands on the axis. */
typedef struct {
    uz_element element[LANES];
    double xyz[LANES][3 * NODES], u[LANES][UZ_ELEMENT_DOFS];
    uz_lanes x[3 * NODES], displacement[UZ_ELEMENT_DOFS];
    uz_lane_material material;
} four_elements;

static void make_four(four_elements *f, uz_element_kind kind, uz_model model, uz_formulation asked, qp_random *rng)
{
    const double(*local)[3] = uz_element_type_of(kind)->local;
    const int dim = uz_element_type_of(kind)->dim, count = uz_element_node_count(kind) * dim;
    for (int l = 0; l < LANES; l++) {
        const double size = pow(10, 2 * random_signed(rng)), poisson = 0.1 * (l + 1);
        const bool ring = model == UZ_AXISYMMETRIC;
        for (int i = 0; i < count; i++) {
            const bool radial = ring && i % dim == 0;
            const double reference = local[i / dim][i % dim] + (radial ? 1 : 0);
            const double bend = radial && reference == 0 ? 0 : 0.06 * random_signed(rng);
            f->xyz[l][i] = size * (reference + bend + (radial ? 2 * l : 0));
            f->u[l][i] = 1e-3 * size * random_signed(rng);
        }
        f->element[l] = (uz_element){.kind = kind,
                                     .model = model,
                                     .formulation = uz_resolve_formulation(asked, kind, model, poisson),
                                     .lame = uz_lame_of(model, 100 * (l + 1), poisson),
                                     .thickness = 0.7,
                                     .xyz = f->xyz[l]};
        CHECK_INT(uz_element_check(&f->element[l]), UZ_SHAPE_GOOD);
        f->material.lambda[l] = f->element[l].lame.lambda;
        f->material.mu[l] = f->element[l].lame.mu;
        for (int i = 0; i < count; i++) {
            f->x[i][l] = f->xyz[l][i];
            f->displacement[i][l] = f->u[l][i];
        }
    }
}

static void compare_lane(const four_elements *f, const uz_strain_rule *rule, const uz_lane_shape *shape,
                         uz_lanes strain[POINTS][STRESSES], int l)
{
    uz_element_motion motion;
    const uz_element *element = &f->element[l];
    uz_element_move(&motion, element, f->u[l]);
    for (int g = 0; g < rule->points; g++) {
        double grad[NODES][3], want[STRESSES], size = 0;
        const uz_gauss_point *at = &uz_element_rule(rule->kind, rule->model)->point[g];
        const double *point = at->at;
        const double volume = at->weight * element_measure(element, point, uz_element_gradients(grad, element, point));
        uz_element_strain(want, &motion, point);
        for (int c = 0; c < rule->stresses; c++)
            size = fmax(size, fabs(want[c]));
        CHECK_REL(shape->volume[g][l], volume, 1e-13);
        for (int c = 0; c < rule->stresses; c++)
            CHECK_MSG(fabs(strain[g][c][l] - want[c]) < 1e-12 * size,
                      "kind %d, model %d, formulation %d: strain %d is %.17g, not %.17g", rule->kind, rule->model,
                      rule->formulation, c, strain[g][c][l], want[c]);
    }
}

/* Derivatives of the displacements alone, whatever the formulation adds to them. */
static void compare_gradients(const four_elements *f, const uz_strain_rule *rule, uz_lanes H[POINTS][3][3], int l)
{
    const uz_element *element = &f->element[l];
    for (int g = 0; g < rule->points; g++) {
        double grad[NODES][3], around[NODES], want[3][3] = {{0}}, size = 0;
        const double *point = uz_element_rule(rule->kind, rule->model)->point[g].at;
        uz_element_gradients(grad, element, point);
        uz_element_around(around, element, grad, point);
        for (int a = 0; a < rule->nodes; a++) {
            for (int c = 0; c < rule->dim; c++)
                for (int j = 0; j < rule->dim; j++)
                    want[c][j] += f->u[l][a * rule->dim + c] * grad[a][j];
            want[2][2] += rule->model == UZ_AXISYMMETRIC ? f->u[l][a * rule->dim] * around[a] : 0;
        }
        for (int i = 0; i < 9; i++)
            size = fmax(size, fabs(want[i / 3][i % 3]));
        for (int i = 0; i < 9; i++)
            CHECK_MSG(fabs(H[g][i / 3][i % 3][l] - want[i / 3][i % 3]) < 1e-12 * size,
                      "kind %d, model %d: derivative %d is %.17g, not %.17g", rule->kind, rule->model, i,
                      H[g][i / 3][i % 3][l], want[i / 3][i % 3]);
    }
}

TEST(strains_in_lanes_are_those_of_single_elements)
{
    static const uz_formulation ASKED[] = {UZ_FORMULATION_STANDARD, UZ_FORMULATION_BBAR, UZ_FORMULATION_INCOMPATIBLE};
    qp_random rng = {2024};
    uz_lanes strain[POINTS][STRESSES], H[POINTS][3][3];
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (int k = 0; k < 9; k++) {
            four_elements f;
            uz_strain_rule rule;
            uz_lane_shape shape;
            make_four(&f, (uz_element_kind)kind, MODELS[uz_element_type_of((uz_element_kind)kind)->dim == 3][k / 3],
                      ASKED[k % 3], &rng);
            uz_strain_rule_at(&rule, f.element[0].kind, f.element[0].model, f.element[0].formulation, NULL, NULL, 0);
            uz_lane_shape_of(&shape, &rule, f.x, f.element[0].thickness);
            uz_lane_strains(strain, &rule, &shape, &f.material, f.displacement);
            uz_lane_gradients(H, &rule, &shape, f.displacement);
            for (int l = 0; l < LANES; l++) {
                compare_lane(&f, &rule, &shape, strain, l);
                compare_gradients(&f, &rule, H, l);
            }
        }
}

/* Where the stress is recovered from, and in the middle: whatever the formulation averages, it averages over the Gauss
 * points. */
TEST(strains_in_lanes_at_other_points_are_those_of_single_elements)
{
    static const uz_formulation ASKED[] = {UZ_FORMULATION_STANDARD, UZ_FORMULATION_BBAR, UZ_FORMULATION_INCOMPATIBLE};
    qp_random rng = {2025};
    uz_lanes strain[POINTS][STRESSES];
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (int k = 0; k < 9; k++) {
            double at[UZ_ELEMENT_SAMPLES + 1][3], share[NODES][UZ_ELEMENT_SAMPLES];
            const uz_element_type *type = uz_element_type_of((uz_element_kind)kind);
            four_elements f;
            uz_strain_rule rule;
            uz_lane_shape shape;
            make_four(&f, (uz_element_kind)kind, MODELS[uz_element_type_of((uz_element_kind)kind)->dim == 3][k / 3],
                      ASKED[k % 3], &rng);
            const int count = type->recover(at, share, (uz_element_kind)kind);
            memcpy(at[count], type->centre, sizeof at[count]);
            uz_strain_rule_at(&rule, f.element[0].kind, f.element[0].model, f.element[0].formulation,
                              (const double(*)[3])at, NULL, count + 1);
            CHECK(rule.points <= UZ_ELEMENT_GAUSS);
            uz_lane_shape_of(&shape, &rule, f.x, f.element[0].thickness);
            uz_lane_strains(strain, &rule, &shape, &f.material, f.displacement);
            for (int l = 0; l < LANES; l++)
                for (int i = 0; i <= count; i++) {
                    double want[STRESSES], size = 0;
                    uz_element_motion motion;
                    uz_element_move(&motion, &f.element[l], f.u[l]);
                    uz_element_strain(want, &motion, at[i]);
                    for (int c = 0; c < rule.stresses; c++)
                        size = fmax(size, fabs(want[c]));
                    for (int c = 0; c < rule.stresses; c++)
                        CHECK_MSG(fabs(strain[i][c][l] - want[c]) < 1e-12 * size,
                                  "kind %d, model %d, formulation %d: strain %d is %.17g, not %.17g", kind, rule.model,
                                  rule.formulation, c, strain[i][c][l], want[c]);
                }
        }
}

/* ----------------------------------------------------------------- estimate */

/* One element after the other; averages: n_nodes x n_materials x (STRESSES and the volume). */
typedef struct {
    const uz_body_model *model;
    const double *u, *free_strain;
    double *average, eta2, stress2, whole2;
    double *least;
} plain;

typedef struct {
    uz_element element;
    double xyz[3 * NODES], u[UZ_ELEMENT_DOFS];
    const int64_t *node;
    int nodes, points, stresses;
    double volume[POINTS], local[POINTS][3], N[POINTS][NODES], strain[POINTS][STRESSES], stress[POINTS][STRESSES];
} plain_element;

typedef enum { GAUSS, ENERGY, SAMPLES } which_points;

/* The points of one rule and their weights; returns how many. */
static int list_points(double at[POINTS][3], double *weight, const uz_element *element, which_points which)
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    const uz_gauss_rule *gauss = uz_element_rule(element->kind, element->model);
    const uz_gauss_rule *rule = which == ENERGY && type->energy.count > 0 ? &type->energy : gauss;
    const int count = rule->count;
    double share[NODES][UZ_ELEMENT_SAMPLES], volume = 0;
    for (int g = 0; g < count; g++) {
        memcpy(at[g], rule->point[g].at, sizeof at[g]);
        weight[g] = rule->point[g].weight;
        volume += weight[g];
    }
    if (which != SAMPLES)
        return count;
    const bool middle = type->nodes == type->corners && element->formulation != UZ_FORMULATION_INCOMPATIBLE;
    const int samples = middle ? 1 : type->recover(at, share, element->kind);
    if (middle)
        memcpy(at[0], type->centre, sizeof at[0]);
    for (int k = 0; k < samples; k++)
        weight[k] = volume / samples;
    return samples;
}

static void look_at(plain_element *s, const plain *x, int64_t e, which_points which)
{
    const int dim = x->model->mesh.dim;
    double weight[POINTS];
    uz_element_motion motion;
    s->node = uz_mesh_element(&x->model->mesh, e, &s->nodes);
    uz_body_element(&s->element, s->xyz, x->model, e);
    for (int i = 0; i < s->nodes * dim; i++)
        s->u[i] = x->u[s->node[i / dim] * dim + i % dim];
    uz_element_move(&motion, &s->element, s->u);
    s->stresses = uz_stress_count(s->element.model);
    s->points = list_points(s->local, weight, &s->element, which);
    for (int g = 0; g < s->points; g++) {
        const double *point = s->local[g];
        double grad[NODES][3], strain[STRESSES] = {0};
        const double det = uz_element_gradients(grad, &s->element, point);
        s->volume[g] = weight[g] * element_measure(&s->element, point, det);
        uz_element_shape(s->N[g], s->element.kind, point);
        uz_element_strain(s->strain[g], &motion, point);
        uz_thermal_strain(strain, s->element.model, s->element.lame, x->free_strain ? x->free_strain[e] : 0);
        for (int c = 0; c < s->stresses; c++)
            strain[c] = s->strain[g][c] - strain[c];
        uz_elastic_stress(s->stress[g], s->element.model, s->element.lame, strain);
    }
}

static bool is_alike(const uz_body_material *a, const uz_body_material *b)
{
    return !a->lame.general && !b->lame.general && a->lame.lambda == b->lame.lambda && a->lame.mu == b->lame.mu &&
           a->expansion == b->expansion && a->law == b->law;
}

static double *average_at(const plain *x, int64_t e, int64_t node)
{
    int64_t material = x->model->material_of ? x->model->material_of[e] : 0;
    for (int64_t k = 0; k < material; k++) /* the first of these constants */
        if (is_alike(&x->model->materials[k], &x->model->materials[material]))
            material = k;
    return x->average + (node * x->model->n_materials + material) * (STRESSES + 1);
}

/* The value at x (dim) of the linear function that fits component c at the samples best, by volume; of one sample, its
 * value. A small system by elimination with the largest pivot. */
static double fit_at(const plain_element *s, const double *x, int c)
{
    const int dim = uz_element_type_of(s->element.kind)->dim, n = s->points == 1 ? 1 : dim + 1;
    double A[4][5] = {{0}}, scale = 0;
    for (int i = 0; i < dim; i++)
        scale = fmax(scale, fabs(s->xyz[dim + i] - s->xyz[i]));
    for (int g = 0; g < s->points; g++) {
        double b[4] = {1};
        for (int i = 0; i < dim; i++)
            for (int a = 0; a < s->nodes; a++)
                b[i + 1] += s->N[g][a] * (s->xyz[a * dim + i] - x[i]) / scale;
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++)
                A[i][j] += s->volume[g] * b[i] * b[j];
            A[i][n] += s->volume[g] * b[i] * s->stress[g][c];
        }
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k; i < n; i++)
            pivot = fabs(A[i][k]) > fabs(A[pivot][k]) ? i : pivot;
        for (int j = 0; j <= n; j++) {
            const double swap = A[k][j];
            A[k][j] = A[pivot][j];
            A[pivot][j] = swap;
        }
        for (int i = 0; i < n; i++)
            for (int j = n; j >= k && i != k; j--)
                A[i][j] -= A[i][k] / A[k][k] * A[k][j];
    }
    return A[0][n] / A[0][0];
}

static void add_averages(const plain *x, const plain_element *s, int64_t e)
{
    const int dim = x->model->mesh.dim;
    double volume = 0;
    for (int g = 0; g < s->points; g++)
        volume += s->volume[g];
    for (int a = 0; a < s->nodes; a++) {
        double *at = average_at(x, e, s->node[a]);
        for (int c = 0; c < s->stresses; c++)
            at[c] += volume * fit_at(s, s->xyz + a * dim, c);
        at[STRESSES] += volume;
    }
}

/* stress' C^-1 stress, twice the complementary energy per volume, by deviator and trace apart: with n directions and
 * t = trace(s) it is t^2 / (n (n lambda + 2 mu)) + (s_dev . s_dev) / (2 mu). */
static double complementary(uz_model model, uz_lame lame, const double *stress)
{
    const int n = uz_stress_count(model), direct = n == 3 ? 2 : 3;
    double trace = 0, deviator = 0;
    if (lame.general)
        return uz_stress_work(model, lame, stress);
    for (int i = 0; i < direct; i++)
        trace += stress[i];
    for (int i = 0; i < direct; i++)
        deviator += (stress[i] - trace / direct) * (stress[i] - trace / direct);
    for (int i = direct; i < n; i++)
        deviator += 2 * stress[i] * stress[i];
    return trace * trace / (direct * (direct * lame.lambda + 2 * lame.mu)) + deviator / (2 * lame.mu);
}

/* A triangle, tetrahedron or wedge whose averages are its own, but for what volumes by two rules differ in. */
static bool is_alone(const plain *x, const plain_element *s, int64_t e)
{
    const uz_element_kind kind = s->element.kind;
    double volume = 0;
    bool alone = kind != UZ_QUAD4 && kind != UZ_QUAD8 && kind != UZ_HEX8 && kind != UZ_HEX20;
    for (int g = 0; g < s->points; g++)
        volume += s->volume[g];
    for (int a = 0; a < s->nodes; a++)
        alone = alone && volume > (1 - 1e-2) * average_at(x, e, s->node[a])[STRESSES];
    return alone;
}

/* Such a one of a quadratic kind is compared with the mean of its corners, a linear one with nothing. */
static double mean_of(const plain *x, const plain_element *s, int64_t e, int c)
{
    const uz_element_type *type = uz_element_type_of(s->element.kind);
    double sum = 0;
    for (int a = 0; a < type->corners && type->corners < type->nodes; a++) {
        const double *at = average_at(x, e, s->node[a]);
        sum += at[c] / at[STRESSES] / type->corners;
    }
    return sum;
}

/* What the square of an element's part is taken for: what the averages are not of its own, and what they hide. */
static double times_of(const plain *x, const plain_element *s, int64_t e)
{
    const uz_element_kind kind = s->element.kind;
    double volume = 0, others = 0;
    for (int g = 0; g < s->points; g++)
        volume += s->volume[g];
    for (int a = 0; a < s->nodes; a++)
        others += 1 - volume / average_at(x, e, s->node[a])[STRESSES];
    return (kind == UZ_TRI6 || kind == UZ_TET10 || kind == UZ_WEDGE15 ? 16. / 9 : 1) /
           ((kind == UZ_TET4 || kind == UZ_TET10) && !is_alone(x, s, e) ? fmax(0.25, others / s->nodes) : 1);
}

static void add_energies(plain *x, const plain_element *s, int64_t e)
{
    double eta2 = 0;
    for (int g = 0; g < s->points; g++) {
        double jump[STRESSES], whole[STRESSES], work = 0;
        uz_elastic_stress(whole, s->element.model, s->element.lame, s->strain[g]);
        for (int c = 0; c < s->stresses; c++) {
            jump[c] = -s->stress[g][c];
            for (int a = 0; a < s->nodes; a++) {
                const double *at = average_at(x, e, s->node[a]);
                jump[c] += s->N[g][a] * (is_alone(x, s, e) ? mean_of(x, s, e, c) : at[c] / at[STRESSES]);
            }
            work += whole[c] * s->strain[g][c];
        }
        eta2 += s->volume[g] * complementary(s->element.model, s->element.lame, jump) * times_of(x, s, e);
        x->stress2 += s->volume[g] * complementary(s->element.model, s->element.lame, s->stress[g]);
        x->whole2 += s->volume[g] * work;
    }
    x->eta2 += fmax(eta2, x->least ? x->least[e] : 0);
}

static double plain_estimate(double *share, const uz_body_model *model, const uz_scene *scene, const double *u)
{
    plain x = {.model = model, .u = u};
    plain_element s;
    double *free_strain = NULL;
    CHECK_INT(uz_free_strains(&free_strain, model, scene, NULL), UZ_OK);
    x.free_strain = free_strain;
    const uz_strain_source from = {.model = model, .nodal = u, .free_strain = free_strain};
    CHECK_INT(uz_thin_elements_errors(&x.least, scene, &from, 1, NULL), UZ_OK);
    x.average = body_room(model->mesh.n_nodes * model->n_materials * (STRESSES + 1), sizeof *x.average);
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        look_at(&s, &x, e, SAMPLES);
        add_averages(&x, &s, e);
    }
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        look_at(&s, &x, e, ENERGY);
        add_energies(&x, &s, e);
    }
    uz_free_all(x.least, x.average, free_strain);
    double stored; /* what springs at nodes hold too well is told by tests of the daemon */
    x.eta2 += uz_spring_error(NULL, &stored, model, scene, u, x.whole2);
    *share = sqrt((x.stress2 += stored) / (x.whole2 + stored));
    return sqrt(x.eta2 / (x.stress2 + x.eta2));
}

/* What the estimate sees beside it: the energy of linear simplices, and how steep displacements are. */
static void check_look(const uz_mesh_look *look, const uz_body_model *model, const double *u, const char *what)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    double energy, springs = 0, steep2 = 0;
    bool simplices = model->kind != UZ_AXISYMMETRIC;
    CHECK_INT(uz_strain_energy(&energy, model, u, false, NULL), UZ_OK);
    for (int64_t i = 0; i < mesh->n_nodes * dim && model->spring; i++)
        springs += 0.5 * model->spring[i] * u[i] * u[i];
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        simplices = simplices && count == dim + 1;
        for (int a = 1; a < count; a++) {
            double u2 = 0, x2 = 0;
            for (int c = 0; c < dim; c++) {
                u2 += pow(u[node[a] * dim + c] - u[node[0] * dim + c], 2);
                x2 += pow(mesh->xyz[node[a] * dim + c] - mesh->xyz[node[0] * dim + c], 2);
            }
            steep2 = fmax(steep2, u2 / x2);
        }
    }
    CHECK_MSG(fabs(look->steep2 - steep2) <= 1e-12 * steep2, "%s: slopes of %.17g, not %.17g", what, look->steep2,
              steep2);
    if (simplices)
        CHECK_MSG(fabs(look->twice / 2 + springs - energy) <= 1e-12 * energy, "%s: an energy of %.17g, not %.17g", what,
                  look->twice / 2 + springs, energy);
    else
        CHECK_MSG(isnan(look->twice), "%s: an energy of %.17g", what, look->twice);
}

static void compare_estimates(const uz_body_model *model, const uz_scene *scene, qp_random *rng, const char *what)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *u = body_room(n, sizeof *u);
    for (int64_t i = 0; i < n; i++)
        u[i] = 1e-3 * (model->mesh.xyz[i] + 0.3 * random_signed(rng));
    double want_share;
    uz_mesh_look look;
    const double want = plain_estimate(&want_share, model, scene, u);
    const double got = uz_estimate_mesh_error(NULL, &look, model, scene, u);
    CHECK_MSG(fabs(got - want) <= 1e-11 * want + 1e-14, "%s: %.17g, not %.17g", what, got, want);
    CHECK_MSG(fabs(look.share - want_share) <= 1e-11 * want_share, "%s: a share of %.17g, not %.17g", what, look.share,
              want_share);
    check_look(&look, model, u, what);
    free(u);
}

/* Stress at the Gauss points as the fields give it: plane models with zz between. */
static void compare_stresses(const uz_body_model *model, const uz_scene *scene, qp_random *rng, const char *what)
{
    uz_field_body body;
    plain_element s;
    const int dim = model->mesh.dim;
    double *u = body_room(model->mesh.n_nodes * dim, sizeof *u), *free_strain = NULL;
    for (int64_t i = 0; i < model->mesh.n_nodes * dim; i++)
        u[i] = 1e-3 * random_signed(rng);
    CHECK_INT(uz_field_body_init(&body, scene, model, NULL), UZ_OK);
    CHECK_INT(uz_free_strains(&free_strain, model, scene, NULL), UZ_OK);
    const plain x = {.model = model, .u = u, .free_strain = free_strain};
    const int64_t n = uz_field_gauss_count(&body);
    double *element = body_room(n, sizeof *u), *point = body_room(n * dim, sizeof *u);
    double *stress = body_room(n * body.components, sizeof *u), *at = stress;
    CHECK_INT(uz_field_gauss(element, point, stress, &body, u, NULL, NULL), UZ_OK);
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        look_at(&s, &x, e, GAUSS);
        for (int g = 0; g < s.points; g++, at += body.components)
            for (int c = 0; c < s.stresses; c++) {
                double size = 0;
                for (int k = 0; k < s.stresses; k++)
                    size = fmax(size, fabs(s.stress[g][k]));
                const double got = at[s.stresses == 3 && c == 2 ? 3 : c];
                CHECK_MSG(fabs(got - s.stress[g][c]) <= 1e-9 * size, "%s, element %d: stress %d is %.17g, not %.17g",
                          what, (int)e, c, got, s.stress[g][c]);
            }
    }
    uz_free_all(stress, point, element, free_strain, u);
    uz_field_body_clear(&body);
}

/* Elements of two materials that share nodes, one of them nearly incompressible: each has averages of its own, and its
 * own formulation. */
static void mix_materials(uz_body_model *model, qp_random *rng)
{
    uz_body_material *two = body_room(2, sizeof *two);
    two[0] = two[1] = model->materials[0];
    for (int k = 0; k < 2; k++) {
        two[k].poisson = k ? 0.48 : 0.2;
        two[k].lame = uz_lame_of(model->kind, k ? 70e3 : 200e3, two[k].poisson);
        two[k].expansion = 1e-5 * (k + 1);
    }
    free(model->materials);
    free(model->material_of);
    model->materials = two;
    model->n_materials = 2;
    model->material_of = body_room(model->mesh.n_elements, sizeof *model->material_of);
    for (int64_t e = 0; e < model->mesh.n_elements; e++)
        model->material_of[e] = random_chance(rng, 0.5);
}

/* Boxes, whose elements may all be equal. */
TEST(estimate_of_boxes_is_that_of_single_elements)
{
    static const uz_formulation ASKED[] = {UZ_FORMULATION_AUTO, UZ_FORMULATION_BBAR, UZ_FORMULATION_INCOMPATIBLE};
    qp_random rng = {7};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int way = 0; way < 12; way++) {
            const char *name = uz_element_name((uz_element_kind)k);
            const uz_model model = MODELS[uz_element_type_of((uz_element_kind)k)->dim == 3][way % 3];
            uz_scene s = body_scene(model, name, (double[3]){5, 3, 2}, (int64_t[3]){5, 3, 1 + way % 2});
            s.formulation = k == UZ_QUAD4 || k == UZ_HEX8 ? ASKED[way / 4] : UZ_FORMULATION_AUTO;
            s.box.grading[0] = way % 4 == 3 ? 1.7 : 1;
            s.materials[0].expansion = 1e-5;
            body_hold(&s, "top", 0, 0, 0);
            body_load(&s, UZ_LOAD_TEMPERATURE, "all", 30, 0, 0);
            s.n_loads = way % 2;
            uz_body_model outline = body_model(&s);
            compare_estimates(&outline, &s, &rng, name);
            mix_materials(&outline, &rng);
            compare_estimates(&outline, &s, &rng, name);
            uz_body_model_clear(&outline);
            uz_scene_clear(&s);
        }
}

/* Of a material with directions elements are looked at one after the other. */
TEST(estimate_of_fibres_is_that_of_single_elements)
{
    static const uz_orthotropic FIBRES = {.young = {130e3, 9e3, 8e3},
                                          .poisson = {0.3, 0.4, 0.25},
                                          .shear = {5e3, 3e3, 4e3},
                                          .expansion = {1e-6, 3e-5, 2e-5}};
    qp_random rng = {11};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int way = 0; way < 6; way++) {
            const char *name = uz_element_name((uz_element_kind)k);
            const uz_model model = MODELS[uz_element_type_of((uz_element_kind)k)->dim == 3][way % 3];
            uz_scene s = body_scene(model, name, (double[3]){5, 3, 2}, (int64_t[3]){3, 2, 2});
            s.formulation = k == UZ_QUAD4 || k == UZ_HEX8 ? UZ_FORMULATION_BBAR : UZ_FORMULATION_AUTO;
            s.materials[0].is_orthotropic = true;
            s.materials[0].orthotropic = FIBRES;
            body_hold(&s, "top", 0, 0, 0);
            body_load(&s, UZ_LOAD_TEMPERATURE, "all", 30, 0, 0);
            s.n_loads = way % 2;
            uz_body_model outline = body_model(&s);
            CHECK(outline.materials[0].lame.general);
            compare_estimates(&outline, &s, &rng, name);
            uz_body_model_clear(&outline);
            uz_scene_clear(&s);
        }
}

/* A strip, a bar, a plate of one or two elements, squeezed evenly between what is at two opposite sides: where that is
 * known and does not squeeze as much, all of it is error, V s^2 / E. Four are not thin any more. */
TEST(thin_bodies_owe_the_stress_between_their_loads)
{
    enum { PRESSED, FREE, HALF, PULLED, STANDARD, CONTACT, FORCE, WAYS };
    static const double TOLD[WAYS] = {[FREE] = 1, [HALF] = 0.5, [PULLED] = 2};
    static const int THICK[] = {1, 2, 4};
    for (int solid = 0; solid < 2; solid++)
        for (int way = 0; way < 3 * WAYS; way++) {
            const char *element = solid ? "hex8" : "quad4", *below = solid ? "back" : "bottom",
                       *above = solid ? "front" : "top";
            const int dim = solid ? 3 : 2, thick = THICK[way / WAYS], ends = way % WAYS;
            const bool along = thick == 4; /* cells a quarter as long as the body is thick */
            uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRESS, element, (double[3]){6, solid ? 4 : 1, 1},
                                    (int64_t[3]){along ? 24 : 6, solid ? 2 : thick, thick});
            s.formulation = ends == STANDARD ? UZ_FORMULATION_AUTO : UZ_FORMULATION_INCOMPATIBLE;
            s.materials[0].poisson = 0;
            const double stress = 1e-3 * s.materials[0].young, pull[3] = {0, solid ? 0 : stress, solid ? stress : 0};
            body_hold(&s, "left", 0, 0, 0);
            if (ends == PRESSED || ends == HALF)
                body_load(&s, UZ_LOAD_PRESSURE, above, stress, 0, 0)->value = stress;
            if (ends == PRESSED)
                body_load(&s, UZ_LOAD_PRESSURE, below, stress, 0, 0)->value = stress;
            if (ends == PULLED)
                body_load(&s, UZ_LOAD_TRACTION, above, pull[0], pull[1], pull[2]);
            if (ends == PULLED) /* outwards at both */
                body_load(&s, UZ_LOAD_TRACTION, below, 0, -pull[1], -pull[2]);
            if (ends == FORCE)
                body_load(&s, UZ_LOAD_FORCE, above, 1, 0, 0);
            if (ends == CONTACT)
                body_plane(&s, below, (double[3]){0}, (double[3]){0, !solid, solid});
            uz_body_model model = body_model(&s);
            double *u = body_room(model.mesh.n_nodes * dim, sizeof *u);
            for (int64_t a = 0; a < model.mesh.n_nodes; a++)
                u[a * dim + dim - 1] = -1e-3 * model.mesh.xyz[a * dim + dim - 1];
            const double told = along ? 0 : TOLD[ends], square = told * told;
            const double got = uz_estimate_mesh_error(NULL, NULL, &model, &s, u);
            CHECK_MSG(fabs(got - sqrt(square / (1 + square))) < 1e-12, "%s, way %d: %.17g", element, way, got);
            free(u);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
}

/* Warm strips and bars, clamped at one end: nothing jumps between elements, and the stress at the clamp is off by as
 * much as it is. Against the solution of a fine mesh the error of strips is 0.68 of the norm of both, 0.73 and 0.53
 * where they are two elements thick. */
TEST(a_thin_strip_does_not_hide_its_error)
{
    static const int CELLS[][2] = {{6, 1}, {6, 2}, {12, 2}};
    for (int k = 0; k < 6; k++) {
        const bool solid = k >= 3;
        const int *cells = CELLS[k % 3];
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRESS, solid ? "hex8" : "quad4", (double[3]){6, 1, 1},
                                (int64_t[3]){cells[0], cells[1], cells[1]});
        s.formulation = UZ_FORMULATION_INCOMPATIBLE;
        s.materials[0].poisson = 0;
        s.materials[0].expansion = 1e-5;
        body_hold(&s, "left", 0, 0, 0);
        body_load(&s, UZ_LOAD_TEMPERATURE, "all", 80, 0, 0);
        uz_result *x = body_solve(&s, 1e-10);
        uz_body_model model = body_model(&s);
        const double got = uz_estimate_mesh_error(NULL, NULL, &model, &s, x->u);
        CHECK_MSG(got > 0.5 && got < 0.75, "%d x %d: %.17g", cells[0], cells[1], got);
        uz_body_model_clear(&model);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* Meshes of two kinds, bent, of several parts; rings on their axis. */
TEST(random_scenes_have_the_stresses_and_estimates_of_single_elements)
{
    for (uint64_t seed = 1; seed <= 150; seed++) {
        random_scene s = make_random_scene(seed);
        uz_body_model model;
        uz_error err = {0};
        char name[32];
        snprintf(name, sizeof name, "seed %d", (int)seed);
        if (uz_body_model_build(&model, &s.scene, UZ_BODY_OUTLINE, &err) == UZ_OK) {
            compare_estimates(&model, &s.scene, &s.rng, name);
            compare_stresses(&model, &s.scene, &s.rng, name);
            mix_materials(&model, &s.rng);
            compare_estimates(&model, &s.scene, &s.rng, name);
            compare_stresses(&model, &s.scene, &s.rng, name);
            uz_body_model_clear(&model);
        } else {
            CHECK_MSG(err.status == UZ_ERR_FREE_BODY, "%s: %s", name, err.message);
        }
        uz_scene_clear(&s.scene);
    }
}

/* NaN is for want of memory alone. */
TEST(what_no_double_holds_is_infinite)
{
    for (int springs = 0; springs < 2; springs++) {
        uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){2, 2, 0});
        body_hold(&s, "left", 0, 0, NAN);
        if (springs) {
            body_hold(&s, "right", 0, 0, NAN);
            s.supports[1].kind = UZ_SUPPORT_SPRING;
            s.supports[1].spring[0] = 1;
        }
        uz_body_model model = body_model(&s);
        const int64_t n = 2 * model.mesh.n_nodes;
        double *u = body_room(n, sizeof *u);
        for (int64_t i = 0; i < n; i++)
            u[i] = i % 3 == 0 ? 1e308 : -1e308;
        CHECK(uz_estimate_mesh_error(NULL, NULL, &model, &s, u) == INFINITY);
        free(u);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
