/* The patch test (Irons; Zienkiewicz and Taylor, vol. 1): a distorted mesh whose boundary moves by a linear field has
 * that field inside, to rounding, whatever the element and its formulation. */
#include "element_mesh.h"
#include "harness.h"

/* The linear field, of a kind that is in equilibrium without body forces: a ring's has equal radial and hoop strain. */
static double field(const small_mesh *mesh, int a, int c)
{
    static const double H[3][3] = {{0.3, -0.7, 0.2}, {0.4, 0.5, 0.9}, {-0.6, 0.1, -0.8}};
    double value = 0;
    for (int j = 0; j < mesh->dim; j++)
        if (mesh->element.model != UZ_AXISYMMETRIC || c == j)
            value += H[c][j] * mesh->xyz[a * mesh->dim + j];
    return value;
}

static void check_patch(const uz_element *element, double scale)
{
    small_mesh mesh = small_grid(*element, 3, 3, 3);
    const int n = mesh.n_nodes * mesh.dim;
    double *u = zeros((size_t)n, sizeof *u), worst = 0;
    bool *fixed = zeros((size_t)n, sizeof *fixed);
    for (int i = 0; i < n; i++)
        fixed[i] = on_boundary(&mesh, i / mesh.dim);
    distort(&mesh, 0.1, 5);
    stretch(&mesh, (const double[3]){0.5 * scale, 0, 0}, (const double[3]){scale, 0.8 * scale, 1.1 * scale});
    for (int i = 0; i < n; i++)
        u[i] = fixed[i] ? field(&mesh, i / mesh.dim, i % mesh.dim) : 0;
    solve_small(u, &mesh, NULL, fixed);
    for (int i = 0; i < n; i++)
        worst = fmax(worst, fabs(u[i] - field(&mesh, i / mesh.dim, i % mesh.dim)));
    CHECK_MSG(worst < 1e-12 * scale, "%s: off by %g of %g", element_words(element), worst, scale);
    free(u);
    free(fixed);
    small_mesh_free(&mesh);
}

TEST(every_element_passes)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++)
        check_patch(&element, 1);
}

/* As a nearly incompressible material asks for, where the formulation is for it. */
TEST(mean_dilatation_passes_for_rubber)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.4999); i++)
        if (element.formulation == UZ_FORMULATION_BBAR)
            check_patch(&element, 1);
}

TEST(in_other_units_too)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        check_patch(&element, 1e-9);
        check_patch(&element, 1e6);
    }
}
