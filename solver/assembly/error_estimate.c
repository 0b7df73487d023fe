/* error_estimate.c: how much of the energy the mesh has missed.
 *
 * The stress of a finite element solution jumps from element to element; averaged at the nodes and interpolated, it is
 * closer to the true stress than the solution's own. The energy of the difference,
 *     eta^2 = integral of (s* - s_h)' C^-1 (s* - s_h) over the volume,
 * estimates the squared energy-norm error of u_h, and ||u||^2 is estimated by ||u_h||^2 + eta^2 (Galerkin
 * orthogonality). */
#include "assembly/parts.h"

#include "assembly/quad4.h"
#include "core/alloc.h"

#include <math.h>
#include <stdlib.h>

enum { CORNERS = 4, STRESSES = 3 };

/* Stress at the four Gauss points of an element; weight[g]: volume of each point. */
typedef struct {
    double stress[CORNERS][STRESSES], strain[CORNERS][STRESSES], weight[CORNERS];
} element_state;

static void evaluate(element_state *state, const uz_body_model *model, const double *nodal, int64_t element)
{
    double xy[8], u[8], grad[4][2];
    const int64_t *corner = model->mesh.node + element * CORNERS;
    uz_element_corners(xy, &model->mesh, element);
    for (int a = 0; a < CORNERS; a++)
        for (int c = 0; c < 2; c++)
            u[2 * a + c] = nodal[corner[a] * 2 + c];
    for (int g = 0; g < CORNERS; g++) {
        double det = uz_quad4_gradients(grad, xy, UZ_QUAD4_GAUSS[g][0], UZ_QUAD4_GAUSS[g][1]);
        state->weight[g] = det * model->thickness;
        uz_quad4_strain(state->strain[g], (const double(*)[2])grad, u);
        uz_stress(state->stress[g], model->elasticity, state->strain[g]);
    }
}

/* Value at (x, y) in [-1, 1]^2 of the bilinear function with these corner values. */
static double bilinear(const double value[CORNERS], double x, double y)
{
    return 0.25 * ((1 - x) * (1 - y) * value[0] + (1 + x) * (1 - y) * value[1] + (1 + x) * (1 + y) * value[2] +
                   (1 - x) * (1 + y) * value[3]);
}

/* Adds the element's mean stress with its volume as weight. The mean is the stress at the centre, where that of a
 * quad4 is most accurate; stresses continued to the corners would bring the solution's own error back into the average
 * and hide a third of it. */
static void add_to_nodes(double *sum, double *volume, const element_state *state, const int64_t *corner)
{
    for (int a = 0; a < CORNERS; a++)
        for (int g = 0; g < CORNERS; g++) {
            volume[corner[a]] += state->weight[g];
            for (int s = 0; s < STRESSES; s++)
                sum[corner[a] * STRESSES + s] += state->weight[g] * state->stress[g][s];
        }
}

static void average_at_nodes(double *sum, double *volume, const uz_body_model *model, const double *nodal)
{
    element_state state;
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        evaluate(&state, model, nodal, e);
        add_to_nodes(sum, volume, &state, model->mesh.node + e * CORNERS);
    }
    for (int64_t a = 0; a < model->mesh.n_nodes; a++)
        for (int s = 0; s < STRESSES && volume[a] > 0; s++)
            sum[a * STRESSES + s] /= volume[a];
}

/* s' C^-1 s for the isotropic C = [[a, b, 0], [b, a, 0], [0, 0, g]]. */
static double complementary(const double C[9], const double s[STRESSES])
{
    const double mean = 0.5 * (s[0] + s[1]), half = 0.5 * (s[0] - s[1]);
    return 2 * mean * mean / (C[0] + C[1]) + 2 * half * half / (C[0] - C[1]) + s[2] * s[2] / C[8];
}

/* Adds one element's share of eta^2 and of ||u_h||^2. */
static void add_energies(double *eta2, double *energy2, const uz_body_model *model, const element_state *state,
                         const double *average, const int64_t *corner)
{
    for (int g = 0; g < CORNERS; g++) {
        double jump[STRESSES], work = 0;
        for (int s = 0; s < STRESSES; s++) {
            const double at_corner[CORNERS] = {average[corner[0] * STRESSES + s], average[corner[1] * STRESSES + s],
                                               average[corner[2] * STRESSES + s], average[corner[3] * STRESSES + s]};
            jump[s] = bilinear(at_corner, UZ_QUAD4_GAUSS[g][0], UZ_QUAD4_GAUSS[g][1]) - state->stress[g][s];
            work += state->stress[g][s] * state->strain[g][s];
        }
        *eta2 += state->weight[g] * complementary(model->elasticity, jump);
        *energy2 += state->weight[g] * work;
    }
}

double uz_estimate_discretization_error(const uz_body_model *model, const double *nodal)
{
    element_state state;
    double eta2 = 0, energy2 = 0;
    double *average = uz_alloc_zero(model->mesh.n_nodes * STRESSES, sizeof *average);
    double *volume = uz_alloc_zero(model->mesh.n_nodes, sizeof *volume);
    if (average && volume) {
        average_at_nodes(average, volume, model, nodal);
        for (int64_t e = 0; e < model->mesh.n_elements; e++) {
            evaluate(&state, model, nodal, e);
            add_energies(&eta2, &energy2, model, &state, average, model->mesh.node + e * CORNERS);
        }
    }
    free(average);
    free(volume);
    return energy2 > 0 ? sqrt(eta2 / (energy2 + eta2)) : NAN;
}
