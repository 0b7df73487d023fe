/* bench.h: what the benchmark driver calls. Rates are in MB/s with MB = 1e6 bytes. */
#ifndef TESTS_BENCH_H
#define TESTS_BENCH_H

#include "uzawa.h"

#include <stdio.h>

/* Reads a coordinate text of about 100 MB from memory, one thread: MB/s, the median of 5 runs. 0 where there was no
 * memory or the text was refused. */
double bench_mm_rate(void);

/* A measured set of values: median, extremes, count. */
typedef struct {
    double median, min, max;
    int runs;
} bench_value;
bench_value bench_summarise(double *samples, int count); /* sorts samples */

/* Seconds of CHOLMOD alone on K u = p: analyse + factorise + solve, and one solve with the factor at hand. */
typedef struct {
    double analyze, factorize, solve;
} bench_linear;
typedef enum { BENCH_AMD, BENCH_METIS } bench_ordering;
bench_linear bench_cholmod(const uz_csc *K, const double *p, bench_ordering ordering);
/* The one whose solve takes less of the processor, by the best of three runs of each. */
bench_ordering bench_better_ordering(const uz_csc *K, const double *p);

/* Seconds that Ipopt takes to minimize *value = 1/2 u'Ku - p'u over lower <= u <= upper (d each), from the given u.
 * NAN: it failed, or was not there when this was built. */
double bench_ipopt(double *u, double *value, const uz_csc *K, const double *p, double *lower, double *upper);
/* OBSTCLAE: time of Ipopt over ours, and ours. *compared false: there is no Ipopt, and no ratio. false: no answer. */
bool bench_obstacle(bench_value *ratio, bench_value *milliseconds, bool *compared);

/* A membrane or a plate of n x n dofs that would sink to `sink` times the depth of its floor: a cold solve over
 * CHOLMOD's linear solve of the same K, and the steps it took. false: no answer. */
bool bench_floor(bench_value *ratio, int64_t *steps, int64_t n, bool plate, double sink);

/* Beams 1000:1 on a plane and a chain of second differences, cold and certified 1e-8, over CHOLMOD's linear solve of
 * the same K, in milliseconds, and in steps. name: NULL after the last. false: no answer. */
const char *bench_slender_name(int which);
bool bench_slender(bench_value *ratio, bench_value *milliseconds, int64_t *steps, int which);

/* Jobs of a daemon at its default settings, HTTP and storage included, on bodies of about 600 x 200 cells that it has
 * not seen: the first job on each over CHOLMOD's linear solve (analyse, factorise, solve) of its K, that of all bodies,
 * of the first ones of a new daemon (whose memory the system has not given yet) and of those after them; the second
 * and the tenth job over one CHOLMOD solve with the factor at hand. Then the times that these are made of. false: says
 * why. */
enum { BENCH_SERVICE_BODIES = 20, BENCH_SERVICE_FIRST = 3 };
typedef struct {
    bench_value cold, first, later, second, tenth;
    bench_value cold_s, linear_s, factored_s, second_ms, tenth_ms, solve_ms;
} bench_service_cost;
bool bench_service(bench_service_cost *out);

/* Peak memory of a cold contact solve over that of the linear solve of the same K with the ordering that takes least,
 * and that of the contact solve, in processes of their own. problem: cells along the paper's body as text, or "hex8_"
 * and those of a cube. */
bool bench_memory(bench_value *ratio, bench_value *megabytes, const char *problem);
/* What main does when it is started as `bench BENCH_MEMORY_FLAG what problem`: prints bytes; its exit status. */
#define BENCH_MEMORY_FLAG "--memory"
#define BENCH_CUBE        "hex8_"
int bench_memory_child(const char *what, const char *problem);

/* Cold solves on an oblique plane over those on a plane along an axis. false: no answer. */
bool bench_oblique(bench_value *ratio, int64_t cells);

/* Cost against size, 600 to 2,000,000 dofs, printed and as a member of a JSON object. Minutes, and 4 GB. wanted: counts
 * of cells along the body as text, `count` of them; 0: all sizes. */
void bench_sizes(FILE *json, char **wanted, int count);
/* Cold certified solves of the cube of n x n x n bricks, one dof in each row or (leaning) three, in units of CHOLMOD's
 * linear solve. false: no answer. */
bool bench_hex8(bench_value *ratio, int64_t n, bool leaning);
/* Cold solves, certified 1e-6, of a cube of n x n x n equal cells without a matrix: in units of CHOLMOD's linear solve
 * of the same K, and of the solve by aggregates of that matrix; and of one with the body cached. */
typedef struct {
    bench_value linear, aggregates, cached;
} bench_cells_row;
bool bench_cells(bench_cells_row *row, int64_t n);
/* Conjugate gradients to 1e-8 on boxes of equal cells, from 16 to 96 along a side and of cells 10 times as long and as
 * short along one axis: their numbers, printed and as a member of a JSON object. false: one is not solved. */
bool bench_cycles(FILE *json);
/* What two threads do over what one does, of arithmetic and of reads: printed and as a member of a JSON object. false:
 * no memory. */
bool bench_roof(FILE *json);
/* Bodies of every kind: seconds and bytes that were predicted, and what their solves took, printed and as a member of a
 * JSON object. filter: part of an element's name, NULL: all. false: one is not solved. Minutes, and 3 GB. */
bool bench_predictions(FILE *json, const char *filter);
/* What main does when it is started as `bench BENCH_PREDICTIONS_FLAG row`; its exit status. */
#define BENCH_PREDICTIONS_FLAG "--prediction"
int bench_predictions_child(const char *which);
/* 100 load cases of the paper's body with nx x nx/3 cells, certified 1e-8: their time over that of one CHOLMOD solve
 * of one right-hand side, both with the factor at hand. false: no answer. */
bool bench_load_cases(bench_value *ratio, int64_t nx);

/* How soon solve `which` (0, 1, ...) stops, in milliseconds: the longest time between two questions whether to go on,
 * by the clock and of this thread's processor alone, and from the answer "stop" to the return. name: NULL after the
 * last. false: no answer. */
const char *bench_stop_name(int which);
bool bench_stop(bench_value *between, bench_value *work, bench_value *to_return, int which);

/* A body by what it touches, with the elements of a kind: what a guaranteed bound on the whole error takes, and the
 * same with the interval of a quantity, over the solve alone; of the processor's time, all threads. name: NULL after
 * the last row. false: no answer, or no proof. */
typedef struct {
    bench_value error, quantity, solve_ms;
    double bound;
    bool proved; /* the interval, too: not where a contact meets a corner, of a quantity that leaps there */
} bench_guarantee_row;
const char *bench_guarantee_name(char name[64], int which);
bool bench_guarantee(bench_guarantee_row *row, int which);

/* Scenes of 200,000 dofs: seconds of the assembly, of all fields and the VTK file, of CHOLMOD's analysis and factor
 * with METIS, and (whole) the sum of the first two over the third. name: NULL after the last scene. false: no answer.
 */
typedef struct {
    bench_value whole, assembly, outputs, factor;
} bench_assembly;
const char *bench_assembly_name(int which);
bool bench_assembly_of(bench_assembly *out, int which);

/* Cold solves of bodies whose whole surface may touch, with all candidates and with those kept: a cube of n x n x n
 * bricks on a sphere (solid), or the paper's body with n x n/3 cells between four walls. false: no answer. */
typedef struct {
    int64_t given, kept, rounds;
    bench_value seconds, all_seconds;
    double bytes, all_bytes;
} bench_candidates;
bool bench_candidates_left_out(bench_candidates *out, int64_t n, bool solid);

/* Accelerated iterations on the dense D of m contacts: time with a float32 copy of D and float64 corrections over that
 * with D alone, the latter in milliseconds, and the iterations of both: of iterations by themselves (milliseconds of
 * one), and of runs to each of `count` relative errors. false: no answer. */
typedef struct {
    bench_value ratio, milliseconds;
    int64_t iterations, mixed_iterations;
} bench_mixed_row;
bool bench_mixed(bench_mixed_row *step_row, bench_mixed_row *out, int count, const double *errors, int m);

/* The paper's body with nx x nx/3 cells. The caller clears it. */
uz_scene bench_paper_scene(int64_t nx);

#endif
