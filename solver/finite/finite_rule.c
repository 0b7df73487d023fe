#include "finite/finite_rule.h"

#include <string.h>

static void begin(uz_finite_rule *rule, uz_element_kind kind, uz_model model)
{
    const uz_element_type *type = uz_element_type_of(kind);
    rule->kind = kind;
    rule->model = model;
    rule->dim = type->dim;
    rule->nodes = type->nodes;
    rule->gauss = rule->points = 0;
}

static void add_point(uz_finite_rule *rule, const double point[3], double weight)
{
    const uz_element_type *type = uz_element_type_of(rule->kind);
    const int p = rule->points++;
    double N[UZ_ELEMENT_NODES], slope[UZ_ELEMENT_NODES][3];
    type->shape(type, N, slope, point);
    rule->weight[p] = weight;
    memset(rule->at_nodes[p], 0, sizeof rule->at_nodes[p]);
    for (int a = 0; a < rule->nodes; a++)
        for (int i = 0; i < 4; i++) {
            if (i >= rule->dim && i < 3)
                continue;
            const double value = i < 3 ? slope[a][i] : N[a];
            rule->at_nodes[p][i][a] = value;
            for (int lane = p; lane == p || lane % UZ_FINITE_LANES != 0; lane++)
                rule->at_points[a][i][lane] = value;
        }
}

void uz_finite_rule_of(uz_finite_rule *rule, uz_element_kind kind, uz_model model)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const uz_gauss_rule *gauss = uz_element_rule(kind, model);
    begin(rule, kind, model);
    for (int g = 0; g < gauss->count; g++)
        add_point(rule, gauss->point[g].at, gauss->point[g].weight);
    rule->gauss = rule->points;
    for (int a = 0; a < type->corners; a++)
        add_point(rule, type->local[a], 0);
}

void uz_finite_rule_at(uz_finite_rule *rule, uz_element_kind kind, uz_model model, const double point[3])
{
    begin(rule, kind, model);
    add_point(rule, point, 1);
    rule->gauss = rule->points;
}
