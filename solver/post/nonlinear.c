/* nonlinear.c: what small deformation leaves out of an answer, told by the answer alone.
 *
 * With H the gradient of u, e and s its strain and stress of small deformation, the forces of large deformation at u do
 * the work  s : e(v)  +  C (H'H / 2) : e(v)  +  s : (H'grad v)  + ...  on v. Of what comes first after the linear part
 * the one is bounded by the energy norm of H'H / 2, the other is taken along u itself; what the law adds is as much of
 * the stress as H is large.
 *
 * All of this is in parts of the whole energy, and of a strip that is pressed or pulled along its axis that is nearly
 * all along the axis: what its stress does to how it bends aside is not seen. It is P / P_0 of that, P_0 the load that
 * buckles it where one end is free: a strain of pi^2 / 48 (h / L)^2 of a length L and a thickness h (Euler). The body
 * is taken for such a strip, of its own area along its diagonal, P is its mean stress, which of a body that only bends
 * is next to none, and what bends aside the part of the gradient that turns. From half of P_0 on it counts in any case.
 * Area in thin parts along the diagonal, as of a frame, is taken for a thicker strip. */
#include "post/balance.h"

#include "assembly/parts.h"

#include <math.h>

#define PI 3.14159265358979323846

typedef struct {
    double squares, along, law, turns, gradient; /* integrals */
    double stress[3], modulus;                   /* the same; xx, yy, xy */
} sums;

/* The least modulus of a strip, whatever its direction. */
static double strip_modulus(const uz_lame *lame)
{
    enum { DIRECTIONS = 24 };
    double softest = 0;
    if (!lame->general)
        return 4 * lame->mu * (lame->lambda + lame->mu) / (lame->lambda + 2 * lame->mu);
    for (int k = 0; k < DIRECTIONS; k++) {
        const double c = cos(PI * k / DIRECTIONS), s = sin(PI * k / DIRECTIONS), pull[3] = {c * c, s * s, c * s};
        softest = fmax(softest, uz_stress_work(UZ_PLANE_STRAIN, *lame, pull));
    }
    return 1 / softest;
}

static void add_point(sums *to, double weight, const uz_lame *lame, double H[2][2])
{
    double Q[3], e[3], of_Q[3], of_e[3], work[3] = {0}; /* xx, yy, xy; of C Q : Q, C e : Q, C e : e */
    for (int k = 0; k < 3; k++) {
        const int i = k == 1, j = k > 0;
        Q[k] = (k == 2 ? 2 : 1) * (H[0][i] * H[0][j] + H[1][i] * H[1][j]);
        e[k] = (k == 2 ? 1 : 0.5) * (H[i][j] + H[j][i]);
    }
    uz_elastic_stress(of_Q, UZ_PLANE_STRAIN, *lame, Q);
    uz_elastic_stress(of_e, UZ_PLANE_STRAIN, *lame, e);
    for (int k = 0; k < 3; k++) {
        work[0] += of_Q[k] * Q[k];
        work[1] += of_e[k] * Q[k];
        work[2] += of_e[k] * e[k];
    }
    const double size = H[0][0] * H[0][0] + H[0][1] * H[0][1] + H[1][0] * H[1][0] + H[1][1] * H[1][1];
    to->squares += 0.25 * weight * work[0];
    to->along += weight * work[1];
    to->gradient += weight * size;
    to->turns += 0.5 * weight * (H[1][0] - H[0][1]) * (H[1][0] - H[0][1]);
    for (int k = 0; k < 3; k++)
        to->stress[k] += weight * of_e[k];
    to->modulus += weight * strip_modulus(lame);
    to->law += weight * size * work[2];
}

double uz_least_buckling_strain(const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    double area = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        for (int a = 0; a < corners; a++) {
            const double *x = mesh->xyz + 2 * node[a], *y = mesh->xyz + 2 * node[(a + 1) % corners];
            area += 0.5 * (x[0] * y[1] - x[1] * y[0]);
        }
    }
    const double flat = area / (mesh->extent * mesh->extent);
    return 0.2 * flat * flat;
}

/* The mean stress along the axis in which it is most, as a strain. */
static double mean_strain(const sums *of)
{
    const double middle = 0.5 * (of->stress[0] + of->stress[1]), half = 0.5 * (of->stress[0] - of->stress[1]);
    return of->modulus > 0 ? (hypot(half, of->stress[2]) + fabs(middle)) / of->modulus : 0;
}

double uz_measure_nonlinear(const uz_body_model *model, const double *u, double energy)
{
    sums all = {0};
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        double xyz[3 * UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3];
        uz_element element;
        int nodes;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
        uz_body_element(&element, xyz, model, e);
        if (element.formulation != UZ_FORMULATION_STANDARD)
            return NAN;
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        for (int g = 0; g < rule->count; g++) {
            double H[2][2] = {{0}};
            const double measure = uz_element_gradients(grad, &element, rule->point[g].at);
            for (int a = 1; a < nodes; a++) /* from the first: a translation leaves no rounding */
                for (int i = 0; i < 2; i++)
                    for (int j = 0; j < 2; j++)
                        H[i][j] += (u[2 * node[a] + i] - u[2 * node[0] + i]) * grad[a][j];
            add_point(&all, rule->point[g].weight * measure * element.thickness, &element.lame, H);
        }
    }
    const double part = mean_strain(&all) / uz_least_buckling_strain(model);
    const double aside = all.gradient > 0 ? sqrt(all.turns / all.gradient) : 0;
    return fmax(part * fmax(2 * UZ_SURELY_SMALL, aside),
                (sqrt(all.squares) + sqrt(all.law)) / sqrt(2 * energy) + fabs(all.along) / (2 * energy));
}
