/* elements.c: the patch test and orders of convergence of all elements; Cook's membrane and a rubber tube by
 * formulation. */
#include "theory/theory_parts.h"

#include "element_accuracy.h"
#include "element_bodies.h"

static void accuracy(FILE *json)
{
    uz_element element;
    fprintf(json, ",\n\"elements\": [\n");
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        double errors[2];
        const double patch = patch_error(&element, 1), order = convergence_order(errors, &element);
        fprintf(json, "%s  {\"name\": \"%s\", \"degree\": %d, \"patch\": %.3g, \"order\": %.6g}", i ? ",\n" : "",
                element_words(&element), element_degree(&element), patch, order);
        printf("| %-40s | patch test off by %8.2g | order %.4f |\n", element_words(&element), patch, order);
    }
    fprintf(json, "\n]");
}

/* What a formulation buys on meshes of 4 and of 64 cells, and in rubber. */
static const struct {
    uz_element_kind kind;
    uz_formulation way;
    const char *name;
} SHOWN[] = {{UZ_QUAD4, UZ_FORMULATION_STANDARD, "standard"},
             {UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, "incompatible_modes"},
             {UZ_QUAD4, UZ_FORMULATION_BBAR, "bbar"},
             {UZ_QUAD8, UZ_FORMULATION_STANDARD, "standard"}};
enum { SHOWN_COUNT = sizeof SHOWN / sizeof SHOWN[0] };

static void membranes(FILE *json)
{
    int written = 0;
    fprintf(json, ",\n\"cook\": [\n");
    for (int k = 0; k < SHOWN_COUNT; k++)
        for (int cells = 4; cells <= 64 && SHOWN[k].way != UZ_FORMULATION_BBAR; cells *= 16) {
            const double moved = cook(SHOWN[k].kind, SHOWN[k].way, UZ_PLANE_STRESS, 1. / 3, cells);
            fprintf(json, "%s  {\"element\": \"%s\", \"formulation\": \"%s\", \"cells\": %d, \"deflection\": %.6g}",
                    written++ ? ",\n" : "", uz_element_name(SHOWN[k].kind), SHOWN[k].name, cells, moved);
            printf("| Cook's membrane, %s %s | %d cells | %.4f |\n", uz_element_name(SHOWN[k].kind), SHOWN[k].name,
                   cells, moved);
        }
    fprintf(json, "\n]");
}

static void tubes(FILE *json)
{
    fprintf(json, ",\n\"tubes\": [\n");
    for (int k = 0; k < SHOWN_COUNT; k++) {
        const double ratio = tube(SHOWN[k].kind, UZ_PLANE_STRAIN, SHOWN[k].way, 0.4999);
        fprintf(json, "%s  {\"element\": \"%s\", \"formulation\": \"%s\", \"ratio\": %.6g}", k ? ",\n" : "",
                uz_element_name(SHOWN[k].kind), SHOWN[k].name, ratio);
        printf("| rubber tube, %s %s | %.4f of the exact displacement |\n", uz_element_name(SHOWN[k].kind),
               SHOWN[k].name, ratio);
    }
    fprintf(json, "\n]");
}

void theory_elements(FILE *json)
{
    accuracy(json);
    membranes(json);
    tubes(json);
}
