/* lab.h: the problems of the comparison, the condensed dual, and what lab.c does with them. */
#ifndef TESTS_PEERS_LAB_H
#define TESTS_PEERS_LAB_H

#include "uzawa.h"

/* Makes the problem of a name: "body/NX" (the paper's body with NX x NX/3 cells), "cases/FOLDER" (K.mtx, N.mtx, h.mtx,
 * p.mtx under `cases`), or a generated one. The caller clears it with uz_qp_clear, after a failure too. */
uz_status lab_problem(uz_qp *out, const char *name, const char *cases, uz_error *err);
/* The same as a scene: false where it has none. */
bool lab_scene(uz_scene *out, const char *name);
/* Names of the generated problems, NULL after the last. */
const char *lab_generated_name(int which);

/* K by CHOLMOD as its manual has it: analyse, factorise, solve; one thread. */
typedef struct lab_factor lab_factor;
lab_factor *lab_factor_new(const uz_csc *K); /* NULL: not positive definite, or no memory */
void lab_factor_free(lab_factor *factor);
/* X = K^-1 B (d x count, column by column); X may be B. */
bool lab_factor_solve(lab_factor *factor, double *X, const double *B, int64_t count);

/* D = N K^-1 N' (m x m) and g0 = h - N K^-1 p (m), in blocks of right-hand sides. The caller frees both; NULL and false
 * where they would take more than `most` bytes, or there was no memory. */
bool lab_condense(double **D, double **g0, lab_factor *factor, const uz_qp *qp, double most);

#endif
