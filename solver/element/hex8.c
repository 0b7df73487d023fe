/* hex8.c: the trilinear hexahedron. */
#include "element/reference.h"

static const double LOCAL[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                   {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const int NEXT[8][3] = {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7}, {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}};
static const int PART[1][UZ_ELEMENT_CORNERS] = {{0, 1, 2, 3, 4, 5, 6, 7}};

/* Product of the rule of two points. */
static const uz_gauss_point GAUSS[8] = {
    {{-UZ_GAUSS2, -UZ_GAUSS2, -UZ_GAUSS2}, 1}, {{UZ_GAUSS2, -UZ_GAUSS2, -UZ_GAUSS2}, 1},
    {{UZ_GAUSS2, UZ_GAUSS2, -UZ_GAUSS2}, 1},   {{-UZ_GAUSS2, UZ_GAUSS2, -UZ_GAUSS2}, 1},
    {{-UZ_GAUSS2, -UZ_GAUSS2, UZ_GAUSS2}, 1},  {{UZ_GAUSS2, -UZ_GAUSS2, UZ_GAUSS2}, 1},
    {{UZ_GAUSS2, UZ_GAUSS2, UZ_GAUSS2}, 1},    {{-UZ_GAUSS2, UZ_GAUSS2, UZ_GAUSS2}, 1}};

static void shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    for (int a = 0; a < 8; a++) {
        const double *at = LOCAL[a];
        const double x = 1 + at[0] * point[0], y = 1 + at[1] * point[1], z = 1 + at[2] * point[2];
        if (N)
            N[a] = 0.5 * x * (0.5 * y) * (0.5 * z);
        if (slope) {
            slope[a][0] = 0.125 * at[0] * y * z;
            slope[a][1] = 0.125 * at[1] * x * z;
            slope[a][2] = 0.125 * at[2] * x * y;
        }
    }
}

const uz_element_type uz_type_hex8 = {
    .name = "hex8",
    .dim = 3,
    .nodes = 8,
    .corners = 8,
    .sides = 6,
    .side = {{4, 4, {0, 4, 7, 3}},
             {4, 4, {1, 2, 6, 5}},
             {4, 4, {0, 1, 5, 4}},
             {4, 4, {3, 7, 6, 2}},
             {4, 4, {0, 3, 2, 1}},
             {4, 4, {4, 5, 6, 7}}},
    .linear = UZ_HEX8,
    .local = LOCAL,
    .shape = shape,
    .rule = {8, GAUSS},
    .bbar = true,
    .incompatible = true,
    .recover = uz_recover_box,
    .next = NEXT,
    .mirrored = "its first four nodes must run counterclockwise seen from the side of the other four: swap the fours",
    .parts = 1,
    .part = PART,
    .vtk = 12,
    .gmsh = 5,
    .abaqus = {NULL, NULL, NULL, "C3D8"},
};
