/* Materials with directions: closed forms, and an isotropic one among them. */
#include "element/element.h"
#include "element_mesh.h"
#include "harness.h"

/* A laminate of carbon fibres along its x; it differs in all that may differ. */
static const uz_orthotropic FIBRES = {
    .young = {140, 9, 11}, .poisson = {0.3, 0.4, 0.27}, .shear = {5, 3.2, 4.1}, .expansion = {-1e-6, 3e-5, 2e-5}};

static uz_orthotropic like(double young, double poisson, double expansion)
{
    const double shear = young / (2 * (1 + poisson));
    return (uz_orthotropic){.young = {young, young, young},
                            .poisson = {poisson, poisson, poisson},
                            .shear = {shear, shear, shear},
                            .expansion = {expansion, expansion, expansion}};
}

/* Directions of the material, of any length; in the plane: turned about z. */
static void turn(uz_orthotropic *m, uz_model model, int k)
{
    static const double SPACE[2][2][3] = {{{1, 2, -3}, {2, 2, 2}}, {{0, -0.1, 0}, {0, 0, 7}}};
    const double angle = 0.4 + k, plane[2][3] = {{2 * cos(angle), 2 * sin(angle), 0}, {-sin(angle), cos(angle), 0}};
    memcpy(m->axes, model == UZ_SOLID ? SPACE[k] : plane, sizeof m->axes);
}

TEST(the_same_in_all_directions_it_is_isotropic)
{
    const double strain[6] = {3e-3, -4e-3, 1e-3, 2e-3, -5e-3, 1e-3}, nus[] = {-0.4, 0, 0.3, 0.4999};
    for (int i = 0; i < 4 * 4 * 2; i++) {
        const uz_model model = (uz_model)(i % 4);
        const double nu = nus[i / 4 % 4], heat = 20, expansion = 1.2e-5;
        const int n = uz_stress_count(model);
        uz_orthotropic m = like(70e3, nu, expansion);
        uz_anisotropy general;
        turn(&m, model, i / 16);
        uz_orthotropic_make(&general, model, &m);
        const uz_lame lame = uz_lame_of(model, 70e3, nu), own = uz_lame_general(&general);
        double want[6], found[6], scale = 0;
        uz_elastic_stress(want, model, lame, strain);
        uz_elastic_stress(found, model, own, strain);
        for (int c = 0; c < n; c++)
            scale = fmax(scale, fabs(general.C[c][c]) * 5e-3);
        for (int c = 0; c < n; c++)
            CHECK_MSG(fabs(found[c] - want[c]) <= 1e-14 / (1 - 2 * nu) * scale,
                      "model %d, nu %g: %d is %.17g, not %.17g", (int)model, nu, c, found[c], want[c]);
        CHECK_REL(uz_stress_work(model, own, want), uz_stress_work(model, lame, want), 1e-11);
        CHECK(fabs(uz_stress_zz(model, own, want, heat) - uz_stress_zz(model, lame, want, heat * expansion)) <=
              1e-11 * scale);
        CHECK(fabs(uz_strain_zz(model, own, want, heat) - uz_strain_zz(model, lame, want, heat * expansion)) <= 1e-15);
        uz_thermal_strain(want, model, lame, heat * expansion);
        uz_thermal_strain(found, model, own, heat);
        for (int c = 0; c < n; c++)
            CHECK(fabs(found[c] - want[c]) <= 1e-11 * heat * expansion);
        CHECK(fabs(general.poisson - nu) <= 1e-12);
        CHECK(isnan(own.lambda) && isnan(own.mu));
    }
}

TEST(stiffness_and_compliance_are_inverse)
{
    for (int model = UZ_PLANE_STRESS; model <= UZ_SOLID; model++)
        for (int k = 0; k < 2; k++) {
            uz_orthotropic m = FIBRES;
            uz_anisotropy g;
            turn(&m, (uz_model)model, k);
            uz_orthotropic_make(&g, (uz_model)model, &m);
            const int n = uz_stress_count((uz_model)model);
            for (int i = 0; i < n; i++)
                for (int j = 0; j < n; j++) {
                    double sum = 0;
                    for (int l = 0; l < n; l++)
                        sum += g.C[i][l] * g.S[l][j];
                    CHECK_MSG(fabs(sum - (i == j)) < 1e-13, "model %d: %d, %d is %.3g", model, i, j, sum);
                    CHECK(fabs(g.C[i][j] - g.C[j][i]) <= 1e-15 * uz_most_stiffness(uz_lame_general(&g)));
                }
        }
}

/* A sheet pulled along x, its fibres turned by `angle` (Jones, "Mechanics of Composite Materials", ch. 2): the strains
 * along, across, and of shear; across the sheet those of both of its own axes. */
TEST(a_pull_off_the_axes)
{
    const double *E = FIBRES.young, *nu = FIBRES.poisson, *G = FIBRES.shear;
    for (int k = 0; k < 8; k++) {
        const double angle = 0.1 + 0.5 * k, c = cos(angle), s = sin(angle), stress[3] = {1, 0, 0};
        uz_orthotropic m = FIBRES;
        uz_anisotropy g;
        memcpy(m.axes, (double[2][3]){{c, s, 0}, {-s, c, 0}}, sizeof m.axes);
        uz_orthotropic_make(&g, UZ_PLANE_STRESS, &m);
        const double mixed = 1 / G[0] - 2 * nu[0] / E[0];
        CHECK_REL(g.S[0][0], pow(c, 4) / E[0] + pow(s, 4) / E[1] + mixed * c * c * s * s, 1e-14);
        CHECK_REL(g.S[0][1], (1 / E[0] + 1 / E[1] - 1 / G[0]) * c * c * s * s - nu[0] / E[0] * (pow(c, 4) + pow(s, 4)),
                  1e-13);
        CHECK_REL(g.S[0][2],
                  (2 / E[0] + 2 * nu[0] / E[0] - 1 / G[0]) * c * c * c * s -
                      (2 / E[1] + 2 * nu[0] / E[0] - 1 / G[0]) * c * s * s * s,
                  1e-13);
        CHECK_REL(uz_strain_zz(UZ_PLANE_STRESS, uz_lame_general(&g), stress, 2),
                  -nu[2] / E[0] * c * c - nu[1] / E[1] * s * s + 2 * FIBRES.expansion[2], 1e-13);
        CHECK_REL(g.expansion[0], FIBRES.expansion[0] * c * c + FIBRES.expansion[1] * s * s, 1e-13);
    }
}

/* In plane strain a solid's stress without strain across, warmed: what the solid's matrix says. */
TEST(plane_strain_is_the_solid_held)
{
    const double angle = 0.7, c = cos(angle), s = sin(angle), heat = 30, strain[6] = {2e-3, -1e-3, 0, 3e-3, 0, 0};
    const int row[3] = {0, 1, 3};
    uz_orthotropic m = FIBRES;
    uz_anisotropy plane, solid;
    double elastic[6], want[6], found[3], free_strain[6];
    memcpy(m.axes, (double[2][3]){{c, s, 0}, {-s, c, 0}}, sizeof m.axes);
    uz_orthotropic_make(&plane, UZ_PLANE_STRAIN, &m);
    uz_orthotropic_make(&solid, UZ_SOLID, &m);
    uz_thermal_strain(free_strain, UZ_SOLID, uz_lame_general(&solid), heat);
    for (int i = 0; i < 6; i++)
        elastic[i] = strain[i] - free_strain[i];
    uz_elastic_stress(want, UZ_SOLID, uz_lame_general(&solid), elastic);
    uz_thermal_strain(free_strain, UZ_PLANE_STRAIN, uz_lame_general(&plane), heat);
    for (int i = 0; i < 3; i++)
        elastic[i] = strain[row[i]] - free_strain[i];
    uz_elastic_stress(found, UZ_PLANE_STRAIN, uz_lame_general(&plane), elastic);
    for (int i = 0; i < 3; i++)
        CHECK_REL(found[i], want[row[i]], 1e-12);
    CHECK_REL(uz_stress_zz(UZ_PLANE_STRAIN, uz_lame_general(&plane), found, heat), want[2], 1e-12);
}

TEST(ratios_that_cost_no_energy_are_told)
{
    double pair[3];
    uz_orthotropic m = like(1, 0.3, 0);
    CHECK_REL(uz_orthotropic_energy(pair, &m), 1.3 * 1.3 * 0.4, 1e-14);
    m = like(1, 0.5, 0);
    CHECK(fabs(uz_orthotropic_energy(pair, &m)) < 1e-15);
    m = FIBRES;
    m.poisson[0] = 1.9; /* more than 1 / 2, as fibres draw in what is soft */
    CHECK(uz_orthotropic_energy(pair, &m) > 0 && pair[0] > 0);
    m.poisson[0] = 3.9; /* the root of 140 / 9 is 3.94, but with the others ... */
    CHECK(uz_orthotropic_energy(pair, &m) < 0 && pair[0] > 0);
    m.poisson[0] = 4;
    (void)uz_orthotropic_energy(pair, &m);
    CHECK(pair[0] < 0 && pair[1] > 0 && pair[2] > 0);
}

/* Every type of element in every model and formulation: the isotropic stiffness. */
static void check_stiffness(uz_element_kind kind, uz_model model, uz_formulation way)
{
    const uz_element_type *type = uz_element_type_of(kind);
    uz_orthotropic m = like(70, 0.3, 0);
    uz_anisotropy general;
    double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS],
        *ke = malloc(2 * sizeof(double) * UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS);
    const int dofs = type->nodes * type->dim, entries = dofs * dofs;
    turn(&m, model, 0);
    uz_orthotropic_make(&general, model, &m);
    for (int i = 0; i < dofs; i++) {
        xyz[i] = 2 + type->local[i / type->dim][i % type->dim] + 0.03 * sin(7 * i);
        u[i] = cos(3 * i);
    }
    const uz_formulation resolved = uz_resolve_formulation(way, kind, model, 0.3);
    uz_element element = {kind, model, resolved, uz_lame_of(model, 70, 0.3), .thickness = 0.75, .xyz = xyz};
    CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
    const double energy = uz_element_strain_energy(&element, u);
    element.lame = uz_lame_general(&general);
    CHECK(uz_element_stiffness(ke + entries, &element) == UZ_SHAPE_GOOD);
    double largest = 0, off = 0;
    for (int i = 0; i < entries; i++) {
        largest = fmax(largest, fabs(ke[i]));
        off = fmax(off, fabs(ke[i] - ke[entries + i]));
    }
    CHECK_MSG(off <= 1e-13 * largest, "%s, model %d, formulation %d: off by %.3g of %.3g", uz_element_name(kind),
              (int)model, (int)way, off, largest);
    CHECK_REL(uz_element_strain_energy(&element, u), energy, 1e-12);
    free(ke);
}

TEST(stiffness_of_the_isotropic_one)
{
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (int model = UZ_PLANE_STRESS; model <= UZ_SOLID; model++)
            for (int way = UZ_FORMULATION_STANDARD; way < UZ_FORMULATIONS; way++)
                if ((uz_element_type_of((uz_element_kind)kind)->dim == 3) == (model == UZ_SOLID))
                    check_stiffness((uz_element_kind)kind, (uz_model)model, (uz_formulation)way);
}

/* Its energy is u' K u / 2 in every formulation. */
TEST(energy_is_that_of_the_stiffness)
{
    for (int way = UZ_FORMULATION_STANDARD; way < UZ_FORMULATIONS; way++)
        for (int model = UZ_PLANE_STRESS; model <= UZ_SOLID; model++) {
            const uz_element_kind kind = model == UZ_SOLID ? UZ_HEX8 : UZ_QUAD4;
            const uz_element_type *type = uz_element_type_of(kind);
            const int dofs = type->nodes * type->dim;
            double xyz[24], u[24], ke[24 * 24], sum = 0;
            uz_orthotropic m = FIBRES;
            uz_anisotropy general;
            turn(&m, (uz_model)model, 1);
            uz_orthotropic_make(&general, (uz_model)model, &m);
            for (int i = 0; i < dofs; i++) {
                xyz[i] = 2 + type->local[i / type->dim][i % type->dim] + 0.1 * sin(7 * i);
                u[i] = cos(3 * i);
            }
            const uz_element element = {kind,
                                        (uz_model)model,
                                        uz_resolve_formulation((uz_formulation)way, kind, (uz_model)model, 0.3),
                                        uz_lame_general(&general),
                                        .thickness = 0.75,
                                        .xyz = xyz};
            CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
            for (int i = 0; i < dofs * dofs; i++)
                sum += 0.5 * ke[i] * u[i / dofs] * u[i % dofs];
            CHECK_REL(uz_element_strain_energy(&element, u), sum, 1e-12);
        }
}
