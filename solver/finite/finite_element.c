/* finite_element.c: internal forces and tangent of one element.
 *
 * With g_a the gradients of the shape functions before anything moves, F = I + sum_a u_a x g_a, P = F S the forces per
 * undeformed area and A = dP/dF, A_iJkL = F_iM D_MJNL F_kN + S_JL (i = k), D = dS/dE of the law:
 *     force_a = integral P g_a,     K_ab = integral g_a A g_b,
 * which takes half of the products that B'D B and the part of the stress take each by itself. Around a ring the stretch
 * is 1 + u_r / r, another F with N / r as its gradient. In plane stress the stretch across the plane is that without
 * stress across it, at each point, and D what is left in the plane.
 * What concerns points stands in lanes by four of them, what concerns pairs of nodes by four nodes.
 * A step d by this tangent takes a slender part that turns along its tangent, which lengthens it by a strain that it
 * does not have in the end, and whose stress is all that the next tangent would see. So K's second part has S of the
 * strain that the step was made for, E - h'h / 2 with h = grad d: what stress would be as an unknown of its own. At the
 * end, where steps are small, it is the same.
 * With mean dilatation (mean_dilatation.h) the stress at a point and its derivative have what the mean's pressure does
 * there, and the tangent has two more terms, of rank two together.
 * Sources: Bonet and Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", ch. 9; total Lagrangian form of
 * Bathe, "Finite Element Procedures", ch. 6; of the step: Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
 * Engrg. 313 (2017) 986-1005. */
#include "finite/finite_element.h"

#include "core/cpu.h"
#include "finite/hyperelastic_lanes.h"
#include "finite/mean_dilatation.h"
#include "finite/point_lanes.h"

#include <math.h>

/* NODES: the most, by fours; AROUND: the derivative of what is around the axis, after those in the plane. */
enum { N_STRAINS = UZ_FINITE_STRAINS, LANES = UZ_FINITE_LANES, POINTS = UZ_FINITE_POINTS, AROUND = 4 };
typedef uz_four four;

/* Steps to the stretch across the plane, when its square is there to rounding, and the least one that is looked for. */
enum { MOST_SETTLING = 60 };
#define SETTLED         1e-13
#define LEAST_THICKNESS 1e-8

/* ---- at all points, four at a time */

/* F of four points; across: what warmth adds to it there. */
UZ_INLINE void deformations(four F[3][3], uz_gradients H, int p, double across, int dim, bool ring)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            F[i][j] = (four){0} + (i == j);
            if ((i < dim && j < dim) || (ring && i + j == 4))
                F[i][j] += *uz_four_from(&H[i][j][p]);
        }
    F[2][2] += across;
}

/* In the plane the last of F is the stretch across it, which is 1 but in rings, and where the element is warm. */
UZ_INLINE void deformation(double F[3][3], uz_gradients H, int p, int dim, bool ring)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            F[i][j] = (i == j) + ((i < dim && j < dim) || (ring && i + j == 4) ? H[i][j][p] : 0);
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

/* Of the components of a strain. */
static const int AXIS[N_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

static void cauchy_green(double C[N_STRAINS], double F[3][3], int dim)
{
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
 * the tangent is that in the plane, condensed. D NULL: the tangent is not wanted, nor needed, as it is in plane stress.
 */
static bool law_at(double *W, double S[N_STRAINS], double D[N_STRAINS][N_STRAINS], double F[3][3], double C[N_STRAINS],
                   uz_model model, uz_lame lame, uz_elasticity law)
{
    const int n = model == UZ_SOLID ? N_STRAINS : UZ_FINITE_PLANE_STRAINS;
    if (model != UZ_PLANE_STRESS)
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

/* What a law says at Gauss points. */
typedef struct {
    double W[POINTS], S[N_STRAINS][POINTS], D[N_STRAINS][N_STRAINS][POINTS];
} law_points;

/* What mean dilatation adds: of the element the mean theta of det F, the directions that it is shared by, the volume
 * and, as `slope`, by how much the mean's pressure grows with theta; of Gauss points what C is multiplied by, and the
 * derivatives of det F (`along`) and of that pressure (`cross`) by strains. */
typedef struct {
    int n;
    double theta, volume, slope, det[POINTS], ratio[POINTS], along[N_STRAINS][POINTS], cross[N_STRAINS][POINTS];
} mean_points;

/* F'F of four points. */
UZ_INLINE void cauchy_greens(four C[N_STRAINS], four F[3][3], int dim)
{
    for (int c = 0; c < N_STRAINS; c++) {
        const int i = AXIS[c][0], j = AXIS[c][1];
        C[c] = (four){0};
        for (int k = 0; k < 3 && (dim == 3 || c < UZ_FINITE_PLANE_STRAINS); k++)
            C[c] += F[k][i] * F[k][j];
    }
}

/* At all Gauss points, but of plane stress, whose F is not known across the plane. mean: the law is that of C with the
 * mean dilatation; NULL: its own. False: det C <= 0 at one. */
UZ_INLINE bool find_laws(law_points *out, const mean_points *mean, const uz_finite_rule *rule, uz_gradients H,
                         double across, bool tangent, uz_elasticity law, uz_lame lame, int dim, bool ring)
{
    const int n = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
    for (int p = 0; p < rule->gauss; p += LANES) {
        bool good;
        four F[3][3], C[N_STRAINS], W, S[N_STRAINS], D[N_STRAINS][N_STRAINS];
        deformations(F, H, p, across, dim, ring);
        cauchy_greens(C, F, dim);
        for (int c = 0; c < n && mean; c++)
            if (c != 2 || dim == 3 || ring)
                C[c] *= *uz_four_from(&mean->ratio[p]);
        const int count = rule->gauss - p < LANES ? rule->gauss - p : LANES;
        uz_law_in_lanes(&good, &W, S, tangent ? D : NULL, n, count, law, lame.lambda, lame.mu, C);
        if (!good)
            return false;
        *uz_four_at(&out->W[p]) = W;
        for (int i = 0; i < n; i++) {
            *uz_four_at(&out->S[i][p]) = S[i];
            for (int j = 0; j < n && tangent; j++)
                *uz_four_at(&out->D[i][j][p]) = D[i][j];
        }
    }
    return true;
}

/* det F at four points. */
UZ_INLINE void determinants(four *det, four F[3][3], int dim)
{
    *det = F[0][0] * F[1][1] - F[0][1] * F[1][0];
    *det *= F[2][2];
    if (dim == 3)
        *det += F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]) - F[0][0] * F[1][2] * F[2][1] +
                F[0][1] * F[1][2] * F[2][0];
}

/* The mean of det F, which is positive at all points, and what C is multiplied by to have it. */
UZ_INLINE void find_mean(mean_points *out, const uz_finite_rule *rule, uz_gradients H, const uz_rest *at, double across,
                         int dim, bool ring)
{
    double sum = 0;
    out->n = dim == 3 || ring ? 3 : 2;
    out->volume = 0;
    for (int p = 0; p < rule->gauss; p += LANES) {
        four F[3][3];
        deformations(F, H, p, across, dim, ring);
        determinants(uz_four_at(&out->det[p]), F, dim);
    }
    for (int g = 0; g < rule->gauss; g++) {
        sum += at->volume[g] * out->det[g];
        out->volume += at->volume[g];
    }
    out->theta = sum / out->volume;
    for (int p = 0; p < rule->gauss; p += LANES)
        for (int l = p; l < p + LANES; l++) {
            const double part = out->theta / out->det[l], root = out->n == 3 ? cbrt(part) : 1;
            out->ratio[l] = out->n == 3 ? root * root : part;
        }
}

/* The law's stress and tangent at C with the mean dilatation become those at C and, with the pressure of the mean,
 * those of the element's energy by C. */
UZ_INLINE void spread_mean(law_points *laws, mean_points *mean, const uz_finite_rule *rule, uz_gradients H,
                           const uz_rest *at, double across, bool tangent, int dim, bool ring)
{
    const int n = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
    double pressure = 0, slope = 0;
    for (int p = 0; p < rule->gauss; p += LANES) {
        four F[3][3], C[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS];
        uz_mean_law x = {.theta = mean->theta, .n = mean->n};
        deformations(F, H, p, across, dim, ring);
        cauchy_greens(C, F, dim);
        for (int i = 0; i < n; i++) {
            S[i] = *uz_four_from(&laws->S[i][p]);
            for (int j = 0; j < n && tangent; j++)
                D[i][j] = *uz_four_from(&laws->D[i][j][p]);
        }
        uz_mean_law_of(&x, S, tangent ? D : NULL, C, uz_four_from(&mean->ratio[p]), n);
        for (int i = 0; i < n; i++) {
            *uz_four_at(&laws->S[i][p]) = S[i];
            *uz_four_at(&mean->along[i][p]) = *uz_four_from(&mean->det[p]) * x.B[i];
            for (int j = 0; j < n && tangent; j++)
                *uz_four_at(&laws->D[i][j][p]) = D[i][j];
            if (tangent)
                *uz_four_at(&mean->cross[i][p]) = x.cross[i];
        }
        for (int g = p; g < p + LANES && g < rule->gauss; g++) {
            pressure += at->volume[g] * x.pressure[g - p];
            slope += tangent ? at->volume[g] * x.slope[g - p] : 0;
        }
    }
    mean->slope = slope / mean->volume;
    pressure /= mean->volume;
    for (int p = 0; p < rule->gauss; p += LANES) {
        four B[N_STRAINS], change[N_STRAINS][N_STRAINS];
        const four det = *uz_four_from(&mean->det[p]);
        for (int i = 0; i < n; i++) {
            const four along = *uz_four_from(&mean->along[i][p]);
            B[i] = along / det;
            *uz_four_at(&laws->S[i][p]) += pressure * along;
        }
        if (tangent)
            uz_mean_change(change, B, n);
        for (int i = 0; i < n && tangent; i++)
            for (int j = 0; j < n; j++)
                *uz_four_at(&laws->D[i][j][p]) += pressure * det * change[i][j];
    }
}

/* The same of plane stress, point by point; false also where no stretch across the plane is without stress. */
static bool settle_laws(law_points *out, const uz_finite_rule *rule, uz_gradients H, uz_elasticity law, uz_lame lame)
{
    for (int g = 0; g < rule->gauss; g++) {
        double F[3][3], C[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS];
        deformation(F, H, g, 2, false);
        cauchy_green(C, F, 2);
        if (!law_at(&out->W[g], S, D, F, C, UZ_PLANE_STRESS, lame, law))
            return false;
        for (int i = 0; i < UZ_FINITE_PLANE_STRAINS; i++) {
            out->S[i][g] = S[i];
            for (int j = 0; j < UZ_FINITE_PLANE_STRAINS; j++)
                out->D[i][j][g] = D[i][j];
        }
    }
    return true;
}

/* The least of what orientation says of each point. */
UZ_INLINE void look_at_orientation(double *least, const uz_finite_rule *rule, uz_gradients H, double across, int dim,
                                   bool ring)
{
    for (int p = 0; p < rule->points; p += LANES) {
        four F[3][3];
        deformations(F, H, p, across, dim, ring);
        four det;
        determinants(&det, F, dim);
        for (int l = 0; l < LANES && p + l < rule->points; l++) {
            const double own = dim == 3 || F[2][2][l] > 0 ? det[l] : -fabs(det[l]);
            *least = own < *least ? own : *least;
        }
    }
}

/* ---- one point */

/* Which component of a strain is that of two axes. */
static const int COMPONENT[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

/* Of Gauss points: G[axis][node], derivatives of the shape functions by places, and N / r of rings as [3]; and
 * A[i dim + J][k dim + L], the derivative of the forces per area P_iJ by F_kL with the point's volume, of rings with
 * those around as AROUND. */
enum { COMPONENTS = 9, PADDED = 12 };
typedef struct {
    double G[UZ_ELEMENT_GAUSS][4][UZ_ELEMENT_NODES];
    double A[UZ_ELEMENT_GAUSS][COMPONENTS][PADDED];
} points;

UZ_INLINE void slopes_of_nodes(points *out, const uz_finite_rule *rule, const uz_rest *at, int p, int dim, int wide,
                               bool ring)
{
    double(*G)[UZ_ELEMENT_NODES] = out->G[p];
    for (int w = 0; w < LANES * wide; w += LANES) {
        for (int j = 0; j < dim; j++) {
            four sum = *uz_four_from(&rule->at_nodes[p][0][w]) * at->inverse[0][j][p];
            for (int i = 1; i < dim; i++)
                sum += *uz_four_from(&rule->at_nodes[p][i][w]) * at->inverse[i][j][p];
            *uz_four_at(&G[j][w]) = sum;
        }
        if (ring && at->per_radius[p] > 0)
            *uz_four_at(&G[3][w]) = *uz_four_from(&rule->at_nodes[p][3][w]) * at->per_radius[p];
        else if (ring)
            *uz_four_at(&G[3][w]) = *uz_four_from(&G[0][w]);
    }
}

/* force[axis][node]: what the stress does, P = F S: of each point Q = P by local coordinates, times the slopes by
 * these. */
UZ_INLINE void find_forces(four force[3][UZ_ELEMENT_NODES / LANES], const double (*S)[POINTS],
                           const uz_finite_rule *rule, uz_gradients H, const uz_rest *at, double across, int dim,
                           int wide, bool ring)
{
    for (int i = 0; i < dim; i++)
        for (int w = 0; w < wide; w++)
            force[i][w] = (four){0};
    for (int p = 0; p < rule->gauss; p += LANES) {
        four F[3][3], P[3][3], around = {0};
        const four volume = *uz_four_from(&at->volume[p]);
        deformations(F, H, p, across, dim, ring);
        for (int i = 0; i < dim; i++) {
            for (int J = 0; J < dim; J++) {
                P[i][J] = F[i][0] * *uz_four_from(&S[COMPONENT[J][0]][p]);
                for (int M = 1; M < dim; M++)
                    P[i][J] += F[i][M] * *uz_four_from(&S[COMPONENT[J][M]][p]);
            }
            if (ring && i == 0) { /* on the axis u_r / r is the derivative along r */
                const four hoop = F[2][2] * *uz_four_from(&S[2][p]), per_radius = *uz_four_from(&at->per_radius[p]);
                around = volume * hoop * per_radius;
                four along = hoop;
                for (int l = 0; l < LANES; l++)
                    along[l] = per_radius[l] > 0 ? 0 : along[l];
                P[i][0] += along;
            }
        }
        uz_add_to_nodes(force, P, volume, around, rule, at, p, dim, ring);
    }
}

/* A_iJkL = F_iM D_JMLN F_kN + T_JL (i = k), T the stress that turns with the body. */
UZ_INLINE void moduli(double A[COMPONENTS][PADDED], double F[3][3], double D[N_STRAINS][N_STRAINS], const double *T,
                      double volume, int dim, bool ring)
{
    double DF[N_STRAINS][PADDED] = {{0}};
    const int strains = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
    const int used = dim == 3 ? 12 : ring ? 8 : 4; /* of PADDED */
    for (int c = 0; c < strains; c++) {
        for (int k = 0; k < dim; k++)
            for (int L = 0; L < dim; L++)
                for (int N = 0; N < dim; N++)
                    DF[c][k * dim + L] += volume * D[c][COMPONENT[L][N]] * F[k][N];
        if (ring)
            DF[c][AROUND] = volume * D[c][2] * F[2][2];
    }
    for (int i = 0; i < dim; i++)
        for (int J = 0; J < dim; J++) {
            double *row = A[i * dim + J];
            for (int v = 0; v < used; v += LANES) {
                four sum = {0};
                for (int M = 0; M < dim; M++)
                    sum += F[i][M] * *uz_four_from(&DF[COMPONENT[J][M]][v]);
                *uz_four_at(&row[v]) = sum;
            }
            for (int L = 0; L < dim; L++)
                row[i * dim + L] += volume * T[COMPONENT[J][L]];
        }
    for (int v = 0; v < used && ring; v++)
        A[AROUND][v] = F[2][2] * DF[2][v] + (v == AROUND ? volume * T[2] : 0);
}

/* h'h / 2 at a point. */
UZ_INLINE void strain_left(double q[N_STRAINS], uz_gradients of_step, int p, int dim, bool ring)
{
    double h[3][3];
    deformation(h, of_step, p, dim, ring);
    for (int i = 0; i < 3; i++)
        h[i][i] -= 1;
    cauchy_green(q, h, dim);
    for (int i = 0; i < 3; i++)
        q[i] *= 0.5;
}

/* S of the strain without h'h / 2. */
UZ_INLINE void stress_before(double T[N_STRAINS], const double *S, double D[N_STRAINS][N_STRAINS], uz_gradients of_step,
                             int p, int dim, bool ring)
{
    double q[N_STRAINS];
    const int n = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
    strain_left(q, of_step, p, dim, ring);
    for (int i = 0; i < n; i++) {
        T[i] = S[i];
        for (int j = 0; j < n; j++)
            T[i] -= D[i][j] * q[j];
    }
}

/* How the strains h'h / 2 of all points change the mean of det F, and its pressure. */
UZ_INLINE void mean_left(double *theta, double *pressure, const mean_points *mean, const uz_finite_rule *rule,
                         const uz_rest *at, uz_gradients of_step, int dim, bool ring)
{
    const int n = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
    double sum[2] = {0};
    for (int g = 0; g < rule->gauss; g++) {
        double q[N_STRAINS];
        strain_left(q, of_step, g, dim, ring);
        for (int i = 0; i < n; i++) {
            sum[0] += at->volume[g] * mean->along[i][g] * q[i];
            sum[1] += at->volume[g] * mean->cross[i][g] * q[i];
        }
    }
    *theta = sum[0] / mean->volume;
    *pressure = sum[1] / mean->volume + mean->slope * *theta;
}

/* ---- the tangent */

/* Rows of node a along `rows` axes from i on, of nodes from the group `first` of four on: K = integral g_a A g_b. */
UZ_INLINE void add_rows(double *ke, const points *at, const uz_finite_rule *rule, int a, int i, int rows, int first,
                        int dim, int wide, bool ring)
{
    four sum[2][3][UZ_ELEMENT_NODES / LANES];
    const int n = dim * rule->nodes, used = dim == 3 ? 12 : ring ? 8 : 4;
    for (int r = 0; r < rows; r++)
        for (int k = 0; k < dim; k++)
            for (int w = first; w < wide; w++)
                sum[r][k][w] = (four){0};
    for (int g = 0; g < rule->gauss; g++) {
        double t[2][PADDED];
        for (int r = 0; r < rows; r++)
            for (int v = 0; v < used; v += LANES) {
                four by = at->G[g][0][a] * *uz_four_from(&at->A[g][(i + r) * dim][v]);
                for (int J = 1; J < dim; J++)
                    by += at->G[g][J][a] * *uz_four_from(&at->A[g][(i + r) * dim + J][v]);
                if (ring && i + r == 0)
                    by += at->G[g][3][a] * *uz_four_from(&at->A[g][AROUND][v]);
                *uz_four_at(&t[r][v]) = by;
            }
        for (int w = first; w < wide; w++)
            for (int r = 0; r < rows; r++)
                for (int k = 0; k < dim; k++) {
                    for (int L = 0; L < dim; L++)
                        sum[r][k][w] += t[r][k * dim + L] * *uz_four_from(&at->G[g][L][LANES * w]);
                    if (ring && k == 0)
                        sum[r][k][w] += t[r][AROUND] * *uz_four_from(&at->G[g][3][LANES * w]);
                }
    }
    for (int r = 0; r < rows; r++) {
        double *row = ke + (dim * a + i + r) * n;
        for (int w = first; w < wide; w++)
            if (dim == 2 && LANES * (w + 1) <= rule->nodes) { /* (x, y) of each node */
                const four x = sum[r][0][w], y = sum[r][1][w];
                *uz_four_at(&row[2 * LANES * w]) = (four){x[0], y[0], x[1], y[1]};
                *uz_four_at(&row[2 * LANES * w + LANES]) = (four){x[2], y[2], x[3], y[3]};
            } else {
                for (int lane = 0; lane < LANES && LANES * w + lane < rule->nodes; lane++)
                    for (int k = 0; k < dim; k++)
                        row[dim * (LANES * w + lane) + k] = sum[r][k][w][lane];
            }
    }
}

/* Rows of four nodes, from `first` fours on. */
UZ_INLINE void add_four(double *ke, const points *at, const uz_finite_rule *rule, int first, int dim, int wide,
                        bool ring)
{
    const int rows = dim == 2 ? 2 : 1; /* what registers hold */
    for (int a = LANES * first; a < LANES * (first + 1) && a < rule->nodes; a++)
        for (int i = 0; i < dim; i += rows)
            add_rows(ke, at, rule, a, i, rows, first, dim, wide, ring);
}

UZ_INLINE void tangent_of(double *ke, const points *at, const uz_finite_rule *rule, int dim, int wide, bool ring)
{
    const int n = dim * rule->nodes, group = dim * LANES;
    add_four(ke, at, rule, 0, dim, wide, ring); /* each by itself: sums stay in registers where it is a constant */
    if (wide > 1)
        add_four(ke, at, rule, 1, dim, wide, ring);
    if (wide > 2)
        add_four(ke, at, rule, 2, dim, wide, ring);
    if (wide > 3)
        add_four(ke, at, rule, 3, dim, wide, ring);
    if (wide > 4)
        add_four(ke, at, rule, 4, dim, wide, ring);
    for (int p = 0; p < n; p++) { /* within fours the later row counts, which saw all that the earlier one did */
        for (int q = p + 1; q < n && q < (p / group + 1) * group; q++)
            ke[p * n + q] = ke[q * n + p];
        for (int q = (p / group + 1) * group; q < n; q++)
            ke[q * n + p] = ke[p * n + q];
    }
}

/* With g the derivative of the mean of det F by nodes, a that of its pressure at the same mean: g (a + slope g)' and
 * its transpose, by the volume. */
UZ_INLINE void add_mean(double *ke, const mean_points *mean, const uz_finite_rule *rule, uz_gradients H,
                        const uz_rest *at, double across, int dim, int wide, bool ring)
{
    four by[2][3][UZ_ELEMENT_NODES / LANES];
    double g[UZ_ELEMENT_DOFS], a[UZ_ELEMENT_DOFS];
    const int n = dim * rule->nodes;
    find_forces(by[0], mean->along, rule, H, at, across, dim, wide, ring);
    find_forces(by[1], mean->cross, rule, H, at, across, dim, wide, ring);
    for (int i = 0; i < n; i++) {
        const int node = i / dim, c = i % dim;
        g[i] = by[0][c][node / LANES][node % LANES] / mean->volume;
        a[i] = by[1][c][node / LANES][node % LANES] + 0.5 * mean->slope * mean->volume * g[i];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            ke[i * n + j] += g[i] * a[j] + a[i] * g[j];
}

/* ---- an element */

typedef struct {
    uz_finite_forces *out;
    double *ke;
    const uz_finite_rule *rule;
    const uz_element *element;
    uz_elasticity law;
    const double *u, *step;
    bool forces;
} task;

/* wide: nodes by fours. */
UZ_INLINE bool evaluate(const task *x, int dim, int wide, bool ring)
{
    const uz_finite_rule *rule = x->rule;
    uz_finite_forces *out = x->out;
    uz_rest rest;
    uz_gradients H, of_step;
    law_points laws;
    mean_points mean;
    points at;
    double theta = 0, pressure = 0;
    four force[3][UZ_ELEMENT_NODES / LANES];
    const uz_model model = x->element->model;
    const uz_lame lame = uz_lame_in_space(model, x->element->lame);
    /* of elements of these sizes alone */
    const bool averaged = wide == dim - 1 && x->element->formulation == UZ_FORMULATION_BBAR;
    uz_rest_of(&rest, rule, x->element, dim, ring);
    uz_find_gradients(H, rule, &rest, x->u, dim, ring);
    if (x->ke && x->step)
        uz_find_gradients(of_step, rule, &rest, x->step, dim, ring);
    const double across = dim == 2 && !ring ? x->element->across : 0;
    look_at_orientation(&out->least_det, rule, H, across, dim, ring);
    if (out->least_det > 0 && averaged)
        find_mean(&mean, rule, H, &rest, across, dim, ring);
    if (!(out->least_det > 0) || !(model == UZ_PLANE_STRESS ? settle_laws(&laws, rule, H, x->law, lame)
                                                            : find_laws(&laws, averaged ? &mean : NULL, rule, H, across,
                                                                        x->ke, x->law, lame, dim, ring))) {
        out->least_det = fmin(out->least_det, 0);
        return false;
    }
    if (averaged)
        spread_mean(&laws, &mean, rule, H, &rest, across, x->ke, dim, ring);
    if (averaged && x->ke && x->step)
        mean_left(&theta, &pressure, &mean, rule, &rest, of_step, dim, ring);
    if (x->forces)
        find_forces(force, laws.S, rule, H, &rest, across, dim, wide, ring);
    for (int g = 0; g < rule->gauss; g++)
        out->energy += rest.volume[g] * laws.W[g];
    for (int g = 0; g < rule->gauss && x->ke; g++) {
        const int n = dim == 2 ? UZ_FINITE_PLANE_STRAINS : N_STRAINS;
        double F[3][3], S[N_STRAINS], D[N_STRAINS][N_STRAINS], T[N_STRAINS];
        deformation(F, H, g, dim, ring);
        F[2][2] += across;
        for (int i = 0; i < n; i++) {
            S[i] = laws.S[i][g];
            for (int j = 0; j < n; j++)
                D[i][j] = laws.D[i][j][g];
        }
        slopes_of_nodes(&at, rule, &rest, g, dim, wide, ring);
        if (x->step)
            stress_before(T, S, D, of_step, g, dim, ring);
        for (int i = 0; i < n && averaged && x->step; i++)
            T[i] -= mean.cross[i][g] * theta + mean.along[i][g] * pressure;
        moduli(at.A[g], F, D, x->step ? T : S, rest.volume[g], dim, ring);
    }
    for (int a = 0; a < rule->nodes && x->forces; a++)
        for (int i = 0; i < dim; i++)
            out->force[dim * a + i] = force[i][a / LANES][a % LANES];
    if (x->ke)
        tangent_of(x->ke, &at, rule, dim, wide, ring);
    if (x->ke && averaged)
        add_mean(x->ke, &mean, rule, H, &rest, across, dim, wide, ring);
    return true;
}

/* Of all shapes, for any processor; and of each by itself. */
static bool any(const task *x)
{
    return evaluate(x, x->rule->dim, (x->rule->nodes + LANES - 1) / LANES, x->rule->model == UZ_AXISYMMETRIC);
}

#define OF_SHAPE(NAME, DIM, WIDE, RING)                                                                                \
    UZ_AVX2_FMA static bool NAME(const task *x)                                                                        \
    {                                                                                                                  \
        return evaluate(x, DIM, WIDE, RING);                                                                           \
    }
OF_SHAPE(four_of_plane, 2, 1, false)
OF_SHAPE(eight_of_plane, 2, 2, false)
OF_SHAPE(four_of_ring, 2, 1, true)
OF_SHAPE(eight_of_ring, 2, 2, true)
OF_SHAPE(four_of_solid, 3, 1, false)
OF_SHAPE(eight_of_solid, 3, 2, false)
OF_SHAPE(twelve_of_solid, 3, 3, false)
OF_SHAPE(sixteen_of_solid, 3, 4, false)
OF_SHAPE(twenty_of_solid, 3, 5, false)

bool uz_finite_element(uz_finite_forces *out, double *ke, bool forces, const uz_finite_rule *rule,
                       const uz_element *element, uz_elasticity law, const double *u, const double *step)
{
    typedef bool (*evaluation)(const task *);
    static const evaluation PLANE[] = {four_of_plane, eight_of_plane}, RING[] = {four_of_ring, eight_of_ring},
                            SOLID[] = {four_of_solid, eight_of_solid, twelve_of_solid, sixteen_of_solid,
                                       twenty_of_solid};
    const int group = (rule->nodes - 1) / LANES;
    *out = (uz_finite_forces){.least_det = INFINITY};
    const task x = {out, ke, rule, element, law, u, step, forces};
    if (!uz_cpu_has_avx2_fma())
        return any(&x);
    return (rule->dim == 3 ? SOLID : rule->model == UZ_AXISYMMETRIC ? RING : PLANE)[group](&x);
}

void uz_finite_warm(uz_element *element, double *xyz, double *u, double free_strain)
{
    const int dim = uz_element_type_of(element->kind)->dim, n = dim * uz_element_node_count(element->kind);
    const bool ring = element->model == UZ_AXISYMMETRIC;
    double first[3] = {0}; /* node: places are from it on, but radii from the axis */
    if (free_strain == 0)
        return;
    for (int c = ring; c < dim; c++)
        first[c] = xyz[c];
    for (int i = 0; i < n; i++) {
        const double more = free_strain * (xyz[i] - first[i % dim]);
        xyz[i] += more;
        u[i] -= more;
    }
    element->thickness *= 1 + free_strain;
    element->across = element->model == UZ_PLANE_STRAIN ? -free_strain / (1 + free_strain) : 0;
}

bool uz_finite_law(double *W, double S[N_STRAINS], double D[N_STRAINS][N_STRAINS], double C[N_STRAINS],
                   const uz_element *element, uz_elasticity law)
{
    double F[3][3];
    return law_at(W, S, D, F, C, element->model, uz_lame_in_space(element->model, element->lame), law);
}

/* F of a point whose det F is det becomes that with the mean dilatation of the element. Returns what det F is then. */
static double take_mean(double F[3][3], double det, const uz_element *element, const double *u)
{
    const bool ring = element->model == UZ_AXISYMMETRIC;
    uz_finite_rule rule;
    uz_rest rest;
    uz_gradients H;
    mean_points mean;
    uz_finite_rule_of(&rule, element->kind, element->model);
    uz_rest_of(&rest, &rule, element, rule.dim, ring);
    uz_find_gradients(H, &rule, &rest, u, rule.dim, ring);
    find_mean(&mean, &rule, H, &rest, rule.dim == 2 && !ring ? element->across : 0, rule.dim, ring);
    const double part = mean.theta / det, size = mean.n == 3 ? cbrt(part) : sqrt(part);
    for (int i = 0; i < 9; i++)
        F[i / 3][i % 3] *= i < 8 || mean.n == 3 ? size : 1;
    return mean.theta;
}

void uz_finite_state_at(uz_finite_state *out, const uz_element *element, uz_elasticity law, const double *u,
                        const double point[3])
{
    double F[3][3], C[N_STRAINS], W, S[N_STRAINS] = {0}, D[N_STRAINS][N_STRAINS];
    const bool ring = element->model == UZ_AXISYMMETRIC;
    uz_finite_rule rule;
    uz_rest rest;
    uz_gradients H;
    uz_finite_rule_at(&rule, element->kind, element->model, point);
    uz_rest_of(&rest, &rule, element, rule.dim, ring);
    uz_find_gradients(H, &rule, &rest, u, rule.dim, ring);
    deformation(F, H, 0, rule.dim, ring);
    F[2][2] += element->across;
    double det = out->det = orientation(F, rule.dim);
    if (det > 0 && element->formulation == UZ_FORMULATION_BBAR)
        det = take_mean(F, det, element, u);
    cauchy_green(C, F, rule.dim);
    const bool good =
        det > 0 && law_at(&W, S, D, F, C, element->model, uz_lame_in_space(element->model, element->lame), law);
    if (element->model == UZ_PLANE_STRESS)
        det = out->det = orientation(F, rule.dim);
    for (int c = 0; c < N_STRAINS; c++)
        out->strain[c] = 0.5 * (C[c] - (c < 3));
    const double full[3][3] = {{S[0], S[3], S[5]}, {S[3], S[1], S[4]}, {S[5], S[4], S[2]}};
    for (int c = 0; c < N_STRAINS; c++) { /* F S F' / J */
        double sum = 0;
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++)
                sum += F[AXIS[c][0]][k] * full[k][l] * F[AXIS[c][1]][l];
        out->stress[c] = good ? sum / det : NAN;
    }
}
