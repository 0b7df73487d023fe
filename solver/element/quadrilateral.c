/* quadrilateral.c: quad4, and quad8 of the serendipity family. */
#include "element/reference.h"

static const double LOCAL[8][3] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}};
static const int EDGE[4][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
static const int NEXT[4][3] = {{1, 3}, {2, 0}, {3, 1}, {0, 2}};
static const int PART[1][UZ_ELEMENT_CORNERS] = {{0, 1, 2, 3}};

/* Products of the rules of two and of three points. */
static const uz_gauss_point FOUR[4] = {{{-UZ_GAUSS2, -UZ_GAUSS2}, 1},
                                       {{UZ_GAUSS2, -UZ_GAUSS2}, 1},
                                       {{UZ_GAUSS2, UZ_GAUSS2}, 1},
                                       {{-UZ_GAUSS2, UZ_GAUSS2}, 1}};

static const uz_gauss_point NINE[9] = {{{-UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3},
                                       {{0, -UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3},
                                       {{UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3},
                                       {{-UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_INNER3},
                                       {{0, 0}, UZ_INNER3 *UZ_INNER3},
                                       {{UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_INNER3},
                                       {{-UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3},
                                       {{0, UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3},
                                       {{UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3}};

static void shape4(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    const double x = point[0], y = point[1];
    for (int a = 0; a < 4; a++) {
        const double p = LOCAL[a][0], q = LOCAL[a][1];
        if (N)
            N[a] = 0.5 * (1 + p * x) * (0.5 * (1 + q * y));
        if (slope) {
            slope[a][0] = 0.25 * p * (1 + q * y);
            slope[a][1] = 0.25 * q * (1 + p * x);
        }
    }
}

static void shape8(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    const double x = point[0], y = point[1];
    for (int a = 0; a < 8; a++) {
        const double p = LOCAL[a][0], q = LOCAL[a][1];
        if (N)
            N[a] = p == 0   ? 0.5 * (1 - x * x) * (1 + q * y)
                   : q == 0 ? 0.5 * (1 - y * y) * (1 + p * x)
                            : 0.25 * (1 + p * x) * (1 + q * y) * (p * x + q * y - 1);
        if (slope && p == 0) {
            slope[a][0] = -x * (1 + q * y);
            slope[a][1] = 0.5 * q * (1 - x * x);
        } else if (slope && q == 0) {
            slope[a][0] = 0.5 * p * (1 - y * y);
            slope[a][1] = -y * (1 + p * x);
        } else if (slope) {
            slope[a][0] = 0.25 * p * (1 + q * y) * (2 * p * x + q * y);
            slope[a][1] = 0.25 * q * (1 + p * x) * (2 * q * y + p * x);
        }
    }
}

const uz_element_type uz_type_quad4 = {
    .name = "quad4",
    .dim = 2,
    .nodes = 4,
    .corners = 4,
    .sides = 4,
    .side = {{2, 2, {0, 1}}, {2, 2, {1, 2}}, {2, 2, {2, 3}}, {2, 2, {3, 0}}},
    .linear = UZ_QUAD4,
    .local = LOCAL,
    .shape = shape4,
    .rule = {4, FOUR},
    .jacobian = UZ_JACOBIAN_LINEAR,
    .bbar = true,
    .incompatible = true,
    .recover = uz_recover_box,
    .next = NEXT,
    .mirrored = UZ_ADVICE_PLANE,
    .parts = 1,
    .part = PART,
    .vtk = 9,
    .gmsh = 3,
    .abaqus = {"CPS4", "CPE4", "CAX4"},
};

const uz_element_type uz_type_quad8 = {
    .name = "quad8",
    .dim = 2,
    .nodes = 8,
    .corners = 4,
    .sides = 4,
    .side = {{3, 2, {0, 1, 4}}, {3, 2, {1, 2, 5}}, {3, 2, {2, 3, 6}}, {3, 2, {3, 0, 7}}},
    .edge = EDGE,
    .linear = UZ_QUAD4,
    .local = LOCAL,
    .shape = shape8,
    .rule = {9, NINE},
    .recover = uz_recover_box,
    .vtk = 23,
    .gmsh = 16,
    .abaqus = {"CPS8", "CPE8", "CAX8"},
};
