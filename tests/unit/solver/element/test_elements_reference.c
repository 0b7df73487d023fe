/* Stiffness against another program's: CalculiX's tetrahedra. */
#include "element_mesh.h"
#include "harness.h"
#include "uzawa.h"

enum { GMSH_TET4 = 4 };

/* Nodes and tetrahedra of a Gmsh 2.2 text whose nodes are numbered 1, 2, ... in order. */
static small_mesh read_tets(const char *text, uz_element element)
{
    small_mesh mesh = {.element = element, .dim = 3, .per = 4};
    char *end;
    const char *at = strstr(text, "$Nodes");
    mesh.n_nodes = (int)strtol(at + 6, &end, 10);
    mesh.xyz = zeros((size_t)mesh.n_nodes * 3, sizeof *mesh.xyz);
    for (int a = 0; a < mesh.n_nodes; a++) {
        CHECK_INT(strtol(end, &end, 10), a + 1);
        for (int c = 0; c < 3; c++)
            mesh.xyz[3 * a + c] = strtod(end, &end);
    }
    const long count = strtol(strstr(text, "$Elements") + 9, &end, 10);
    mesh.node = zeros((size_t)count * 4, sizeof *mesh.node);
    for (long e = 0; e < count; e++) {
        (void)strtol(end, &end, 10); /* its number */
        const bool tet = strtol(end, &end, 10) == GMSH_TET4;
        for (long tags = strtol(end, &end, 10); tags > 0; tags--)
            (void)strtol(end, &end, 10);
        for (int a = 0; a < 4 && tet; a++)
            mesh.node[4 * mesh.n_elements + a] = (int)strtol(end, &end, 10) - 1;
        mesh.n_elements += tet;
        end += strcspn(end, "\n");
    }
    return mesh;
}

/* An entry of the lower triangle, 0 where the pattern has none. */
static double entry_of(const uz_csc *K, int64_t i, int64_t j)
{
    const int64_t row = i > j ? i : j, column = i > j ? j : i;
    for (int64_t q = K->ptr[column]; q < K->ptr[column + 1]; q++)
        if (K->idx[q] == row)
            return K->val[q];
    return 0;
}

/* E = 1000, nu = 0.3, the nodes of the top (z = 1) held, the others in the order of the mesh. */
static void compare_with_calculix(const char *mesh_text, const uz_csc *K)
{
    const uz_element tet = {UZ_TET4,        UZ_SOLID,   UZ_FORMULATION_STANDARD, uz_lame_of(UZ_SOLID, 1000, 0.3),
                            .thickness = 1, .xyz = NULL};
    small_mesh mesh = read_tets(mesh_text, tet);
    skyline ours = assemble(&mesh);
    int *dof = zeros((size_t)ours.n, sizeof *dof), n = 0;
    double worst = 0, largest = 0;
    for (int i = 0; i < ours.n; i++)
        dof[i] = mesh.xyz[i / 3 * 3 + 2] == 1 ? -1 : n++;
    CHECK_INT(n, K->rows);
    for (int i = 0; i < ours.n; i++)
        for (int j = 0; j <= i; j++) {
            const double value = j >= ours.first[i] ? sky_row(&ours, i)[j] : 0;
            if (dof[i] < 0 || dof[j] < 0)
                continue;
            largest = fmax(largest, fabs(value));
            worst = fmax(worst, fabs(value - entry_of(K, dof[i], dof[j])));
        }
    CHECK_MSG(worst < 1e-12 * largest, "entries differ by up to %g of %g", worst, largest);
    skyline_free(&ours);
    small_mesh_free(&mesh);
    free(dof);
}

TEST(tetrahedra_are_those_of_calculix)
{
    char path[256];
    size_t len = 0, mesh_len = 0;
    const char *cases = test_cases_dir();
    if (!cases) {
        test_skip("../shared/cases is not there");
        return;
    }
    snprintf(path, sizeof path, "%s/meshes/skfem_box.msh", cases);
    char *mesh_text = test_read_file(path, &mesh_len);
    snprintf(path, sizeof path, "%s/qp/FEM_skfem_box/K.mtx", cases);
    char *text = test_read_file(path, &len);
    uz_csc K = {0};
    CHECK(mesh_text && text);
    if (mesh_text && text && uz_mm_read(&K, NULL, text, len, 0, NULL) == UZ_OK)
        compare_with_calculix(mesh_text, &K);
    CHECK(K.rows == 879);
    uz_csc_clear(&K);
    free(text);
    free(mesh_text);
}
