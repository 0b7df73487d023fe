/* motion.c: the strain of a deformed element, as its stiffness takes it. */
#include "element/element_private.h"

#include <string.h>

void uz_element_move(uz_element_motion *motion, const uz_element *element, const double *u)
{
    memset(motion, 0, sizeof *motion);
    motion->element = element;
    motion->u = u;
    if (element->formulation == UZ_FORMULATION_BBAR) {
        double mean[UZ_ELEMENT_NODES][3];
        const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
        uz_mean_gradients(mean, element);
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < dim; c++)
                motion->dilatation += mean[a][c] * u[a * dim + c];
    } else if (element->formulation == UZ_FORMULATION_INCOMPATIBLE) {
        motion->centre_det = uz_centre_jacobian(motion->centre, element);
        uz_internal_parameters(motion->internal, element, u);
    }
}

/* H[c][j] += sum of value[a * dim + c] grad[a][j]: the gradient of a displacement. */
static void add_gradient(double H[3][3], double grad[][3], const double *value, int count, int dim)
{
    for (int a = 0; a < count; a++)
        for (int c = 0; c < dim; c++)
            for (int j = 0; j < dim; j++)
                H[c][j] += value[a * dim + c] * grad[a][j];
}

void uz_element_strain(double *strain, const uz_element_motion *motion, const double point[3])
{
    double grad[UZ_ELEMENT_NODES][3], H[3][3] = {{0}};
    const uz_element *element = motion->element;
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const double det = uz_element_gradients(grad, element, point);
    add_gradient(H, grad, motion->u, nodes, dim);
    if (element->formulation == UZ_FORMULATION_INCOMPATIBLE) {
        double mode[3][3], centre[3][3];
        memcpy(centre, motion->centre, sizeof centre);
        uz_mode_gradients(mode, centre, motion->centre_det, dim, point, det);
        add_gradient(H, mode, motion->internal, dim, dim);
    }
    strain[0] = H[0][0];
    strain[1] = H[1][1];
    if (element->model == UZ_SOLID) {
        strain[2] = H[2][2];
        strain[3] = H[0][1] + H[1][0];
        strain[4] = H[1][2] + H[2][1];
        strain[5] = H[2][0] + H[0][2];
    } else if (element->model == UZ_AXISYMMETRIC) {
        double N[UZ_ELEMENT_NODES], largest, displacement = 0;
        uz_element_shape(N, element->kind, point);
        const double radius = uz_ring_radius(&largest, element, N);
        for (int a = 0; a < nodes; a++)
            displacement += N[a] * motion->u[2 * a];
        strain[2] = radius > UZ_AXIS * largest ? displacement / radius : H[0][0]; /* what it tends to at the axis */
        strain[3] = H[0][1] + H[1][0];
    } else {
        strain[2] = H[0][1] + H[1][0];
    }
    /* An n-th of what the dilatation lacks of its mean goes to each of n direct strains, n as in stiffness.c. */
    const int n = element->formulation != UZ_FORMULATION_BBAR ? 0 : element->model == UZ_PLANE_STRAIN ? 2 : 3;
    double own = 0;
    for (int i = 0; i < n; i++)
        own += strain[i];
    for (int i = 0; i < n; i++)
        strain[i] += (motion->dilatation - own) / n;
}

double uz_element_strain_energy(const uz_element *element, const double *u)
{
    const int count = uz_element_rule(element->kind, element->model)->count, n = uz_stress_count(element->model);
    uz_element_motion motion;
    double sum = 0;
    uz_element_move(&motion, element, u);
    for (int g = 0; g < count; g++) {
        uz_gauss_state state;
        double strain[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES], density = 0;
        uz_gauss_state_at(&state, element, g);
        uz_element_strain(strain, &motion, state.point);
        uz_elastic_stress(stress, element->model, element->lame, strain);
        for (int i = 0; i < n; i++)
            density += stress[i] * strain[i];
        sum += 0.5 * state.volume * density;
    }
    return sum;
}
