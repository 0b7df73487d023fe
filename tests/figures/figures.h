/* figures.h: the measurements behind docs/numbers.md. One thread; times are of the processor's clock for this thread
 * and of the wall: on a machine with other work only the first means anything, on a quiet one they agree. */
#ifndef TESTS_FIGURES_H
#define TESTS_FIGURES_H

#include "figures/reference.h"
#include "uzawa.h"

#include <stdio.h>

/* ------------------------------------------------------------------ JSON */

/* Writes the commas. Keys are NULL in arrays. */
typedef struct {
    FILE *file;
    bool first; /* in its object or array */
} json;
void json_open(json *out, const char *key, char bracket);   /* '{' or '[' */
void json_close(json *out, char bracket);                   /* '}' or ']' */
void json_number(json *out, const char *key, double value); /* null where it is not finite */
void json_integer(json *out, const char *key, int64_t value);
void json_text(json *out, const char *key, const char *value);

/* ------------------------------------------------------------------ runs */

/* Counts of what the solver did, by the linker's --wrap: see count.c. */
typedef struct {
    double entries; /* of L that substitutions passed over; a forward and a backward pass are two times nnz(L) */
    int64_t solves; /* with the factor of the free dofs: each is counted as one back-substitution */
    int64_t cycles; /* of multigrid */
} figure_work;
void figure_count_from_zero(void);
figure_work figure_counted(void);

enum { FIGURE_RUNS_MOST = 11 };

typedef struct {
    double median, min, max;
} figure_spread;

typedef struct {
    uz_status status;
    uz_error err;      /* where status says so */
    uz_result *result; /* of the last run; else NULL */
    bool limited;      /* stopped by the limit on seconds */
    int runs;
    figure_spread cpu, wall; /* seconds */
    figure_work work;        /* of the last run */
} figure_run;

/* Solves `runs` times (0: by how long the first one took) and keeps the last answer. limit: seconds of processor time
 * after which the solver is told to stop. The caller frees run->result. */
void figure_solve(figure_run *run, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                  double limit, int runs);
void figure_write_times(json *out, const figure_run *run);

/* -------------------------------------------------------------- problems */

typedef struct {
    const char *name, *title;
    uz_problem problem;
    uz_qp qp;             /* a scene's matrices; else those of `problem` */
    int64_t *dof;         /* a scene's: n_nodes x dim, the free dof or negative; else NULL */
    int64_t places;       /* n_nodes x dim */
    double mesh_error;    /* relative, energy norm; NaN: no mesh, or not known */
    const char *mesh_how; /* how that is known */
    bool whole;           /* every method and form; else `auto` alone */
} figure_problem;

enum { FIGURE_PROBLEMS = 8 };
/* false: what it is made of is not there (*why says what), or it could not be made. The caller clears it. */
bool figure_problem_make(figure_problem *out, int which, const char **why);
const char *figure_problem_name(int which);
void figure_problem_clear(figure_problem *problem);
/* u (d) of a result. The caller frees it. */
double *figure_displacements(const figure_problem *problem, const uz_result *result);
/* The paper's body with nx x nx/3 cells as matrices. */
uz_problem figure_paper_matrices(int64_t nx);

/* ------------------------------------------------------------- the parts */

/* Members "history", "sizes" of the JSON: the paper's Figures 2 and 3, and how many iterations its methods take. */
void figure_history(json *out);
void figure_sizes(json *out);
/* Member "precision": every method, form of the operator and accuracy on every problem, or on that of this name. */
void figure_precision(json *out, const char *filter);

#endif
