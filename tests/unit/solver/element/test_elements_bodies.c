/* Known bodies: Cook's membrane, a nearly incompressible tube, beams of one layer. */
#include "element_bodies.h"
#include "harness.h"

TEST(cooks_membrane)
{
    const uz_formulation s = UZ_FORMULATION_STANDARD;
    CHECK_REL(cook(UZ_QUAD4, s, UZ_PLANE_STRESS, 1. / 3, 64), 23.96, 2e-3);
    CHECK_REL(cook(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, UZ_PLANE_STRESS, 1. / 3, 32), 23.96, 2e-3);
    CHECK_REL(cook(UZ_QUAD8, s, UZ_PLANE_STRESS, 1. / 3, 16), 23.96, 2e-3);
    CHECK_REL(cook(UZ_TRI6, s, UZ_PLANE_STRESS, 1. / 3, 16), 23.96, 2e-3);
    CHECK_REL(cook(UZ_TRI3, s, UZ_PLANE_STRESS, 1. / 3, 64), 23.96, 1e-2);
    /* On a coarse mesh incompatible modes do what they are for. */
    CHECK(cook(UZ_QUAD4, s, UZ_PLANE_STRESS, 1. / 3, 4) < 0.80 * 23.96);
    CHECK(cook(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, UZ_PLANE_STRESS, 1. / 3, 4) > 0.95 * 23.96);
}

TEST(rubber_tube_does_not_lock_with_mean_dilatation)
{
    CHECK_REL(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_QUAD4, UZ_AXISYMMETRIC, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_INCOMPATIBLE, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_INCOMPATIBLE, 0.4999), 1.0, 1e-2);
    CHECK(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_STANDARD, 0.4999) < 0.5);
    CHECK(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_STANDARD, 0.4999) < 0.5);
}

/* Curved sides and faces, pressed: the body is the tube itself but for the third order. */
TEST(quadratic_elements_follow_the_tube)
{
    const uz_formulation s = UZ_FORMULATION_STANDARD;
    CHECK_REL(tube(UZ_QUAD8, UZ_PLANE_STRAIN, s, 0.3), 1.0, 1e-4);
    CHECK_REL(tube(UZ_TRI6, UZ_PLANE_STRAIN, s, 0.3), 1.0, 1e-3);
    CHECK_REL(tube(UZ_TET10, UZ_SOLID, s, 0.3), 1.0, 2e-3);
    CHECK_REL(tube(UZ_HEX20, UZ_SOLID, s, 0.3), 1.0, 1e-4);
    CHECK_REL(tube(UZ_WEDGE15, UZ_SOLID, s, 0.3), 1.0, 1e-3);
    CHECK_REL(tube(UZ_QUAD8, UZ_AXISYMMETRIC, s, 0.3), 1.0, 1e-4);
    CHECK_REL(tube(UZ_TRI6, UZ_AXISYMMETRIC, s, 0.3), 1.0, 1e-3);
    CHECK_REL(tube(UZ_TRI3, UZ_AXISYMMETRIC, s, 0.3), 1.0, 2e-2);
}

/* ------------------------------------------------- beams of one layer
 * 12 x 1 (x 1), E = 1e4, nu = 0.3. Bent by end moments: curvature M / (E I), exact for incompatible modes on
 * rectangles. By a force at the end: F L^3 / (3 E I) + F L / (5/6 G A) (Timoshenko). */
enum { LENGTH = 12 };

static double beam(uz_element_kind kind, uz_formulation way, bool by_moment)
{
    const uz_model model = uz_element_type_of(kind)->dim == 3 ? UZ_SOLID : UZ_PLANE_STRESS;
    const uz_element element = {kind, model, way, uz_lame_of(model, 1e4, 0.3), .thickness = 1, .xyz = NULL};
    small_body b = body_of(element, LENGTH, 1, 1);
    const int dim = b.mesh.dim;
    hold(&b, 0, 0, 0);
    mark(&b, 0, 1);
    b.fixed[node_at(&b, 0, 0, 0) * dim + 1] = true;
    if (dim == 3) {
        b.fixed[node_at(&b, 0, 0, 0) * dim + 2] = true;
        b.fixed[node_at(&b, 0, 0, 1) * dim + 1] = true;
    }
    stretch(&b.mesh, (const double[3]){0, 0, 0}, (const double[3]){LENGTH, 1, 1});
    b.value = by_moment ? 12 : 1; /* stress 12 y: M = 1, E I = 1e4 / 12 */
    each_side(&b.mesh, b.loaded, &b, by_moment ? bend : lift);
    solve_small(b.u, &b.mesh, b.f, b.fixed);
    const double deflection = b.u[node_at(&b, LENGTH, 0, 0) * dim + 1];
    body_free(&b);
    const double bending = 1e4 / 12, shear = 5. / 6 * 1e4 / 2.6;
    return deflection /
           (by_moment ? -LENGTH * LENGTH / (2 * bending) : pow(LENGTH, 3) / (3 * bending) + LENGTH / shear);
}

TEST(one_layer_bends_with_incompatible_modes)
{
    CHECK_REL(beam(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_HEX8, UZ_FORMULATION_INCOMPATIBLE, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, false), 1.0, 1e-2);
    CHECK_REL(beam(UZ_HEX8, UZ_FORMULATION_INCOMPATIBLE, false), 1.0, 1e-2);
    CHECK_REL(beam(UZ_QUAD8, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_TRI6, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_TET10, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_HEX20, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_WEDGE15, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_HEX20, UZ_FORMULATION_STANDARD, false), 1.0, 2e-2);
    CHECK(beam(UZ_QUAD4, UZ_FORMULATION_STANDARD, true) < 0.8);
    CHECK(beam(UZ_HEX8, UZ_FORMULATION_STANDARD, true) < 0.8);
}
