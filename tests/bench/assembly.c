/* assembly.c: what a large scene costs beside its factorization: the assembly of K, N, p and h, and everything that may
 * be asked of the answer: all fields, and the VTK file. */
#include "bench.h"
#include "assembly/assembly.h"
#include "core/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 5, ITEMS = 4 };

static const unsigned ALL_FIELDS = UZ_FIELD_PRESSURE | UZ_FIELD_CONTACT_STATUS | UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL |
                                   UZ_FIELD_VON_MISES | UZ_FIELD_STRAIN | UZ_FIELD_STRESS_GAUSS;
static const unsigned ALL_OF_FILE = UZ_FIELD_PRESSURE | UZ_FIELD_CONTACT_STATUS | UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL |
                                    UZ_FIELD_VON_MISES | UZ_FIELD_STRAIN | UZ_FIELD_DISPLACEMENTS | UZ_FIELD_REACTIONS |
                                    UZ_FIELD_GAPS | UZ_FIELD_MATERIALS;

static const struct {
    const char *name, *element;
    uz_model model;
    double size[3];
    int64_t cells[3];
} SCENES[] = {
    {"assembly_quad4", "quad4", UZ_PLANE_STRESS, {60, 20}, {546, 182}},
    {"assembly_tri3", "tri3", UZ_PLANE_STRESS, {60, 20}, {546, 182}},
    {"assembly_quad8", "quad8", UZ_PLANE_STRAIN, {60, 20}, {316, 105}},
    {"assembly_hex8", "hex8", UZ_SOLID, {1, 1, 1}, {40, 40, 39}},
};
enum { N_SCENES = sizeof SCENES / sizeof SCENES[0] };

const char *bench_assembly_name(int which)
{
    return which < N_SCENES ? SCENES[which].name : NULL;
}

/* Held on the left, pressed on the floor; false: no memory. */
static bool make_scene(uz_scene *s, int which)
{
    *s = (uz_scene){.model = SCENES[which].model, .thickness = 1, .source = UZ_MESH_BOX};
    s->box.dim = s->model == UZ_SOLID ? 3 : 2;
    strcpy(s->box.element, SCENES[which].element);
    memcpy(s->box.size, SCENES[which].size, sizeof s->box.size);
    memcpy(s->box.cells, SCENES[which].cells, sizeof s->box.cells);
    s->materials = calloc(ITEMS, sizeof *s->materials);
    s->supports = calloc(ITEMS, sizeof *s->supports);
    s->loads = calloc(ITEMS, sizeof *s->loads);
    s->contacts = calloc(ITEMS, sizeof *s->contacts);
    if (!s->materials || !s->supports || !s->loads || !s->contacts)
        return false;
    s->n_materials = s->n_supports = s->n_loads = s->n_contacts = 1;
    s->materials[0] = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3};
    s->supports[0] = (uz_support){.on = "left"};
    s->loads[0] = (uz_load){.on = "top", .v = {0.1, -0.5, 0}};
    s->contacts[0] = (uz_contact){.on = "bottom", .normal = {0, 1, 0}};
    return true;
}

static double seconds_of_assembly(const uz_scene *scene)
{
    uz_qp qp;
    const double start = uz_seconds();
    const bool ok = uz_scene_to_qp(&qp, NULL, scene, NULL) == UZ_OK;
    const double seconds = uz_seconds() - start;
    uz_qp_clear(&qp);
    return ok ? seconds : NAN;
}

static double seconds_of_outputs(const uz_scene *scene, const uz_result *answer)
{
    const uz_field_source source = {answer->u, answer->r, answer->g, answer->n_nodes * answer->mesh.dim, answer->m};
    uz_fields fields;
    char *text = NULL;
    size_t len;
    const double start = uz_seconds();
    const bool ok = uz_fields_compute(&fields, scene, &source, ALL_FIELDS, NULL, NULL) == UZ_OK &&
                    uz_vtu_write(&text, &len, scene, &source, ALL_OF_FILE, NULL, NULL) == UZ_OK;
    const double seconds = uz_seconds() - start;
    uz_fields_clear(&fields);
    free(text);
    return ok ? seconds : NAN;
}

static double cholmod_seconds(const uz_qp *qp, bench_ordering ordering)
{
    const bench_linear t = bench_cholmod(&qp->K, qp->p, ordering);
    return t.analyze + t.factorize;
}

/* Of two orderings the faster; in space AMD takes minutes. */
static double seconds_of_factor(const uz_scene *scene)
{
    uz_qp qp;
    if (uz_scene_to_qp(&qp, NULL, scene, NULL) != UZ_OK)
        return NAN;
    double seconds = cholmod_seconds(&qp, BENCH_METIS);
    if (scene->model != UZ_SOLID)
        seconds = fmin(seconds, cholmod_seconds(&qp, BENCH_AMD));
    uz_qp_clear(&qp);
    return seconds;
}

static bool measure(bench_assembly *out, const uz_scene *scene, const uz_result *answer)
{
    double whole[RUNS], assembly[RUNS], outputs[RUNS], factor[RUNS];
    for (int k = 0; k < RUNS; k++) {
        factor[k] = seconds_of_factor(scene);
        assembly[k] = seconds_of_assembly(scene);
        outputs[k] = seconds_of_outputs(scene, answer);
        whole[k] = (assembly[k] + outputs[k]) / factor[k];
        if (isnan(whole[k]))
            return false;
    }
    out->whole = bench_summarise(whole, RUNS);
    out->assembly = bench_summarise(assembly, RUNS);
    out->outputs = bench_summarise(outputs, RUNS);
    out->factor = bench_summarise(factor, RUNS);
    return true;
}

bool bench_assembly_of(bench_assembly *out, int which)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
    uz_settings settings = uz_settings_default();
    uz_result *answer = NULL;
    settings.relative_error = 1e-2;
    bool ok = make_scene(&problem.scene, which) && uz_solve(&answer, &problem, &settings, NULL, NULL, NULL) == UZ_OK;
    ok = ok && measure(out, &problem.scene, answer);
    uz_result_free(answer);
    uz_problem_clear(&problem);
    return ok;
}
