/* theory.c: how stress and contact pressure come closer to theory as meshes get finer, how exact elements are, and
 * which grids a chosen accuracy takes: `make theory`. Prints tables and writes them as JSON. usage: theory OUTPUT.json
 */
#include "theory.h"
#include "theory/theory_parts.h"

static FILE *json;
static int rows;

static void print(const theory_table *t)
{
    for (int i = 0; i < t->count; i++) {
        fprintf(json, "%s  {\"name\": \"%s\", \"quantity\": \"%s\", \"computed\": %.9g, \"theory\": %.9g}",
                rows++ ? ",\n" : "", t->row[i].name, t->row[i].quantity, t->row[i].computed, t->row[i].theory);
        printf("| %-66s | %-14s | %12.6g | %12.6g | %7.3f %% |\n", t->row[i].name, t->row[i].quantity,
               t->row[i].computed, t->row[i].theory, 100 * theory_error(&t->row[i]));
    }
    fflush(stdout);
}

static void hertz_ladder(uz_model model, const char *element, int first, int last, double growth)
{
    for (int n = first; n <= last; n *= 2) {
        theory_table t = {.count = 0};
        theory_hertz(&t, model, element, n, growth);
        print(&t);
    }
}

static void hertz(void)
{
    hertz_ladder(UZ_PLANE_STRAIN, "quad4", 8, 64, 1.2);
    hertz_ladder(UZ_PLANE_STRAIN, "tri3", 16, 64, 1.2);
    hertz_ladder(UZ_PLANE_STRAIN, "quad8", 8, 32, 1.2);
    hertz_ladder(UZ_PLANE_STRAIN, "tri6", 8, 32, 1.2);
    hertz_ladder(UZ_AXISYMMETRIC, "quad4", 8, 64, 1.2);
    hertz_ladder(UZ_AXISYMMETRIC, "quad8", 8, 32, 1.2);
    hertz_ladder(UZ_SOLID, "hex8", 3, 12, 1.6);
    hertz_ladder(UZ_SOLID, "tet10", 3, 3, 1.8);
}

static void others(void)
{
    theory_table t = {.count = 0};
    for (int n = 8; n <= 32; n *= 2)
        theory_punch(&t, "quad4", n);
    for (int n = 6; n <= 24; n *= 2)
        theory_tube(&t, UZ_PLANE_STRAIN, "quad4", n);
    for (int n = 3; n <= 12; n *= 2)
        theory_tube(&t, UZ_PLANE_STRAIN, "quad8", n);
    for (int n = 6; n <= 24; n *= 2)
        theory_tube(&t, UZ_AXISYMMETRIC, "quad4", n);
    for (int n = 1; n <= 4; n *= 2)
        theory_beam(&t, "quad4", UZ_FORMULATION_INCOMPATIBLE, n);
    theory_beam(&t, "quad8", UZ_FORMULATION_AUTO, 1);
    theory_beam(&t, "tri3", UZ_FORMULATION_AUTO, 16);
    for (int n = 8; n <= 32; n *= 2)
        theory_roller(&t, "quad4", n, 1.25);
    theory_roller(&t, "quad8", 10, 1.3);
    print(&t);
}

int main(int argc, char **argv)
{
    if (argc != 2 || !(json = fopen(argv[1], "w"))) {
        fprintf(stderr, "usage: theory OUTPUT.json\n");
        return 2;
    }
    fprintf(json, "{\"rows\": [\n");
    printf("| %-66s | %-14s | %12s | %12s | %9s |\n|---|---|---|---|---|\n", "body", "quantity", "computed", "theory",
           "error");
    hertz();
    others();
    fprintf(json, "\n]");
    theory_elements(json);
    theory_ladders(json);
    fprintf(json, "}\n");
    return fclose(json) != 0 || test_has_failed();
}
