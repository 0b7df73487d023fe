/* anisotropy.c: linear elasticity of a material with three planes of symmetry, turned into a model's axes.
 *
 * In its own axes its compliance is S_ii = 1 / E_i, S_ij = - nu_ij / E_i, and 1 / G_ij of shear. As the stress is
 * sum s'_kl a_k a_l', with a_k the directions of its axes, s = M s' with M of products of their components, and work
 * being work, strain' = M' strain: C = M C' M' and S = N S' N', N = M'^-1, which is M with other factors of 2 (Bond's
 * matrices: Auld, "Acoustic Fields and Waves in Solids", vol. 1, ch. 3). A plane model takes the rows of its own
 * strains: of C in plane strain, of S in plane stress; what it lacks is then the inverse of what it has. */
#include "element/element.h"

#include <math.h>
#include <string.h>

/* Components of stress of a solid: which axes each has. */
static const int PAIR[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

/* By pairs xy, yz, xz: the correlation of the direct compliances, nu_ij / E_i over the root of S_ii S_jj. */
static void correlate(double r[3], const uz_orthotropic *from)
{
    static const int OF[3][2] = {{0, 1}, {1, 2}, {0, 2}};
    for (int k = 0; k < 3; k++)
        r[k] = from->poisson[k] * sqrt(from->young[OF[k][1]] / from->young[OF[k][0]]);
}

double uz_orthotropic_energy(double pair[3], const uz_orthotropic *from)
{
    double r[3];
    correlate(r, from);
    for (int k = 0; k < 3; k++)
        pair[k] = (1 - r[k]) * (1 + r[k]);
    return 1 - r[0] * r[0] - r[1] * r[1] - r[2] * r[2] - 2 * r[0] * r[1] * r[2];
}

/* C and S in the material's own axes. The inverse of the correlations is their cofactors over their determinant. */
static void own_matrices(double C[6][6], double S[6][6], const uz_orthotropic *from)
{
    double r[3], pair[3], root[3];
    const double det = uz_orthotropic_energy(pair, from);
    memset(C, 0, 36 * sizeof(double));
    memset(S, 0, 36 * sizeof(double));
    correlate(r, from);
    const double R[3][3] = {{1, -r[0], -r[2]}, {-r[0], 1, -r[1]}, {-r[2], -r[1], 1}};
    const double cofactor[3][3] = {{pair[1], r[0] + r[1] * r[2], r[2] + r[0] * r[1]},
                                   {r[0] + r[1] * r[2], pair[2], r[1] + r[0] * r[2]},
                                   {r[2] + r[0] * r[1], r[1] + r[0] * r[2], pair[0]}};
    for (int i = 0; i < 3; i++)
        root[i] = sqrt(from->young[i]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            S[i][j] = R[i][j] / root[i] / root[j];
            C[i][j] = cofactor[i][j] / det * root[i] * root[j];
        }
    for (int k = 0; k < 3; k++) { /* xy, yz, xz: in the order of stresses, too */
        C[3 + k][3 + k] = from->shear[k];
        S[3 + k][3 + k] = 1 / from->shear[k];
    }
}

/* Unit vectors: along x, across it in the plane of both, and what makes them right-handed. */
static void directions(double a[3][3], const double axes[2][3])
{
    double length[2];
    memset(a, 0, 9 * sizeof(double));
    for (int k = 0; k < 2; k++)
        length[k] = sqrt(axes[k][0] * axes[k][0] + axes[k][1] * axes[k][1] + axes[k][2] * axes[k][2]);
    if (!(length[0] > 0 && length[1] > 0)) {
        a[0][0] = a[1][1] = a[2][2] = 1;
        return;
    }
    double along = 0, rest = 0;
    for (int c = 0; c < 3; c++) {
        a[0][c] = axes[0][c] / length[0];
        along += a[0][c] * axes[1][c] / length[1];
    }
    for (int c = 0; c < 3; c++) {
        a[1][c] = axes[1][c] / length[1] - along * a[0][c];
        rest += a[1][c] * a[1][c];
    }
    for (int c = 0; c < 3; c++)
        a[1][c] /= sqrt(rest);
    for (int c = 0; c < 3; c++)
        a[2][c] = a[0][(c + 1) % 3] * a[1][(c + 2) % 3] - a[0][(c + 2) % 3] * a[1][(c + 1) % 3];
}

/* to = T from T'. Of stresses (M) or of strains (N), whose shears are doubled. */
static void turn(double to[6][6], double from[6][6], double T[6][6])
{
    double left[6][6] = {{0}};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            for (int k = 0; k < 6; k++)
                left[i][j] += T[i][k] * from[k][j];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) {
            to[i][j] = 0;
            for (int k = 0; k < 6; k++)
                to[i][j] += left[i][k] * T[j][k];
            to[j][i] = to[i][j];
        }
}

static void make_turns(double M[6][6], double N[6][6], double a[3][3])
{
    for (int p = 0; p < 6; p++)
        for (int q = 0; q < 6; q++) {
            const int i = PAIR[p][0], j = PAIR[p][1], k = PAIR[q][0], l = PAIR[q][1];
            const double one = a[k][i] * a[l][j], other = a[l][i] * a[k][j];
            M[p][q] = q < 3 ? one : one + other;
            N[p][q] = p < 3 ? (q < 3 ? one : one / 2 + other / 2) : (q < 3 ? 2 * one : one + other);
        }
}

/* Of the first three rows and columns. */
static void invert(double out[6][6], double A[6][6])
{
    double block[3][3], inverse[3][3];
    for (int i = 0; i < 3; i++)
        memcpy(block[i], A[i], sizeof block[i]);
    uz_invert_small(inverse, block, 3);
    for (int i = 0; i < 3; i++)
        memcpy(out[i], inverse[i], sizeof inverse[i]);
}

/* Of the isotropic material of the same bulk modulus under pressure (Reuss) and the mean of its shear moduli (Voigt).
 */
static double ratio_like(double C[6][6], double S[6][6])
{
    double compliance = 0, shear = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            compliance += S[i][j];
            shear += (i == j ? 1. / 15 : -1. / 30) * C[i][j];
        }
    for (int k = 3; k < 6; k++)
        shear += C[k][k] / 5;
    const double part = shear * compliance; /* G / K */
    return (3 - 2 * part) / (2 * (3 + part));
}

void uz_orthotropic_make(uz_anisotropy *out, uz_model model, const uz_orthotropic *from)
{
    static const int ROWS[][6] = {[UZ_PLANE_STRESS] = {0, 1, 3},
                                  [UZ_PLANE_STRAIN] = {0, 1, 3},
                                  [UZ_AXISYMMETRIC] = {0, 1, 2, 3},
                                  [UZ_SOLID] = {0, 1, 2, 3, 4, 5}};
    double own[6][6], C[6][6], S[6][6], M[6][6], N[6][6], a[3][3], expansion[6] = {0};
    const int *row = ROWS[model], n = uz_stress_count(model);
    *out = (uz_anisotropy){.warmed = 0};
    directions(a, from->axes);
    make_turns(M, N, a);
    own_matrices(own, S, from);
    turn(C, own, M);
    memcpy(own, S, sizeof own);
    turn(S, own, N);
    for (int p = 0; p < 6; p++)
        for (int k = 0; k < 3; k++)
            expansion[p] += N[p][k] * from->expansion[k];
    out->poisson = ratio_like(C, S);
    for (int i = 0; i < n; i++) {
        out->expansion[i] = expansion[row[i]];
        for (int j = 0; j < n; j++) {
            out->C[i][j] = C[row[i]][row[j]];
            out->S[i][j] = S[row[i]][row[j]];
        }
    }
    if (model == UZ_PLANE_STRESS)
        invert(out->C, out->S);
    if (model == UZ_PLANE_STRAIN)
        invert(out->S, out->C);
    /* The strain across is S_zz zz + sum S_zi s_i + expansion: in plane stress zz is 0, in plane strain the strain. */
    const double per = model == UZ_PLANE_STRAIN ? -1 / S[2][2] : 1;
    for (int i = 0; i < n && n == 3; i++) {
        out->across[i] = per * S[2][row[i]];
        out->expansion[i] += model == UZ_PLANE_STRAIN ? out->across[i] * expansion[2] : 0;
    }
    out->warmed = n == 3 ? per * expansion[2] : 0;
    out->kept = model == UZ_PLANE_STRAIN ? 0.5 * expansion[2] * expansion[2] / S[2][2] : 0;
}
