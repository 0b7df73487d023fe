/* stiffness_lanes.c: stiffness.c and geometry.c of isotropic elements, with the same operations in the same order, none
 * of them contracted. A block of two nodes is summed over all points in registers and finished there. */
#include "element/stiffness_lanes.h"

#include "core/cpu.h"
#include "element/element_private.h"
#include "element/lane_shape.h"

#include <float.h>

enum { LANES = UZ_STRAIN_LANES };

typedef int64_t lane_bits __attribute__((vector_size(8 * UZ_STRAIN_LANES), aligned(8)));

void uz_stiffness_rule_of(uz_stiffness_rule *rule, uz_element_kind kind, uz_model model)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const uz_gauss_rule *gauss = uz_element_rule(kind, model);
    *rule = (uz_stiffness_rule){.kind = kind,
                                .model = model,
                                .dim = type->dim,
                                .nodes = type->nodes,
                                .points = gauss->count,
                                .corners = type->jacobian == UZ_JACOBIAN_CONSTANT ? 1 : type->nodes,
                                .checks_rule = type->jacobian == UZ_JACOBIAN_GENERAL};
    for (int g = 0; g < gauss->count; g++) {
        rule->weight[g] = gauss->point[g].weight;
        type->shape(type, NULL, rule->slope[g], gauss->point[g].at);
    }
    for (int a = 0; a < rule->corners; a++)
        type->shape(type, NULL, rule->corner_slope[a], type->local[a]);
}

bool uz_is_for_lanes(const uz_element *element)
{
    return element->model != UZ_AXISYMMETRIC && !element->lame.general &&
           element->formulation != UZ_FORMULATION_INCOMPATIBLE;
}

/* ---- shape */

/* J[axis][x], as uz_jacobian. */
UZ_INLINE void jacobian(uz_lanes J[3][3], const double slope[][3], const uz_lanes *x, int nodes, int dim)
{
    uz_lanes X[3][3];
    uz_lane_differentiate(X, slope, x, nodes, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            J[i][j] = X[j][i];
}

/* The question of uz_element_check, squared: what overflows or vanishes by that is not said to be good. */
UZ_INLINE void look_at(lane_bits *good, uz_lanes J[3][3], int dim)
{
    uz_lanes det, squares = UZ_FLAT * UZ_FLAT - (uz_lanes){0};
    for (int i = 0; i < dim; i++) {
        uz_lanes square = J[i][0] * J[i][0] + J[i][1] * J[i][1];
        if (dim == 3)
            square += J[i][2] * J[i][2];
        squares *= square;
    }
    uz_lane_determinant(&det, J, dim);
    *good &= (lane_bits)(det > 0) & (lane_bits)(det * det > squares);
}

UZ_INLINE void look_at_corners(lane_bits *good, const uz_stiffness_rule *rule, const uz_lanes *x, int nodes, int dim)
{
    for (int a = 0; a < rule->corners; a++) {
        uz_lanes J[3][3];
        jacobian(J, rule->corner_slope[a], x, nodes, dim);
        look_at(good, J, dim);
    }
}

/* ---- stiffness */

typedef struct {
    uz_lanes grad[UZ_ELEMENT_GAUSS][UZ_ELEMENT_DOFS], volume[UZ_ELEMENT_GAUSS]; /* at each point */
    uz_lanes lambda, mu;
    bool averaged; /* mean dilatation: lambda is what stiffness.c says then, and there are ... */
    uz_lanes mean[UZ_ELEMENT_DOFS], mean_stiffness;
} integrand;

UZ_INLINE void differentiate(integrand *of, lane_bits *good, const uz_stiffness_rule *rule, const uz_lanes *x,
                             double thickness, int nodes, int points, int dim)
{
    for (int g = 0; g < points; g++) {
        uz_lanes J[3][3], inverse[3][3], det;
        jacobian(J, rule->slope[g], x, nodes, dim);
        if (rule->checks_rule)
            look_at(good, J, dim);
        uz_lane_invert(inverse, &det, J, dim);
        of->volume[g] = rule->weight[g] * det;
        if (rule->model != UZ_SOLID)
            of->volume[g] *= thickness;
        for (int a = 0; a < nodes; a++)
            for (int j = 0; j < dim; j++) {
                uz_lanes sum = {0};
                for (int i = 0; i < dim; i++)
                    sum += inverse[i][j] * rule->slope[g][a][i];
                of->grad[g][a * dim + j] = sum;
            }
    }
}

/* uz_mean_gradients, what the mean dilatation resists with, and what is in the place of lambda. */
UZ_INLINE void average(integrand *of, const uz_stiffness_rule *rule, int dofs)
{
    const uz_lanes share = 2 * of->mu / (rule->model == UZ_PLANE_STRAIN ? 2.0 : 3.0);
    uz_lanes volume = {0};
    for (int i = 0; i < dofs; i++)
        of->mean[i] = (uz_lanes){0};
    for (int g = 0; g < rule->points; g++) {
        volume += of->volume[g];
        for (int i = 0; i < dofs; i++)
            of->mean[i] += of->volume[g] * of->grad[g][i];
    }
    for (int i = 0; i < dofs; i++)
        of->mean[i] /= volume;
    of->mean_stiffness = (of->lambda + share) * volume;
    of->lambda = -share;
}

/* The block of nodes a and b, b <= a, from own[point][direction], the derivatives of a times the volumes. */
UZ_INLINE void find_block(uz_lanes block[3][3], const integrand *of, uz_lanes own[][3], int points, int a, int b,
                          int dim)
{
    uz_lanes sum[3][3] = {{{0}}}, trace = {0};
    for (int g = 0; g < points; g++)
        for (int i = 0; i < dim; i++)
            for (int j = 0; j < dim; j++)
                sum[i][j] += own[g][i] * of->grad[g][b * dim + j];
    for (int i = 0; i < dim; i++) {
        for (int j = i + 1; j < dim && a == b; j++)
            sum[i][j] = sum[j][i];
        trace += sum[i][i];
    }
    for (int i = 0; i < dim; i++) {
        const uz_lanes of_mean = of->averaged ? of->mean_stiffness * of->mean[a * dim + i] : (uz_lanes){0};
        for (int j = 0; j < dim; j++) {
            block[i][j] = of->lambda * sum[i][j] + of->mu * (i == j ? sum[j][i] + trace : sum[j][i]);
            if (of->averaged)
                block[i][j] += of_mean * of->mean[b * dim + j];
        }
    }
    for (int i = 0; i < dim && a == b; i++)
        for (int j = i + 1; j < dim; j++)
            block[i][j] = block[j][i];
}

UZ_INLINE void look_at_block(lane_bits *good, uz_lanes block[3][3], bool diagonal, int dim)
{
    for (int i = 0; i < dim; i++) {
        for (int j = 0; j < dim; j++)
            *good &= (lane_bits)(block[i][j] < DBL_MAX / 1024) & (lane_bits)(block[i][j] > -DBL_MAX / 1024);
        if (diagonal)
            *good &= (lane_bits)(block[i][i] > DBL_MIN * 1024);
    }
}

UZ_INLINE bool stiffness_of(double *const ke[LANES], const uz_stiffness_rule *rule, uz_formulation formulation,
                            const uz_lanes *x, const uz_lane_material *material, double thickness, int nodes,
                            int points, int dim)
{
    integrand of;
    uz_lanes own[UZ_ELEMENT_GAUSS][3], block[3][3];
    const int n = nodes * dim;
    lane_bits good = (lane_bits){0} - 1;
    look_at_corners(&good, rule, x, nodes, dim);
    of.lambda = material->lambda;
    of.mu = material->mu;
    of.averaged = formulation == UZ_FORMULATION_BBAR;
    differentiate(&of, &good, rule, x, thickness, nodes, points, dim);
    if (of.averaged)
        average(&of, rule, n);
    for (int a = 0; a < nodes; a++) {
        for (int g = 0; g < points; g++)
            for (int i = 0; i < dim; i++)
                own[g][i] = of.volume[g] * of.grad[g][a * dim + i];
        for (int b = 0; b <= a; b++) {
            find_block(block, &of, own, points, a, b, dim);
            look_at_block(&good, block, a == b, dim);
            for (int i = 0; i < dim; i++)
                for (int j = 0; j < dim; j++)
                    for (int l = 0; l < LANES; l++) {
                        const int row = a * dim + i, column = b * dim + j;
                        ke[l][row * n + column] = ke[l][column * n + row] = block[i][j][l];
                    }
        }
    }
    return (good[0] & good[1] & good[2] & good[3]) != 0;
}

/* ---- for each kind of processor */

UZ_INLINE bool stiffness_in_space(double *const ke[LANES], const uz_stiffness_rule *rule, uz_formulation formulation,
                                  const uz_lanes *x, const uz_lane_material *material, double thickness)
{
    if (rule->dim == 2)
        return stiffness_of(ke, rule, formulation, x, material, thickness, rule->nodes, rule->points, 2);
    if (rule->kind == UZ_TET4) /* one point: what it takes is loops, unless they are unrolled */
        return stiffness_of(ke, rule, UZ_FORMULATION_STANDARD, x, material, thickness, 4, 1, 3);
    return stiffness_of(ke, rule, formulation, x, material, thickness, rule->nodes, rule->points, 3);
}

UZ_AVX2 static bool stiffness_wide(double *const ke[LANES], const uz_stiffness_rule *rule, uz_formulation formulation,
                                   const uz_lanes *x, const uz_lane_material *material, double thickness)
{
    return stiffness_in_space(ke, rule, formulation, x, material, thickness);
}

bool uz_lane_stiffness(double *const ke[UZ_STRAIN_LANES], const uz_stiffness_rule *rule, uz_formulation formulation,
                       const uz_lanes *x, const uz_lane_material *material, double thickness)
{
    return (uz_cpu_has_avx2_fma() ? stiffness_wide : stiffness_in_space)(ke, rule, formulation, x, material, thickness);
}
