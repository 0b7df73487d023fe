/* worker.h: the parts of uzawa-group: a multigrid whose rows are spread over the processes of a group, and conjugate
 * gradients with it. All functions are collective. They are PETSc's kind: PETSc's error handler ends the group. */
#ifndef UZ_GROUP_WORKER_H
#define UZ_GROUP_WORKER_H

#include <petscksp.h>
#include <stdbool.h>

enum { LEVELS_MOST = 24 };

/* One level, the finest first, and the way to the next. Its smoother sweeps over the rows of each process with D' in
 * place of the diagonal: D plus the absolute sums of what is coupled with other processes. */
typedef struct {
    Mat A, own, other;  /* whole; of this process's columns, and of the others': parts of A */
    Mat P;              /* from the next level; NULL: the coarsest */
    PetscInt n;         /* rows here */
    PetscInt *diagonal; /* n: where it stands in its row of `own` */
    double *inverse;    /* n: 1 / D', 0 where D' is 0 */
    double *outside;    /* n: D' - D */
    VecScatter fetch;
    Vec ghosts; /* what `other` is multiplied with */
    Vec x, b, r;
} level;

/* A symmetric positive definite system and room for conjugate gradients. */
typedef struct {
    Mat A;
    PC pc;        /* has made the levels and keeps them */
    KSP coarsest; /* where there are more levels than one */
    int levels;
    level level[LEVELS_MOST];
    double most; /* a bound on lambda_max(diag(K)^-1 M) */
    Vec x, b, r, z, p, q;
} linear_system;

/* Takes A. modes: of the dofs of this process, row by row, `count` each. */
PetscErrorCode system_create(linear_system *s, Mat A, const float *modes, PetscInt count);
PetscErrorCode system_free(linear_system *s);
/* z = M^-1 r: one V-cycle. */
PetscErrorCode system_precondition(linear_system *s, Vec z, Vec r);
/* From x and b: r = b - A x, z = M^-1 r, p = z; *square = r'z. */
PetscErrorCode system_begin(linear_system *s, double *square);
/* Steps of conjugate gradients until *square <= goal2; *made of them. *flat: the last one
 * was not made, as p'A p was not positive. */
PetscErrorCode system_steps(linear_system *s, double *square, int *made, bool *flat, int most, double goal2);

#endif
