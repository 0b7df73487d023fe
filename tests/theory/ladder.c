/* grids.c: the grids that are tried for the paper's body where its cells are chosen ("cells": "auto"). */
#include "theory/theory_parts.h"

#include "ladder_fixture.h"

static void print_levels(FILE *json, const uz_grid_sequence *grids)
{
    for (int k = 0; k < grids->count; k++) {
        const int64_t *cells = grids->level[k].cells;
        fprintf(json, "%s[%lld, %lld]", k ? ", " : "", (long long)cells[0], (long long)cells[1]);
        printf("%s%lld x %lld", k ? ", " : "", (long long)cells[0], (long long)cells[1]);
    }
}

void theory_ladders(FILE *json)
{
    static const double asked[] = {0.05, 0.02};
    fprintf(json, ",\n\"ladders\": [\n");
    for (int k = 0; k < 2; k++) {
        uz_scene scene = paper(1);
        const uz_settings settings = asking(asked[k]);
        uz_result *result = solve(&scene, &settings);
        const uz_grid_sequence *grids = result->grids;
        CHECK_MSG(grids && result->summary.outcome == UZ_CONVERGED, "the paper's body at %g did not end well",
                  asked[k]);
        fprintf(json, "%s  {\"asked\": %g, \"tried\": [", k ? ",\n" : "", asked[k]);
        printf("| the paper's body, %g %% asked | ", 100 * asked[k]);
        if (grids)
            print_levels(json, grids);
        fprintf(json, "], \"cells\": [%lld, %lld]}", grids ? (long long)grids->cells[0] : 0,
                grids ? (long long)grids->cells[1] : 0);
        printf(" |\n");
        uz_result_free(result);
        uz_scene_clear(&scene);
    }
    fprintf(json, "\n]");
}
