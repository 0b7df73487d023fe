/* One element of every kind, model and formulation: shape functions, rules, stiffness, strain. */
#include "element/element.h"
#include "element_mesh.h"
#include "harness.h"
#include "hex8.h"

static const double TAU = 6.283185307179586;

TEST(shape_functions_are_one_at_their_node_and_sum_to_one)
{
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        const uz_element_kind k = (uz_element_kind)kind;
        const int nodes = uz_element_node_count(k);
        double N[UZ_ELEMENT_NODES], sum = 0;
        for (int a = 0; a < nodes; a++) {
            uz_element_shape(N, k, uz_element_type_of(k)->local[a]);
            for (int b = 0; b < nodes; b++)
                CHECK(N[b] == (a == b));
        }
        for (int m = uz_element_type_of(k)->corners; m < nodes; m++)
            for (int c = 0; c < uz_element_type_of(k)->dim; c++) {
                const int *end = uz_element_type_of(k)->edge[m - uz_element_type_of(k)->corners];
                CHECK(uz_element_type_of(k)->local[m][c] ==
                      0.5 * (uz_element_type_of(k)->local[end[0]][c] + uz_element_type_of(k)->local[end[1]][c]));
            }
        uz_element_shape(N, k, (const double[3]){0.3, 0.21, 0.4});
        for (int a = 0; a < nodes; a++)
            sum += N[a];
        CHECK_REL(sum, 1.0, 1e-15);
    }
}

/* With x = the reference coordinates the gradients are those by them; central differences of a polynomial of degree 3
 * at most in each direction are exact but for h^2. */
TEST(gradients_are_the_shape_functions_derivatives)
{
    const double point[3] = {0.3, 0.21, 0.17}, h = 1e-4;
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        uz_element element = {.kind = (uz_element_kind)kind};
        const int nodes = uz_element_node_count(element.kind), dim = uz_element_type_of(element.kind)->dim;
        double xe[UZ_ELEMENT_DOFS], grad[UZ_ELEMENT_NODES][3], up[UZ_ELEMENT_NODES], down[UZ_ELEMENT_NODES];
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < dim; c++)
                xe[a * dim + c] = uz_element_type_of(element.kind)->local[a][c];
        element.xyz = xe;
        CHECK_REL(uz_element_gradients(grad, &element, point), 1.0, 1e-14);
        for (int c = 0; c < dim; c++) {
            double ahead[3] = {point[0], point[1], point[2]}, behind[3] = {point[0], point[1], point[2]};
            ahead[c] += h;
            behind[c] -= h;
            uz_element_shape(up, element.kind, ahead);
            uz_element_shape(down, element.kind, behind);
            for (int a = 0; a < nodes; a++)
                CHECK(fabs((up[a] - down[a]) / (2 * h) - grad[a][c]) < 1e-7);
        }
    }
}

/* Integral of x^p y^q z^r over the reference element. */
static double monomial(uz_element_kind kind, int p, int q, int r)
{
    const int dim = uz_element_type_of(kind)->dim;
    if (corner_count(kind) == dim + 1) /* p! q! r! / (p + q + r + dim)! */
        return tgamma(p + 1) * tgamma(q + 1) * tgamma(r + 1) / tgamma(p + q + r + dim + 1);
    const bool wedge = corner_count(kind) == 6; /* a triangle times a line */
    double product = wedge ? tgamma(p + 1) * tgamma(q + 1) / tgamma(p + q + 3) : 1;
    const int power[3] = {p, q, r};
    for (int c = wedge ? 2 : 0; c < dim; c++)
        product *= power[c] % 2 ? 0 : 2.0 / (power[c] + 1);
    return product;
}

TEST(gauss_rules_have_their_degree)
{
    static const int DEGREE[UZ_ELEMENT_KINDS] = {
        [UZ_TRI3] = 1, [UZ_QUAD4] = 3, [UZ_TRI6] = 2,  [UZ_QUAD8] = 5,  [UZ_TET4] = 1,
        [UZ_HEX8] = 3, [UZ_TET10] = 2, [UZ_HEX20] = 5, [UZ_WEDGE6] = 2, [UZ_WEDGE15] = 2};
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (int ring = 0; ring < 2; ring++) {
            const uz_element_kind k = (uz_element_kind)kind;
            const uz_model model = ring ? UZ_AXISYMMETRIC : UZ_PLANE_STRESS;
            const int degree = k == UZ_TRI3 && ring ? 2 : DEGREE[k], dim = uz_element_type_of(k)->dim;
            for (int p = 0; p <= degree; p++)
                for (int q = 0; p + q <= degree; q++)
                    for (int r = 0; p + q + r <= degree && (dim == 3 || r == 0); r++) {
                        double sum = 0;
                        const uz_gauss_rule *rule = uz_element_rule(k, model);
                        for (int g = 0; g < rule->count; g++) {
                            const double *at = rule->point[g].at;
                            sum += rule->point[g].weight * pow(at[0], p) * pow(at[1], q) * pow(at[2], r);
                        }
                        CHECK(fabs(sum - monomial(k, p, q, r)) < (rule->count > 9 ? 4e-15 : 1e-15));
                    }
        }
}

/* Eigenvalues of the symmetric A (n x n), unordered, by Jacobi's rotations. A is destroyed. */
static void eigenvalues(double *value, double *A, int n)
{
    for (int sweep = 0; sweep < 30; sweep++)
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++) {
                if (A[p * n + q] == 0)
                    continue;
                const double theta = (A[q * n + q] - A[p * n + p]) / (2 * A[p * n + q]);
                const double t = copysign(1, theta) / (fabs(theta) + hypot(theta, 1)), c = 1 / hypot(t, 1), s = t * c;
                for (int k = 0; k < n; k++) {
                    const double x = A[k * n + p], y = A[k * n + q];
                    A[k * n + p] = c * x - s * y;
                    A[k * n + q] = s * x + c * y;
                }
                for (int k = 0; k < n; k++) {
                    const double x = A[p * n + k], y = A[q * n + k];
                    A[p * n + k] = c * x - s * y;
                    A[q * n + k] = s * x + c * y;
                }
            }
    for (int i = 0; i < n; i++)
        value[i] = A[i * n + i];
}

static void check_null_space(const uz_element *element)
{
    double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], value[UZ_ELEMENT_DOFS], largest = 0;
    const int n = uz_element_node_count(element->kind) * uz_element_type_of(element->kind)->dim;
    const int rigid = element->model == UZ_SOLID ? 6 : element->model == UZ_AXISYMMETRIC ? 1 : 3;
    int none = 0, soft = 0;
    CHECK(uz_element_stiffness(ke, element) == UZ_SHAPE_GOOD);
    for (int r = 0; r < n; r++)
        for (int c = 0; c < r; c++)
            CHECK(ke[r * n + c] == ke[c * n + r]);
    eigenvalues(value, ke, n);
    for (int k = 0; k < n; k++)
        largest = fmax(largest, value[k]);
    for (int k = 0; k < n; k++) {
        none += fabs(value[k]) < 1e-13 * largest;
        soft += value[k] < 1e-5 * largest;
    }
    CHECK_MSG(none == rigid && soft == rigid, "%s: %d eigenvalues are zero, %d small, want %d", element_words(element),
              none, soft, rigid);
}

TEST(only_rigid_motions_have_no_energy)
{
    uz_element element;
    uint64_t seed = 17;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS];
        const int dim = uz_element_type_of(element.kind)->dim, n = uz_element_node_count(element.kind) * dim;
        element = bent(xe, element, 1);
        check_null_space(&element);
        for (int k = corner_count(element.kind) * dim; k < n; k++) /* curved */
            xe[k] += 0.05 * shake(&seed);
        check_null_space(&element);
    }
}

static void random_motion(double *u, int n, uint64_t seed)
{
    for (int k = 0; k < n; k++)
        u[k] = shake(&seed);
}

/* Stiffness and strain are two derivations: from the energy's second derivatives, and from the displacement. */
TEST(stiffness_is_the_strain_energy)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], u[UZ_ELEMENT_DOFS], v[UZ_ELEMENT_DOFS];
        element = bent(xe, element, 1);
        const int n = uz_element_node_count(element.kind) * uz_element_type_of(element.kind)->dim;
        CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
        random_motion(u, n, 3);
        random_motion(v, n, 4);
        uz_element_motion of_u, of_v;
        uz_element_move(&of_u, &element, u);
        uz_element_move(&of_v, &element, v);
        double work = 0, form = 0, size = 0;
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        for (int g = 0; g < rule->count; g++) {
            double grad[UZ_ELEMENT_NODES][3], strain[6], stress[6];
            const double *at = rule->point[g].at, weight = rule->point[g].weight;
            const double measure = element_measure(&element, at, uz_element_gradients(grad, &element, at));
            uz_element_strain(strain, &of_u, at);
            uz_element_strain(stress, &of_v, at);
            uz_elastic_stress(stress, element.model, element.lame, stress);
            for (int s = 0; s < uz_stress_count(element.model); s++)
                work += weight * measure * strain[s] * stress[s];
        }
        for (int r = 0; r < n; r++)
            for (int c = 0; c < n; c++) {
                form += u[r] * ke[r * n + c] * v[c];
                size += fabs(u[r] * ke[r * n + c] * v[c]);
            }
        CHECK_MSG(fabs(work - form) < 1e-14 * size, "%s: %.17g from strains, %.17g from the stiffness",
                  element_words(&element), work, form);
    }
}

/* A field x -> H x, and its strain in the element's model. */
static void linear_field(double *u, double *strain, const uz_element *element, double H[3][3])
{
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const bool ring = element->model == UZ_AXISYMMETRIC, solid = element->model == UZ_SOLID;
    for (int a = 0; a < nodes; a++)
        for (int c = 0; c < dim; c++) {
            u[a * dim + c] = 0;
            for (int j = 0; j < dim; j++)
                u[a * dim + c] += H[c][j] * element->xyz[a * dim + j];
        }
    strain[0] = H[0][0];
    strain[1] = H[1][1];
    strain[2] = solid ? H[2][2] : ring ? H[0][0] : H[0][1] + H[1][0];
    strain[3] = H[0][1] + H[1][0];
    strain[4] = H[1][2] + H[2][1];
    strain[5] = H[0][2] + H[2][0];
}

/* Everywhere, in every formulation: the mean is the strain itself, and no incompatible mode stirs. */
TEST(linear_fields_have_their_strain)
{
    double H[3][3] = {{0.3, -0.7, 0.2}, {0.4, 0.5, 0.9}, {-0.6, 0.1, -0.8}};
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], u[UZ_ELEMENT_DOFS], want[6], got[6];
        uz_element_motion motion;
        element = bent(xe, element, 1);
        H[0][1] = element.model == UZ_AXISYMMETRIC ? 0 : -0.7; /* else the hoop strain is not constant */
        linear_field(u, want, &element, H);
        uz_element_move(&motion, &element, u);
        for (int a = 0; a < uz_element_node_count(element.kind); a++) {
            uz_element_strain(got, &motion, uz_element_type_of(element.kind)->local[a]);
            for (int s = 0; s < uz_stress_count(element.model); s++)
                CHECK_MSG(fabs(got[s] - want[s]) < 1e-13, "%s: strain %d at node %d is %.17g, want %.17g",
                          element_words(&element), s, a, got[s], want[s]);
        }
    }
}

/* And they need the forces of their stress, all six (four, three) components of it. */
TEST(constant_stress_has_its_forces)
{
    double H[3][3] = {{0.3, -0.7, 0.2}, {0.4, 0.5, 0.9}, {-0.6, 0.1, -0.8}};
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], u[UZ_ELEMENT_DOFS], strain[6], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
        double f[UZ_ELEMENT_DOFS] = {0}, largest = 0;
        element = bent(xe, element, 1);
        const int n = uz_element_node_count(element.kind) * uz_element_type_of(element.kind)->dim;
        H[0][1] = element.model == UZ_AXISYMMETRIC ? 0 : -0.7;
        linear_field(u, strain, &element, H);
        CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
        uz_element_add_thermal_load(f, &element, strain);
        for (int r = 0; r < n; r++)
            largest = fmax(largest, fabs(f[r]));
        for (int r = 0; r < n; r++) {
            double force = 0;
            for (int c = 0; c < n; c++)
                force += ke[r * n + c] * u[c];
            CHECK_MSG(fabs(force - f[r]) < 1e-13 * largest, "%s: dof %d has %g, want %g", element_words(&element), r,
                      force, f[r]);
        }
    }
}

/* u_x = x^2, u_y = x y [, u_z = y z]: quadratic elements have it exactly, straight-sided. */
TEST(quadratic_elements_have_quadratic_fields)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], u[UZ_ELEMENT_DOFS], got[6], N[UZ_ELEMENT_NODES], x[3] = {0};
        const double point[3] = {0.3, 0.2, 0.1};
        const int dim = uz_element_type_of(element.kind)->dim, nodes = uz_element_node_count(element.kind);
        uz_element_motion motion;
        if (nodes == corner_count(element.kind) || corner_count(element.kind) > dim + 1)
            continue; /* but for simplices only on parallelograms */
        element = bent(xe, element, 1);
        for (int a = 0; a < nodes; a++) {
            u[a * dim] = xe[a * dim] * xe[a * dim];
            u[a * dim + 1] = xe[a * dim] * xe[a * dim + 1];
            if (dim == 3)
                u[a * dim + 2] = xe[a * dim + 1] * xe[a * dim + 2];
        }
        uz_element_shape(N, element.kind, point);
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < dim; c++)
                x[c] += N[a] * xe[a * dim + c];
        uz_element_move(&motion, &element, u);
        uz_element_strain(got, &motion, point);
        CHECK_REL(got[0], 2 * x[0], 1e-13);
        CHECK_REL(got[1], x[0], 1e-13);
        if (element.model == UZ_SOLID)
            CHECK_REL(got[4], x[2], 1e-12);
        else
            CHECK_REL(got[element.model == UZ_AXISYMMETRIC ? 3 : 2], x[1], 1e-12);
        if (element.model == UZ_AXISYMMETRIC)
            CHECK_REL(got[2], x[0], 1e-13);
    }
}

/* The hoop strain of a point on the axis is its radial strain. */
TEST(a_ring_may_reach_the_axis)
{
    const double xe[8] = {0, 0, 2, 0, 2, 1, -1e-18, 1};
    uz_element element = {UZ_QUAD4, UZ_AXISYMMETRIC, UZ_FORMULATION_STANDARD, {1, 1, NULL}, .thickness = 0, .xyz = xe};
    double u[8], want[6], got[6], ke[64];
    uz_element_motion motion;
    linear_field(u, want, &element, (double[3][3]){{0.25, 0}, {0.5, 2}});
    CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
    for (int i = 0; i < 64; i++)
        CHECK(isfinite(ke[i]));
    uz_element_move(&motion, &element, u);
    uz_element_strain(got, &motion, uz_element_type_of(UZ_QUAD4)->local[3]);
    CHECK(got[0] == 0.25 && got[2] == 0.25);
    CHECK_REL(uz_element_volume(&element), TAU / 2 * 4, 1e-15);
}

/* K of the turned element is Q K Q'. */
TEST(turning_an_element_turns_its_stiffness)
{
    uz_element element;
    const double c = cos(0.7), s = sin(0.7), d = cos(-1.1), t = sin(-1.1);
    const double Q3[3][3] = {{c, -s * d, s * t}, {s, c * d, -c * t}, {0, t, d}}, Q2[3][3] = {{c, -s}, {s, c}};
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double xe[UZ_ELEMENT_DOFS], xt[UZ_ELEMENT_DOFS] = {0}, largest = 0, worst = 0;
        double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], kt[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
        if (element.model == UZ_AXISYMMETRIC)
            continue;
        element = bent(xe, element, 1);
        const int dim = uz_element_type_of(element.kind)->dim, n = uz_element_node_count(element.kind) * dim;
        const double(*Q)[3] = dim == 3 ? Q3 : Q2;
        for (int k = 0; k < n; k++)
            for (int j = 0; j < dim; j++)
                xt[k] += Q[k % dim][j] * xe[k / dim * dim + j];
        CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
        element.xyz = xt;
        CHECK(uz_element_stiffness(kt, &element) == UZ_SHAPE_GOOD);
        for (int k = 0; k < n; k++)
            for (int l = 0; l < n; l++) {
                double turned = 0;
                for (int p = 0; p < dim; p++)
                    for (int q = 0; q < dim; q++)
                        turned += Q[k % dim][p] * ke[(k / dim * dim + p) * n + l / dim * dim + q] * Q[l % dim][q];
                largest = fmax(largest, fabs(turned));
                worst = fmax(worst, fabs(turned - kt[k * n + l]));
            }
        CHECK_MSG(worst < 1e-13 * largest, "%s: off by %g of %g", element_words(&element), worst, largest);
    }
}

/* In other units of length K is multiplied by a power of the ratio, whatever the ratio. */
TEST(units_of_length_change_no_digit)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++)
        for (int k = 0; k < 2; k++) {
            const double scale = k ? 3e6 : 7e-9;
            double xe[UZ_ELEMENT_DOFS], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], ks[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
            double largest = 0, worst = 0;
            element = bent(xe, element, 1);
            const int n = uz_element_node_count(element.kind) * uz_element_type_of(element.kind)->dim;
            CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
            element = bent(xe, element, scale);
            CHECK(uz_element_stiffness(ks, &element) == UZ_SHAPE_GOOD);
            const double power = element.model >= UZ_AXISYMMETRIC ? scale : 1;
            for (int j = 0; j < n * n; j++) {
                largest = fmax(largest, fabs(ke[j]));
                worst = fmax(worst, fabs(ks[j] / power - ke[j]));
            }
            CHECK_MSG(worst < 1e-13 * largest, "%s: off by %g of %g", element_words(&element), worst, largest);
        }
}

TEST(cube_has_the_stiffness_of_the_matrices_of_strains)
{
    double ke[24 * 24], want[24][24], xe[24];
    const double h = 0.25;
    uz_element element = {UZ_HEX8,        UZ_SOLID, UZ_FORMULATION_STANDARD, uz_lame_of(UZ_SOLID, 1, HEX8_POISSON),
                          .thickness = 0, .xyz = xe};
    int bits[8];
    for (int a = 0; a < 8; a++) {
        bits[a] = 0;
        for (int c = 0; c < 3; c++) {
            const bool upper = uz_element_type_of(UZ_HEX8)->local[a][c] > 0;
            xe[3 * a + c] = upper ? h : 0;
            bits[a] |= upper << c;
        }
    }
    hex8_element(want, h);
    CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
    for (int i = 0; i < 24; i++)
        for (int j = 0; j < 24; j++)
            CHECK(fabs(ke[24 * i + j] - want[3 * bits[i / 3] + i % 3][3 * bits[j / 3] + j % 3]) < 1e-15);
}

static uz_shape_fault fault_of(uz_element_kind kind, uz_model model, const double *xe)
{
    double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
    const uz_element element = {kind, model, UZ_FORMULATION_STANDARD, {1, 1, NULL}, .thickness = 1, .xyz = xe};
    const uz_shape_fault fault = uz_element_stiffness(ke, &element);
    CHECK(uz_element_check(&element) == fault);
    CHECK(strlen(uz_shape_fault_text(fault)) > 5);
    return fault;
}

TEST(bad_plane_elements_are_refused)
{
    const uz_model p = UZ_PLANE_STRESS, ring = UZ_AXISYMMETRIC;
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 1, 0, 1, 1, 0, 1}) == UZ_SHAPE_GOOD);
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 0, 1, 1, 1, 1, 0}) == UZ_SHAPE_INVERTED);
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 1, 1, 1, 0, 0, 1}) == UZ_SHAPE_INVERTED);     /* a bow tie */
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 2, 0, 0.2, 0.2, 0, 2}) == UZ_SHAPE_INVERTED); /* not convex */
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 1, 0, 1, 0, 0, 1}) == UZ_SHAPE_DEGENERATE);
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 0.1, 0.1, 0.3, 0.3, 0, 1}) == UZ_SHAPE_DEGENERATE);
    CHECK(fault_of(UZ_QUAD4, p, (const double[]){0, 0, 1, 0, 1, (double)NAN, 0, 1}) == UZ_SHAPE_DEGENERATE);
    CHECK(fault_of(UZ_TRI3, p, (const double[]){0, 0, 1, 0, 0, 1}) == UZ_SHAPE_GOOD);
    CHECK(fault_of(UZ_TRI3, p, (const double[]){0, 0, 1e9, 0, 0, 1e-9}) == UZ_SHAPE_GOOD); /* flat, but no angle is */
    CHECK(fault_of(UZ_TRI3, p, (const double[]){0, 0, 0, 1, 1, 0}) == UZ_SHAPE_INVERTED);
    CHECK(fault_of(UZ_TRI3, p, (const double[]){0.1, 0.1, 0.3, 0.3, 0.7, 0.7}) == UZ_SHAPE_DEGENERATE);
    CHECK(fault_of(UZ_TRI6, p, (const double[]){0, 0, 1, 0, 0, 1, 0.5, 0.1, 0.5, 0.5, 0, 0.5}) == UZ_SHAPE_GOOD);
    CHECK(fault_of(UZ_TRI6, p, (const double[]){0, 0, 1, 0, 0, 1, 0.8, 0, 0.5, 0.5, 0, 0.5}) == UZ_SHAPE_MIDDLES);
    CHECK(fault_of(UZ_TRI6, p, (const double[]){0, 0, 0, 1, 1, 0, 0, 0.5, 0.5, 0.5, 0.5, 0}) == UZ_SHAPE_INVERTED);
    CHECK(fault_of(UZ_QUAD8, p, (const double[]){0, 0, 1, 0, 1, 1, 0, 1, 0.5, 1.2, 1, 0.5, 0.5, 1, 0, 0.5}) ==
          UZ_SHAPE_MIDDLES);
    CHECK(fault_of(UZ_QUAD8, p, (const double[]){0, 0, 1, 0, 1, 1, 0, 1, 0.25, 0, 1, 0.5, 0.5, 1, 0, 0.5}) ==
          UZ_SHAPE_MIDDLES); /* a quarter point: singular at the corner */
    CHECK(fault_of(UZ_QUAD4, ring, (const double[]){0, 0, 1, 0, 1, 1, 0, 1}) == UZ_SHAPE_GOOD);
    CHECK(fault_of(UZ_QUAD4, ring, (const double[]){-0.1, 0, 1, 0, 1, 1, 0, 1}) == UZ_SHAPE_NEGATIVE_RADIUS);
}

TEST(bad_solid_elements_are_refused)
{
    const uz_model s = UZ_SOLID;
    double cube[24], tet[30], ke[900];
    const uz_element small = {UZ_HEX8, s, UZ_FORMULATION_STANDARD, {1, 1, NULL}, .thickness = 1, .xyz = cube};
    memcpy(tet, (const double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 12 * sizeof *tet);
    CHECK(fault_of(UZ_TET4, s, tet) == UZ_SHAPE_GOOD);
    tet[11] = -1;
    CHECK(fault_of(UZ_TET4, s, tet) == UZ_SHAPE_INVERTED);
    tet[11] = 0;
    CHECK(fault_of(UZ_TET4, s, tet) == UZ_SHAPE_DEGENERATE);
    for (int a = 0; a < 10; a++)
        for (int c = 0; c < 3; c++)
            tet[3 * a + c] = uz_element_type_of(UZ_TET10)->local[a][c];
    CHECK(fault_of(UZ_TET10, s, tet) == UZ_SHAPE_GOOD);
    tet[3 * 9 + 1] = 0.85; /* beyond a quarter of its edge */
    tet[3 * 9 + 2] = 0.15;
    CHECK(fault_of(UZ_TET10, s, tet) == UZ_SHAPE_MIDDLES);
    for (int i = 0; i < 24; i++)
        cube[i] = 1 + 1e-3 * uz_element_type_of(UZ_HEX8)->local[i / 3][i % 3];
    CHECK(uz_element_stiffness(ke, &small) == UZ_SHAPE_GOOD);
    cube[0] = cube[1] = cube[2] = 1 + 1e-3; /* a corner at the opposite one */
    CHECK(uz_element_stiffness(ke, &small) == UZ_SHAPE_INVERTED);
}

/* At every node these have a positive Jacobian, inside not. */
TEST(elements_inverted_inside_are_refused)
{
    const double quad[16] = {-1, -0.3, 1.4, -2, 0, 1.8, -0.2, 2, -0.7, -0.5, 1.1, 0.8, -0.1, 0.6, -1.4, 0.6};
    const double hex[24] = {0.1, 0.1,  -1.2, -0.1, -0.8, -0.1, 0.3, 0.1, -1.3, -1.1, 1.4, -1.7,
                            0,   -1.9, 0.4,  1.6,  -1.4, 0.2,  0.2, 2,   0,    -1.7, 1.3, 1.9};
    const double *xyz[2] = {quad, hex};
    for (int k = 0; k < 2; k++) {
        const uz_element_kind kind = k ? UZ_HEX8 : UZ_QUAD8;
        const uz_element element = {kind,         UZ_PLANE_STRESS, UZ_FORMULATION_STANDARD,
                                    {1, 1, NULL}, .thickness = 1,  .xyz = xyz[k]};
        double grad[UZ_ELEMENT_NODES][3];
        for (int a = 0; a < uz_element_node_count(kind); a++)
            CHECK(uz_element_gradients(grad, &element, uz_element_type_of(kind)->local[a]) > 1e-3);
        CHECK(fault_of(kind, k ? UZ_SOLID : UZ_PLANE_STRESS, xyz[k]) == (k ? UZ_SHAPE_INVERTED : UZ_SHAPE_MIDDLES));
    }
}

/* No node is beyond the axis, but a curved side is. */
TEST(a_curved_side_must_not_cross_the_axis)
{
    const double thin[16] = {0, 0, 0.2, 0, 1.2, 1, 1, 1, 0.1, 0, 0.2, 0.5, 1.1, 1, 0, 0.5};
    CHECK(fault_of(UZ_QUAD8, UZ_PLANE_STRESS, thin) == UZ_SHAPE_GOOD);
    CHECK(fault_of(UZ_QUAD8, UZ_AXISYMMETRIC, thin) == UZ_SHAPE_NEGATIVE_RADIUS);
}

/* An area that is only the rounding of its coordinates is none; a sharp angle is one. */
TEST(rounding_is_no_area)
{
    const double line[6] = {-0.45, -0.54, -0.45 + 0.1, -0.54 + 0.3, -0.45 + 0.2, -0.54 + 0.6};
    const uz_element element = {UZ_TRI3,      UZ_PLANE_STRESS, UZ_FORMULATION_STANDARD,
                                {1, 1, NULL}, .thickness = 1,  .xyz = line};
    double grad[UZ_ELEMENT_NODES][3];
    CHECK(uz_element_gradients(grad, &element, (const double[3]){0.3, 0.3}) > 0);
    CHECK(fault_of(UZ_TRI3, UZ_PLANE_STRESS, line) == UZ_SHAPE_DEGENERATE);
    CHECK(fault_of(UZ_TRI3, UZ_PLANE_STRESS, (const double[]){0, 0, 1, 0, 2, 1e-6}) == UZ_SHAPE_GOOD);
}

TEST(formulations_are_resolved)
{
    const uz_formulation a = UZ_FORMULATION_AUTO, s = UZ_FORMULATION_STANDARD, b = UZ_FORMULATION_BBAR,
                         i = UZ_FORMULATION_INCOMPATIBLE;
    CHECK(uz_resolve_formulation(a, UZ_QUAD4, UZ_PLANE_STRAIN, 0.3) == s);
    CHECK(uz_resolve_formulation(a, UZ_QUAD4, UZ_PLANE_STRAIN, 0.49) == b);
    CHECK(uz_resolve_formulation(a, UZ_QUAD4, UZ_AXISYMMETRIC, 0.49) == b);
    CHECK(uz_resolve_formulation(a, UZ_HEX8, UZ_SOLID, 0.49) == b);
    CHECK(uz_resolve_formulation(a, UZ_QUAD4, UZ_PLANE_STRESS, 0.49) == s);
    CHECK(uz_resolve_formulation(a, UZ_TET10, UZ_SOLID, 0.49) == s);
    CHECK(uz_resolve_formulation(s, UZ_HEX8, UZ_SOLID, 0.49) == s);
    CHECK(uz_resolve_formulation(b, UZ_HEX8, UZ_SOLID, 0.1) == b);
    CHECK(uz_resolve_formulation(b, UZ_QUAD4, UZ_PLANE_STRESS, 0.1) == s);
    CHECK(uz_resolve_formulation(i, UZ_QUAD4, UZ_PLANE_STRESS, 0.1) == i);
    CHECK(uz_resolve_formulation(i, UZ_QUAD4, UZ_AXISYMMETRIC, 0.1) == s);
    CHECK(uz_resolve_formulation(i, UZ_TET4, UZ_SOLID, 0.1) == s);
}
