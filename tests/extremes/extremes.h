/* extremes.h: the solver where it hurts. Each row solves one problem in one way and holds the claims against the exact
 * solution; a row passes when no claim is false and, where an answer is owed, there is one. */
#ifndef TESTS_EXTREMES_H
#define TESTS_EXTREMES_H

#include "judge.h"
#include "uzawa.h"

#include <stdio.h>

/* How a row is solved. */
typedef enum {
    WAY_DEFAULT,  /* auto, certified 1e-8 */
    WAY_EXACT,    /* auto, rounding level: precision_limit is an answer too */
    WAY_CACHED,   /* as default, a second time with its factor from the cache */
    WAY_FACTORED, /* accelerated_restart by sparse solves, 1e-6, few iterations */
    WAY_ACTIVE,   /* active_set, 1e-8 */
    WAY_FREE,     /* matrix_free, 1e-8: may refuse matrices that a factorization takes */
    WAYS
} way;

/* What is owed. */
typedef enum {
    OWED_TRUTH,  /* any named outcome or error, as long as it is true */
    OWED_ANSWER, /* converged, by default and cached */
    OWED_ERROR,  /* a refusal with a name */
    OWED_PROOF   /* infeasible, by default */
} owed;

/* Results of one family, for the closing table. */
typedef struct {
    char name[32];
    int rows, converged, other, refused, failed;
    int is_short;                    /* of `other`: doubles could hold what was asked */
    double worst_error, least_ratio; /* of converged rows; ratio: bound / true error, least of all bounds */
} family;

typedef struct {
    FILE *json;
    const char *filter; /* NULL, or part of a family's name */
    int rows, passed, failed;
    family families[32];
    int n_families;
    struct {
        int problems, solves, converged, wrong, asked, answered;
        double ratio_median, ratio_least;
    } generated;
} suite;

/* One problem in matrices, or one scene, in several ways; both take over and free what they are given. */
void run_matrices(suite *all, const char *family_name, const char *name, uz_qp qp, owed what);
void run_scene(suite *all, const char *family_name, const char *name, uz_scene scene, owed what);

/* A row that was judged elsewhere. error and certified may be NaN. */
void add_row(suite *all, const char *family_name, const char *name, const char *how, const char *outcome,
             const judgement *j, bool missed);

bool wants_family(const suite *all, const char *name);

/* The families. */
void run_scenes(suite *all);
void run_scene_mixtures(suite *all);
void run_bodies(suite *all);
void run_stiffnesses(suite *all);
void run_rows(suite *all);
void run_ranges(suite *all);
void run_exhaustive(suite *all);
void run_invariance(suite *all);
void run_guarantees(suite *all);
void run_generated_problems(suite *all);
void run_degenerate_problems(suite *all);
void run_contradictions(suite *all);
void run_conditioned_problems(suite *all);

const char *name_of(char *room, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
