/* multigrid_cost.c: what solves without a factor are expected to take. */
#include "dual/multigrid_cost.h"

#include "amg/amg.h"

#include <math.h>

/* A cycle and a product, in entries that two sweeps read, for each entry of K and for each dof. They grow with the
 * dofs, over those of GROWN dofs: what is read comes from farther off, and contact has more rows to find; a power,
 * measured. */
typedef struct {
    double passes, numbers, growth;
} cycle_cost;
/* Of making a multigrid and bounding the spectrum, and of loads. The other numbers are such cycles: making a multigrid,
 * bounding the spectrum, solving once, a step of the active set, without and with sweeps over bounds on many dofs, a
 * guess of rows of several entries, whose answer is found within them, and an iteration that starts at the last one's
 * answer. hex8, tet4, wedge6, tet10, hex20 of 14,000 to 810,000 dofs, quad4 and quad8 of 60,000 to 540,000 (make
 * bench-predictions). */
typedef struct {
    cycle_cost making, loading;
    double create, step, guess;
} cycle_costs;
static const cycle_costs PLANE = {{1.7, 41.0, 0.0}, {4.0, 19.0, 0.2}, 40.0, 10.0, 22.0},
                         SOLID = {{1.25, 77.0, 0.06}, {0.0, 163.0, 0.15}, 25.0, 3.0, 11.6};
#define GROWN           1e5
#define SPECTRUM_CYCLES 30.0
/* Load cases that begin at answers of others take this part of a whole load: from 0.2 where loads and contact change
 * little from case to case to 0.5 where each has a contact of its own: 50 cases on hex8 and tet4 of 45,000 and 105,000
 * dofs. */
#define NEXT_CASE     0.33
#define SOLVE_CYCLES  6.0
#define STEPS         6.0
#define SWEPT_CYCLES  30.0
#define CHANGE_CYCLES 6.0
/* As UZ_COST_VECTORS, with conjugate gradients; not all of them at the time of what a guess of bounds takes. Few bounds
 * are not swept, and take no vectors of all dofs. */
#define VECTORS            60.0
#define BOUNDS_VECTORS     38.0
#define FEW_BOUNDS_VECTORS 32.0
/* Where no other form is to be had and the steps are so much harder, aggregates of another kind are made beside the
 * first ones, of which this part is more than what is there later: hex8 and tet10 at 0.49, stretched hex8. */
#define BADLY  2.2
#define SECOND 0.75

/* Steps of solids that resist changes of volume, by their firmness, of stretched elements, and of long bodies, over
 * those of the same body of cubes at a Poisson's ratio of 0.3: powers of these, measured at 0.45, 0.49, elements 10
 * times as long along one axis, and cubes of them in bodies as long. Without a matrix what is stretched is coarsened
 * where it is short first. */
typedef struct {
    double firmness, stretch, slender;
} hardness;
static const hardness MAKING = {0.4, 1.3, 0.0}, LOADING = {0.24, 0.3, 0.7};
#define CUBES_STRETCH 2.0 /* about the square root of 3, somewhat moved */
/* Aggregates of irregular tetrahedra are rougher than those of a grid's: steps of the multigrid, and of loads, with
 * nine guesses for seven; where nothing touches these are a third of it. Eight meshes of tet4 and tet10 of 40,000 to
 * 130,000 dofs by Gmsh: blocks with a hole, angles, shafts. */
#define IRREGULAR_MAKING  1.85
#define IRREGULAR_LOADING 2.5

/* On equal cells: making the multigrid and bounding the spectrum, a load that begins on coarser grids, in steps of the
 * smoother, and vectors. Solid bodies of 100,000 to 810,000 dofs, plane ones of 15,000 to 1,500,000. */
typedef struct {
    double create, load, growth, vectors;
    hardness making, loading;
} cells_costs;
static const cells_costs PLANE_CELLS = {373.0, 212.0, 0.1, 27.5, {0.4, 0.0, 0.07}, {0.29, 0.0, 0.35}},
                         SOLID_CELLS = {225.0, 170.0, 0.06, 25.0, {0.45, 0.35, 0.0}, {0.29, 0.3, 0.2}};
#define CELLS_FLOPS 40.0 /* for each dof, of what is as much as a step */
#define CELLS_CYCLE 20.0 /* a cycle and a product, with the vectors */

static double find_hardness(const uz_cost_size *size, hardness of)
{
    return pow(fmax(1.0, size->firmness), of.firmness) * pow(fmax(1.0, size->stretch / CUBES_STRETCH), of.stretch) *
           pow(fmax(1.0, size->slender), of.slender);
}

static double find_growth(const uz_cost_size *size, double power)
{
    return pow((double)size->d / GROWN, power);
}

/* Entries that a cycle and a product are as much as. */
static double find_work(const uz_cost_size *size, const cycle_cost *of)
{
    return (of->passes * (double)size->k_entries + of->numbers * (double)size->d) * find_growth(size, of->growth);
}

static void add_cost_by_cells(uz_cost_estimate *cost, const uz_cost_size *size, const uz_cost_rates *rates)
{
    const cells_costs *of = size->modes == UZ_MODES_MOST ? &SOLID_CELLS : &PLANE_CELLS;
    const double step = (double)size->d * rates->cycle_s * find_growth(size, of->growth),
                 create = of->create * find_hardness(size, of->making),
                 steps = size->bounds || size->m == 0 ? 0.0 : UZ_COST_ITERATIONS * CHANGE_CYCLES * CELLS_CYCLE,
                 load = (of->load + steps) * find_hardness(size, of->loading);
    cost->setup_s += create * step;
    cost->case_s += load * step;
    cost->flops += (create + load) * CELLS_FLOPS * (double)size->d;
    cost->bytes += size->by_cells + 8.0 * of->vectors * (double)size->d;
}

void uz_cost_of_multigrid(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                          const uz_cost_rates *rates)
{
    (void)factor;
    if (size->by_cells > 0.0) {
        add_cost_by_cells(cost, size, rates);
        return;
    }
    const cycle_costs *of = size->modes == UZ_MODES_MOST ? &SOLID : &PLANE;
    const double making = find_work(size, &of->making), loading = find_work(size, &of->loading),
                 hard = find_hardness(size, MAKING), harder = hard * (size->irregular ? IRREGULAR_MAKING : 1.0),
                 setup = (of->create + SPECTRUM_CYCLES) * harder * making;
    const bool sweeps = size->bounds && !uz_bounds_are_few(size->m, size->d);
    const double load = loading * find_hardness(size, LOADING) * (size->irregular ? IRREGULAR_LOADING : 1.0) *
                        (SOLVE_CYCLES + (size->m == 0       ? 0.0
                                         : size->bounds     ? STEPS * (sweeps ? SWEPT_CYCLES : of->step)
                                         : size->active_set ? STEPS * of->guess
                                                            : UZ_COST_ITERATIONS * CHANGE_CYCLES));
    double levels = uz_amg_predict_bytes(size->d, size->k_entries, size->modes);
    cost->setup_s += setup * rates->cycle_s;
    cost->steps = SPECTRUM_CYCLES * harder;
    cost->setup_steps_s = cost->steps * making * rates->cycle_s;
    cost->case_steps_s = load * rates->cycle_s;
    cost->next_steps_s = (size->bounds ? NEXT_CASE : 1.0) * load * rates->cycle_s;
    cost->next_s = cost->case_s + cost->next_steps_s;
    cost->case_s += cost->case_steps_s;
    cost->flops += (setup + load) * 4.0;
    /* beside it the dofs that are swept, with both triangles of K */
    const double swept = 32.0 * (double)size->k_entries + 52.0 * (double)size->d;
    cost->bytes += levels + (sweeps ? swept : 0.0) + (size->alone && hard > BADLY ? SECOND * levels : 0.0);
    const double vectors = !size->bounds ? VECTORS : sweeps ? BOUNDS_VECTORS : FEW_BOUNDS_VECTORS;
    cost->bytes += 8.0 * vectors * (double)size->d;
}

/* The same on so many processes of equal speed; here are K, its rows on their way, and the vectors. Of 1,006,000
 * dofs of hex8 two take 0.89 of our time on two processors, which is about 0.85 of what follows assembly, the same for
 * both. */
#define PROCESSES 2.0
#define SLOWER    1.7

void uz_cost_of_group(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                      const uz_cost_rates *rates)
{
    uz_cost_estimate alone = *cost;
    uz_cost_size iterated = *size; /* it has no answers within rows between two bodies */
    iterated.active_set = size->bounds;
    uz_cost_of_multigrid(&alone, &iterated, factor, rates);
    cost->next_s = cost->case_s + (alone.next_s - cost->case_s) * SLOWER / PROCESSES;
    cost->setup_s += (alone.setup_s - cost->setup_s) * SLOWER / PROCESSES;
    cost->case_s += (alone.case_s - cost->case_s) * SLOWER / PROCESSES;
    cost->flops = alone.flops;
    cost->bytes += 16.0 * (double)size->k_entries / PROCESSES + 8.0 * VECTORS * (double)size->d;
}
