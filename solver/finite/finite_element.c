/* finite_element.c: internal forces and tangent of one element.
 *
 * With g_a the gradients of the shape functions before anything moves, F = I + sum_a u_a x g_a; the variation of E by
 * u_a is B_a = (F_i1 g_1, F_i2 g_2, F_i3 g_3, F_i1 g_2 + F_i2 g_1, F_i2 g_3 + F_i3 g_2, F_i3 g_1 + F_i1 g_3); in the
 * plane the third is z N / r, of rings only, along the radius, with the stretch z = 1 + u_r / r around; so that
 *     force_a = integral B_a'S,     K_ab = integral B_a' D B_b + (g_a . S g_b) I,
 * and along the radius S_zz N_a N_b / r^2 more. In plane stress the stretch across the plane is that without stress
 * across it, at each point, and D what is left in the plane.
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

/* Steps to the stretch across the plane, when its square is there to rounding, and the least one that is looked for. */
enum { MOST_SETTLING = 60 };
#define SETTLED         1e-13
#define LEAST_THICKNESS 1e-8

/* A point of an element: derivatives of shape functions, and N / r of rings; what an area, of solids a volume, stands
 * for. n: components of strain. */
typedef struct {
    double grad[UZ_ELEMENT_NODES][3], around[UZ_ELEMENT_NODES], depth, det;
    int nodes, dim, n;
    bool ring;
} shape_at;

static void shape_of(shape_at *out, const uz_element *element, const double point[3])
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    out->nodes = type->nodes;
    out->dim = type->dim;
    out->n = type->dim == 2 ? UZ_FINITE_PLANE_STRAINS : UZ_FINITE_STRAINS;
    out->ring = element->model == UZ_AXISYMMETRIC;
    out->det = uz_element_gradients(out->grad, element, point);
    out->depth = uz_element_around(out->around, element, out->grad, point);
}

/* In the plane the last of F is the stretch across it, which is 1 but in rings. */
static void deformation(double F[3][3], const shape_at *at, const double *u)
{
    const int dim = at->dim;
    memset(F, 0, 9 * sizeof F[0][0]);
    for (int i = 0; i < 3; i++)
        F[i][i] = 1;
    for (int a = 0; a < at->nodes; a++)
        for (int i = 0; i < dim; i++) {
            const double way = u[dim * a + i] - u[i]; /* a translation leaves no rounding */
            for (int j = 0; j < dim; j++)
                F[i][j] += way * at->grad[a][j];
        }
    for (int a = 0; a < at->nodes && at->ring; a++)
        F[2][2] += u[2 * a] * at->around[a];
}

/* det F, and not positive where one of the two of a plane is not: both may be negative of a ring that is turned inside
 * out. */
static double orientation(double F[3][3], int dim)
{
    const double plane = F[0][0] * F[1][1] - F[0][1] * F[1][0], across = F[2][2];
    if (dim == 2)
        return across > 0 ? plane * across : -fabs(plane * across);
    return plane * across - F[0][0] * F[1][2] * F[2][1] + F[0][1] * F[1][2] * F[2][0] +
           F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
}

static void cauchy_green(double C[N_STRAINS], double F[3][3], int dim)
{
    static const int AXIS[N_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    for (int c = 0; c < N_STRAINS; c++) {
        const int i = AXIS[c][0], j = AXIS[c][1];
        C[c] = dim == 2 && c > 3 ? 0 : F[0][i] * F[0][j] + F[1][i] * F[1][j] + F[2][i] * F[2][j];
    }
}

/* ---- the law at a point */

/* Of C and F in plane stress the stretch across the plane at which there is no stress across it, from 1 on: C_zz by
 * Newton's method, S_zz growing with it, but not past a quarter or four times in a step. False: there is none. */
static bool settle_thickness(double *W, double S[N_STRAINS], double D[N_STRAINS][N_STRAINS], uz_elasticity law,
                             uz_lame lame, double C[N_STRAINS])
{
    bool settled = false;
    C[2] = 1;
    for (int k = 0; k <= MOST_SETTLING; k++) {
        if (!(C[2] > LEAST_THICKNESS && C[2] < 1 / LEAST_THICKNESS) ||
            !uz_hyperelastic(W, S, D, UZ_FINITE_PLANE_STRAINS, law, lame.lambda, lame.mu, C))
            return false;
        if (settled)
            return true;
        const double newton = D[2][2] > 0 ? C[2] - 2 * S[2] / D[2][2] : S[2] > 0 ? 0 : (double)INFINITY;
        const double next = fmin(4 * C[2], fmax(0.25 * C[2], newton));
        settled = fabs(next - C[2]) <= SETTLED * C[2];
        C[2] = next;
    }
    return false;
}

/* Energy, stress and tangent at C, and what F and C are across the plane where that follows from them: in plane stress
 * the tangent is that in the plane, condensed. */
static bool law_at(double *W, double S[N_STRAINS], double D[N_STRAINS][N_STRAINS], double F[3][3], double C[N_STRAINS],
                   const uz_element *element, uz_elasticity law, int n)
{
    const uz_lame lame = uz_lame_in_space(element->model, element->lame);
    if (element->model != UZ_PLANE_STRESS)
        return uz_hyperelastic(W, S, D, n, law, lame.lambda, lame.mu, C);
    if (!settle_thickness(W, S, D, law, lame, C))
        return false;
    F[2][2] = sqrt(C[2]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n && i != 2; j++)
            D[i][j] -= j == 2 ? 0 : D[i][2] * D[2][j] / D[2][2];
    for (int i = 0; i < n; i++)
        D[i][2] = D[2][i] = 0;
    S[2] = 0;
    return true;
}

static double least_det_at_corners(const uz_element *element, const double *u)
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    double least = INFINITY, F[3][3];
    shape_at at;
    for (int a = 0; a < type->corners; a++) {
        shape_of(&at, element, type->local[a]);
        deformation(F, &at, u);
        least = fmin(least, orientation(F, at.dim));
    }
    return least;
}

/* What a displacement of node a along axis i adds to E. */
static void add_strain_row(double b[N_STRAINS], const shape_at *at, double F[3][3], int a, int i)
{
    const double *g = at->grad[a], *f = F[i];
    b[0] = f[0] * g[0];
    b[1] = f[1] * g[1];
    b[3] = f[0] * g[1] + f[1] * g[0];
    if (at->dim == 2) {
        b[2] = i == 0 ? F[2][2] * at->around[a] : 0;
        return;
    }
    b[2] = f[2] * g[2];
    b[4] = f[1] * g[2] + f[2] * g[1];
    b[5] = f[2] * g[0] + f[0] * g[2];
}

static void add_material(double *ke, double weight, double B[][N_STRAINS], double D[N_STRAINS][N_STRAINS], int n,
                         int strains)
{
    for (int p = 0; p < n; p++) {
        double DB[N_STRAINS] = {0};
        for (int i = 0; i < strains; i++)
            for (int j = 0; j < strains; j++)
                DB[i] += weight * D[i][j] * B[p][j];
        if (strains == UZ_FINITE_PLANE_STRAINS)
            for (int q = 0; q <= p; q++)
                ke[p * n + q] += DB[0] * B[q][0] + DB[1] * B[q][1] + DB[2] * B[q][2] + DB[3] * B[q][3];
        else
            for (int q = 0; q <= p; q++)
                ke[p * n + q] += DB[0] * B[q][0] + DB[1] * B[q][1] + DB[2] * B[q][2] + DB[3] * B[q][3] +
                                 DB[4] * B[q][4] + DB[5] * B[q][5];
    }
}

/* What turns with the body. */
static void add_stress(double *ke, double weight, const shape_at *at, const double *S)
{
    const int nodes = at->nodes, dim = at->dim, n = dim * nodes;
    for (int a = 0; a < nodes; a++) {
        const double *g = at->grad[a];
        double t[3] = {weight * (S[0] * g[0] + S[3] * g[1]), weight * (S[3] * g[0] + S[1] * g[1]), 0};
        if (dim == 3) {
            t[0] += weight * S[5] * g[2];
            t[1] += weight * S[4] * g[2];
            t[2] = weight * (S[5] * g[0] + S[4] * g[1] + S[2] * g[2]);
        }
        for (int b = 0; b <= a; b++) {
            double sum = t[0] * at->grad[b][0] + t[1] * at->grad[b][1];
            sum += dim == 3 ? t[2] * at->grad[b][2] : 0;
            for (int i = 0; i < dim; i++)
                ke[(dim * a + i) * n + dim * b + i] += sum;
        }
        for (int b = 0; b <= a && at->ring; b++)
            ke[2 * a * n + 2 * b] += weight * S[2] * at->around[a] * at->around[b];
    }
}

/* S of the strain without h'h / 2. */
static void stress_before(double T[N_STRAINS], const double *S, double D[N_STRAINS][N_STRAINS], const shape_at *at,
                          const double *step)
{
    double h[3][3], q[N_STRAINS];
    deformation(h, at, step);
    for (int i = 0; i < 3; i++)
        h[i][i] -= 1;
    cauchy_green(q, h, at->dim);
    for (int i = 0; i < at->n; i++) {
        T[i] = S[i];
        for (int j = 0; j < at->n; j++)
            T[i] -= (j < 3 ? 0.5 : 1) * D[i][j] * q[j];
    }
}

bool uz_finite_element(uz_finite_forces *out, double *ke, const uz_element *element, uz_elasticity law, const double *u,
                       const double *step)
{
    const uz_gauss_rule *rule = uz_element_rule(element->kind, element->model);
    const uz_element_type *type = uz_element_type_of(element->kind);
    const int dim = type->dim, n = dim * type->nodes;
    double F[3][3], B[UZ_ELEMENT_DOFS][N_STRAINS];
    shape_at at;
    memset(out, 0, sizeof *out);
    out->least_det = least_det_at_corners(element, u);
    if (ke)
        memset(ke, 0, (size_t)(n * n) * sizeof *ke);
    for (int g = 0; g < rule->count; g++) {
        double W, C[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS], T[N_STRAINS];
        shape_of(&at, element, rule->point[g].at);
        const double weight = rule->point[g].weight * at.det * at.depth;
        deformation(F, &at, u);
        out->least_det = fmin(out->least_det, orientation(F, dim));
        cauchy_green(C, F, dim);
        if (!(out->least_det > 0) || !law_at(&W, S, D, F, C, element, law, at.n)) {
            out->least_det = fmin(out->least_det, 0); /* also where no stretch across a plane is without stress */
            continue;                                 /* the other points may be worse */
        }
        out->energy += weight * W;
        for (int p = 0; p < n; p++) {
            double work = 0;
            add_strain_row(B[p], &at, F, p / dim, p % dim);
            for (int c = 0; c < at.n; c++)
                work += B[p][c] * S[c];
            out->force[p] += weight * work;
        }
        if (ke && step)
            stress_before(T, S, D, &at, step);
        if (ke) {
            add_material(ke, weight, B, D, n, at.n);
            add_stress(ke, weight, &at, step ? T : S);
        }
    }
    for (int p = 0; p < n && ke; p++)
        for (int q = 0; q < p; q++)
            ke[q * n + p] = ke[p * n + q];
    return out->least_det > 0;
}

void uz_finite_state_at(uz_finite_state *out, const uz_element *element, uz_elasticity law, const double *u,
                        const double point[3])
{
    static const int AXIS[N_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    double F[3][3], C[N_STRAINS], W, S[N_STRAINS] = {0}, D[N_STRAINS][N_STRAINS];
    shape_at at;
    shape_of(&at, element, point);
    deformation(F, &at, u);
    out->det = orientation(F, at.dim);
    cauchy_green(C, F, at.dim);
    const bool good = out->det > 0 && law_at(&W, S, D, F, C, element, law, at.n);
    out->det = orientation(F, at.dim);
    for (int c = 0; c < N_STRAINS; c++)
        out->strain[c] = 0.5 * (C[c] - (c < 3));
    const double full[3][3] = {{S[0], S[3], S[5]}, {S[3], S[1], S[4]}, {S[5], S[4], S[2]}};
    for (int c = 0; c < N_STRAINS; c++) { /* F S F' / J */
        double sum = 0;
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++)
                sum += F[AXIS[c][0]][k] * full[k][l] * F[AXIS[c][1]][l];
        out->stress[c] = good ? sum / out->det : NAN;
    }
}
