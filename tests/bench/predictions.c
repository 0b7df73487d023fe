/* predictions.c: what a solve is expected to take against what it takes, and what the other form of the operator does.
 * Each row in a process of its own, this program started again. Seconds are of the processor, without assembly: of the
 * time of a solve the share that is not. Memory is the largest resident set of a solve that knows nothing of its body
 * (proc(5): VmHWM) less what was there before. */
#include "bench/bench.h"
#include "core/clock.h"
#include "run/cost.h"
#include "scene/mesh.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define SIDE  40.0
#define YOUNG 1000.0

typedef struct {
    const char *element;
    int64_t cells[3];
    double poisson, stretch, jump; /* stretch: of a cell along x over the others; jump: of E in a ball; 0: 1 */
    bool moved;                    /* the mesh in numbers, inner nodes moved; in the plane graded */
    uz_operator op;
} predicted_row;

#define FREE  UZ_OPERATOR_MATRIX_FREE
#define DENSE UZ_OPERATOR_CONDENSED
static const predicted_row ROWS[] = {
    /* boxes */
    {"hex8", {16, 16, 16}, 0.3, 0, 0, false, 0},
    {"hex8", {32, 32, 32}, 0.3, 0, 0, false, 0},
    {"hex8", {48, 48, 48}, 0.3, 0, 0, false, 0},
    {"hex8", {64, 64, 64}, 0.3, 0, 0, false, 0},
    {"hex8", {32, 32, 32}, 0.45, 0, 0, false, 0},
    {"hex8", {32, 32, 32}, 0.49, 0, 0, false, 0},
    {"hex8", {48, 48, 48}, 0.49, 0, 0, false, 0},
    {"hex8", {32, 32, 32}, 0.3, 10, 0, false, 0},
    {"hex8", {32, 32, 32}, 0.3, 0.1, 0, false, 0},
    {"hex8", {48, 24, 36}, 0.3, 0, 0, false, 0},
    /* others */
    {"hex8", {12, 12, 12}, 0.3, 0, 0, true, 0},
    {"hex8", {16, 16, 16}, 0.3, 0, 0, true, 0},
    {"hex8", {24, 24, 24}, 0.3, 0, 0, true, 0},
    {"hex8", {32, 32, 32}, 0.3, 0, 0, true, 0},
    {"hex8", {48, 48, 48}, 0.3, 0, 0, true, 0},
    {"hex8", {64, 64, 64}, 0.3, 0, 0, true, 0},
    {"hex8", {24, 24, 24}, 0.45, 0, 0, true, 0},
    {"hex8", {32, 32, 32}, 0.45, 0, 0, true, 0},
    {"hex8", {24, 24, 24}, 0.49, 0, 0, true, 0},
    {"hex8", {32, 32, 32}, 0.49, 0, 0, true, 0},
    {"hex8", {32, 32, 32}, 0.3, 10, 0, true, 0},
    {"hex8", {32, 32, 32}, 0.3, 0, 1e4, true, 0},
    {"tet4", {16, 16, 16}, 0.3, 0, 0, false, 0},
    {"tet4", {24, 24, 24}, 0.3, 0, 0, false, 0},
    {"tet4", {32, 32, 32}, 0.3, 0, 0, false, 0},
    {"tet4", {48, 48, 48}, 0.3, 0, 0, false, 0},
    {"tet4", {24, 24, 24}, 0.45, 0, 0, false, 0},
    {"tet4", {24, 24, 24}, 0.3, 10, 0, false, 0},
    {"tet10", {8, 8, 8}, 0.3, 0, 0, false, 0},
    {"tet10", {12, 12, 12}, 0.3, 0, 0, false, 0},
    {"tet10", {16, 16, 16}, 0.3, 0, 0, false, 0},
    {"tet10", {24, 24, 24}, 0.3, 0, 0, false, 0},
    {"tet10", {12, 12, 12}, 0.49, 0, 0, false, 0},
    {"tet10", {16, 16, 16}, 0.45, 0, 0, false, 0},
    {"hex20", {12, 12, 12}, 0.3, 0, 0, false, 0},
    {"hex20", {16, 16, 16}, 0.3, 0, 0, false, 0},
    {"wedge6", {24, 24, 24}, 0.3, 0, 0, false, 0},
    {"wedge6", {32, 32, 32}, 0.3, 0, 0, false, 0},
    /* the plane */
    {"quad4", {60, 20, 0}, 0.3, 0, 0, false, 0},
    {"quad4", {150, 50, 0}, 0.3, 0, 0, false, 0},
    {"quad4", {300, 100, 0}, 0.3, 0, 0, false, 0},
    {"quad4", {600, 200, 0}, 0.3, 0, 0, false, 0},
    {"quad4", {900, 300, 0}, 0.3, 0, 0, false, 0},
    {"quad4", {300, 100, 0}, 0.3, 0, 0, false, DENSE},
    {"quad4", {600, 200, 0}, 0.3, 0, 0, false, DENSE},
    {"quad4", {900, 300, 0}, 0.3, 0, 0, false, DENSE},
    {"quad8", {300, 100, 0}, 0.3, 0, 0, false, 0},
    {"tri3", {300, 100, 0}, 0.3, 0, 0, false, 0},
    /* by the other form */
    {"hex8", {24, 24, 24}, 0.3, 0, 0, true, DENSE},
    {"hex8", {24, 24, 24}, 0.3, 0, 0, true, FREE},
    {"hex8", {16, 16, 16}, 0.3, 0, 0, true, DENSE},
    {"hex8", {16, 16, 16}, 0.3, 0, 0, true, FREE},
    {"hex8", {24, 24, 24}, 0.49, 0, 0, true, DENSE},
    {"hex8", {24, 24, 24}, 0.49, 0, 0, true, FREE},
    {"hex8", {32, 32, 32}, 0.3, 0, 0, true, DENSE},
    {"hex8", {32, 32, 32}, 0.49, 0, 0, true, DENSE},
    {"hex8", {32, 32, 32}, 0.3, 10, 0, true, DENSE},
    {"hex8", {16, 16, 16}, 0.3, 0, 0, false, DENSE},
    {"hex8", {32, 32, 32}, 0.49, 0, 0, false, DENSE},
    {"tet4", {24, 24, 24}, 0.3, 0, 0, false, DENSE},
    {"tet4", {24, 24, 24}, 0.3, 0, 0, false, FREE},
    {"tet4", {32, 32, 32}, 0.3, 0, 0, false, DENSE},
    {"tet4", {24, 24, 24}, 0.3, 10, 0, false, FREE},
    {"tet10", {12, 12, 12}, 0.3, 0, 0, false, DENSE},
    {"tet10", {12, 12, 12}, 0.3, 0, 0, false, FREE},
    {"tet10", {16, 16, 16}, 0.3, 0, 0, false, DENSE},
    {"tet10", {12, 12, 12}, 0.49, 0, 0, false, FREE},
    {"hex20", {12, 12, 12}, 0.3, 0, 0, false, FREE},
    {"wedge6", {24, 24, 24}, 0.3, 0, 0, false, FREE},
    {"quad4", {300, 100, 0}, 0.3, 0, 0, true, FREE},
    {"quad4", {600, 200, 0}, 0.3, 0, 0, true, FREE},
    {"quad4", {900, 300, 0}, 0.3, 0, 0, true, FREE},
    {"quad8", {300, 100, 0}, 0.3, 0, 0, false, FREE},
};
enum { COUNT = sizeof ROWS / sizeof ROWS[0] };

/* -------------------------------------------------------------------- a row's scene */

static void *room(int64_t count, size_t size)
{
    void *at = calloc((size_t)count, size);
    if (!at)
        abort();
    return at;
}

/* Between -1 and 1, always the same. */
static double scattered(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / (double)(1ull << 52) - 1.0;
}

static void move_nodes(uz_given_mesh *to, const uz_mesh *mesh, const uz_box *box)
{
    uint64_t seed = 1;
    to->n_nodes = mesh->n_nodes;
    to->xyz = room(3 * mesh->n_nodes, sizeof *to->xyz);
    for (int64_t i = 0; i < 3 * mesh->n_nodes; i++) {
        const int c = (int)(i % 3);
        const double x = mesh->xyz[i], by = 0.15 * scattered(&seed) * box->size[c] / (double)box->cells[c];
        to->xyz[i] = x > 0.0 && x < (1.0 - 1e-9) * box->size[c] ? x + by : x;
    }
}

static uz_given_group faces_of(const uz_mesh *mesh, const uz_group *from)
{
    uz_given_group to = {.n_faces = from->n_faces};
    memcpy(to.name, from->name, sizeof to.name);
    to.face_first = room(from->n_faces + 1, sizeof *to.face_first);
    to.face_node = room(from->n_faces * UZ_FACE_NODES, sizeof *to.face_node);
    for (int64_t i = 0; i < from->n_faces; i++)
        to.face_first[i + 1] = to.face_first[i] + uz_mesh_face(to.face_node + to.face_first[i], mesh, from->face[i]);
    return to;
}

/* Elements in a ball that no plane of the mesh touches, or the rest. */
static uz_given_group ball_of(const uz_mesh *mesh, const uz_box *box, bool inside)
{
    uz_given_group to = {0};
    snprintf(to.name, sizeof to.name, inside ? "ball" : "rest");
    to.element = room(mesh->n_elements, sizeof *to.element);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        double distance = 0.0;
        for (int c = 0; c < 3; c++) {
            double middle = 0.0;
            for (int k = 0; k < count; k++)
                middle += mesh->xyz[3 * node[k] + c] / (double)count / box->size[c];
            distance = hypot(distance, middle - 0.47);
        }
        if ((distance < 0.27) == inside)
            to.element[to.n_elements++] = e;
    }
    return to;
}

static void give_mesh(uz_scene *scene)
{
    uz_mesh mesh;
    uz_error err = {0};
    uz_given_mesh *g = &scene->given;
    if (uz_mesh_from_box(&mesh, &scene->box, &err) != UZ_OK)
        abort();
    const int64_t total = mesh.first[mesh.n_elements];
    *g = (uz_given_mesh){.dim = 3, .n_elements = mesh.n_elements};
    move_nodes(g, &mesh, &scene->box);
    g->kind = memcpy(room(mesh.n_elements, 1), mesh.kind, (size_t)mesh.n_elements);
    g->first = memcpy(room(mesh.n_elements + 1, sizeof *g->first), mesh.first,
                      (size_t)(mesh.n_elements + 1) * sizeof *g->first);
    g->node = memcpy(room(total, sizeof *g->node), mesh.node, (size_t)total * sizeof *g->node);
    g->groups = room(mesh.n_groups + 2, sizeof *g->groups);
    for (int64_t i = 0; i < mesh.n_groups; i++)
        if (mesh.groups[i].kind == UZ_GROUP_FACES)
            g->groups[g->n_groups++] = faces_of(&mesh, &mesh.groups[i]);
    for (int inside = 0; inside < 2; inside++)
        g->groups[g->n_groups++] = ball_of(&mesh, &scene->box, inside);
    scene->source = UZ_MESH_GIVEN;
    uz_mesh_clear(&mesh);
}

/* A block clamped on the left, pulled, and pressed on a plane under it; in the plane the paper's body. */
static uz_scene scene_of(const predicted_row *row)
{
    uz_scene s = bench_paper_scene(30);
    snprintf(s.box.element, sizeof s.box.element, "%s", row->element);
    memcpy(s.box.cells, row->cells, sizeof s.box.cells);
    s.materials[0].poisson = row->poisson;
    if (row->cells[2] == 0) { /* cells that are not all equal have a matrix */
        s.box.grading[0] = row->moved ? 1.01 : 1.0;
        return s;
    }
    s.model = UZ_SOLID;
    s.box.dim = 3;
    s.materials[0].young = YOUNG;
    s.supports[0].u[2] = 0.0;
    const double cell = SIDE / (double)row->cells[0];
    for (int c = 0; c < 3; c++)
        s.box.size[c] = cell * (double)row->cells[c] * (c == 0 && row->stretch > 0.0 ? row->stretch : 1.0);
    if (row->moved)
        give_mesh(&s);
    if (row->jump > 0.0) { /* the ball's elements, and all others */
        s.materials = realloc(s.materials, 2 * sizeof *s.materials);
        if (!s.materials)
            abort();
        s.materials[1] = s.materials[0];
        snprintf(s.materials[0].on, sizeof s.materials[0].on, "rest");
        snprintf(s.materials[1].on, sizeof s.materials[1].on, "ball");
        s.materials[1].young *= row->jump;
        s.n_materials = 2;
    }
    return s;
}

/* ------------------------------------------------------------------------- a row */

/* Bytes by the name of a line in the system's account of this process, 0 where it does not tell. */
static double told(const char *name)
{
    char line[256];
    long long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, name, strlen(name)) == 0)
            sscanf(line + strlen(name), ": %lld", &kilobytes);
    if (file)
        fclose(file);
    return 1024.0 * (double)kilobytes;
}

static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* What of a solve a row tells. */
typedef struct {
    uz_cost cost;
    uz_operator op;
    double seconds, order, made, iterated, certified; /* of the processor; made: what stands for K^-1 */
} solved;

static bool solve(solved *out, const uz_problem *problem, uz_operator op, uz_cache *cache)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.op = op;
    settings.relative_error = 1e-6;
    const double start = processor_seconds(), begun = uz_seconds();
    const bool ok =
        uz_solve(&result, problem, &settings, cache, NULL, &err) == UZ_OK && result->summary.outcome == UZ_CONVERGED;
    const double passed = uz_seconds() - begun, spent = processor_seconds() - start;
    if (ok) {
        const uz_timings *t = &result->summary.timings;
        const double share = spent / passed;
        *out = (solved){.cost = result->summary.cost, .op = result->summary.op};
        out->seconds = share * out->cost.actual_seconds;
        out->order = share * t->order;
        out->made = share * (t->factor + t->condense);
        out->iterated = share * t->iterate;
        out->certified = share * t->certify;
        /* the order of a factor was there, and its time known by the clock, before the price was told */
        out->cost.seconds -= t->order * (1.0 - fmin(1.0, share));
    } else {
        fprintf(stderr, "%s\n", result ? result->summary.message : err.message);
    }
    uz_result_free(result);
    return ok;
}

int bench_predictions_child(const char *which)
{
    const predicted_row *row = &ROWS[atoi(which)];
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene_of(row)};
    uz_cache *cache = uz_cache_new((size_t)8 << 30);
    solved cold, cached;
    uz_prediction asked;
    uz_settings settings = uz_settings_default();
    double before, peak;
    uz_error err = {0};
    settings.op = row->op;
    const double begun = processor_seconds();
    if (uz_predict(&asked, &problem, &settings, NULL, &err) != UZ_OK)
        return 1;
    const double asking = processor_seconds() - begun;
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file) {
        fputs("5", file);
        fclose(file);
    }
    before = told("VmRSS");
    if (!solve(&cold, &problem, row->op, cache))
        return 1;
    peak = told("VmHWM") - before;
    for (int64_t k = 0; k < problem.scene.n_loads; k++)
        for (int c = 0; c < 3; c++)
            problem.scene.loads[k].v[c] *= 1.03;
    if (!solve(&cached, &problem, row->op, cache))
        return 1;
    printf("{\"element\": \"%s\", \"cells\": [%lld, %lld, %lld], \"poisson\": %g, \"stretch\": %g, \"jump\": %g, "
           "\"moved\": %s, \"asked\": \"%s\", \"operator\": \"%s\", \"unknowns\": %lld, \"asking_s\": %.4g, "
           "\"asked_s\": %.4g, \"predicted_s\": %.4g, \"cold_s\": %.4g, \"predicted_cached_s\": %.4g, "
           "\"cached_s\": %.4g, \"order_s\": %.4g, \"made_s\": %.4g, \"iterated_s\": %.4g, \"certified_s\": %.4g, "
           "\"cached_iterated_s\": %.4g, \"predicted_bytes\": %.4g, \"counted_bytes\": %.4g, \"peak_bytes\": %.4g, "
           "\"factor_entries\": %lld, \"flop_s\": %.4g, \"entry_s\": %.4g, \"sweep_s\": %.4g, "
           "\"step_s\": %.4g}\n",
           row->element, (long long)row->cells[0], (long long)row->cells[1], (long long)row->cells[2], row->poisson,
           row->stretch > 0.0 ? row->stretch : 1.0, row->jump > 0.0 ? row->jump : 1.0, row->moved ? "true" : "false",
           uz_choice_name(UZ_CHOICE_OPERATOR, row->op), uz_choice_name(UZ_CHOICE_OPERATOR, cold.op), (long long)asked.d,
           asking, asked.seconds, cold.cost.seconds, cold.seconds, cached.cost.seconds, cached.seconds, cold.order,
           cold.made, cold.iterated, cold.certified, cached.iterated, cold.cost.bytes, cold.cost.actual_bytes, peak,
           (long long)asked.factor_nnz, uz_cost_machine()->flop_s, uz_cost_machine()->entry_s, uz_amg_rate(),
           uz_brick_rate(3));
    uz_cache_free(cache);
    return 0;
}

static bool run_child(char *line, int size, int which)
{
    char self[PATH_MAX] = {0}, number[16];
    int ends[2], status = 1;
    snprintf(number, sizeof number, "%d", which);
    if (readlink("/proc/self/exe", self, sizeof self - 1) < 0 || pipe(ends) != 0)
        return false;
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        execl(self, self, BENCH_PREDICTIONS_FLAG, number, (char *)NULL);
        _exit(127);
    }
    close(ends[1]);
    FILE *out = fdopen(ends[0], "r");
    const bool has_told = child > 0 && out && fgets(line, size, out);
    if (out)
        fclose(out);
    if (child > 0)
        waitpid(child, &status, 0);
    return has_told && status == 0;
}

bool bench_predictions(FILE *json, const char *filter)
{
    int written = 0;
    fprintf(json, "\"rows\": [");
    for (int k = 0; k < COUNT; k++) {
        char line[2048];
        if (filter && !strstr(ROWS[k].element, filter))
            continue;
        if (!run_child(line, sizeof line, k)) {
            printf("row %d, %s, gave no answer\n", k, ROWS[k].element);
            return false;
        }
        fputs(line, stdout);
        fflush(stdout);
        line[strcspn(line, "\n")] = '\0';
        fprintf(json, "%s\n  %s", written++ ? "," : "", line);
    }
    fprintf(json, "\n]");
    return written > 0;
}
