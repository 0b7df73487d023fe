/* Stress and contact pressure against theory, on meshes that take a moment; `make theory` goes further. Under a
 * sanitizer one mesh of each scene: its answers are those of the plain build. */
#include "sanitized.h"
#include "theory.h"

static void check_all(const theory_table *t, double tolerance)
{
    for (int i = 0; i < t->count; i++)
        CHECK_MSG(theory_error(&t->row[i]) <= tolerance, "%s: %s is %.6g, theory %.6g (%.2f %%)", t->row[i].name,
                  t->row[i].quantity, t->row[i].computed, t->row[i].theory, 100 * theory_error(&t->row[i]));
}

TEST(hertz_line)
{
    theory_table t = {.count = 0};
    theory_hertz(&t, UZ_PLANE_STRAIN, "tri6", 20, 1.25);
    if (!SANITIZED) {
        theory_hertz(&t, UZ_PLANE_STRAIN, "quad4", 32, 1.2);
        theory_hertz(&t, UZ_PLANE_STRAIN, "quad8", 20, 1.25);
    }
    check_all(&t, 0.03);
}

TEST(hertz_point)
{
    theory_table t = {.count = 0};
    theory_hertz(&t, UZ_AXISYMMETRIC, "quad8", 20, 1.25);
    if (!SANITIZED)
        theory_hertz(&t, UZ_AXISYMMETRIC, "quad4", 32, 1.2);
    check_all(&t, 0.03);
}

TEST(hertz_point_in_space)
{
    theory_table t = {.count = 0};
    theory_hertz(&t, UZ_SOLID, "hex8", 4, 1.7);
    if (!SANITIZED) {
        theory_hertz(&t, UZ_SOLID, "hex20", 3, 1.8);
        theory_hertz(&t, UZ_SOLID, "wedge15", 3, 1.8);
    }
    check_all(&t, 0.15);
}

TEST(hertz_gets_better_with_the_mesh)
{
    theory_table t = {.count = 0};
    for (int n = 6; n <= 24; n *= 2)
        theory_hertz(&t, UZ_PLANE_STRAIN, "quad4", n, 1.2);
    CHECK_INT(t.count, 9);
    for (int i = 0; i + 3 < t.count; i++)
        CHECK_MSG(theory_error(&t.row[i + 3]) < theory_error(&t.row[i]) || theory_error(&t.row[i + 3]) < 5e-3, "%g %g",
                  theory_error(&t.row[i]), theory_error(&t.row[i + 3]));
}

TEST(flat_punch)
{
    theory_table t = {.count = 0};
    theory_punch(&t, "quad8", 8);
    if (!SANITIZED)
        theory_punch(&t, "quad4", 16);
    CHECK_INT(t.count, SANITIZED ? 2 : 4);
    check_all(&t, 0.03);
}

TEST(thick_tube)
{
    theory_table t = {.count = 0};
    theory_tube(&t, UZ_PLANE_STRAIN, "quad8", 6);
    theory_tube(&t, UZ_AXISYMMETRIC, "quad4", 12);
    if (!SANITIZED) {
        theory_tube(&t, UZ_PLANE_STRAIN, "tri6", 8);
        theory_tube(&t, UZ_AXISYMMETRIC, "quad8", 8);
        theory_tube(&t, UZ_PLANE_STRAIN, "quad4", 12);
    }
    check_all(&t, 0.03);
}

TEST(bent_beam)
{
    theory_table t = {.count = 0};
    theory_beam(&t, "quad8", UZ_FORMULATION_AUTO, 1);
    theory_beam(&t, "quad4", UZ_FORMULATION_INCOMPATIBLE, 1);
    theory_beam(&t, "quad4", UZ_FORMULATION_STANDARD, 8);
    theory_beam(&t, "tri6", UZ_FORMULATION_AUTO, 2);
    check_all(&t, 0.02);
}

TEST(nafems_roller)
{
    theory_table t = {.count = 0};
    theory_roller(&t, "quad4", 12, 1.3);
    CHECK_INT(t.count, 3);
    check_all(&t, 0.05);
}
