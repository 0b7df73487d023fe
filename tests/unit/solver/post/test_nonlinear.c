/* What small deformation leaves out, which takes several elements at a time, against one element after the other by the
 * functions on single elements; and from which strain on a body may buckle. */
#include "assembly/parts.h"
#include "body_fixture.h"
#include "element_mesh.h"
#include "post/balance.h"
#include "post/parts.h"
#include "random_scene.h"

enum { NODES = UZ_ELEMENT_NODES, STRESSES = UZ_ELEMENT_STRESSES, DIRECTIONS = 24 };

typedef struct {
    double squares, along, law, turns, gradient, stress[3][3], modulus;
} integrals;

/* In tensors: components of a model's stress, and where they stand. */
static int places(int at[STRESSES][2], uz_model model)
{
    static const int PLANE[3][2] = {{0, 0}, {1, 1}, {0, 1}};
    static const int SPACE[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    const int n = uz_stress_count(model);
    for (int k = 0; k < n; k++)
        memcpy(at[k], n == 3 ? PLANE[k] : SPACE[k], sizeof at[k]);
    return n;
}

/* C E for a symmetric E; `across`: the strain that plane stress leaves free. */
static void stress_tensor(double S[3][3], double *across, uz_model model, const uz_lame *lame, double E[3][3])
{
    int at[STRESSES][2];
    double strain[STRESSES], stress[STRESSES];
    const int n = places(at, model);
    for (int k = 0; k < n; k++)
        strain[k] = (at[k][0] == at[k][1] ? 1 : 2) * E[at[k][0]][at[k][1]];
    uz_elastic_stress(stress, model, *lame, strain);
    memset(S, 0, 9 * sizeof(double));
    for (int k = 0; k < n; k++)
        S[at[k][0]][at[k][1]] = S[at[k][1]][at[k][0]] = stress[k];
    *across = uz_strain_zz(model, *lame, stress, 0);
}

static double product(double A[3][3], double B[3][3])
{
    double sum = 0;
    for (int i = 0; i < 9; i++)
        sum += A[i / 3][i % 3] * B[i / 3][i % 3];
    return sum;
}

static double least_modulus(uz_model model, const uz_lame *lame)
{
    double softest = 0;
    int at[STRESSES][2];
    const int n = places(at, model), planes = lame->general ? 3 : 1;
    for (int k = 0; k < planes * DIRECTIONS; k++) {
        double way[3] = {0}, pull[STRESSES];
        way[k / DIRECTIONS] = cos(acos(-1) * k / DIRECTIONS);
        way[(k / DIRECTIONS + 1) % 3] = sin(acos(-1) * k / DIRECTIONS);
        for (int i = 0; i < n; i++)
            pull[i] = way[at[i][0]] * way[at[i][1]];
        softest = fmax(softest, uz_stress_work(model, *lame, pull));
    }
    return 1 / softest;
}

/* mean: of mean dilatation the traces of e and Q; NULL: their own. */
static void add_point(integrals *to, const uz_element *element, double volume, double H[3][3], const double *mean)
{
    double Q[3][3] = {{0}}, e[3][3], of_Q[3][3], of_e[3][3], across, unused;
    const int size = uz_stress_count(element->model) == 3 ? 2 : 3;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            for (int c = 0; c < 3 && i < size && j < size; c++)
                Q[i][j] += H[c][i] * H[c][j];
            e[i][j] = 0.5 * (H[i][j] + H[j][i]);
            to->turns += 0.25 * volume * (H[i][j] - H[j][i]) * (H[i][j] - H[j][i]);
        }
    for (int k = 0; k < 2 && mean; k++) {
        double(*of)[3] = k ? Q : e;
        const double lacks = mean[k] - of[0][0] - of[1][1] - (size == 3 ? of[2][2] : 0);
        for (int i = 0; i < size; i++)
            of[i][i] += lacks / size;
    }
    stress_tensor(of_Q, &unused, element->model, &element->lame, Q);
    stress_tensor(of_e, &across, element->model, &element->lame, e);
    const double square = product(H, H) + across * across;
    to->squares += 0.25 * volume * product(of_Q, Q);
    to->along += volume * product(of_e, Q);
    to->law += volume * square * product(of_e, e);
    to->gradient += volume * square;
    to->modulus += volume * least_modulus(element->model, &element->lame);
    for (int i = 0; i < 9; i++)
        to->stress[i / 3][i % 3] += volume * of_e[i / 3][i % 3];
}

/* NaN where an element has incompatible modes. */
static double plain_measure(const uz_body_model *model, const double *u, double energy)
{
    integrals all = {0};
    const int dim = model->mesh.dim;
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        double xyz[3 * NODES], grad[NODES][3], around[NODES];
        uz_element element;
        int nodes;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
        uz_body_element(&element, xyz, model, e);
        if (element.formulation == UZ_FORMULATION_INCOMPATIBLE)
            return NAN;
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        const bool averaged = element.formulation == UZ_FORMULATION_BBAR;
        double mean[2] = {0}, volume = 0;
        for (int k = averaged ? 0 : rule->count; k < 2 * rule->count; k++) {
            const int g = k % rule->count;
            double H[3][3] = {{0}};
            const double det = uz_element_gradients(grad, &element, rule->point[g].at);
            const double depth = uz_element_around(around, &element, grad, rule->point[g].at);
            for (int a = 0; a < nodes; a++) {
                for (int i = 0; i < dim * dim; i++)
                    H[i / dim][i % dim] += u[dim * node[a] + i / dim] * grad[a][i % dim];
                if (model->kind == UZ_AXISYMMETRIC)
                    H[2][2] += u[dim * node[a]] * around[a];
            }
            const double own = rule->point[g].weight * det * depth;
            if (k >= rule->count) {
                add_point(&all, &element, own, H, averaged ? (double[]){mean[0] / volume, mean[1] / volume} : NULL);
                continue;
            }
            volume += own;
            mean[0] += own * (H[0][0] + H[1][1] + H[2][2]);
            for (int i = 0; i < 9; i++)
                mean[1] += own * H[i / 3][i % 3] * H[i / 3][i % 3];
        }
    }
    double principal[3], stress[STRESSES] = {all.stress[0][0], all.stress[1][1], all.stress[2][2],
                                             all.stress[0][1], all.stress[1][2], all.stress[2][0]};
    uz_principal(principal, stress, STRESSES);
    const double strain = fmax(fabs(principal[0]), fabs(principal[2])) / all.modulus;
    const double aside = fmax(2 * UZ_SURELY_SMALL, sqrt(all.turns / all.gradient));
    return fmax(strain / uz_least_buckling_strain(model) * aside,
                (sqrt(all.squares) + sqrt(all.law)) / sqrt(2 * energy) + fabs(all.along) / (2 * energy));
}

/* Twice the energy, by each element alone, and by springs. */
static double energy_one_by_one(const uz_body_model *model, const double *u)
{
    const int dim = model->mesh.dim;
    double twice = 0;
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &count);
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES], d[UZ_ELEMENT_DOFS];
        uz_body_element(&element, xyz, model, e);
        for (int i = 0; i < count * dim; i++)
            d[i] = u[node[i / dim] * dim + i % dim];
        twice += 2 * uz_element_strain_energy(&element, d);
    }
    for (int64_t i = 0; i < model->mesh.n_nodes * dim && model->spring; i++)
        twice += model->spring[i] * u[i] * u[i];
    return twice;
}

static void compare(const uz_body_model *model, qp_random *rng, const char *what)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *u = body_room(n, sizeof *u), got, energy;
    const double size = pow(10, -1 - 3 * random_unit(rng));
    for (int64_t i = 0; i < n; i++)
        u[i] = size * (model->mesh.xyz[i] + 0.3 * random_signed(rng));
    CHECK_INT(uz_strain_energy(&energy, model, u, false, NULL), UZ_OK);
    CHECK_MSG(fabs(2 * energy / energy_one_by_one(model, u) - 1) <= 1e-12, "%s: energy %.17g", what, energy);
    const double want = plain_measure(model, u, energy);
    CHECK_INT(uz_measure_nonlinear(&got, model, u, energy, uz_least_buckling_strain(model), 0, NULL), UZ_OK);
    CHECK_MSG(isnan(want) ? isnan(got) : fabs(got - want) <= 1e-11 * want, "%s: %.17g, not %.17g", what, got, want);
    free(u);
}

TEST(elements_together_leave_out_what_they_do_one_by_one)
{
    static const uz_model MODELS[] = {UZ_PLANE_STRESS, UZ_PLANE_STRAIN, UZ_AXISYMMETRIC, UZ_SOLID};
    static const uz_orthotropic FIBRES = {.young = {130e3, 9e3, 8e3},
                                          .poisson = {0.28, 0.4, 0.3},
                                          .shear = {4.8e3, 3.2e3, 4.5e3},
                                          .axes = {{0.8, 0.6, 0}, {-0.6, 0.8, 0}}};
    qp_random rng = {11};
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int way = 0; way < 12; way++) {
            const char *name = uz_element_name((uz_element_kind)k);
            const bool solid = uz_element_type_of((uz_element_kind)k)->dim == 3;
            uz_scene s = body_scene(solid ? UZ_SOLID : MODELS[way % 3], name, (double[3]){5, 3, 2},
                                    (int64_t[3]){5, 3, 1 + way % 2});
            s.formulation = way == 11 && (k == UZ_QUAD4 || k == UZ_HEX8) ? UZ_FORMULATION_BBAR : UZ_FORMULATION_AUTO;
            s.box.grading[0] = way % 4 == 3 ? 1.7 : 1;
            s.materials[0].is_orthotropic = way / 3 == 1;
            s.materials[0].orthotropic = FIBRES;
            body_hold(&s, "top", 0, 0, 0);
            uz_body_model model = body_model(&s);
            compare(&model, &rng, name);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
}

TEST(random_bodies_leave_out_what_their_elements_do)
{
    for (uint64_t seed = 1; seed <= 100; seed++) {
        random_scene s = make_random_scene(seed);
        uz_body_model model;
        uz_error err = {0};
        char name[32];
        snprintf(name, sizeof name, "seed %d", (int)seed);
        if (uz_body_model_build(&model, &s.scene, UZ_BODY_OUTLINE, &err) == UZ_OK) {
            compare(&model, &s.rng, name);
            uz_body_model_clear(&model);
        }
        uz_scene_clear(&s.scene);
    }
}

/* A bar of length L and thickness h may buckle from (h / L)^2 / 5 on, whether or not its elements are known to be
 * equal. */
TEST(a_bar_may_buckle_by_its_thickness)
{
    static const char *const NAMES[] = {"hex8", "hex20", "tet4", "tet10"};
    for (int k = 0; k < 4; k++) {
        uz_scene s = body_scene(UZ_SOLID, NAMES[k], (double[3]){2, 20, 1}, (int64_t[3]){2, 8, 3});
        body_hold(&s, "top", 0, 0, 0);
        uz_body_model model = body_model(&s);
        CHECK_REL(uz_least_buckling_strain(&model), 0.2 / 400, 1e-12);
        model.mesh.uniform = false;
        CHECK_REL(uz_least_buckling_strain(&model), 0.2 / 400, 1e-12);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* By an angle, with a normal for each axis that supports hold along. */
static void turn_about(uz_scene *s, uz_body_model *model, double angle)
{
    const uz_support given[2] = {s->supports[0], s->supports[1]};
    const int64_t n = s->n_supports;
    const double c = cos(angle), d = sin(angle);
    for (int64_t i = 0; i < model->mesh.n_nodes; i++) {
        double *x = model->mesh.xyz + 2 * i;
        const double at[2] = {x[0], x[1]};
        x[0] = c * at[0] - d * at[1];
        x[1] = d * at[0] + c * at[1];
    }
    s->n_supports = 0;
    for (int64_t k = 0; k < n; k++)
        for (int axis = 0; axis < 2; axis++) {
            if (isnan(given[k].u[axis]))
                continue;
            uz_support *support = body_hold(s, given[k].on, NAN, NAN, NAN);
            support->kind = UZ_SUPPORT_NORMAL;
            support->normal[0] = axis == 0 ? c : -d;
            support->normal[1] = axis == 0 ? d : c;
        }
}

/* A strip of L = 8, h = 0.5, held at both ends along x and y, along y, at one end; and with its upper side held along
 * x, next to the end that is: as it lies, and turned. */
TEST(what_is_left_out_pulls_between_holders)
{
    static const double L = 8, H = 0.5;
    for (int turn = 0; turn < 8; turn++) {
        const int k = turn % 4;
        uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad8", (double[3]){L, H, 0}, (int64_t[3]){8, 1, 0});
        uz_body_model model;
        uz_error err = {0};
        uz_resultant force[2] = {{.force = {3, 4, 0}}, {.force = {-1, 0, 0}}};
        const uz_evaluation e = {.supports = force, .n_supports = 2, .strain_energy = 2};
        double got = NAN;
        body_hold(&s, "left", 0, 0, NAN);
        if (k == 0 || k == 1)
            body_hold(&s, "right", k == 0 ? 0 : NAN, 0, NAN);
        if (k == 3)
            body_hold(&s, "top", 0, NAN, NAN);
        CHECK_INT(uz_body_model_build(&model, &s, UZ_BODY_OUTLINE, &err), UZ_OK);
        const double buckling = uz_least_buckling_strain(&model), h = L * H / model.mesh.extent;
        const double next = sqrt(L * H / 3); /* the least distance that counts */
        const double want[] = {sqrt(1 + pow(h / L, 2)) / L, h / L / L, 0, sqrt(1 + pow(h / next, 2)) / next};
        if (turn >= 4) {
            turn_about(&s, &model, 0.6);
            force[0] = (uz_resultant){.force = {3, 0, 0}}; /* the left has two supports now */
            force[1] = (uz_resultant){.force = {0, 4, 0}};
        }
        CHECK_INT(uz_force_leverage(&got, &model, &s, &e, NULL, buckling, &err), UZ_OK);
        CHECK_MSG(fabs(got - want[k] * 2 / 5) <= 1e-12, "%d: %.17g, not %.17g", k, got, want[k] * 2 / 5);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
