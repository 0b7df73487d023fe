/* strain_energy.c: the energy of elements of different shapes, of which no matrix is kept, or of a body that is carried
 * along: by their strains, some elements at a time. */
#include "assembly/parts.h"

#include "assembly/strain_group.h"
#include "core/cpu.h"

typedef struct {
    const uz_body_model *model;
    double twice;
} energy_sum;

static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    const energy_sum *sum = ctx;
    uz_strain_rule_at(rule, kind, sum->model->kind, formulation, NULL, NULL, 0);
}

/* n: components, `direct` of them no shear. */
UZ_INLINE void add(energy_sum *sum, const uz_strain_group *g, int n, int direct)
{
    uz_lanes energy = {0};
    for (int p = 0; p < g->rule.asked; p++) {
        const uz_lanes *strain = g->strain[p];
        uz_lanes trace = {0}, squares = {0}, shears = {0};
        for (int c = 0; c < direct; c++) {
            trace += strain[c];
            squares += strain[c] * strain[c];
        }
        for (int c = direct; c < n; c++)
            shears += strain[c] * strain[c];
        energy += g->shape.volume[p] * (g->material.lambda * trace * trace + g->material.mu * (2 * squares + shears));
    }
    for (int l = 0; l < g->count; l++)
        sum->twice += energy[l];
}

UZ_INLINE void add_of_model(energy_sum *sum, const uz_strain_group *g)
{
    if (g->rule.stresses == 3)
        add(sum, g, 3, 2);
    else if (g->rule.stresses == 4)
        add(sum, g, 4, 3);
    else
        add(sum, g, 6, 3);
}

UZ_AVX2_FMA static void add_fused(energy_sum *sum, const uz_strain_group *g)
{
    add_of_model(sum, g);
}

/* Of a material with directions, one element after the other. */
static void add_each(energy_sum *sum, const uz_strain_group *g)
{
    for (int l = 0; l < g->count; l++)
        for (int p = 0; p < g->rule.asked; p++) {
            double strain[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES];
            for (int c = 0; c < g->rule.stresses; c++)
                strain[c] = g->strain[p][c][l];
            uz_elastic_stress(stress, g->rule.model, *g->lame[l], strain);
            for (int c = 0; c < g->rule.stresses; c++)
                sum->twice += g->shape.volume[p][l] * stress[c] * strain[c];
        }
}

static void add_group(void *ctx, const uz_strain_group *group)
{
    if (group->general)
        add_each(ctx, group);
    else
        (uz_cpu_has_avx2_fma() ? add_fused : add_of_model)(ctx, group);
}

uz_status uz_strain_energy_of_groups(double *twice, const uz_body_model *model, const double *nodal, bool carried,
                                     int64_t begin, int64_t end, uz_error *err)
{
    energy_sum sum = {.model = model};
    const uz_strain_work work = {make_rule, add_group, &sum};
    const uz_strain_source from = {
        .model = model, .nodal = nodal, .apart = true, .unrotated = carried, .begin = begin, .end = end};
    const uz_status status = uz_strain_groups(&work, &from, NULL, err);
    *twice = sum.twice;
    return status;
}
