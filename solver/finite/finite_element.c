/* finite_element.c: internal forces and tangent of one element.
 *
 * With g_a the gradients of the shape functions before anything moves, F = I + sum_a u_a x g_a; the variation of E by
 * u_a is B_a = (F_i1 g_1, F_i2 g_2, z N / r, F_i1 g_2 + F_i2 g_1), the third of rings only, along the radius, with the
 * stretch z = 1 + u_r / r around; so that
 *     force_a = integral B_a'S,     K_ab = integral B_a' D B_b + (g_a . S g_b) I,
 * and along the radius S_zz N_a N_b / r^2 more.
 * A step d by this tangent takes a slender part that turns along its tangent, which lengthens it by a strain that it
 * does not have in the end, and whose stress is all that the next tangent would see. So K's second part has S of the
 * strain that the step was made for, E - h'h / 2 with h = grad d: what stress would be as an unknown of its own. At the
 * end, where steps are small, it is the same.
 * Sources: Bonet and Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", ch. 9; total Lagrangian form of
 * Bathe, "Finite Element Procedures", ch. 6; of the step: Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
 * Engrg. 313 (2017) 986-1005. */
#include "finite/finite_element.h"

#include "finite/hyperelastic.h"

#include <math.h>
#include <string.h>

enum { N_STRAINS = UZ_FINITE_STRAINS };

/* A point of an element: derivatives of shape functions, and N / r of rings; what an area stands for. */
typedef struct {
    double grad[UZ_ELEMENT_NODES][3], around[UZ_ELEMENT_NODES], depth, det;
    int nodes;
    bool ring;
} shape_at;

static void shape_of(shape_at *out, const uz_element *element, const double point[3])
{
    out->nodes = uz_element_node_count(element->kind);
    out->ring = element->model == UZ_AXISYMMETRIC;
    out->det = uz_element_gradients(out->grad, element, point);
    out->depth = uz_element_around(out->around, element, out->grad, point);
}

/* F in the plane and the stretch across it, which is 1 but in rings. */
static void deformation(double F[2][2], double *across, const shape_at *at, const double *u)
{
    *across = 1;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            F[i][j] = i == j;
            for (int a = 0; a < at->nodes; a++)
                F[i][j] += (u[2 * a + i] - u[i]) * at->grad[a][j]; /* a translation leaves no rounding */
        }
    for (int a = 0; a < at->nodes && at->ring; a++)
        *across += u[2 * a] * at->around[a];
}

/* det F, and not positive where one of the two is not: both may be negative of a ring that is turned inside out. */
static double orientation(double F[2][2], double across)
{
    const double plane = F[0][0] * F[1][1] - F[0][1] * F[1][0];
    return across > 0 ? plane * across : -fabs(plane * across);
}

static void cauchy_green(double C[N_STRAINS], double F[2][2], double across)
{
    C[0] = F[0][0] * F[0][0] + F[1][0] * F[1][0];
    C[1] = F[0][1] * F[0][1] + F[1][1] * F[1][1];
    C[2] = across * across;
    C[3] = F[0][0] * F[0][1] + F[1][0] * F[1][1];
}

static double least_det_at_corners(const uz_element *element, const double *u)
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    double least = INFINITY, F[2][2], across;
    shape_at at;
    for (int a = 0; a < type->corners; a++) {
        shape_of(&at, element, type->local[a]);
        deformation(F, &across, &at, u);
        least = fmin(least, orientation(F, across));
    }
    return least;
}

static void add_tangent(double *ke, double weight, double B[][N_STRAINS], double D[N_STRAINS][N_STRAINS],
                        const shape_at *at, const double *S)
{
    const int nodes = at->nodes, n = 2 * nodes;
    for (int p = 0; p < n; p++) {
        double DB[N_STRAINS];
        for (int i = 0; i < N_STRAINS; i++)
            DB[i] = weight * (D[i][0] * B[p][0] + D[i][1] * B[p][1] + D[i][2] * B[p][2] + D[i][3] * B[p][3]);
        for (int q = 0; q <= p; q++)
            ke[p * n + q] += DB[0] * B[q][0] + DB[1] * B[q][1] + DB[2] * B[q][2] + DB[3] * B[q][3];
    }
    for (int a = 0; a < nodes; a++) {
        const double t[2] = {weight * (S[0] * at->grad[a][0] + S[3] * at->grad[a][1]),
                             weight * (S[3] * at->grad[a][0] + S[1] * at->grad[a][1])};
        for (int b = 0; b <= a; b++)
            for (int i = 0; i < 2; i++)
                ke[(2 * a + i) * n + 2 * b + i] += t[0] * at->grad[b][0] + t[1] * at->grad[b][1];
        for (int b = 0; b <= a && at->ring; b++)
            ke[2 * a * n + 2 * b] += weight * S[2] * at->around[a] * at->around[b];
    }
}

/* S of the strain without h'h / 2. */
static void stress_before(double T[N_STRAINS], const double *S, double D[N_STRAINS][N_STRAINS], const shape_at *at,
                          const double *step)
{
    double h[2][2], across, q[N_STRAINS];
    deformation(h, &across, at, step);
    h[0][0] -= 1;
    h[1][1] -= 1;
    cauchy_green(q, h, across - 1);
    for (int i = 0; i < N_STRAINS; i++)
        T[i] = S[i] - 0.5 * (D[i][0] * q[0] + D[i][1] * q[1] + D[i][2] * q[2] + 2 * D[i][3] * q[3]);
}

bool uz_finite_element(uz_finite_forces *out, double *ke, const uz_element *element, uz_elasticity law, const double *u,
                       const double *step)
{
    const uz_gauss_rule *rule = uz_element_rule(element->kind, element->model);
    const int nodes = uz_element_node_count(element->kind), n = 2 * nodes;
    double F[2][2], across, B[2 * UZ_ELEMENT_NODES][N_STRAINS];
    shape_at at;
    memset(out, 0, sizeof *out);
    out->least_det = least_det_at_corners(element, u);
    if (ke)
        memset(ke, 0, (size_t)(n * n) * sizeof *ke);
    for (int g = 0; g < rule->count; g++) {
        double W, C[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS], T[N_STRAINS];
        shape_of(&at, element, rule->point[g].at);
        const double weight = rule->point[g].weight * at.det * at.depth;
        deformation(F, &across, &at, u);
        out->least_det = fmin(out->least_det, orientation(F, across));
        cauchy_green(C, F, across);
        if (!(out->least_det > 0) || !uz_hyperelastic(&W, S, D, law, element->lame.lambda, element->lame.mu, C))
            continue; /* the other points may be worse */
        out->energy += weight * W;
        for (int a = 0; a < nodes; a++)
            for (int i = 0; i < 2; i++) {
                double *b = B[2 * a + i];
                b[0] = F[i][0] * at.grad[a][0];
                b[1] = F[i][1] * at.grad[a][1];
                b[2] = i == 0 ? across * at.around[a] : 0;
                b[3] = F[i][0] * at.grad[a][1] + F[i][1] * at.grad[a][0];
                out->force[2 * a + i] += weight * (b[0] * S[0] + b[1] * S[1] + b[2] * S[2] + b[3] * S[3]);
            }
        if (ke && step)
            stress_before(T, S, D, &at, step);
        if (ke)
            add_tangent(ke, weight, B, D, &at, step ? T : S);
    }
    for (int p = 0; p < n && ke; p++)
        for (int q = 0; q < p; q++)
            ke[q * n + p] = ke[p * n + q];
    return out->least_det > 0;
}

void uz_finite_state_at(uz_finite_state *out, const uz_element *element, uz_elasticity law, const double *u,
                        const double point[3])
{
    double F[2][2], across, C[N_STRAINS], W, S[N_STRAINS], D[N_STRAINS][N_STRAINS];
    shape_at at;
    shape_of(&at, element, point);
    deformation(F, &across, &at, u);
    out->det = orientation(F, across);
    memcpy(out->F, F, sizeof out->F);
    cauchy_green(C, F, across);
    memcpy(out->strain, (double[4]){0.5 * (C[0] - 1), 0.5 * (C[1] - 1), 0.5 * (C[2] - 1), 0.5 * C[3]},
           sizeof out->strain);
    if (!(out->det > 0) || !uz_hyperelastic(&W, S, D, law, element->lame.lambda, element->lame.mu, C)) {
        for (int c = 0; c < 4; c++)
            out->stress[c] = NAN;
        return;
    }
    /* F S F' / J */
    const double full[2][2] = {{S[0], S[3]}, {S[3], S[1]}};
    double sigma[2][2] = {{0}};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 2; k++)
                for (int l = 0; l < 2; l++)
                    sigma[i][j] += F[i][k] * full[k][l] * F[j][l] / out->det;
    memcpy(out->stress, (double[4]){sigma[0][0], sigma[1][1], C[2] * S[2] / out->det, sigma[0][1]}, sizeof out->stress);
}
