#include "certificate/infeasible.h"

#include "certificate/one_sided.h"
#include "certificate/double_double.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <gmp.h>
#include <math.h>
#include <string.h>

/* h'y is positive beyond what the rounding of each h_i may do to it. Its own sum is exact to far less. */
#define RAY_NOISE (8.0 * DBL_EPSILON)

bool uz_ray_is_likely(const double *y, const uz_csc *N, const double *h, const double *g, double *row_room)
{
    double_double work = {0};
    double size = 0.0, residual = 0.0, length = 0.0;
    bool rounded = true;
    if (!uz_is_ray_direction(y, N->rows))
        return false;
    memset(row_room, 0, (size_t)N->rows * sizeof *row_room);
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        row_room[N->idx[k]] = fmax(row_room[N->idx[k]], fabs(N->val[k]));
    for (int64_t i = 0; i < N->rows; i++)
        if (row_room[i] > 0.0)
            length = fmax(length, (fabs(h[i]) + fabs(g[i])) / row_room[i]);
    for (int64_t i = 0; i < N->rows; i++) {
        dd_add_product(&work.hi, &work.lo, h[i], y[i], 0);
        size += fabs(h[i] * y[i]);
    }
    for (int64_t j = 0; j < N->cols; j++) {
        double_double sum = {0};
        double terms = 0.0;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            dd_add_product(&sum.hi, &sum.lo, N->val[k], y[N->idx[k]], 0);
            terms += fabs(N->val[k] * y[N->idx[k]]);
        }
        residual += fabs(sum.hi + sum.lo);
        rounded = rounded && fabs(sum.hi + sum.lo) <= 4.0 * DBL_EPSILON * terms;
    }
    double sure = work.hi + work.lo;
    return sure > RAY_NOISE * size && sure > residual * (rounded ? UZ_RAY_ROUNDED : UZ_RAY_FACTOR) * length;
}

/* ------------------------------------------------------------------- exactly */

/* Entries of a part's equations, and words multiplied in all parts, before it is too large: about two seconds. */
enum { MOST_ENTRIES = 400000, MOST_SORTED = 2000, RETRIES = 20 };
static const double MOST_WORK = 4e8;

/* Rows with y < 0 that share dofs, and their equations. What is of the rows is in the order of `row`, by falling |y|.
 */
typedef struct {
    const uz_csc *N, *Nt; /* m x d, d x m */
    const double *h, *y;
    int64_t n, n_dof;
    int64_t *row, *dof;     /* room: m, d; numbers in N, also those of earlier parts */
    int64_t *place;         /* d: where a dof stands in `dof`; -1: not yet seen */
    bool *seen;             /* m: of this or an earlier part */
    int64_t *pivot, *shift; /* m: the equation that the row's entry was solved from, -1: free; and see A */
    bool *used;             /* d: equations that were solved */
    mpz_t *A;               /* n_dof x n: column c is row c of N times 2^shift; eliminated: `last` times the unit matrix
                               in the columns that were solved for */
    mpz_t last, a, b;
    mpq_t *value; /* n: the exact y */
    mpq_t term, sum;
    double work; /* left to spend */
} parts;

/* Column c out of all equations but one. false: there is no such equation. */
static bool eliminate(parts *x, int64_t c)
{
    int64_t p = -1;
    for (int64_t e = 0; e < x->n_dof; e++) {
        const mpz_t *entry = &x->A[e * x->n + c];
        if (!x->used[e] && mpz_sgn(*entry) != 0 && (p < 0 || mpz_size(*entry) < mpz_size(x->A[p * x->n + c])))
            p = e;
    }
    x->pivot[c] = p;
    if (p < 0)
        return false;
    x->used[p] = true;
    const mpz_t *solved = x->A + p * x->n;
    mpz_set(x->a, solved[c]);
    for (int64_t e = 0; e < x->n_dof; e++) {
        mpz_t *equation = x->A + e * x->n;
        mpz_set(x->b, equation[c]);
        for (int64_t k = 0; e != p && k < x->n && x->work > 0.0; k++) {
            const bool changes = mpz_sgn(x->b) != 0 && mpz_sgn(solved[k]) != 0;
            if (!changes && mpz_sgn(equation[k]) == 0)
                continue;
            x->work -= (double)(mpz_size(x->a) * mpz_size(equation[k]) + mpz_size(x->b) * mpz_size(solved[k]) + 4);
            mpz_mul(equation[k], equation[k], x->a);
            if (changes)
                mpz_submul(equation[k], x->b, solved[k]);
            mpz_divexact(equation[k], equation[k], x->last);
        }
    }
    mpz_set(x->last, x->a);
    return true;
}

/* The entries that are solved for, from the free ones, which keep y. Returns a column that would have to pull; -1: none
 * does. */
static int64_t solve(parts *x)
{
    int64_t pulls = -1;
    for (int64_t c = 0; c < x->n; c++) {
        mpq_set_d(x->value[c], x->y[x->row[c]]);
        mpq_div_2exp(x->value[c], x->value[c], (mp_bitcnt_t)x->shift[c]);
    }
    for (int64_t c = 0; c < x->n; c++) {
        if (x->pivot[c] < 0)
            continue;
        mpq_set_ui(x->sum, 0, 1);
        for (int64_t k = 0; k < x->n; k++)
            if (x->pivot[k] < 0 && mpz_sgn(x->A[x->pivot[c] * x->n + k]) != 0) {
                mpq_set_z(x->term, x->A[x->pivot[c] * x->n + k]);
                mpq_mul(x->term, x->term, x->value[k]);
                mpq_sub(x->sum, x->sum, x->term);
            }
        mpq_set_z(x->term, x->last);
        mpq_div(x->value[c], x->sum, x->term);
        pulls = mpq_sgn(x->value[c]) > 0 ? c : pulls;
    }
    for (int64_t c = 0; c < x->n; c++)
        mpq_mul_2exp(x->value[c], x->value[c], (mp_bitcnt_t)x->shift[c]);
    return pulls;
}

/* sum += x y */
static void add_product(mpq_t sum, mpq_t term, double x, const mpq_t y)
{
    mpq_set_d(term, x);
    mpq_mul(term, term, y);
    mpq_add(sum, sum, term);
}

/* Is there an exact ray near y on the rows of this part? Rows that would have to pull, of which y has no more than
 * rounding, are left out. */
static bool prove_part(parts *x)
{
    for (int attempt = 0; attempt < RETRIES && x->n > 0; attempt++) {
        int64_t solved = 0;
        memset(x->used, 0, (size_t)x->n_dof * sizeof *x->used);
        mpz_set_ui(x->last, 1);
        for (int64_t k = 0; k < x->n_dof * x->n; k++) /* the equations N'y = 0 in integers */
            mpz_set_ui(x->A[k], 0);
        for (int64_t c = 0; c < x->n; c++) {
            const int64_t first = x->Nt->ptr[x->row[c]], end = x->Nt->ptr[x->row[c] + 1];
            int exponent, least = 0;
            for (int64_t q = first; q < end; q++) {
                frexp(x->Nt->val[q], &exponent);
                least = x->Nt->val[q] != 0.0 && exponent - DBL_MANT_DIG < least ? exponent - DBL_MANT_DIG : least;
            }
            x->shift[c] = -least;
            for (int64_t q = first; q < end; q++) {
                mpz_t *entry = &x->A[x->place[x->Nt->idx[q]] * x->n + c];
                mpz_set_d(*entry, ldexp(frexp(x->Nt->val[q], &exponent), DBL_MANT_DIG));
                if (x->Nt->val[q] != 0.0)
                    mpz_mul_2exp(*entry, *entry, (mp_bitcnt_t)(exponent - DBL_MANT_DIG - least));
            }
        }
        for (int64_t c = 0; c < x->n; c++)
            solved += eliminate(x, c);
        if (!(x->work > 0.0) || solved == x->n)
            return false;
        int64_t pulls = solve(x);
        if (pulls < 0) {
            mpq_set_ui(x->sum, 0, 1);
            for (int64_t c = 0; c < x->n; c++)
                add_product(x->sum, x->term, x->h[x->row[c]], x->value[c]);
            return mpq_sgn(x->sum) > 0;
        }
        x->n--;
        for (int64_t c = pulls; c < x->n; c++)
            x->row[c] = x->row[c + 1];
    }
    return false;
}

/* exact (m): += the ray of the part that row i belongs to, rounded, if it has one. */
static uz_status try_part(bool *proven, double *exact, parts *x, int64_t i, uz_error *err)
{
    uz_status status = UZ_OK;
    /* the rows that row i is joined to by dofs, directly or by others */
    x->n = x->n_dof = 0;
    x->row[x->n++] = i;
    x->seen[i] = true;
    for (int64_t c = 0; c < x->n; c++)
        for (int64_t q = x->Nt->ptr[x->row[c]]; q < x->Nt->ptr[x->row[c] + 1]; q++) {
            const int64_t j = x->Nt->idx[q];
            if (x->place[j] >= 0)
                continue;
            x->place[j] = x->n_dof;
            x->dof[x->n_dof++] = j;
            for (int64_t k = x->N->ptr[j]; k < x->N->ptr[j + 1]; k++) {
                const int64_t other = x->N->idx[k];
                if (x->y[other] < 0.0 && !x->seen[other])
                    x->row[x->n++] = other;
                x->seen[other] = x->seen[other] || x->y[other] < 0.0;
            }
        }
    for (int64_t c = 1; c < x->n && x->n <= MOST_SORTED; c++) {
        const int64_t row = x->row[c];
        int64_t k = c;
        for (; k > 0 && x->y[x->row[k - 1]] > x->y[row]; k--)
            x->row[k] = x->row[k - 1];
        x->row[k] = row;
    }
    const int64_t n = x->n, entries = x->n_dof * n;
    if (entries <= MOST_ENTRIES) {
        x->A = uz_alloc(entries, sizeof *x->A);
        x->value = uz_alloc(n, sizeof *x->value);
        if (!x->A || !x->value) {
            status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to prove that %lld rows contradict", (long long)n);
        } else {
            for (int64_t k = 0; k < entries; k++)
                mpz_init(x->A[k]);
            for (int64_t c = 0; c < n; c++)
                mpq_init(x->value[c]);
            bool found = prove_part(x);
            for (int64_t c = 0; found && c < x->n; c++)
                if (mpq_sgn(x->value[c]) < 0)
                    exact[x->row[c]] = fmin(mpq_get_d(x->value[c]), -DBL_MIN);
            *proven = *proven || found;
            for (int64_t k = 0; k < entries; k++)
                mpz_clear(x->A[k]);
            for (int64_t c = 0; c < n; c++)
                mpq_clear(x->value[c]);
        }
        uz_free_all(x->A, x->value);
    }
    return status;
}

/* h'y / ||N'y||_1, rounded down; 0 where h'y is not positive. */
static double radius_of(const double *y, const uz_csc *N, const double *h)
{
    mpq_t work, slack, sum, term, entry;
    mpq_inits(work, slack, sum, term, entry, NULL);
    for (int64_t i = 0; i < N->rows; i++)
        if (y[i] < 0.0) {
            mpq_set_d(entry, y[i]);
            add_product(work, term, h[i], entry);
        }
    for (int64_t j = 0; j < N->cols; j++) {
        mpq_set_ui(sum, 0, 1);
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            if (y[N->idx[k]] < 0.0) {
                mpq_set_d(entry, y[N->idx[k]]);
                add_product(sum, term, N->val[k], entry);
            }
        mpq_abs(sum, sum);
        mpq_add(slack, slack, sum);
    }
    double radius = mpq_sgn(work) > 0 ? INFINITY : 0.0;
    if (mpq_sgn(work) > 0 && mpq_sgn(slack) > 0) {
        mpq_div(work, work, slack);
        radius = fmin(mpq_get_d(work), DBL_MAX); /* INFINITY would say that there is no u at all */
    }
    mpq_clears(work, slack, sum, term, entry, NULL);
    return radius;
}

uz_status uz_prove_ray(double *radius, double *y, const uz_csc *N, const double *h, uz_error *err)
{
    const int64_t m = N->rows, d = N->cols;
    uz_csc Nt;
    *radius = 0.0;
    if (!uz_is_ray_direction(y, m))
        return UZ_OK;
    for (int64_t i = 0; i < m; i++)
        if (!isfinite(y[i])) /* no rational number */
            return UZ_OK;
    uz_status status = uz_csc_transpose(&Nt, N, err);
    if (status != UZ_OK)
        return status;
    parts x = {.N = N, .Nt = &Nt, .h = h, .y = y, .work = MOST_WORK};
    int64_t **of_m[] = {&x.row, &x.pivot, &x.shift}, **of_d[] = {&x.dof, &x.place};
    double *exact = uz_alloc_zero(m, sizeof *exact);
    bool ok = exact && (x.seen = uz_alloc_zero(m, sizeof *x.seen)) && (x.used = uz_alloc_zero(d, sizeof *x.used));
    for (size_t k = 0; ok && k < sizeof of_m / sizeof of_m[0]; k++)
        ok = (*of_m[k] = uz_alloc_zero(m, sizeof(int64_t))) != NULL;
    for (size_t k = 0; ok && k < sizeof of_d / sizeof of_d[0]; k++)
        ok = (*of_d[k] = uz_alloc_zero(d, sizeof(int64_t))) != NULL;
    if (!ok)
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to prove that rows contradict");
    for (int64_t j = 0; ok && j < d; j++)
        x.place[j] = -1;
    bool proven = false;
    mpz_inits(x.last, x.a, x.b, NULL);
    mpq_inits(x.term, x.sum, NULL);
    for (int64_t i = 0; status == UZ_OK && i < m; i++)
        if (y[i] < 0.0 && !x.seen[i])
            status = try_part(&proven, exact, &x, i, err);
    mpz_clears(x.last, x.a, x.b, NULL);
    mpq_clears(x.term, x.sum, NULL);
    if (status == UZ_OK && proven) {
        *radius = INFINITY;
        memcpy(y, exact, (size_t)m * sizeof *y);
    } else if (status == UZ_OK) {
        *radius = radius_of(y, N, h);
    }
    uz_free_all(x.row, x.pivot, x.shift, x.dof, x.place, x.seen, x.used, exact);
    uz_csc_clear(&Nt);
    return status;
}
