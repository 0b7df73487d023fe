/* cost.c: predicted seconds and bytes, and the choice that follows. */
#include "run/cost.h"
#include "dual/form.h"

#include "amg/amg.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "linalg/blas.h"
#include "linalg/linalg.h"
#include "scene/breadth.h"

#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>

/* ----------------------------------------------------------------- the machine */

/* What is sparse, of less than a megabyte, is about as much as a core has for itself. */
enum { DENSE = 192, SPARSE = 1600, BAND = 32, REACH = 40, LEAST = 3, REPEATS = 40 };

/* Of one measurement, but for LEAST runs: in the first one BLAS may allocate what it works in. */
#define ENOUGH_S 0.0025

/* What is assumed where there is no memory to measure: a core of 2020. */
static const uz_cost_rates ASSUMED = {.flop_s = 3e-11, .entry_s = 1e-9};

static uz_cost_rates measured; /* written once, under the guard */

typedef struct {
    const double *val, *x;
    const int32_t *idx;
    int64_t n;
} entry_pass;

/* n entries times numbers of x, summed. In four sums, whatever columns they belong to: none waits for another, and how
 * often a processor mistakes where a column ends differs from run to run. */
static void pass_entries(void *ctx)
{
    const entry_pass *of = ctx;
    double sum[4] = {0.0};
    for (int64_t k = 0; k + 4 <= of->n; k += 4)
        for (int i = 0; i < 4; i++)
            sum[i] += of->val[k + i] * of->x[of->idx[k + i]];
    const volatile double all = sum[0] + sum[1] + sum[2] + sum[3];
    (void)all;
}

/* room: a matrix, and behind it one of its size for the product. */
static void multiply_dense(void *ctx)
{
    double *room = ctx;
    uz_syrk_lower_t_while(DENSE, DENSE, room, room + DENSE * DENSE, NULL);
}

/* In pages that go back to the system: what lies free in the heap would hide what the first body takes. */
static void measure(void)
{
    enum { ROOM = 2 * DENSE * DENSE, ENTRIES = SPARSE * BAND };
    const size_t bytes = (ROOM + ENTRIES) * sizeof(double) + ENTRIES * sizeof(int32_t);
    double *room = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    measured = ASSUMED;
    if (room == MAP_FAILED)
        return;
    for (int64_t i = 0; i < DENSE * DENSE; i++)
        room[i] = 1.0 / (double)(1 + i % 7);
    measured.flop_s =
        uz_least_seconds(multiply_dense, room, LEAST, REPEATS, ENOUGH_S) / ((double)DENSE * DENSE * DENSE);
    /* a lower triangle with BAND entries in a column, far enough apart to be read as those of a mesh are */
    double *val = room + ROOM;
    int32_t *idx = (int32_t *)(void *)(val + ENTRIES);
    for (int32_t k = 0; k < ENTRIES; k++) {
        idx[k] = k / BAND + k % BAND / 4 * REACH + k % BAND;
        val[k] = 1.0;
    }
    measured.entry_s =
        uz_least_seconds(pass_entries, &(entry_pass){val, room, idx, ENTRIES}, LEAST, REPEATS, ENOUGH_S) / ENTRIES;
    munmap(room, bytes);
}

const uz_cost_rates *uz_cost_machine(void)
{
    static pthread_once_t guard = PTHREAD_ONCE_INIT; /* a property of the machine, not of any call */
    pthread_once(&guard, measure);
    return &measured;
}

static double of_sweeps, of_cells[2]; /* likewise, each under its own; of solids, and of plane bodies */

static void measure_sweeps(void)
{
    of_sweeps = uz_amg_rate();
}

static void measure_solid_cells(void)
{
    of_cells[0] = uz_brick_rate(3);
}

static void measure_plane_cells(void)
{
    of_cells[1] = uz_brick_rate(2);
}

/* Only who may take a multigrid waits for its rate. axes: of a brick; 0 where there is a matrix. */
static double cycle_rate(int axes)
{
    static pthread_once_t sweeps = PTHREAD_ONCE_INIT, solid = PTHREAD_ONCE_INIT, plane = PTHREAD_ONCE_INIT;
    if (axes == 0) {
        pthread_once(&sweeps, measure_sweeps);
        return of_sweeps;
    }
    const bool flat = axes == 2;
    pthread_once(flat ? &plane : &solid, flat ? measure_plane_cells : measure_solid_cells);
    return of_cells[flat];
}

void uz_cost_measure(void)
{
    (void)uz_cost_machine();
    for (int axes = 0; axes <= 3; axes += axes == 0 ? 2 : 1)
        (void)cycle_rate(axes);
}

/* Beyond what a core has for itself entries come from memory: their rate is that of K, which is there. From so many
 * entries on, and of the first so many. */
#define LARGE_ENTRIES  250000
#define SAMPLE_ENTRIES 2000000

static bool is_large(const uz_csc *K)
{
    return K->ptr[K->cols] >= LARGE_ENTRIES;
}

/* Seconds for an entry of K where it is large, else 0. What K is multiplied with does not matter, as long as there is
 * as much of it: its own entries, where there are as many as rows: a diagonal may have gaps. */
static double rate_of(const uz_csc *K)
{
    const int64_t count = K->ptr[K->cols], n = count < SAMPLE_ENTRIES ? count : SAMPLE_ENTRIES;
    if (!is_large(K) || count < K->rows)
        return 0.0;
    return uz_least_seconds(pass_entries, &(entry_pass){K->val, K->val, K->idx, n}, 2, 2, 0.0) / (double)n;
}

/* -------------------------------------------------------------------- the model */

/* Putting the contact last costs a tenth more entries of L and half as many flops again (plane bodies, AMD). */
#define LAST_ENTRIES 1.1
#define LAST_FLOPS   1.5

/* While it is made: supernodes are updated through room of their own, up to a sixth of the factor of a small solid. */
#define FACTOR_PEAK 1.1
/* Vectors of dofs: passes of K that a certificate and a load take, and of single numbers. */
#define CASE_PASSES  3.5
#define CASE_NUMBERS 19.0

static double matrix_bytes(const uz_cost_size *s)
{
    return 12.0 * (double)s->k_entries + 8.0 * (double)s->d + 36.0 * (double)s->n_entries;
}

/* Has the factor been made, and does it take no more time? */
static bool is_there(const uz_factor_info *factor)
{
    return factor->factor_s > 0.0;
}

/* predicted: the factor (nnz, flops, bytes, order_s) analysed for the form `of`, whose own differs from it by what
 * ordering the contact last costs; NULL for a form that needs none. */
static uz_cost_estimate estimate(const uz_dual_abilities *can, const uz_cost_size *size,
                                 const uz_factor_info *predicted, uz_operator of, const uz_cost_rates *rates)
{
    uz_cost_estimate out = {.op = can->op};
    uz_factor_info L = {0};
    out.bytes = matrix_bytes(size);
    out.case_s = (CASE_PASSES * (double)size->k_entries + CASE_NUMBERS * (double)size->d) * rates->entry_s;
    if (predicted) {
        bool last = can->contact_last, was_last = uz_dual_form_of(of)->can.contact_last;
        double entries = last == was_last ? 1.0 : last ? LAST_ENTRIES : 1.0 / LAST_ENTRIES;
        L = *predicted;
        L.flops *= last == was_last ? 1.0 : last ? LAST_FLOPS : 1.0 / LAST_FLOPS;
        L.nnz = (int64_t)((double)L.nnz * entries);
        L.bytes = (size_t)((double)L.bytes * entries);
        out.flops = !is_there(predicted) ? L.flops : last ? L.condensing : 0.0;
        out.bytes += FACTOR_PEAK * (double)L.bytes;
        out.setup_s = UZ_COST_FACTOR_FLOPS * out.flops * rates->flop_s;
        if (!is_there(predicted))
            out.setup_s += UZ_COST_FACTOR_PASSES * (double)L.nnz * rates->entry_s;
    }
    uz_dual_form_of(out.op)->add_cost(&out, size, predicted ? &L : NULL, rates);
    out.next_s = out.next_s > 0.0 ? out.next_s : out.case_s;
    return out;
}

/* The pattern both ways with room for elimination, and vectors of integers. */
double uz_cost_analysis_bytes(const uz_cost_size *size)
{
    return matrix_bytes(size) + 20.0 * (double)size->k_entries + 130.0 * (double)size->d;
}

/* Longest over shortest distance of an element's corners: sqrt(3) of a cube, and of the tetrahedra that it is divided
 * into, sqrt(2) of a square. Of a thousand elements, their geometric mean. */
static double find_stretch(const uz_mesh *mesh, const uz_brick *brick)
{
    const double *cell = brick ? brick->cell : NULL;
    double sum = 0.0;
    int64_t n = 0;
    if (cell)
        return hypot(hypot(cell[0], cell[1]), cell[2]) /
               fmin(brick->axes == 2 ? INFINITY : cell[1], fmin(cell[0], cell[2]));
    for (int64_t e = 0; e < mesh->n_elements; e += 1 + mesh->n_elements / 1000, n++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        double longest = 0.0, shortest = INFINITY;
        for (int i = 0; i < type->corners; i++)
            for (int k = 0; k < i; k++) {
                double distance = 0.0;
                for (int c = 0; c < mesh->dim; c++)
                    distance = hypot(distance, mesh->xyz[node[i] * mesh->dim + c] - mesh->xyz[node[k] * mesh->dim + c]);
                longest = fmax(longest, distance);
                shortest = fmin(shortest, distance);
            }
        sum += log(longest / shortest);
    }
    return n > 0 ? exp(sum / (double)n) : 1.0;
}

/* Of the box around it, which of a plane body has no third side. */
static double find_slender(const uz_mesh *mesh, const uz_brick *brick)
{
    double side[3] = {0.0};
    for (int c = 0; c < 3; c++) {
        double least = INFINITY, most = -INFINITY;
        for (int64_t i = 0; i < mesh->n_nodes && !brick; i++) {
            least = fmin(least, mesh->xyz[3 * i + c]);
            most = fmax(most, mesh->xyz[3 * i + c]);
        }
        side[c] = brick ? (double)brick->cells[c] * brick->cell[c] : most - least;
    }
    const double longest = fmax(fmax(side[0], side[1]), side[2]), shortest = fmin(fmin(side[0], side[1]), side[2]);
    return longest / (side[0] + side[1] + side[2] - longest - shortest);
}

/* How much more a solid resists a change of volume than one of shape, over what it does at a Poisson's ratio of 0.3: of
 * the material where that is most. Linear tetrahedra, whose shapes are hardly free to keep their volume, show the root
 * of it, and plane stress nothing. */
static double find_firmness(const uz_scene *scene, const uz_mesh *mesh, const uz_brick *brick)
{
    const bool tetrahedra =
        !brick && mesh->n_elements > 0 && uz_element_type_of((uz_element_kind)mesh->kind[0])->nodes == 4;
    double most = 1.0;
    for (int64_t k = 0; scene->model != UZ_PLANE_STRESS && k < scene->n_materials; k++) {
        const double nu = scene->materials[k].poisson;
        most = fmax(most, (1.0 - nu) / (1.0 - 2.0 * nu) / (0.7 / 0.4));
    }
    return tetrahedra ? sqrt(most) : most;
}

/* Tetrahedra that lie as in no grid: there half of the nodes and more, of thin bodies a third, have as many around
 * them, of what mesh generators make an eighth. Where that can't be counted it is not known. */
static bool is_irregular(const uz_mesh *mesh)
{
    enum { MOST = 63, CORNERS = 4 };
    int64_t with[MOST + 1] = {0}, nodes = 0, largest = 0;
    uint8_t *around = NULL;
    if (mesh->n_elements == 0 || uz_element_type_of((uz_element_kind)mesh->kind[0])->corners != CORNERS ||
        !(around = uz_alloc_zero(mesh->n_nodes, sizeof *around)))
        return false;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int k = 0; k < CORNERS; k++) {
            uint8_t *own = &around[mesh->node[mesh->first[e] + k]];
            *own = (uint8_t)(*own + (*own < MOST));
        }
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        with[around[i]]++;
    for (int k = 1; k <= MOST; k++) {
        nodes += with[k];
        largest = with[k] > largest ? with[k] : largest;
    }
    free(around);
    return 4 * largest < nodes;
}

uz_cost_size uz_cost_size_of(const uz_csc *K, const uz_csc *N, const uz_body_model *model, const uz_scene *scene,
                             int64_t n_b, int64_t cases, const uz_settings *settings)
{
    const bool by_auto = settings->method == UZ_METHOD_AUTO && settings->stopping == UZ_STOP_CERTIFIED;
    const bool by_active_set = by_auto || settings->method == UZ_METHOD_ACTIVE_SET;
    const uz_brick *brick = model ? model->brick : NULL;
    const bool solid = model && model->mesh.dim == 3, shaped = solid || brick;
    return (uz_cost_size){.d = N->cols,
                          .m = N->rows,
                          .n_b = n_b,
                          .k_entries = brick ? brick->d : K->ptr[K->cols],
                          .n_entries = N->ptr[N->cols],
                          .modes = solid ? 6 : 3,
                          .active_set = by_active_set,
                          .bounds = by_active_set && uz_csc_is_single(N),
                          .alone = settings->op != UZ_OPERATOR_AUTO && !uz_dual_form_of(settings->op)->can.needs_factor,
                          .by_cells = brick ? uz_brick_predict_bytes(brick) : 0.0,
                          .stretch = shaped ? find_stretch(&model->mesh, brick) : 1.0,
                          .slender = shaped ? find_slender(&model->mesh, brick) : 1.0,
                          .firmness = shaped ? find_firmness(scene, &model->mesh, brick) : 1.0,
                          .irregular = solid && !brick && is_irregular(&model->mesh),
                          .entry_s = brick ? 0.0 : rate_of(K),
                          .cycle_s = brick || is_large(K) ? cycle_rate(brick ? brick->axes : 0) : 0.0,
                          .cases = cases};
}

bool uz_cost_is_one_to_one(const uz_csc *N, int64_t n_b)
{
    return N->rows == n_b && N->ptr[N->cols] == n_b;
}

/* ------------------------------------------------------------------- the choice */

/* A form without a factor has to be so much cheaper for one load, as a factor spares later ones on the body much; of
 * several load cases what it spares them is counted. It is asked for only where there are seconds to win. */
#define MUCH_CHEAPER 2.0
#define WORTH_S      2.0

double uz_cost_seconds(const uz_cost_estimate *form, int64_t cases)
{
    return form->setup_s + form->case_s + (double)(cases > 1 ? cases - 1 : 0) * form->next_s;
}

_Static_assert(sizeof((uz_cost){0}.considered) == UZ_DUAL_FORMS * sizeof(uz_cost_option), "a result names each form");

/* What a number of a cycle takes where that was not measured, in entries. */
#define SWEPT_ENTRY 0.7
#define STEPPED_DOF 2.5

static uz_cost_rates rates_of(const uz_cost_size *size)
{
    uz_cost_rates rates = *uz_cost_machine();
    rates.cycle_s =
        size->cycle_s > 0.0 ? size->cycle_s : rates.entry_s * (size->by_cells > 0.0 ? STEPPED_DOF : SWEPT_ENTRY);
    if (size->entry_s > 0.0)
        rates.entry_s = size->entry_s;
    return rates;
}

/* ordered: the order of a factor has been found, whatever is chosen; else forms with a factor would take it. */
static void decide(uz_cost_plan *plan, const uz_cost_size *size, const uz_factor_info *factor, bool ordered,
                   uz_operator direct, uz_operator asked, size_t memory_limit)
{
    const uz_cost_rates rates = rates_of(size);
    const double order_s = factor && !is_there(factor) ? factor->order_s : 0.0;
    plan->count = 0;
    if (factor)
        plan->form[plan->count++] = estimate(&uz_dual_form_of(direct)->can, size, factor, direct, &rates);
    for (int k = 0; k < UZ_DUAL_FORMS; k++) {
        const uz_dual_abilities *can = &uz_dual_forms[k]->can;
        if (can->asked_for && can->op != asked)
            continue;
        if (!can->needs_factor || (factor && can->op != direct))
            plan->form[plan->count++] = estimate(can, size, can->needs_factor ? factor : NULL, direct, &rates);
    }
    plan->chosen = -1;
    const double cheaper = size->cases > 1 ? 1.0 : MUCH_CHEAPER;
    for (int k = 0; k < plan->count; k++) {
        uz_cost_estimate *form = &plan->form[k];
        if (!ordered && uz_dual_form_of(form->op)->can.needs_factor)
            form->setup_s += order_s;
        form->fits = memory_limit == 0 || form->bytes <= (double)memory_limit;
        bool allowed = asked == UZ_OPERATOR_AUTO || form->op == asked;
        if (!allowed || !form->fits)
            continue;
        const double before = plan->chosen >= 0 ? uz_cost_seconds(&plan->form[plan->chosen], size->cases) : INFINITY;
        if (plan->chosen < 0 || (!uz_dual_form_of(form->op)->can.needs_factor && before > WORTH_S &&
                                 cheaper * uz_cost_seconds(form, size->cases) < before))
            plan->chosen = k;
    }
    for (int k = 0; k < plan->count && ordered; k++)
        plan->form[k].setup_s += order_s;
}

void uz_cost_decide(uz_cost_plan *plan, const uz_cost_size *size, const uz_factor_info *factor, uz_operator direct,
                    uz_operator asked, size_t memory_limit)
{
    decide(plan, size, factor, true, direct, asked, memory_limit);
}

/* Of the dense block of a layer's dofs, with the contact last: METIS took 6 to 75 times its cube in flops and 9 to 58
 * times its square in entries; hex8, tet4, hex20, tet10, cubes, bars and plates of 14,000 to 105,000 dofs. Its own time
 * was that of 100 to 230 passes of K. */
#define LEAST_FLOPS   6.0
#define LEAST_ENTRIES 9.0
#define LEAST_PASSES  100.0

bool uz_cost_is_surely_free(uz_cost_plan *plan, const uz_cost_size *size, const uz_mesh *mesh, uz_operator direct,
                            uz_operator asked, size_t memory_limit)
{
    if (asked != UZ_OPERATOR_AUTO)
        return false;
    const double layer = 3.0 * uz_mesh_breadth(mesh), entries = LEAST_ENTRIES * layer * layer;
    const uz_factor_info least = {.nnz = (int64_t)entries,
                                  .order_s = LEAST_PASSES * (double)size->k_entries * rates_of(size).entry_s,
                                  .flops = LEAST_FLOPS * layer * layer * layer,
                                  .bytes = (size_t)(sizeof(double) * entries)};
    decide(plan, size, &least, false, direct, asked, memory_limit);
    return plan->chosen >= 0 && !uz_dual_form_of(plan->form[plan->chosen].op)->can.needs_factor;
}

int uz_cost_patience(const uz_cost_plan *plan, const uz_cost_size *size)
{
    const uz_cost_estimate *chosen = &plan->form[plan->chosen];
    const double further = (double)(size->cases > 1 ? size->cases - 1 : 0);
    const double grows = chosen->setup_steps_s + chosen->case_steps_s + further * chosen->next_steps_s;
    double least = INFINITY;
    for (int k = 0; k < plan->count; k++)
        if (plan->form[k].fits && uz_dual_form_of(plan->form[k].op)->can.needs_factor)
            least = fmin(least, uz_cost_seconds(&plan->form[k], size->cases));
    const double more = (least - uz_cost_seconds(chosen, size->cases)) / grows;
    return isfinite(least) ? (int)fmin(chosen->steps * (1.0 + fmax(0.0, more)), INT_MAX) : 0;
}

/* The fewest bytes of the forms with a factor, or without, and which that is. */
static double least_bytes(const uz_cost_plan *plan, bool with_factor, uz_operator asked, uz_operator *op)
{
    double least = INFINITY;
    for (int k = 0; k < plan->count; k++) {
        const uz_cost_estimate *form = &plan->form[k];
        bool counts = uz_dual_form_of(form->op)->can.needs_factor == with_factor &&
                      (asked == UZ_OPERATOR_AUTO || asked == form->op);
        if (!counts || !(form->bytes < least))
            continue;
        least = form->bytes;
        *op = form->op;
    }
    return least;
}

/* Of the processor time of a cold solve that contact is certified in, what is in shares: a cube of 64 cells along a
 * side as a box; one of 64 as hex8 0.86, as tet4 0.77, and less of those of 32; of plane boxes of 241,200 and 541,800
 * dofs 0.37 and 0.54. */
#define BOX_SHARED   0.65
#define PLANE_SHARED 0.45
#define MESH_SHARED  0.65
/* And of a factor with what is made of it: cubes of 12 to 24 hex8 and tet4 along a side 0.36 to 0.79, plane boxes of
 * 15,000 to 540,000 dofs 0.45 to 0.65. Substitutions, which loads take, are of one thread. */
#define FACTOR_SHARED 0.55

double uz_cost_shared(double setup_s, double loads_s, uz_operator op, const uz_brick *brick, int threads)
{
    const bool by_factor = uz_dual_form_of(op)->can.needs_factor, by_cycles = op == UZ_OPERATOR_MATRIX_FREE;
    const double by_cells = brick && brick->axes == 2 ? PLANE_SHARED : BOX_SHARED,
                 of_cycles = brick ? by_cells : MESH_SHARED,
                 of_setup = by_factor   ? FACTOR_SHARED
                            : by_cycles ? of_cycles
                                        : 0.0,
                 of_loads = by_cycles ? of_cycles : 0.0, spared = threads > 1 ? 1.0 - 1.0 / threads : 0.0;
    return setup_s * (1.0 - of_setup * spared) + loads_s * (1.0 - of_loads * spared);
}

uz_status uz_cost_refuse(const uz_cost_plan *plan, uz_operator asked, size_t memory_limit, uz_error *err)
{
    const bool any = asked == UZ_OPERATOR_AUTO, by_factor = any || uz_dual_form_of(asked)->can.needs_factor;
    uz_operator op = asked;
    char with_factor[80] = "the symbolic analysis of a factor alone passes it";
    double direct = least_bytes(plan, true, by_factor ? asked : UZ_OPERATOR_AUTO, &op),
           free = least_bytes(plan, false, by_factor ? UZ_OPERATOR_AUTO : asked, &op);
    if (isfinite(direct))
        snprintf(with_factor, sizeof with_factor, "with a factor the solve would take %.0f bytes", direct);
    if (!by_factor)
        return uz_fail(err, UZ_ERR_LIMIT, "K", "the solve would take %.0f bytes and the limit is %zu: raise the limit",
                       free, memory_limit);
    char advice[80] = "raise the limit";
    if (!any && free <= (double)memory_limit)
        snprintf(advice, sizeof advice, "ask for the operator %s or auto", uz_choice_name(UZ_CHOICE_OPERATOR, op));
    return uz_fail(err, UZ_ERR_LIMIT, "K", "%s, as %s %.0f bytes, and the limit is %zu: %s", with_factor,
                   uz_choice_name(UZ_CHOICE_OPERATOR, op), free, memory_limit, advice);
}
