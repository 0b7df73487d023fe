/* How broad boxes are, and bodies of several pieces side by side. */
#include "harness.h"
#include "scene/breadth.h"
#include "scene_fixture.h"

#include <string.h>

static double breadth_of(const char *element, int64_t nx, int64_t ny, int64_t nz)
{
    uz_box box = {.size = {(double)nx, (double)ny, (double)nz}, .cells = {nx, ny, nz}, .dim = nz ? 3 : 2};
    uz_mesh mesh;
    uz_error err = {0};
    strcpy(box.element, element);
    CHECK_MSG(uz_mesh_from_box(&mesh, &box, &err) == UZ_OK, "%s", err.message);
    const double breadth = uz_mesh_breadth(&mesh);
    uz_mesh_clear(&mesh);
    return breadth;
}

static void check_about(double got, double expected)
{
    CHECK_MSG(got > 0.9 * expected && got < 1.2 * expected, "%g, not about %g", got, expected);
}

TEST(layers_of_boxes)
{
    check_about(breadth_of("hex8", 10, 10, 10), 11 * 11);
    check_about(breadth_of("tet4", 12, 12, 12), 13 * 13);
    check_about(breadth_of("hex8", 4, 60, 6), 5 * 7);
    check_about(breadth_of("hex8", 20, 3, 20), 21 * 4);
    CHECK(breadth_of("quad4", 20, 20, 0) == 0.0);
}

/* Every other layer of hex20 has fewer nodes. */
TEST(nodes_on_edges_are_layers_of_their_own)
{
    check_about(breadth_of("hex20", 20, 5, 5), 0.5 * (96 + 36));
    check_about(breadth_of("tet10", 20, 5, 5), 11 * 11);
}

/* Bars along x that hang together at one end alone part as one bar does, but for that end. */
TEST(a_comb_is_as_broad_as_its_teeth)
{
    enum { TEETH = 5, LENGTH = 40 };
    double xyz[TEETH * 2 * 2 * (LENGTH + 1) * 3];
    int64_t node[(TEETH * LENGTH + TEETH - 1) * 8], first[TEETH * LENGTH + TEETH];
    unsigned char kind[TEETH * LENGTH + TEETH - 1];
    uz_mesh mesh = {.dim = 3, .xyz = xyz, .kind = kind, .first = first, .node = node};
    for (int64_t z = 0; z < 2; z++)
        for (int64_t y = 0; y < 2 * TEETH; y++)
            for (int64_t x = 0; x <= LENGTH; x++) {
                const double at[3] = {(double)x, (double)y, (double)z};
                memcpy(xyz + 3 * mesh.n_nodes++, at, sizeof at);
            }
    for (int64_t y = 0; y < 2 * TEETH - 1; y++)
        for (int64_t x = 0; x < (y % 2 == 0 ? LENGTH : 1); x++) {
            first[mesh.n_elements] = 8 * mesh.n_elements;
            kind[mesh.n_elements] = UZ_HEX8;
            for (int64_t a = 0; a < 8; a++) {
                const int64_t i = x + (a % 4 == 1 || a % 4 == 2), j = y + (a % 4 > 1), k = a / 4;
                node[8 * mesh.n_elements + a] = (k * 2 * TEETH + j) * (LENGTH + 1) + i;
            }
            mesh.n_elements++;
        }
    first[mesh.n_elements] = 8 * mesh.n_elements;
    check_about(uz_mesh_breadth(&mesh), 4 + 16.0 * 2 / LENGTH);
}
