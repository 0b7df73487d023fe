#include "element/strain_lanes.h"

#include "core/cpu.h"
#include "element/element_private.h"
#include "element/lane_shape.h"

#include <math.h>
#include <string.h>

#define TWO_PI 6.28318530717958647693

enum { MODES = UZ_ELEMENT_INTERNAL };

typedef int64_t lane_bits __attribute__((vector_size(8 * UZ_STRAIN_LANES), aligned(8)));

static void add_point(uz_strain_rule *rule, const double point[3], double weight)
{
    const int g = rule->points++;
    memcpy(rule->point[g], point, sizeof rule->point[g]);
    rule->weight[g] = weight;
    const uz_element_type *type = uz_element_type_of(rule->kind);
    type->shape(type, rule->N[g], rule->slope[g], rule->point[g]);
}

void uz_strain_rule_at(uz_strain_rule *rule, uz_element_kind kind, uz_model model, uz_formulation formulation,
                       const double point[][3], const double *weight, int count)
{
    static const double ORIGIN[3] = {0};
    const uz_element_type *type = uz_element_type_of(kind);
    const uz_gauss_rule *gauss = uz_element_rule(kind, model);
    double volume = 0;
    memset(rule, 0, sizeof *rule);
    rule->kind = kind;
    rule->model = model;
    rule->formulation = formulation;
    rule->dim = uz_element_type_of(kind)->dim;
    rule->nodes = uz_element_node_count(kind);
    rule->stresses = uz_stress_count(model);
    rule->direct = rule->stresses == 3 ? 2 : 3;
    rule->asked = count > 0 ? count : gauss->count;
    rule->averaged = count;
    type->shape(type, NULL, rule->centre, ORIGIN);
    for (int g = 0; g < gauss->count; g++)
        volume += gauss->point[g].weight;
    for (int k = 0; k < count; k++)
        add_point(rule, point[k], weight ? weight[k] : volume / count);
    rule->simplex = type->jacobian == UZ_JACOBIAN_CONSTANT && rule->asked == 1 && model != UZ_AXISYMMETRIC &&
                    formulation == UZ_FORMULATION_STANDARD;
    if (count > 0 && formulation == UZ_FORMULATION_STANDARD)
        return;
    for (int g = 0; g < gauss->count; g++)
        add_point(rule, gauss->point[g].at, gauss->point[g].weight);
}

/* ---- shape */

UZ_INLINE void shape_of(uz_lane_shape *shape, const uz_strain_rule *rule, const uz_lanes *x, double thickness, int dim)
{
    uz_lanes X[3][3]; /* derivatives of position: [x][axis], and so are inverses */
    for (int g = 0; g < rule->points; g++) {
        uz_lane_differentiate(X, rule->slope[g], x, rule->nodes, dim);
        uz_lane_invert(shape->inverse[g], &shape->det[g], X, dim);
        shape->volume[g] = rule->weight[g] * shape->det[g];
        if (rule->model == UZ_AXISYMMETRIC) { /* a radius of at most UZ_AXIS of the largest counts as on the axis */
            uz_lanes radius = {0}, largest = {0};
            for (int a = 0; a < rule->nodes; a++) {
                const uz_lanes r = x[2 * a];
                const lane_bits larger = (lane_bits)(r > largest);
                radius += rule->N[g][a] * r;
                largest = (uz_lanes)((larger & (lane_bits)r) | (~larger & (lane_bits)largest));
            }
            const uz_lanes inverse = 1 / radius;
            shape->per_radius[g] = (uz_lanes)((lane_bits)(radius > UZ_AXIS * largest) & (lane_bits)inverse);
            shape->volume[g] *= TWO_PI * radius;
        } else if (rule->model != UZ_SOLID) {
            shape->volume[g] *= thickness;
        }
    }
    if (rule->formulation == UZ_FORMULATION_INCOMPATIBLE) {
        uz_lane_differentiate(X, rule->centre, x, rule->nodes, dim);
        uz_lane_invert(shape->centre_inverse, &shape->centre_det, X, dim);
    }
}

/* ---- strain */

/* Derivatives of the incompatible mode m by x_j at a Gauss point: slope[m][j], see uz_mode_gradients. */
UZ_INLINE void mode_slopes(uz_lanes slope[3][3], const uz_strain_rule *rule, const uz_lane_shape *shape, int g, int dim)
{
    const uz_lanes ratio = -2 * shape->centre_det / shape->det[g];
    for (int m = 0; m < dim; m++)
        for (int j = 0; j < dim; j++)
            slope[m][j] = rule->point[g][m] * ratio * shape->centre_inverse[j][m];
}

/* A point's part of the modes' equations A internal = b: of A its lower triangle, (m, c) being row m dim + c; b is what
 * the stress of the displacements does along the modes. */
UZ_INLINE void add_mode_equations(uz_lanes A[MODES][MODES], uz_lanes b[MODES], uz_lanes H[3][3], uz_lanes slope[3][3],
                                  const uz_lane_material *material, const uz_lanes *volume, int dim)
{
    uz_lanes trace = H[0][0] + H[1][1];
    if (dim == 3)
        trace += H[2][2];
    const uz_lanes lambda = *volume * material->lambda, mu = *volume * material->mu;
    for (int m = 0; m < dim; m++)
        for (int c = 0; c < dim; c++) {
            b[m * dim + c] -= lambda * trace * slope[m][c];
            for (int j = 0; j < dim; j++)
                b[m * dim + c] -= mu * (H[c][j] + H[j][c]) * slope[m][j];
        }
    for (int m = 0; m < dim; m++)
        for (int n = 0; n <= m; n++) {
            uz_lanes product = slope[m][0] * slope[n][0];
            for (int j = 1; j < dim; j++)
                product += slope[m][j] * slope[n][j];
            for (int c = 0; c < dim; c++) {
                for (int d = 0; d < dim; d++)
                    A[m * dim + c][n * dim + d] += lambda * slope[m][c] * slope[n][d] + mu * slope[m][d] * slope[n][c];
                A[m * dim + c][n * dim + c] += mu * product;
            }
        }
}

/* The modes take the shape of least energy, and their derivatives join in. */
UZ_INLINE void add_modes(uz_lanes H[][3][3], const uz_strain_rule *rule, const uz_lane_shape *shape,
                         const uz_lane_material *material, int dim)
{
    uz_lanes A[MODES][MODES] = {{{0}}}, internal[MODES] = {{0}}, slope[3][3];
    for (int g = rule->averaged; g < rule->points; g++) {
        mode_slopes(slope, rule, shape, g, dim);
        add_mode_equations(A, internal, H[g], slope, material, &shape->volume[g], dim);
    }
    /* internal = A^-1 internal by A = L D L', in place; only the lower triangle of A is read. */
    const int count = dim * dim;
    for (int k = 0; k < count; k++) {
        const uz_lanes pivot = 1 / A[k][k];
        for (int i = k + 1; i < count; i++) {
            const uz_lanes factor = A[i][k] * pivot;
            for (int j = k + 1; j <= i; j++)
                A[i][j] -= factor * A[j][k];
            internal[i] -= factor * internal[k];
        }
    }
    for (int k = count - 1; k >= 0; k--) {
        for (int i = k + 1; i < count; i++)
            internal[k] -= A[i][k] * internal[i];
        internal[k] /= A[k][k];
    }
    for (int g = 0; g < rule->points; g++) {
        mode_slopes(slope, rule, shape, g, dim);
        for (int m = 0; m < dim; m++)
            for (int c = 0; c < dim; c++)
                for (int j = 0; j < dim; j++)
                    H[g][c][j] += internal[m * dim + c] * slope[m][j];
    }
}

/* The dilatation becomes its mean over the volume: an n-th of the difference goes to each of n direct strains. */
UZ_INLINE void take_mean_dilatation(uz_lanes strain[][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                                    const uz_lane_shape *shape)
{
    uz_lanes sum = {0}, volume = {0}, own[UZ_ELEMENT_GAUSS];
    const int n = rule->direct;
    for (int g = 0; g < rule->points; g++) {
        own[g] = strain[g][0] + strain[g][1];
        if (n == 3)
            own[g] += strain[g][2];
        if (g < rule->averaged)
            continue;
        sum += shape->volume[g] * own[g];
        volume += shape->volume[g];
    }
    const uz_lanes mean = sum / volume;
    for (int g = 0; g < rule->points; g++)
        for (int i = 0; i < n; i++)
            strain[g][i] += (mean - own[g]) / n;
}

/* Of a ring u_r / r; on the axis the radial strain. */
UZ_INLINE void strain_around(uz_lanes *around, const uz_lanes *radial, const uz_strain_rule *rule,
                             const uz_lane_shape *shape, const uz_lanes *u, int g)
{
    const lane_bits on_axis = (lane_bits)(shape->per_radius[g] == 0);
    uz_lanes displacement = {0};
    for (int a = 0; a < rule->nodes; a++)
        displacement += rule->N[g][a] * u[2 * a];
    displacement *= shape->per_radius[g];
    *around = (uz_lanes)((on_axis & (lane_bits)*radial) | (~on_axis & (lane_bits)displacement));
}

UZ_INLINE void strain_of_gradient(uz_lanes *strain, uz_lanes H[3][3], const uz_strain_rule *rule,
                                  const uz_lane_shape *shape, const uz_lanes *u, int g, int dim)
{
    strain[0] = H[0][0];
    strain[1] = H[1][1];
    if (dim == 3) {
        strain[2] = H[2][2];
        strain[3] = H[0][1] + H[1][0];
        strain[4] = H[1][2] + H[2][1];
        strain[5] = H[2][0] + H[0][2];
    } else if (rule->model == UZ_AXISYMMETRIC) {
        strain_around(&strain[2], &H[0][0], rule, shape, u, g);
        strain[3] = H[0][1] + H[1][0];
    } else {
        strain[2] = H[0][1] + H[1][0];
    }
}

/* H[c][j]: derivative of u_c by x_j. */
UZ_INLINE void gradient_at(uz_lanes H[3][3], const uz_strain_rule *rule, const uz_lane_shape *shape, const uz_lanes *u,
                           int g, int dim)
{
    uz_lanes D[3][3];
    uz_lane_differentiate(D, rule->slope[g], u, rule->nodes, dim);
    for (int c = 0; c < dim; c++)
        for (int j = 0; j < dim; j++) {
            H[c][j] = D[c][0] * shape->inverse[g][j][0];
            for (int i = 1; i < dim; i++)
                H[c][j] += D[c][i] * shape->inverse[g][j][i];
        }
}

UZ_INLINE void strains_of(uz_lanes strain[][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                          const uz_lane_shape *shape, const uz_lane_material *material, const uz_lanes *u, int dim)
{
    if (rule->formulation == UZ_FORMULATION_INCOMPATIBLE) {
        uz_lanes H[UZ_ELEMENT_GAUSS][3][3];
        for (int g = 0; g < rule->points; g++)
            gradient_at(H[g], rule, shape, u, g, dim);
        add_modes(H, rule, shape, material, dim);
        for (int g = 0; g < rule->points; g++)
            strain_of_gradient(strain[g], H[g], rule, shape, u, g, dim);
        return;
    }
    for (int g = 0; g < rule->points; g++) {
        uz_lanes H[3][3];
        gradient_at(H, rule, shape, u, g, dim);
        strain_of_gradient(strain[g], H, rule, shape, u, g, dim);
    }
    if (rule->formulation == UZ_FORMULATION_BBAR)
        take_mean_dilatation(strain, rule, shape);
}

/* Derivatives by the reference coordinates are differences between nodes. */
UZ_INLINE void simplex_of(uz_lane_shape *shape, uz_lanes *strain, const uz_strain_rule *rule, const uz_lanes *x,
                          const uz_lanes *u, double thickness, int dim)
{
    uz_lanes X[3][3], D[3][3], inverse[3][3], H[3][3], det;
    for (int c = 0; c < dim; c++)
        for (int i = 0; i < dim; i++) {
            X[c][i] = x[(i + 1) * dim + c] - x[c];
            D[c][i] = u[(i + 1) * dim + c] - u[c];
        }
    uz_lane_invert(inverse, &det, X, dim);
    for (int c = 0; c < dim; c++)
        for (int j = 0; j < dim; j++) {
            shape->inverse[0][c][j] = inverse[c][j];
            H[c][j] = D[c][0] * inverse[j][0];
            for (int i = 1; i < dim; i++)
                H[c][j] += D[c][i] * inverse[j][i];
        }
    shape->det[0] = det;
    shape->volume[0] = (dim == 3 ? rule->weight[0] : rule->weight[0] * thickness) * det;
    strain_of_gradient(strain, H, rule, shape, u, 0, dim);
}

UZ_INLINE void gradients_of(uz_lanes H[][3][3], const uz_strain_rule *rule, const uz_lane_shape *shape,
                            const uz_lanes *u, int dim)
{
    for (int g = 0; g < rule->points; g++) {
        for (int c = 0; c < 3 && dim == 2; c++)
            H[g][c][2] = H[g][2][c] = (uz_lanes){0};
        gradient_at(H[g], rule, shape, u, g, dim);
        if (rule->model == UZ_AXISYMMETRIC)
            strain_around(&H[g][2][2], &H[g][0][0], rule, shape, u, g);
    }
}

/* ---- for each kind of processor */

/* det F - 1 of the directions that dilatation is shared by, as strains may be tiny. */
UZ_INLINE void dilatation(uz_lanes *more, uz_lanes h[3][3], int direct, int dim)
{
    const uz_lanes plane = h[0][0] + h[1][1] + (h[0][0] * h[1][1] - h[0][1] * h[1][0]);
    *more = plane;
    if (direct == 3)
        *more += h[2][2] + plane * h[2][2];
    if (dim == 3)
        *more += h[0][1] * h[1][2] * h[2][0] + h[0][2] * h[1][0] * h[2][1] - (1 + h[0][0]) * h[1][2] * h[2][1] -
                 (1 + h[1][1]) * h[0][2] * h[2][0];
}

/* det F becomes its mean over the volume at rest: C is multiplied by the n-th root of the square of what this is more.
 * own: det F - 1 of points, and becomes that. */
UZ_INLINE void take_mean_determinant(uz_lanes strain[][UZ_ELEMENT_STRESSES], uz_lanes *own, const uz_strain_rule *rule,
                                     const uz_lane_shape *shape)
{
    uz_lanes sum = {0}, volume = {0};
    for (int g = rule->averaged; g < rule->points; g++) {
        sum += shape->volume[g] * own[g];
        volume += shape->volume[g];
    }
    sum /= volume;
    for (int g = 0; g < rule->points; g++) {
        uz_lanes more = {0};
        for (int l = 0; l < UZ_STRAIN_LANES; l++)
            more[l] = expm1(2.0 / rule->direct * (log1p(sum[l]) - log1p(own[g][l])));
        for (int c = 0; c < rule->stresses; c++)
            strain[g][c] += more * (strain[g][c] + (c < rule->direct ? 0.5 : 0));
        own[g] = sum;
    }
}

/* The trace becomes the logarithm of det F. */
UZ_INLINE void take_volume(uz_lanes strain[][UZ_ELEMENT_STRESSES], const uz_lanes *own, const uz_strain_rule *rule)
{
    for (int g = 0; g < rule->points; g++) {
        uz_lanes more = {0};
        for (int l = 0; l < UZ_STRAIN_LANES; l++)
            more[l] = log1p(own[g][l]);
        for (int c = 0; c < rule->direct; c++)
            more -= strain[g][c];
        for (int c = 0; c < rule->direct; c++)
            strain[g][c] += more / rule->direct;
    }
}

/* (H'H)_ij of the components' axes i and j, half of it where these are one: of rings H[2][2] is that around. */
UZ_INLINE void green_strains_of(uz_lanes strain[][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                                const uz_lane_shape *shape, const uz_lanes *u, bool by_volume, int dim)
{
    static const int PLANE[][2] = {{0, 0}, {1, 1}, {0, 1}}, RING[][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}},
                     SPACE[][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    const int(*axes)[2] = dim == 3 ? SPACE : rule->stresses == 4 ? RING : PLANE;
    const bool averaged = rule->formulation == UZ_FORMULATION_BBAR;
    uz_lanes H[UZ_ELEMENT_GAUSS][3][3], own[UZ_ELEMENT_GAUSS];
    gradients_of(H, rule, shape, u, dim);
    for (int g = 0; g < rule->points; g++) {
        if (averaged || by_volume)
            dilatation(&own[g], H[g], rule->direct, dim);
        strain_of_gradient(strain[g], H[g], rule, shape, u, g, dim);
        for (int c = 0; c < rule->stresses; c++) {
            const int i = axes[c][0], j = axes[c][1];
            uz_lanes square = H[g][0][i] * H[g][0][j] + H[g][1][i] * H[g][1][j];
            if (dim == 3 || rule->stresses == 4)
                square += H[g][2][i] * H[g][2][j];
            strain[g][c] += (i == j ? 0.5 : 1.0) * square;
        }
    }
    if (averaged)
        take_mean_determinant(strain, own, rule, shape);
    if (by_volume)
        take_volume(strain, own, rule);
}

/* NAME is KERNEL, for the rule's number of dimensions and for the processor. */
#define FOR_ALL(NAME, KERNEL, PARAMETERS, ...)                                                                         \
    UZ_INLINE void KERNEL##_in_space PARAMETERS                                                                        \
    {                                                                                                                  \
        if (rule->dim == 2)                                                                                            \
            KERNEL(__VA_ARGS__, 2);                                                                                    \
        else                                                                                                           \
            KERNEL(__VA_ARGS__, 3);                                                                                    \
    }                                                                                                                  \
    UZ_AVX2_FMA static void KERNEL##_fused PARAMETERS                                                                  \
    {                                                                                                                  \
        KERNEL##_in_space(__VA_ARGS__);                                                                                \
    }                                                                                                                  \
    void NAME PARAMETERS                                                                                               \
    {                                                                                                                  \
        (uz_cpu_has_avx2_fma() ? KERNEL##_fused : KERNEL##_in_space)(__VA_ARGS__);                                     \
    }
FOR_ALL(uz_lane_shape_of, shape_of,
        (uz_lane_shape * shape, const uz_strain_rule *rule, const uz_lanes *x, double thickness), shape, rule, x,
        thickness)
FOR_ALL(uz_lane_strains, strains_of,
        (uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule, const uz_lane_shape *shape,
         const uz_lane_material *material, const uz_lanes *u),
        strain, rule, shape, material, u)
FOR_ALL(uz_lane_simplex, simplex_of,
        (uz_lane_shape * shape, uz_lanes strain[UZ_ELEMENT_STRESSES], const uz_strain_rule *rule, const uz_lanes *x,
         const uz_lanes *u, double thickness),
        shape, strain, rule, x, u, thickness)
FOR_ALL(uz_lane_green_strains, green_strains_of,
        (uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule, const uz_lane_shape *shape,
         const uz_lanes *u, bool by_volume),
        strain, rule, shape, u, by_volume)
FOR_ALL(uz_lane_gradients, gradients_of,
        (uz_lanes H[UZ_ELEMENT_GAUSS][3][3], const uz_strain_rule *rule, const uz_lane_shape *shape, const uz_lanes *u),
        H, rule, shape, u)
