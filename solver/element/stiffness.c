/* stiffness.c: element stiffness in every formulation.
 *
 * For an isotropic material B'CB need not be formed. With g_a the gradient of shape function a, the energy density is
 *     lambda (div u)^2 + 2 mu epsilon : epsilon,
 * and its second derivatives are lambda g_a,i g_b,j + mu (g_a,j g_b,i + delta_ij g_a . g_b): all of it follows from
 *     S[a,i][b,j] = integral g_a,i g_b,j,
 * one symmetric rank-one update per Gauss point. A ring adds the hoop strain u_r / r, with h_a = N_a / r: 2 mu h_a h_b
 * between radial displacements, and h_a to what div u takes of the radial one.
 *
 * Mean dilatation (B-bar; Hughes, "Generalization of selective integration procedures to anisotropic and nonlinear
 * media", Int. J. Numer. Meth. Engng 15 (1980)): in div u, and with an n-th of the difference in each direct strain,
 * the dilatation is replaced by its mean over the volume. The energy is then
 *     (lambda + 2 mu / n) (mean div u)^2 + 2 mu epsilon : epsilon - (2 mu / n) (div u)^2,
 * that is -2 mu / n in lambda's place, and one more rank-one update. n is 3; in plane strain 2, so that the third
 * direction keeps its strain of zero.
 *
 * Of a material with directions (lame.general) B'CB is formed, with the same strains.
 *
 * Incompatible modes are further shape functions without nodes (element_private.h), condensed at once. */
#include "element/element_private.h"

#include <math.h>
#include <string.h>

/* The internal parameters come with hex8 at most. */
enum { MOST = UZ_ELEMENT_DOFS > 33 ? UZ_ELEMENT_DOFS : 33 };

/* Where mean dilatation begins to pay. On Cook's membrane in plane strain (8 x 8 cells) the energy that plain quad4
 * lacks is 7.6 % for Poisson's ratio 0 and 8.4 % for 0.3, but 11.6 % for 0.4, 17 % for 0.45 and 65 % for 0.499; with
 * mean dilatation it is 3 to 5 % for all. Below, plain elements are the more exact where the field is smooth
 * (test_elements_accuracy). */
#define NEARLY_INCOMPRESSIBLE 0.4

uz_formulation uz_resolve_formulation(uz_formulation asked, uz_element_kind kind, uz_model model, double poisson)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const bool bbar = type->bbar && model != UZ_PLANE_STRESS;
    switch (asked) {
    case UZ_FORMULATION_AUTO:
        return bbar && poisson >= NEARLY_INCOMPRESSIBLE ? UZ_FORMULATION_BBAR : UZ_FORMULATION_STANDARD;
    case UZ_FORMULATION_BBAR:
        return bbar ? UZ_FORMULATION_BBAR : UZ_FORMULATION_STANDARD;
    case UZ_FORMULATION_INCOMPATIBLE:
        return type->incompatible && model != UZ_AXISYMMETRIC ? UZ_FORMULATION_INCOMPATIBLE : UZ_FORMULATION_STANDARD;
    case UZ_FORMULATION_STANDARD:
    case UZ_FORMULATIONS:
        break;
    }
    return UZ_FORMULATION_STANDARD;
}

/* K += weight v v', lower triangle of the leading size x size, rows MOST apart. */
static void add_product(double *K, int size, double weight, const double *v)
{
    for (int i = 0; i < size; i++) {
        const double scaled = weight * v[i];
        for (int j = 0; j <= i; j++)
            K[i * MOST + j] += scaled * v[j];
    }
}

/* From S to stiffness in place, blocks of dim x dim: K_ij = lambda S_ij + mu (S_ji + delta_ij trace S). Each block of
 * the lower triangle is complete in S but those of the diagonal, which are symmetric. */
static void finish_blocks(double *S, int size, int dim, double lambda, double mu)
{
    for (int a = 0; a < size; a += dim)
        for (int b = 0; b <= a; b += dim) {
            double block[3][3], trace = 0;
            for (int i = 0; i < dim; i++) {
                for (int j = 0; j < dim; j++)
                    block[i][j] = a == b && j > i ? S[(a + j) * MOST + b + i] : S[(a + i) * MOST + b + j];
                trace += block[i][i];
            }
            for (int i = 0; i < dim; i++)
                for (int j = 0; j < dim; j++)
                    S[(a + i) * MOST + b + j] = lambda * block[i][j] + mu * (block[j][i] + (i == j ? trace : 0));
        }
}

/* The shape functions' gradients as one vector, then those of the modes if there are any. Returns its length. */
static int flatten(double *v, double grad[][3], int count, int dim)
{
    int size = 0;
    for (int a = 0; a < count; a++)
        for (int i = 0; i < dim; i++)
            v[size++] = grad[a][i];
    return size;
}

/* Strains at a point by the size unknowns, of which v has the gradients; hoop: of rings. */
static void strain_rows(double B[UZ_ELEMENT_STRESSES][MOST], uz_model model, const double *v, const double *hoop,
                        int size, int dim)
{
    const int shear = model == UZ_SOLID || model == UZ_AXISYMMETRIC ? 3 : 2;
    memset(B, 0, UZ_ELEMENT_STRESSES * sizeof B[0]);
    for (int a = 0; a < size; a += dim) {
        for (int c = 0; c < dim; c++)
            B[c][a + c] = v[a + c];
        B[shear][a] = v[a + 1];
        B[shear][a + 1] = v[a];
        if (model == UZ_AXISYMMETRIC)
            B[2][a] = hoop[a];
        if (dim < 3)
            continue;
        B[4][a + 1] = B[5][a] = v[a + 2];
        B[4][a + 2] = v[a + 1];
        B[5][a + 2] = v[a];
    }
}

/* Mean dilatation: each of n direct strains gets an n-th of what the dilatation lacks of its mean. */
static void take_mean(double B[UZ_ELEMENT_STRESSES][MOST], const double *mean, int dofs, int n)
{
    for (int i = 0; i < dofs; i++) {
        double own = 0;
        for (int k = 0; k < n; k++)
            own += B[k][i];
        for (int k = 0; k < n; k++)
            B[k][i] += (mean[i] - own) / n;
    }
}

/* A point's part of B'CB. */
static void add_general(double *K, double B[UZ_ELEMENT_STRESSES][MOST], const uz_element *element, double volume,
                        int size)
{
    const int n = uz_stress_count(element->model);
    for (int i = 0; i < size; i++) {
        double stress[UZ_ELEMENT_STRESSES];
        for (int k = 0; k < n; k++)
            stress[k] = B[k][i];
        uz_elastic_stress(stress, element->model, element->lame, stress);
        for (int j = 0; j <= i; j++)
            for (int k = 0; k < n; k++)
                K[i * MOST + j] += volume * stress[k] * B[k][j];
    }
}

/* integrate() of a material with directions, but for the last step. */
static void integrate_general(double *K, const uz_element *element, int size)
{
    double B[UZ_ELEMENT_STRESSES][MOST], centre[3][3], mode[3][3], v[MOST], mean[MOST], hoop[MOST] = {0};
    double centre_det = 1;
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const int count = uz_element_rule(element->kind, element->model)->count, dofs = nodes * dim;
    const bool averaged = element->formulation == UZ_FORMULATION_BBAR;
    if (size > dofs)
        centre_det = uz_centre_jacobian(centre, element);
    if (averaged) {
        double means[UZ_ELEMENT_NODES][3];
        uz_mean_gradients(means, element);
        flatten(mean, means, nodes, dim);
    }
    for (int g = 0; g < count; g++) {
        uz_gauss_state state;
        uz_gauss_state_at(&state, element, g);
        flatten(v, state.grad, nodes, dim);
        if (size > dofs) {
            uz_mode_gradients(mode, centre, centre_det, dim, state.point, state.det);
            flatten(v + dofs, mode, dim, dim);
        }
        for (int a = 0; a < nodes && element->model == UZ_AXISYMMETRIC; a++)
            hoop[2 * a] = state.N[a] / state.radius;
        strain_rows(B, element->model, v, hoop, size, dim);
        if (averaged)
            take_mean(B, mean, dofs, element->model == UZ_PLANE_STRAIN ? 2 : 3);
        add_general(K, B, element, state.volume, size);
    }
}

static void factor_modes(double *K, int dofs, int size);

/* Lower triangle, with the internal parameters last; rows MOST apart. Of their block A there is L, A = L L'. Returns
 * the size. */
static int integrate(double *K, const uz_element *element)
{
    double S[MOST * MOST], centre[3][3], mode[3][3], v[MOST], centre_det = 1;
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const int count = uz_element_rule(element->kind, element->model)->count, dofs = nodes * dim;
    const bool modes = element->formulation == UZ_FORMULATION_INCOMPATIBLE;
    const bool mean = element->formulation == UZ_FORMULATION_BBAR, ring = element->model == UZ_AXISYMMETRIC;
    const int size = dofs + (modes ? dim * dim : 0);
    const double share = 2 * element->lame.mu / (element->model == UZ_PLANE_STRAIN ? 2 : 3);
    const double lambda = mean ? -share : element->lame.lambda;
    for (int i = 0; i < size; i++)
        for (int j = 0; j <= i; j++)
            S[i * MOST + j] = K[i * MOST + j] = 0;
    if (element->lame.general) {
        integrate_general(K, element, size);
        factor_modes(K, dofs, size);
        return size;
    }
    if (modes)
        centre_det = uz_centre_jacobian(centre, element);
    for (int g = 0; g < count; g++) {
        uz_gauss_state state;
        uz_gauss_state_at(&state, element, g);
        flatten(v, state.grad, nodes, dim);
        if (modes) {
            uz_mode_gradients(mode, centre, centre_det, dim, state.point, state.det);
            flatten(v + dofs, mode, dim, dim);
        }
        add_product(S, size, state.volume, v);
        if (ring) {
            /* What a ring adds at a point: lambda with the whole dilatation, and the hoop strain. */
            double dilatation[UZ_ELEMENT_DOFS], hoop[UZ_ELEMENT_DOFS];
            for (int i = 0; i < dofs; i++) {
                hoop[i] = i % 2 == 0 ? state.N[i / 2] / state.radius : 0;
                dilatation[i] = v[i] + hoop[i];
            }
            add_product(K, dofs, lambda * state.volume, dilatation);
            add_product(K, dofs, 2 * element->lame.mu * state.volume, hoop);
        }
    }
    finish_blocks(S, size, dim, ring ? 0 : lambda, element->lame.mu);
    for (int i = 0; i < size; i++)
        for (int j = 0; j <= i; j++)
            K[i * MOST + j] += S[i * MOST + j];
    if (mean) { /* the mean dilatation's share of the energy */
        double means[UZ_ELEMENT_NODES][3];
        const double volume = uz_mean_gradients(means, element);
        flatten(v, means, nodes, dim);
        add_product(K, dofs, (element->lame.lambda + share) * volume, v);
    }
    factor_modes(K, dofs, size);
    return size;
}

static void factor_modes(double *K, int dofs, int size)
{
    for (int i = dofs; i < size; i++)
        for (int j = dofs; j <= i; j++) {
            double sum = K[i * MOST + j];
            for (int k = dofs; k < j; k++)
                sum -= K[i * MOST + k] * K[j * MOST + k];
            K[i * MOST + j] = i == j ? sqrt(sum) : sum / K[j * MOST + j];
        }
}

void uz_internal_parameters(double internal[UZ_ELEMENT_INTERNAL], const uz_element *element, const double *u)
{
    double K[MOST * MOST];
    const int dim = uz_element_type_of(element->kind)->dim, dofs = uz_element_node_count(element->kind) * dim;
    const int size = integrate(K, element), count = size - dofs;
    for (int i = 0; i < count; i++) { /* L y = - coupling u */
        const double *row = K + (dofs + i) * MOST;
        double sum = 0;
        for (int j = 0; j < dofs; j++)
            sum -= row[j] * u[j];
        for (int k = 0; k < i; k++)
            sum -= row[dofs + k] * internal[k];
        internal[i] = sum / row[dofs + i];
    }
    for (int i = count - 1; i >= 0; i--) { /* L' internal = y */
        for (int k = i + 1; k < count; k++)
            internal[i] -= K[(dofs + k) * MOST + dofs + i] * internal[k];
        internal[i] /= K[(dofs + i) * MOST + dofs + i];
    }
}

uz_shape_fault uz_element_stiffness(double *ke, const uz_element *element)
{
    double K[MOST * MOST];
    const int dofs = uz_element_node_count(element->kind) * uz_element_type_of(element->kind)->dim;
    memset(ke, 0, (size_t)(dofs * dofs) * sizeof *ke);
    const uz_shape_fault fault = uz_element_check(element);
    if (fault != UZ_SHAPE_GOOD)
        return fault;
    const int size = integrate(K, element);
    /* The internal parameters are those of least energy: K_uu - K_ua A^-1 K_au, first L^-1 times the coupling. */
    for (int i = dofs; i < size; i++)
        for (int j = 0; j < dofs; j++) {
            double sum = K[i * MOST + j];
            for (int k = dofs; k < i; k++)
                sum -= K[i * MOST + k] * K[k * MOST + j];
            K[i * MOST + j] = sum / K[i * MOST + i];
        }
    for (int k = dofs; k < size; k++)
        for (int i = 0; i < dofs; i++)
            for (int j = 0; j <= i; j++)
                K[i * MOST + j] -= K[k * MOST + i] * K[k * MOST + j];
    for (int i = 0; i < dofs; i++)
        for (int j = 0; j <= i; j++)
            ke[dofs * i + j] = ke[dofs * j + i] = K[i * MOST + j];
    return UZ_SHAPE_GOOD;
}
