/* nonlinear.c: what small deformation leaves out of an answer, told by the answer alone.
 *
 * With H the gradient of u, e and s its strain and stress of small deformation, the forces of large deformation at u do
 * the work  s : e(v)  +  C (H'H / 2) : e(v)  +  s : (H'grad v)  + ...  on v. Of what comes first after the linear part
 * the one is bounded by the energy norm of H'H / 2, the other is taken along u itself; what the law adds is as much of
 * the stress as H is large. Around a ring H is u_r / r; in plane stress C is what it is without stress across the
 * plane, and so is the strain across in H.
 *
 * All of this is in parts of the whole energy, and of a strip that is pressed or pulled along its axis that is nearly
 * all along the axis: what its stress does to how it bends aside is not seen. It is P / P_0 of that, P_0 the load that
 * buckles it where one end is free: a strain of pi^2 / 48 (h / L)^2 of a length L and a thickness h (Euler). A plane
 * body is taken for such a strip, of its own area along the diagonal of a rectangle of its polar moment, a solid for
 * the brick that has its moments of inertia, P is its mean stress, which of a body that only bends is next to none, and
 * what bends aside the part of the gradient that turns. From half of P_0 on it counts in any case. Area in thin parts
 * along the diagonal, as of a frame, is taken for a thicker strip. Forces may be off by more than the energy:
 * leverage.c says by how much. */
#include "post/balance.h"

#include "assembly/strain_group.h"
#include "core/cpu.h"
#include "post/parts.h"

#include <math.h>

#define PI 3.14159265358979323846

enum { N = UZ_ELEMENT_STRESSES };
/* Axes of the components of a symmetric matrix, xx yy zz xy yz zx, and which of these strains of a model are. */
static const int AXIS[N][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
static const int PLANE[N] = {0, 1, 3}, SPACE[N] = {0, 1, 2, 3, 4, 5};

typedef struct {
    const uz_body_model *model;
    const int *part;   /* of AXIS, by component of strain */
    bool other;        /* some element has incompatible modes, which large deformation has not */
    const uz_lame *of; /* whose strip_modulus `modulus_of` is */
    double modulus_of;
    uz_lanes squares, along, law, turns, gradient; /* integrals, over every fourth element in each lane */
    uz_lanes stress[N], modulus;                   /* the same; stress by AXIS */
} sums;

/* The least modulus of a strip, whatever its direction in the plane; of materials with directions in space, in any of
 * the three planes of the axes. */
static double strip_modulus(uz_model model, const uz_lame *lame)
{
    enum { DIRECTIONS = 24 };
    const int *part = uz_stress_count(model) == 3 ? PLANE : SPACE, n = uz_stress_count(model);
    double softest = 0;
    for (int k = 0; k < (lame->general ? 3 * DIRECTIONS : 1); k++) {
        const double c = cos(PI * k / DIRECTIONS), s = sin(PI * k / DIRECTIONS);
        double way[3] = {0}, pull[N];
        way[k / DIRECTIONS] = c;
        way[(k / DIRECTIONS + 1) % 3] = s;
        for (int i = 0; i < n; i++)
            pull[i] = way[AXIS[part[i]][0]] * way[AXIS[part[i]][1]];
        softest = fmax(softest, uz_stress_work(model, *lame, pull));
    }
    return 1 / softest;
}

/* stress = C strain in each lane. */
UZ_INLINE void stress_of(uz_lanes *stress, const uz_strain_group *group, const uz_lanes *strain)
{
    const uz_strain_rule *rule = &group->rule;
    if (group->general) {
        for (int l = 0; l < UZ_STRAIN_LANES; l++) {
            double one[N];
            for (int k = 0; k < rule->stresses; k++)
                one[k] = strain[k][l];
            uz_elastic_stress(one, rule->model, *group->lame[l], one);
            for (int k = 0; k < rule->stresses; k++)
                stress[k][l] = one[k];
        }
        return;
    }
    uz_lanes trace = strain[0] + strain[1];
    if (rule->direct == 3)
        trace += strain[2];
    for (int k = 0; k < rule->stresses; k++)
        stress[k] = k < rule->direct ? group->material.lambda * trace + 2 * group->material.mu * strain[k]
                                     : group->material.mu * strain[k];
}

/* Of plane stress, where nothing holds the body across the plane. */
UZ_INLINE void strain_across(uz_lanes *across, const uz_strain_group *group, const uz_lanes *stress)
{
    *across = (uz_lanes){0};
    for (int l = 0; l < UZ_STRAIN_LANES && group->rule.model == UZ_PLANE_STRESS; l++)
        (*across)[l] =
            uz_strain_zz(UZ_PLANE_STRESS, *group->lame[l], (double[]){stress[0][l], stress[1][l], stress[2][l]}, 0);
}

/* e and Q, what H'H adds to it, whose traces may become means. */
typedef struct {
    uz_lanes e, Q;
} traces;

UZ_INLINE void traces_of(traces *out, const uz_strain_group *group, uz_lanes H[3][3])
{
    *out = (traces){{0}, {0}};
    for (int i = 0; i < group->rule.direct; i++) {
        out->e += H[i][i];
        out->Q += H[0][i] * H[0][i] + H[1][i] * H[1][i] + H[2][i] * H[2][i];
    }
}

/* mean: of mean dilatation, else NULL. */
UZ_INLINE void add_point(sums *to, const uz_strain_group *group, const uz_lanes *volume, uz_lanes H[3][3],
                         const traces *mean)
{
    const uz_lanes weight = *volume;
    uz_lanes across, Q[N], e[N], of_Q[N], of_e[N], size = {0};
    uz_lanes work[3] = {{0}}; /* of C Q : Q, C e : Q, C e : e */
    const int n = group->rule.stresses;
    for (int k = 0; k < n; k++) {
        const int i = AXIS[to->part[k]][0], j = AXIS[to->part[k]][1];
        Q[k] = (i == j ? 1 : 2) * (H[0][i] * H[0][j] + H[1][i] * H[1][j] + H[2][i] * H[2][j]);
        e[k] = (i == j ? 0.5 : 1) * (H[i][j] + H[j][i]);
    }
    if (mean) {
        traces own;
        traces_of(&own, group, H);
        for (int k = 0; k < group->rule.direct; k++) {
            e[k] += (mean->e - own.e) / group->rule.direct;
            Q[k] += (mean->Q - own.Q) / group->rule.direct;
        }
    }
    stress_of(of_Q, group, Q);
    stress_of(of_e, group, e);
    strain_across(&across, group, of_e);
    for (int k = 0; k < n; k++) {
        work[0] += of_Q[k] * Q[k];
        work[1] += of_e[k] * Q[k];
        work[2] += of_e[k] * e[k];
        to->stress[to->part[k]] += weight * of_e[k];
    }
    for (int i = 0; i < 3; i++) {
        const uz_lanes turn = H[(i + 1) % 3][i] - H[i][(i + 1) % 3];
        to->turns += 0.5 * weight * turn * turn;
        for (int j = 0; j < 3; j++)
            size += H[i][j] * H[i][j];
    }
    size += across * across;
    to->squares += 0.25 * weight * work[0];
    to->along += weight * work[1];
    to->gradient += weight * size;
    to->law += weight * size * work[2];
}

UZ_INLINE void add_group(sums *to, const uz_strain_group *group, const uz_lanes *modulus)
{
    uz_lanes H[UZ_ELEMENT_GAUSS][3][3];
    const bool averaged = group->rule.formulation == UZ_FORMULATION_BBAR;
    traces mean = {{0}, {0}}, own;
    uz_lanes all = {0};
    uz_lane_gradients(H, &group->rule, &group->shape, group->u);
    for (int g = 0; g < group->rule.asked && averaged; g++) {
        traces_of(&own, group, H[g]);
        mean.e += group->shape.volume[g] * own.e;
        mean.Q += group->shape.volume[g] * own.Q;
        all += group->shape.volume[g];
    }
    if (averaged) {
        mean.e /= all;
        mean.Q /= all;
    }
    for (int g = 0; g < group->rule.asked; g++) {
        uz_lanes weight = group->shape.volume[g];
        for (int l = group->count; l < UZ_STRAIN_LANES; l++)
            weight[l] = 0;
        add_point(to, group, &weight, H[g], averaged ? &mean : NULL);
        to->modulus += weight * *modulus;
    }
}

UZ_AVX2_FMA static void add_group_fused(sums *to, const uz_strain_group *group, const uz_lanes *modulus)
{
    add_group(to, group, modulus);
}

static void take(void *ctx, const uz_strain_group *group)
{
    sums *to = ctx;
    uz_lanes modulus = {0};
    for (int l = 0; l < UZ_STRAIN_LANES; l++) {
        if (group->lame[l] != to->of) {
            to->of = group->lame[l];
            to->modulus_of = strip_modulus(to->model->kind, to->of);
        }
        modulus[l] = to->modulus_of;
    }
    (uz_cpu_has_avx2_fma() ? add_group_fused : add_group)(to, group, &modulus);
}

static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    sums *to = ctx;
    to->other = to->other || formulation == UZ_FORMULATION_INCOMPATIBLE;
    uz_strain_rule_at(rule, kind, to->model->kind, formulation, NULL, NULL, 0);
}

static double total(const uz_lanes *of)
{
    double sum = 0;
    for (int l = 0; l < UZ_STRAIN_LANES; l++)
        sum += (*of)[l];
    return sum;
}

/* (h / L)^2 of a plane body, L^2 + h^2 the square of the diagonal of the rectangle that has its polar moment of area,
 * 12 I / A: however the body stands. */
static double flatness_in_plane(const uz_mesh *mesh)
{
    double area = 0, first[2] = {0}, second = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        for (int a = 0; a < corners; a++) {
            double x[2], y[2], square = 0; /* from the first node */
            for (int c = 0; c < 2; c++) {
                x[c] = mesh->xyz[2 * node[a] + c] - mesh->xyz[c];
                y[c] = mesh->xyz[2 * node[(a + 1) % corners] + c] - mesh->xyz[c];
                square += x[c] * x[c] + x[c] * y[c] + y[c] * y[c];
            }
            const double twice = x[0] * y[1] - x[1] * y[0];
            area += twice / 2;
            for (int c = 0; c < 2; c++)
                first[c] += twice * (x[c] + y[c]) / 6;
            second += twice * square / 12;
        }
    }
    const double polar = second - (first[0] * first[0] + first[1] * first[1]) / area;
    const double flat = area * area / (12 * polar);
    return flat * flat;
}

/* Volume of an element, and its second moments (by AXIS) about its middle over its volume, by its corners. */
static double element_moments(double own[N], const uz_body_model *model, int64_t e, const double middle[3])
{
    double xyz[3 * UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], amid[3] = {0}, volume = 0;
    uz_element element;
    uz_body_element(&element, xyz, model, e);
    const int corners = uz_element_type_of(element.kind)->corners;
    const double share = (corners == 8 ? 1 / 3.0 : corners == 4 ? 0.2 : 0.25) / corners;
    const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
    for (int g = 0; g < rule->count; g++) {
        volume += rule->point[g].weight;
        for (int c = 0; c < 3; c++)
            amid[c] += rule->point[g].at[c] / rule->count;
    }
    for (int k = 0; k < N; k++) {
        const int i = AXIS[k][0], j = AXIS[k][1];
        own[k] = 0;
        for (int a = 0; a < corners; a++)
            own[k] += share * (xyz[3 * a + i] - middle[i]) * (xyz[3 * a + j] - middle[j]);
    }
    return volume * uz_element_gradients(grad, &element, amid);
}

/* The same of a solid: the least of its moments of second order over the largest one, of each element by its corners
 * and its volume, as they are of a parallelepiped, a tetrahedron, about so of a prism. */
static double flatness_in_space(const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    double all = 0, first[3] = {0}, second[N] = {0}, principal[3], volume = 0, own[N];
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        double middle[3] = {0}, from[3]; /* from: the first node */
        for (int a = 0; a < corners; a++)
            for (int c = 0; c < 3; c++)
                middle[c] += mesh->xyz[3 * node[a] + c] / corners;
        if (e == 0 || !mesh->uniform)
            volume = element_moments(own, model, e, middle);
        all += volume;
        for (int c = 0; c < 3; c++) {
            from[c] = middle[c] - mesh->xyz[c];
            first[c] += volume * from[c];
        }
        for (int k = 0; k < N; k++)
            second[k] += volume * (from[AXIS[k][0]] * from[AXIS[k][1]] + own[k]);
    }
    for (int k = 0; k < N; k++)
        second[k] -= first[AXIS[k][0]] * first[AXIS[k][1]] / all;
    uz_principal(principal, second, N);
    return fmax(0, principal[2] / principal[0]);
}

double uz_least_buckling_strain(const uz_body_model *model)
{
    return 0.2 * (model->kind == UZ_SOLID ? flatness_in_space(model) : flatness_in_plane(&model->mesh));
}

/* The mean stress along the axis in which it is most, as a strain. */
static double mean_strain(const sums *of)
{
    double principal[3], stress[N];
    for (int k = 0; k < N; k++)
        stress[k] = total(&of->stress[k]);
    uz_principal(principal, stress, N);
    const double modulus = total(&of->modulus);
    return modulus > 0 ? fmax(fabs(principal[0]), fabs(principal[2])) / modulus : 0;
}

uz_status uz_measure_nonlinear(double *out, const uz_body_model *model, const double *u, double energy, double buckling,
                               double leverage, uz_error *err)
{
    sums all = {.model = model, .part = uz_stress_count(model->kind) == 3 ? PLANE : SPACE};
    const uz_strain_source from = {.model = model, .nodal = u};
    const uz_strain_work work = {make_rule, take, &all};
    const uz_status status = uz_strain_groups(&work, &from, NULL, err);
    *out = NAN;
    if (status != UZ_OK || all.other)
        return status;
    *out = 1;
    if (!(energy > 0)) /* all of it is more than there is */
        return UZ_OK;
    const double part = mean_strain(&all) / buckling, gradient = total(&all.gradient);
    const double aside = gradient > 0 ? sqrt(total(&all.turns) / gradient) : 0;
    const double left = (sqrt(total(&all.squares)) + sqrt(total(&all.law))) / sqrt(2 * energy);
    const double forces = left * leverage * sqrt(total(&all.modulus));
    *out = fmax(fmax(part * fmax(2 * UZ_SURELY_SMALL, aside), forces * (UZ_SURELY_SMALL / UZ_SURELY_HELD)),
                left + fabs(total(&all.along)) / (2 * energy));
    return UZ_OK;
}
