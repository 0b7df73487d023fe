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
 * body is taken for such a strip, of its own area along its diagonal, a solid for the brick that has its moments of
 * inertia, P is its mean stress, which of a body that only bends is next to none, and what bends aside the part of the
 * gradient that turns. From half of P_0 on it counts in any case. Area in thin parts along the diagonal, as of a frame,
 * is taken for a thicker strip. */
#include "post/balance.h"

#include "assembly/parts.h"
#include "post/parts.h"

#include <math.h>

#define PI 3.14159265358979323846

enum { N = UZ_ELEMENT_STRESSES };
/* Axes of the components of a symmetric matrix, xx yy zz xy yz zx, and which of these strains of a model are. */
static const int AXIS[N][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
static const int PLANE[N] = {0, 1, 3}, SPACE[N] = {0, 1, 2, 3, 4, 5};

typedef struct {
    uz_model model;
    const int *part;                             /* of AXIS, by component of strain */
    double squares, along, law, turns, gradient; /* integrals */
    double stress[N], modulus;                   /* the same; stress by AXIS */
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

static void add_point(sums *to, double weight, const uz_lame *lame, double H[3][3])
{
    double Q[N], e[N], of_Q[N], of_e[N], work[3] = {0}, size = 0; /* work: of C Q : Q, C e : Q, C e : e */
    const int n = uz_stress_count(to->model);
    for (int k = 0; k < n; k++) {
        const int i = AXIS[to->part[k]][0], j = AXIS[to->part[k]][1];
        Q[k] = (i == j ? 1 : 2) * (H[0][i] * H[0][j] + H[1][i] * H[1][j] + H[2][i] * H[2][j]);
        e[k] = (i == j ? 0.5 : 1) * (H[i][j] + H[j][i]);
    }
    uz_elastic_stress(of_Q, to->model, *lame, Q);
    uz_elastic_stress(of_e, to->model, *lame, e);
    const double across = uz_strain_zz(to->model, *lame, of_e, 0);
    for (int k = 0; k < n; k++) {
        work[0] += of_Q[k] * Q[k];
        work[1] += of_e[k] * Q[k];
        work[2] += of_e[k] * e[k];
    }
    for (int i = 0; i < 3; i++) {
        const double turn = H[(i + 1) % 3][i] - H[i][(i + 1) % 3];
        to->turns += 0.5 * weight * turn * turn;
        for (int j = 0; j < 3; j++)
            size += H[i][j] * H[i][j];
    }
    size += across * across;
    to->squares += 0.25 * weight * work[0];
    to->along += weight * work[1];
    to->gradient += weight * size;
    for (int k = 0; k < n; k++)
        to->stress[to->part[k]] += weight * of_e[k];
    to->modulus += weight * strip_modulus(to->model, lame);
    to->law += weight * size * work[2];
}

/* (h / L)^2 of a plane body. */
static double flatness_in_plane(const uz_mesh *mesh)
{
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
    return flat * flat;
}

/* The same of a solid: the least of its moments of second order over the largest one, of each element by its corners
 * and its volume, as they are of a parallelepiped, a tetrahedron, about so of a prism. */
static double flatness_in_space(const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    double volume = 0, first[3] = {0}, second[N] = {0}, principal[3];
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        double xyz[3 * UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], amid[3] = {0}, weight = 0, mean[3] = {0};
        uz_element element;
        uz_body_element(&element, xyz, model, e);
        const int corners = uz_element_type_of(element.kind)->corners;
        const double share = (corners == 8 ? 1 / 3.0 : corners == 4 ? 0.2 : 0.25) / corners;
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        for (int g = 0; g < rule->count; g++) {
            weight += rule->point[g].weight;
            for (int c = 0; c < 3; c++)
                amid[c] += rule->point[g].at[c] / rule->count;
        }
        weight *= uz_element_gradients(grad, &element, amid);
        for (int a = 0; a < corners; a++)
            for (int c = 0; c < 3; c++)
                mean[c] += (xyz[3 * a + c] - mesh->xyz[c]) / corners; /* from the first node */
        volume += weight;
        for (int c = 0; c < 3; c++)
            first[c] += weight * mean[c];
        for (int k = 0; k < N; k++) {
            const int i = AXIS[k][0], j = AXIS[k][1];
            double own = 0;
            for (int a = 0; a < corners; a++)
                own += share * (xyz[3 * a + i] - mesh->xyz[i] - mean[i]) * (xyz[3 * a + j] - mesh->xyz[j] - mean[j]);
            second[k] += weight * (mean[i] * mean[j] + own);
        }
    }
    for (int k = 0; k < N; k++)
        second[k] -= first[AXIS[k][0]] * first[AXIS[k][1]] / volume;
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
    double principal[3];
    uz_principal(principal, of->stress, N);
    return of->modulus > 0 ? fmax(fabs(principal[0]), fabs(principal[2])) / of->modulus : 0;
}

double uz_measure_nonlinear(const uz_body_model *model, const double *u, double energy)
{
    const int dim = model->mesh.dim;
    sums all = {.model = model->kind, .part = uz_stress_count(model->kind) == 3 ? PLANE : SPACE};
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        double xyz[3 * UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], around[UZ_ELEMENT_NODES];
        uz_element element;
        int nodes;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
        uz_body_element(&element, xyz, model, e);
        if (element.formulation != UZ_FORMULATION_STANDARD)
            return NAN;
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        for (int g = 0; g < rule->count; g++) {
            double H[3][3] = {{0}};
            const double det = uz_element_gradients(grad, &element, rule->point[g].at);
            const double depth = uz_element_around(around, &element, grad, rule->point[g].at);
            for (int a = 0; a < nodes; a++) { /* from the first: a translation leaves no rounding */
                for (int i = 0; i < dim; i++)
                    for (int j = 0; j < dim; j++)
                        H[i][j] += (u[dim * node[a] + i] - u[dim * node[0] + i]) * grad[a][j];
                H[2][2] += model->kind == UZ_AXISYMMETRIC ? u[dim * node[a]] * around[a] : 0;
            }
            add_point(&all, rule->point[g].weight * det * depth, &element.lame, H);
        }
    }
    const double part = mean_strain(&all) / uz_least_buckling_strain(model);
    const double aside = all.gradient > 0 ? sqrt(all.turns / all.gradient) : 0;
    return fmax(part * fmax(2 * UZ_SURELY_SMALL, aside),
                (sqrt(all.squares) + sqrt(all.law)) / sqrt(2 * energy) + fabs(all.along) / (2 * energy));
}
