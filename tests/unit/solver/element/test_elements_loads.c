/* Material, loads on elements and on their sides. */
#include "element/element.h"
#include "element_mesh.h"
#include "harness.h"

static const double TAU = 6.283185307179586;

static uz_side side_of(double *xs, const uz_element *element, int number)
{
    const int dim = uz_element_type_of(element->kind)->dim;
    const uz_element_side *at = &uz_element_type_of(element->kind)->side[number];
    const uz_side side = {dim, at->nodes, element->model, element->thickness, xs};
    for (int a = 0; a < side.nodes; a++)
        memcpy(xs + a * dim, element->xyz + at->node[a] * dim, (size_t)dim * sizeof *xs);
    return side;
}

/* C, n x n: its columns are the stresses of unit strains. */
static void elastic_matrix(double *C, uz_model model, uz_lame lame)
{
    const int n = uz_stress_count(model);
    for (int j = 0; j < n; j++) {
        double strain[6] = {0}, stress[6];
        strain[j] = 1;
        uz_elastic_stress(stress, model, lame, strain);
        for (int i = 0; i < n; i++)
            C[n * i + j] = stress[i];
    }
}

TEST(elasticity_matches_textbook)
{
    const double E = 200, nu = 0.3, strain_factor = E / ((1 + nu) * (1 - 2 * nu)), G = E / (2 * (1 + nu));
    double C[36];
    elastic_matrix(C, UZ_PLANE_STRESS, uz_lame_of(UZ_PLANE_STRESS, E, nu));
    CHECK_REL(C[0], E / (1 - nu * nu), 1e-14);
    CHECK_REL(C[3], nu * E / (1 - nu * nu), 1e-14);
    CHECK_REL(C[8], G, 1e-14);
    CHECK(C[2] == 0 && C[5] == 0 && C[6] == 0 && C[7] == 0);
    for (int model = UZ_PLANE_STRAIN; model <= UZ_SOLID; model++) {
        const int n = uz_stress_count((uz_model)model), direct = n == 3 ? 2 : 3;
        elastic_matrix(C, (uz_model)model, uz_lame_of((uz_model)model, E, nu));
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                const double want = i < direct && j < direct ? strain_factor * (i == j ? 1 - nu : nu) : i == j ? G : 0;
                CHECK(fabs(C[n * i + j] - want) <= 1e-14 * want);
            }
    }
}

TEST(stress_agrees_with_the_matrix)
{
    const double strain[6] = {0.3, -0.5, 0.7, 0.2, -0.9, 0.4}, nus[3] = {0, 0.3, 0.4999};
    for (int model = 0; model <= UZ_SOLID; model++)
        for (int k = 0; k < 3; k++) {
            const uz_model m = (uz_model)model;
            const uz_lame lame = uz_lame_of(m, 200, nus[k]);
            const int n = uz_stress_count(m);
            double C[36], stress[6];
            elastic_matrix(C, m, lame);
            uz_elastic_stress(stress, m, lame, strain);
            for (int i = 0; i < n; i++) {
                double want = 0;
                for (int j = 0; j < n; j++)
                    want += C[n * i + j] * strain[j];
                CHECK(fabs(stress[i] - want) <= 1e-14 * C[0]);
            }
        }
}

/* A plane body held by nothing but its own plane: the third direction's law closes. */
TEST(third_stress_of_plane_strain)
{
    const double E = 70, nu = 0.31, strain[3] = {1e-3, -4e-4, 2e-4}, heat = 5e-4;
    const uz_lame lame = uz_lame_of(UZ_PLANE_STRAIN, E, nu);
    double thermal[3], elastic[3], stress[3];
    uz_thermal_strain(thermal, UZ_PLANE_STRAIN, lame, heat);
    for (int i = 0; i < 3; i++)
        elastic[i] = strain[i] - thermal[i];
    uz_elastic_stress(stress, UZ_PLANE_STRAIN, lame, elastic);
    const double zz = uz_stress_zz(UZ_PLANE_STRAIN, lame, stress, heat);
    /* Hooke's law in three dimensions gives the strains back, and no strain along z. */
    CHECK_REL((stress[0] - nu * (stress[1] + zz)) / E + heat, strain[0], 1e-12);
    CHECK_REL((stress[1] - nu * (stress[0] + zz)) / E + heat, strain[1], 1e-12);
    CHECK(fabs((zz - nu * (stress[0] + stress[1])) / E + heat) < 1e-17);
    CHECK(uz_stress_zz(UZ_PLANE_STRESS, lame, stress, heat) == 0);
}

/* Green: half the sum over corner pairs, times thickness; a ring's by Pappus. */
TEST(volumes_of_simple_bodies)
{
    const double quad[8] = {1, 0, 4, 0, 4, 2, 1, 2}, tet[12] = {0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5};
    uz_element element = {UZ_QUAD4,     UZ_PLANE_STRAIN,  UZ_FORMULATION_STANDARD,
                          {1, 1, NULL}, .thickness = 0.5, .xyz = quad};
    CHECK_REL(uz_element_volume(&element), 3.0, 1e-15);
    element.model = UZ_AXISYMMETRIC;
    CHECK_REL(uz_element_volume(&element), TAU / 2 * (16 - 1) * 2, 1e-15);
    const uz_element solid = {UZ_TET4, UZ_SOLID, UZ_FORMULATION_STANDARD, {1, 1, NULL}, .thickness = 0.5, .xyz = tet};
    CHECK_REL(uz_element_volume(&solid), 5.0, 1e-15);
}

TEST(body_force_is_force_times_volume)
{
    uz_element element;
    const double b[3] = {0.3, -2, 0.7};
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], f[UZ_ELEMENT_DOFS] = {0}, sum[3] = {0};
        element = bent(xe, element, 1);
        const int dim = uz_element_type_of(element.kind)->dim, n = uz_element_node_count(element.kind) * dim;
        uz_element_add_body_force(f, &element, b);
        for (int k = 0; k < n; k++)
            sum[k % dim] += f[k];
        for (int c = 0; c < dim; c++)
            CHECK_REL(sum[c], b[c] * uz_element_volume(&element), 1e-14);
    }
}

/* A free body that is warmed expands, and nothing else: K u = f, and no stress but the one that holds the plane. */
TEST(free_expansion_has_no_stress)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], u[UZ_ELEMENT_DOFS], thermal[6], strain[6];
        double f[UZ_ELEMENT_DOFS] = {0}, largest = 0;
        uz_element_motion motion;
        element = bent(xe, element, 1);
        const int n = uz_element_node_count(element.kind) * uz_element_type_of(element.kind)->dim;
        uz_thermal_strain(thermal, element.model, element.lame, 2e-3);
        CHECK_REL(thermal[0], element.model == UZ_PLANE_STRAIN ? 1.3 * 2e-3 : 2e-3, 1e-14);
        for (int k = 0; k < n; k++)
            u[k] = thermal[0] * xe[k];
        CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
        uz_element_add_thermal_load(f, &element, thermal);
        for (int r = 0; r < n; r++)
            largest = fmax(largest, fabs(f[r]));
        for (int r = 0; r < n; r++) {
            double residual = -f[r];
            for (int c = 0; c < n; c++)
                residual += ke[r * n + c] * u[c];
            CHECK_MSG(fabs(residual) < 1e-13 * largest, "%s: force %g of %g is left", element_words(&element), residual,
                      largest);
        }
        uz_element_move(&motion, &element, u);
        uz_element_strain(strain, &motion, uz_element_type_of(element.kind)->local[1]);
        for (int s = 0; s < uz_stress_count(element.model); s++)
            CHECK(fabs(strain[s] - thermal[s]) < 1e-16);
    }
}

/* The divergence theorem on one element: pressure p all round does the work -p integral div v on v, here v = x. It
 * fails for a side in the wrong sense, or with a wrong measure. */
TEST(pressure_all_round_is_the_volume)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], work = 0, sum[3] = {0}, area = 0;
        element = bent(xe, element, 1);
        const int dim = uz_element_type_of(element.kind)->dim;
        for (int s = 0; s < uz_element_type_of(element.kind)->sides; s++) {
            double xs[3 * UZ_SIDE_NODES], f[3 * UZ_SIDE_NODES] = {0}, pressure[UZ_SIDE_NODES];
            const uz_side side = side_of(xs, &element, s);
            for (int a = 0; a < side.nodes; a++)
                pressure[a] = 4;
            uz_side_add_pressure(f, &side, pressure);
            for (int k = 0; k < side.nodes * dim; k++) {
                work += f[k] * xs[k];
                sum[k % dim] += f[k];
            }
            area += uz_side_area(&side);
        }
        const bool ring = element.model == UZ_AXISYMMETRIC;
        CHECK_REL(work, -4.0 * (ring ? 3 : dim) * uz_element_volume(&element), 1e-13);
        for (int c = 0; c < dim; c++)
            CHECK(fabs(sum[c]) < 1e-13 * 4 * area || (ring && c == 0));
    }
}

/* Areas, weights, mass and tractions of one side are one integral. */
TEST(side_integrals_agree)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        enum { MOST = 3 * UZ_SIDE_NODES };
        double xe[UZ_ELEMENT_DOFS], xs[MOST], w[UZ_SIDE_NODES], M[UZ_SIDE_NODES * UZ_SIDE_NODES], t[3] = {3, -1, 2};
        double f[MOST] = {0};
        element = bent(xe, element, 1);
        const uz_side side = side_of(xs, &element, uz_element_type_of(element.kind)->sides - 1);
        const int dim = side.dim, n = side.nodes;
        double area = 0;
        uz_side_weights(w, &side);
        side_mass(M, &side);
        for (int a = 0; a < n; a++) {
            double row = 0;
            area += w[a];
            for (int b = 0; b < n; b++) {
                row += M[a * n + b];
                CHECK(M[a * n + b] == M[b * n + a]);
            }
            CHECK(fabs(row - w[a]) < 1e-15 * 20);
        }
        CHECK_REL(uz_side_area(&side), area, 1e-14);
        uz_side_add_traction(f, &side, t);
        for (int k = 0; k < n * dim; k++)
            CHECK(fabs(f[k] - w[k / dim] * t[k % dim]) < 1e-14);
    }
}

/* Known entries: a straight edge has A/6 (1, 4, 1) and mass A/30 (4, -1, 2; ...), a triangle mass A/12 (2, 1, 1), one
 * of six nodes weights (0, 0, 0, A/3, A/3, A/3) and mass A/180 (6, -1, -1, 0, -4, 0) in its first row (Zienkiewicz and
 * Taylor, vol. 1). */
TEST(sides_have_their_textbook_weights)
{
    double w[6], M[36];
    const double edge[6] = {0, 0, 3, 4, 1.5, 2}; /* length 5, thickness 0.6 */
    const uz_side line = {2, 3, UZ_PLANE_STRESS, 0.6, edge};
    uz_side_weights(w, &line);
    CHECK_REL(w[0], 0.5, 1e-14);
    CHECK_REL(w[1], 0.5, 1e-14);
    CHECK_REL(w[2], 2.0, 1e-14);
    side_mass(M, &line);
    CHECK_REL(M[0], 0.4, 1e-14);
    CHECK_REL(M[1], -0.1, 1e-13);
    CHECK_REL(M[2], 0.2, 1e-13);
    CHECK_REL(M[8], 1.6, 1e-14);
    const double triangle[18] = {0, 0, 1, 2, 0, 1, 0, 3, 1, 1, 0, 1, 1, 1.5, 1, 0, 1.5, 1}; /* area 3 */
    const double row[6] = {0.1, -1. / 60, -1. / 60, 0, -1. / 15, 0};
    const uz_side three = {3, 3, UZ_SOLID, 0, triangle}, six = {3, 6, UZ_SOLID, 0, triangle};
    side_mass(M, &three);
    CHECK_REL(M[0], 0.5, 1e-14);
    CHECK_REL(M[1], 0.25, 1e-14);
    uz_side_weights(w, &six);
    side_mass(M, &six);
    for (int a = 0; a < 6; a++) {
        CHECK(fabs(w[a] - (a < 3 ? 0 : 1)) < 1e-15);
        CHECK(fabs(M[a] - row[a]) < 1e-15);
    }
    const double ring_edge[4] = {1, 0, 3, 0};
    const uz_side ring = {2, 2, UZ_AXISYMMETRIC, 0, ring_edge};
    double vector[2];
    CHECK_REL(uz_side_area(&ring), TAU / 2 * (9 - 1), 1e-14);
    uz_side_area_vector(vector, &ring, (const double[2]){0, 0});
    CHECK(vector[0] == 0);
    CHECK_REL(vector[1], -TAU * 2, 1e-14); /* the ring is above: outward is down */
}

/* A square of eight nodes: weights of a constant traction -A/12 at corners and A/3 between (Zienkiewicz and Taylor,
 * vol. 1), the first row of the mass A/180 (6, 2, 3, 2, -6, -8, -8, -6), and weights that are positive. */
TEST(face_of_eight_nodes_has_known_weights)
{
    const double square[24] = {0, 0, 1, 2, 0, 1, 2, 2, 1, 0, 2, 1, 1, 0, 1, 2, 1, 1, 1, 2, 1, 0, 1, 1}; /* area 4 */
    const double row[8] = {6, 2, 3, 2, -6, -8, -8, -6};
    const uz_side side = {3, 8, UZ_SOLID, 0, square};
    double w[8], M[64];
    uz_side_weights(w, &side);
    side_mass(M, &side);
    for (int a = 0; a < 8; a++) {
        CHECK_REL(w[a], a < 4 ? -4. / 12 : 4. / 3, 1e-14);
        CHECK_REL(M[a], 4. / 180 * row[a], 1e-13);
    }
    uz_side_positive_weights(w, &side);
    for (int a = 0; a < 8; a++)
        CHECK_REL(w[a], a < 4 ? 4. / 20 : 4. / 5, 1e-14);
}

/* The shape functions of a side are those of its element there. */
TEST(sides_are_their_elements_sides)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++)
        for (int s = 0; s < uz_element_type_of(element.kind)->sides; s++) {
            double xe[UZ_ELEMENT_DOFS], xs[3 * UZ_SIDE_NODES], N[UZ_SIDE_NODES], Ne[UZ_ELEMENT_NODES], at[3] = {0};
            const int *local = uz_element_type_of(element.kind)->side[s].node;
            element = bent(xe, element, 1);
            const uz_side side = side_of(xs, &element, s);
            uz_side_shape(N, &side, (const double[2]){0.3, 0.2});
            for (int a = 0; a < side.nodes; a++)
                for (int c = 0; c < 3; c++)
                    at[c] += N[a] * uz_element_type_of(element.kind)->local[local[a]][c];
            uz_element_shape(Ne, element.kind, at);
            for (int a = 0; a < side.nodes; a++) {
                CHECK(fabs(Ne[local[a]] - N[a]) < 1e-15);
                uz_side_shape(Ne, &side, uz_side_local_nodes(&side)[a]);
                for (int b = 0; b < side.nodes; b++)
                    CHECK(Ne[b] == (a == b));
                uz_element_shape(Ne, element.kind, at);
            }
        }
}
