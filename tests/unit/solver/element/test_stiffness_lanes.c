/* Stiffness of elements in lanes: that of each alone, to the last bit. */
#include "element/stiffness_lanes.h"
#include "harness.h"

#include <math.h>
#include <string.h>

enum { LANES = UZ_STRAIN_LANES, DOFS = UZ_ELEMENT_DOFS };

typedef struct {
    uz_element element;
    double xyz[DOFS];
} single;

/* Local coordinates a little elsewhere, another way in each lane, and materials of their own. */
static void make_singles(single of[LANES], uz_element_kind kind, uz_model model, uz_formulation formulation)
{
    const uz_element_type *type = uz_element_type_of(kind);
    for (int l = 0; l < LANES; l++) {
        for (int a = 0; a < type->nodes; a++)
            for (int c = 0; c < type->dim; c++)
                of[l].xyz[a * type->dim + c] =
                    3 + type->local[a][c] + 0.04 * sin(5.0 * a + 3.0 * c + 2.0 * l) + 0.1 * type->local[a][0];
        of[l].element = (uz_element){.kind = kind,
                                     .model = model,
                                     .formulation = formulation,
                                     .lame = uz_lame_of(model, 100.0 + l, 0.1 + 0.1 * l),
                                     .thickness = 0.3,
                                     .xyz = of[l].xyz};
    }
}

static bool make_in_lanes(double ke[LANES][DOFS * DOFS], const single of[LANES])
{
    static uz_stiffness_rule rule;
    const uz_element *first = &of[0].element;
    double *each[LANES];
    uz_lanes x[DOFS];
    uz_lane_material material;
    uz_stiffness_rule_of(&rule, first->kind, first->model);
    for (int l = 0; l < LANES; l++) {
        CHECK(uz_is_for_lanes(&of[l].element));
        each[l] = ke[l];
        material.lambda[l] = of[l].element.lame.lambda;
        material.mu[l] = of[l].element.lame.mu;
        for (int i = 0; i < rule.nodes * rule.dim; i++)
            x[i][l] = of[l].xyz[i];
    }
    return uz_lane_stiffness(each, &rule, first->formulation, x, &material, first->thickness);
}

static void check_bits(uz_element_kind kind, uz_model model, uz_formulation formulation)
{
    static double ke[LANES][DOFS * DOFS], alone[DOFS * DOFS];
    const int n = uz_element_type_of(kind)->nodes * uz_element_type_of(kind)->dim;
    single of[LANES];
    make_singles(of, kind, model, formulation);
    CHECK(make_in_lanes(ke, of));
    for (int l = 0; l < LANES; l++) {
        CHECK(uz_element_stiffness(alone, &of[l].element) == UZ_SHAPE_GOOD);
        CHECK_MSG(memcmp(alone, ke[l], (size_t)(n * n) * sizeof *alone) == 0, "%s, model %d, formulation %d, lane %d",
                  uz_element_type_of(kind)->name, model, formulation, l);
    }
}

TEST(lanes_have_the_bits_of_single_elements)
{
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)kind);
        static const uz_model PLANE[] = {UZ_PLANE_STRESS, UZ_PLANE_STRAIN}, SPACE[] = {UZ_SOLID, UZ_SOLID};
        const uz_model *models = type->dim == 2 ? PLANE : SPACE;
        for (int k = 0; k < 4 - type->dim; k++) {
            check_bits((uz_element_kind)kind, models[k], UZ_FORMULATION_STANDARD);
            if (type->bbar && models[k] != UZ_PLANE_STRESS)
                check_bits((uz_element_kind)kind, models[k], UZ_FORMULATION_BBAR);
        }
    }
}

TEST(what_lanes_cannot_make_is_told)
{
    const uz_anisotropy general = {.poisson = 0.3};
    uz_element element = {.kind = UZ_QUAD4, .model = UZ_PLANE_STRESS, .formulation = UZ_FORMULATION_STANDARD};
    CHECK(uz_is_for_lanes(&element));
    element.model = UZ_AXISYMMETRIC;
    CHECK(!uz_is_for_lanes(&element));
    element.model = UZ_PLANE_STRAIN;
    element.formulation = UZ_FORMULATION_INCOMPATIBLE;
    CHECK(!uz_is_for_lanes(&element));
    element.formulation = UZ_FORMULATION_BBAR;
    CHECK(uz_is_for_lanes(&element));
    element.lame.general = &general;
    CHECK(!uz_is_for_lanes(&element));
}

/* Whatever lane it is in. */
TEST(one_bad_element_is_noticed)
{
    static double ke[LANES][DOFS * DOFS];
    static const double INSIDE[16] = {-1, -0.3, 1.4, -2, 0, 1.8, -0.2, 2, -0.7, -0.5, 1.1, 0.8, -0.1, 0.6, -1.4, 0.6};
    single of[LANES];
    for (int l = 0; l < LANES; l++) {
        make_singles(of, UZ_HEX8, UZ_SOLID, UZ_FORMULATION_STANDARD);
        for (int i = 0; i < 24; i++)
            of[l].xyz[i] = -of[l].xyz[i];
        CHECK(!make_in_lanes(ke, of));
        make_singles(of, UZ_TET4, UZ_SOLID, UZ_FORMULATION_STANDARD);
        for (int c = 0; c < 3; c++) /* flat */
            of[l].xyz[9 + c] = of[l].xyz[c];
        CHECK(!make_in_lanes(ke, of));
        make_singles(of, UZ_QUAD4, UZ_PLANE_STRESS, UZ_FORMULATION_STANDARD);
        of[l].xyz[5] = NAN;
        CHECK(!make_in_lanes(ke, of));
        make_singles(of, UZ_QUAD8, UZ_PLANE_STRESS, UZ_FORMULATION_STANDARD);
        memcpy(of[l].xyz, INSIDE, sizeof INSIDE); /* inverted between good nodes */
        CHECK(!make_in_lanes(ke, of));
        make_singles(of, UZ_QUAD4, UZ_PLANE_STRESS, UZ_FORMULATION_STANDARD);
        of[l].element.lame = uz_lame_of(UZ_PLANE_STRESS, 1e307, 0.3);
        CHECK(!make_in_lanes(ke, of));
        of[l].element.lame = uz_lame_of(UZ_PLANE_STRESS, 1e-307, 0.3);
        CHECK(!make_in_lanes(ke, of));
    }
}
