/* system.c: multigrid of smoothed aggregates on the levels that PETSc's GAMG makes, with a cycle of its own, and
 * conjugate gradients.
 *
 * The cycle sweeps once forwards over the rows of each process from 0, S = (D' + L)^-1, L the strict lower triangle
 * among its own rows, and once backwards, S', after the coarse correction. With D' = D + sum_j |o_ij| over the entries
 * o_ij that couple processes, D' + L + L' - A = diag(sum |o_ij|) - O is positive semidefinite by Gershgorin, whatever
 * the number of processes, and also where there is one level only (l1 smoothers: Baker, Falgout, Kolev, Yang, SIAM J.
 * Sci. Comput. 33 (2011)). So
 *
 *     S + S' - S'A S = S'(D' + (D' + L + L' - A)) S >= S'D'S > 0:   the cycle M^-1 is symmetric positive definite,
 *     M <= (D' + L) D'^-1 (D' + L'),                                which bounds lambda_max(diag(K)^-1 M). */
#include "worker.h"

#include <float.h>
#include <math.h>

static PetscErrorCode make_level(level *l, Mat A)
{
    const PetscInt *columns, *ia, *ja;
    const PetscScalar *val;
    PetscInt n, ghosts;
    PetscBool done;
    IS from;
    PetscFunctionBeginUser;
    l->A = A;
    PetscCall(MatMPIAIJGetSeqAIJ(A, &l->own, &l->other, &columns));
    PetscCall(MatGetSize(l->other, NULL, &ghosts));
    PetscCall(MatCreateVecs(A, &l->x, &l->b));
    PetscCall(VecDuplicate(l->x, &l->r));
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, ghosts, &l->ghosts));
    PetscCall(ISCreateGeneral(PETSC_COMM_SELF, ghosts, columns, PETSC_COPY_VALUES, &from));
    PetscCall(VecScatterCreate(l->x, from, l->ghosts, NULL, &l->fetch));
    PetscCall(ISDestroy(&from));
    PetscCall(MatGetRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    l->n = n;
    PetscCall(PetscMalloc1(n, &l->diagonal));
    PetscCall(PetscMalloc2(n, &l->inverse, n, &l->outside));
    PetscCall(MatSeqAIJGetArrayRead(l->own, &val));
    for (PetscInt i = 0; i < n; i++) {
        l->diagonal[i] = ia[i];
        while (l->diagonal[i] < ia[i + 1] && ja[l->diagonal[i]] < i)
            l->diagonal[i]++;
        const bool has = l->diagonal[i] < ia[i + 1] && ja[l->diagonal[i]] == i;
        PetscCheck(has, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONGSTATE, "row %" PetscInt_FMT " has no diagonal entry", i);
        l->inverse[i] = val[l->diagonal[i]];
    }
    PetscCall(MatSeqAIJRestoreArrayRead(l->own, &val));
    PetscCall(MatRestoreRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscCall(MatGetRowIJ(l->other, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscCall(MatSeqAIJGetArrayRead(l->other, &val));
    for (PetscInt i = 0; i < n; i++) {
        double sum = 0.0;
        for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
            sum += fabs(val[k]);
        const double d = l->inverse[i] + sum;
        l->outside[i] = sum;
        l->inverse[i] = d > 0.0 ? 1.0 / d : 0.0;
    }
    PetscCall(MatSeqAIJRestoreArrayRead(l->other, &val));
    PetscCall(MatRestoreRowIJ(l->other, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscFunctionReturn(0);
}

/* The norm of D^-1/2 L D^-1/2 is at most the root of its largest row sum times its largest column sum. */
static PetscErrorCode bound_by_diagonal(double *bound, const level *l)
{
    const PetscInt *ia, *ja;
    const PetscScalar *val;
    PetscInt n;
    PetscBool done;
    double most[3] = {0.0, 0.0, 1.0}, all[3], *column; /* row sum, column sum, D'/D */
    PetscFunctionBeginUser;
    PetscCall(PetscCalloc1(l->n, &column));
    PetscCall(MatGetRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscCall(MatSeqAIJGetArrayRead(l->own, &val));
    for (PetscInt i = 0; i < n; i++) {
        const double own = val[l->diagonal[i]];
        double row = 0.0;
        for (PetscInt k = ia[i]; k < l->diagonal[i]; k++) {
            const double scaled = fabs(val[k]) / sqrt(own) / sqrt(val[l->diagonal[ja[k]]]);
            row += scaled;
            column[ja[k]] += scaled;
        }
        most[0] = fmax(most[0], row);
        most[2] = fmax(most[2], (own + l->outside[i]) / own);
    }
    for (PetscInt i = 0; i < n; i++)
        most[1] = fmax(most[1], column[i]);
    PetscCall(MatSeqAIJRestoreArrayRead(l->own, &val));
    PetscCall(MatRestoreRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    PetscCall(PetscFree(column));
    PetscCallMPI(MPI_Allreduce(most, all, 3, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
    const double root = sqrt(all[2]) + sqrt(all[0] * all[1]);
    *bound = root * root;
    PetscFunctionReturn(0);
}

static PetscErrorCode attach_modes(Mat A, const float *modes, PetscInt count)
{
    Vec *vectors;
    MatNullSpace space;
    PetscInt n;
    PetscFunctionBeginUser;
    PetscCall(MatGetLocalSize(A, &n, NULL));
    PetscCall(PetscMalloc1(count, &vectors));
    for (PetscInt k = 0; k < count; k++) {
        PetscScalar *to;
        PetscCall(MatCreateVecs(A, &vectors[k], NULL));
        PetscCall(VecGetArrayWrite(vectors[k], &to));
        for (PetscInt i = 0; i < n; i++)
            to[i] = (double)modes[i * count + k];
        PetscCall(VecRestoreArrayWrite(vectors[k], &to));
    }
    PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, count, vectors, &space));
    PetscCall(MatSetNearNullSpace(A, space));
    PetscCall(MatNullSpaceDestroy(&space));
    for (PetscInt k = 0; k < count; k++)
        PetscCall(VecDestroy(&vectors[k]));
    PetscCall(PetscFree(vectors));
    PetscFunctionReturn(0);
}

PetscErrorCode system_create(linear_system *s, Mat A, const float *modes, PetscInt count)
{
    PetscInt levels;
    PetscFunctionBeginUser;
    PetscCall(PetscMemzero(s, sizeof *s));
    s->A = A;
    PetscCall(attach_modes(A, modes, count));
    PetscCall(PCCreate(PETSC_COMM_WORLD, &s->pc));
    PetscCall(PCSetOperators(s->pc, A, A));
    PetscCall(PCSetType(s->pc, PCGAMG));
    PetscCall(PCSetFromOptions(s->pc));
    PetscCall(PCSetUp(s->pc));
    PetscCall(PCMGGetLevels(s->pc, &levels));
    PetscCheck(levels <= LEVELS_MOST, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%" PetscInt_FMT " levels", levels);
    s->levels = (int)levels;
    for (PetscInt l = 0; l < levels; l++) {
        level *to = &s->level[levels - 1 - l];
        KSP smoother;
        Mat of_level;
        if (l == 0 && levels > 1)
            PetscCall(PCMGGetCoarseSolve(s->pc, &smoother));
        else
            PetscCall(PCMGGetSmoother(s->pc, l, &smoother));
        PetscCall(KSPGetOperators(smoother, &of_level, NULL));
        if (l == 0 && levels > 1) {
            s->coarsest = smoother;
            to->A = of_level;
            PetscCall(MatCreateVecs(of_level, &to->x, &to->b));
            PetscCall(VecDuplicate(to->x, &to->r));
        } else {
            PetscCall(make_level(to, of_level));
        }
        if (l > 0)
            PetscCall(PCMGGetInterpolation(s->pc, l, &to->P));
    }
    PetscCall(bound_by_diagonal(&s->most, &s->level[0]));
    PetscCall(MatCreateVecs(A, &s->x, &s->b));
    Vec *more[] = {&s->r, &s->z, &s->p, &s->q};
    for (size_t k = 0; k < sizeof more / sizeof more[0]; k++)
        PetscCall(VecDuplicate(s->x, more[k]));
    PetscFunctionReturn(0);
}

PetscErrorCode system_free(linear_system *s)
{
    PetscFunctionBeginUser;
    for (int k = 0; k < s->levels; k++) {
        level *l = &s->level[k];
        Vec *vectors[] = {&l->x, &l->b, &l->r, &l->ghosts};
        for (size_t v = 0; v < sizeof vectors / sizeof vectors[0]; v++)
            PetscCall(VecDestroy(vectors[v]));
        PetscCall(VecScatterDestroy(&l->fetch));
        PetscCall(PetscFree(l->diagonal));
        PetscCall(PetscFree2(l->inverse, l->outside));
    }
    Vec *vectors[] = {&s->x, &s->b, &s->r, &s->z, &s->p, &s->q};
    for (size_t v = 0; v < sizeof vectors / sizeof vectors[0]; v++)
        PetscCall(VecDestroy(vectors[v]));
    PetscCall(PCDestroy(&s->pc));
    PetscCall(MatDestroy(&s->A));
    PetscCall(PetscMemzero(s, sizeof *s));
    PetscFunctionReturn(0);
}

/* ---- the cycle */

/* What the rows here take from other processes: out = sum of other * x there. `to` (n) is overwritten or added to. */
static PetscErrorCode fetch_ghosts(level *l, Vec x, const PetscScalar **ghosts)
{
    PetscFunctionBeginUser;
    PetscCall(VecScatterBegin(l->fetch, x, l->ghosts, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(l->fetch, x, l->ghosts, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetArrayRead(l->ghosts, ghosts));
    PetscFunctionReturn(0);
}

typedef struct {
    const PetscInt *ia, *ja, *oia, *oja;
    const PetscScalar *val, *oval;
} rows;

static PetscErrorCode get_rows(rows *r, const level *l)
{
    PetscInt n;
    PetscBool done;
    PetscFunctionBeginUser;
    PetscCall(MatGetRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &r->ia, &r->ja, &done));
    PetscCall(MatGetRowIJ(l->other, 0, PETSC_FALSE, PETSC_FALSE, &n, &r->oia, &r->oja, &done));
    PetscCall(MatSeqAIJGetArrayRead(l->own, &r->val));
    PetscCall(MatSeqAIJGetArrayRead(l->other, &r->oval));
    PetscFunctionReturn(0);
}

static PetscErrorCode restore_rows(rows *r, const level *l)
{
    PetscInt n;
    PetscBool done;
    PetscFunctionBeginUser;
    PetscCall(MatSeqAIJRestoreArrayRead(l->own, &r->val));
    PetscCall(MatSeqAIJRestoreArrayRead(l->other, &r->oval));
    PetscCall(MatRestoreRowIJ(l->own, 0, PETSC_FALSE, PETSC_FALSE, &n, &r->ia, &r->ja, &done));
    PetscCall(MatRestoreRowIJ(l->other, 0, PETSC_FALSE, PETSC_FALSE, &n, &r->oia, &r->oja, &done));
    PetscFunctionReturn(0);
}

/* x = (D' + L)^-1 b, and the residual r = b - A x: of the own rows all but -L'x + (D' - D) x is 0. */
static PetscErrorCode sweep_down(level *l, Vec X, Vec R, Vec B)
{
    rows a;
    PetscScalar *x, *r;
    const PetscScalar *b, *ghosts;
    PetscFunctionBeginUser;
    PetscCall(get_rows(&a, l));
    PetscCall(VecGetArray(X, &x));
    PetscCall(VecGetArrayRead(B, &b));
    for (PetscInt i = 0; i < l->n; i++) {
        double sum = b[i];
        for (PetscInt k = a.ia[i]; k < l->diagonal[i]; k++)
            sum -= a.val[k] * x[a.ja[k]];
        x[i] = sum * l->inverse[i];
    }
    PetscCall(VecRestoreArrayRead(B, &b));
    PetscCall(VecRestoreArray(X, &x));
    PetscCall(fetch_ghosts(l, X, &ghosts));
    PetscCall(VecGetArray(X, &x));
    PetscCall(VecGetArrayWrite(R, &r));
    for (PetscInt i = 0; i < l->n; i++) {
        double sum = l->outside[i] * x[i];
        for (PetscInt k = l->diagonal[i] + 1; k < a.ia[i + 1]; k++)
            sum -= a.val[k] * x[a.ja[k]];
        for (PetscInt k = a.oia[i]; k < a.oia[i + 1]; k++)
            sum -= a.oval[k] * ghosts[a.oja[k]];
        r[i] = sum;
    }
    PetscCall(VecRestoreArrayWrite(R, &r));
    PetscCall(VecRestoreArray(X, &x));
    PetscCall(VecRestoreArrayRead(l->ghosts, &ghosts));
    PetscCall(restore_rows(&a, l));
    PetscFunctionReturn(0);
}

/* x += (D' + L')^-1 (b - A x). */
static PetscErrorCode sweep_up(level *l, Vec X, Vec B)
{
    rows a;
    PetscScalar *x;
    const PetscScalar *b, *ghosts;
    PetscFunctionBeginUser;
    PetscCall(get_rows(&a, l));
    PetscCall(fetch_ghosts(l, X, &ghosts));
    PetscCall(VecGetArray(X, &x));
    PetscCall(VecGetArrayRead(B, &b));
    for (PetscInt i = l->n - 1; i >= 0; i--) {
        double sum = b[i];
        for (PetscInt k = a.oia[i]; k < a.oia[i + 1]; k++)
            sum -= a.oval[k] * ghosts[a.oja[k]];
        for (PetscInt k = a.ia[i]; k < a.ia[i + 1]; k++)
            sum -= a.val[k] * x[a.ja[k]];
        x[i] += sum * l->inverse[i];
    }
    PetscCall(VecRestoreArrayRead(B, &b));
    PetscCall(VecRestoreArray(X, &x));
    PetscCall(VecRestoreArrayRead(l->ghosts, &ghosts));
    PetscCall(restore_rows(&a, l));
    PetscFunctionReturn(0);
}

PetscErrorCode system_precondition(linear_system *s, Vec z, Vec r)
{
    const int last = s->levels - 1;
    PetscFunctionBeginUser;
    for (int k = 0; k < last; k++) {
        level *l = &s->level[k];
        PetscCall(sweep_down(l, k == 0 ? z : l->x, l->r, k == 0 ? r : l->b));
        PetscCall(MatMultTranspose(l->P, l->r, s->level[k + 1].b));
    }
    if (last == 0) { /* GAMG's solver of a level that is the only one is none */
        PetscCall(sweep_down(&s->level[0], z, s->level[0].r, r));
        PetscCall(sweep_up(&s->level[0], z, r));
        PetscFunctionReturn(0);
    }
    PetscCall(KSPSolve(s->coarsest, s->level[last].b, s->level[last].x));
    for (int k = last - 1; k >= 0; k--) {
        level *l = &s->level[k];
        Vec x = k == 0 ? z : l->x;
        PetscCall(MatMultAdd(l->P, s->level[k + 1].x, x, x));
        PetscCall(sweep_up(l, x, k == 0 ? r : l->b));
    }
    PetscFunctionReturn(0);
}

/* ---- conjugate gradients */

PetscErrorCode system_begin(linear_system *s, double *square)
{
    PetscFunctionBeginUser;
    PetscCall(MatMult(s->A, s->x, s->r));
    PetscCall(VecAYPX(s->r, -1.0, s->b));
    PetscCall(system_precondition(s, s->z, s->r));
    PetscCall(VecDot(s->r, s->z, square));
    PetscCall(VecCopy(s->z, s->p));
    PetscFunctionReturn(0);
}

PetscErrorCode system_steps(linear_system *s, double *square, int *made, bool *flat, int most, double goal2)
{
    PetscFunctionBeginUser;
    *flat = false;
    for (*made = 0; *made<most && * square> goal2;) {
        double curvature, last = *square;
        PetscCall(MatMult(s->A, s->p, s->q));
        PetscCall(VecDot(s->p, s->q, &curvature));
        if (fabs(curvature) < DBL_MIN) /* underflow: there is no more to gain */
            break;
        *flat = !(curvature > 0.0);
        if (*flat)
            break;
        const double alpha = last / curvature;
        PetscCall(VecAXPY(s->x, alpha, s->p));
        PetscCall(VecAXPY(s->r, -alpha, s->q));
        PetscCall(system_precondition(s, s->z, s->r));
        PetscCall(VecDot(s->r, s->z, square));
        PetscCall(VecAYPX(s->p, *square / last, s->z));
        (*made)++;
    }
    PetscFunctionReturn(0);
}
