/* law.h: a contact law: which reactions a contact can give, and which gaps go with them.
 *
 * A law is a closed convex set C of reactions for each contact, a block of `rows` consecutive rows of N: its normal,
 * then its tangents where the law has friction. r is a solution with the gaps g = h - N u of these rows when
 *
 *     r in C   and   g'(s - r) <= 0 for all s in C,   that is   r = P(r + t g) for every t > 0
 *
 * with P the closest point of C. Frictionless: C = {r <= 0}, which says r <= 0, g >= 0, r g = 0. Coulomb friction is
 * such a set, too, once the normal reaction is known (Tresca), or with g enlarged by mu |g_t| (de Saxce and Feng 1998).
 *
 * A law is asked for whole vectors, once, so that loops over rows stay inside it. n: rows, a whole number of blocks;
 * one block alone is a vector, too. Nothing is allocated. The certificate does not use any of this: it states the law
 * for itself (certificate/one_sided.h), so that a mistake here is found there. How to add one: docs/architecture. */
#ifndef UZ_LAW_H
#define UZ_LAW_H

#include <stdbool.h>
#include <stdint.h>

typedef struct uz_law uz_law;

typedef struct {
    const char *name;
    int rows;       /* of a contact */
    bool one_sided; /* C is r <= 0 row by row: active sets, exchanges and conjugate steps need that, and rays, which are
                     * proofs by Farkas, and what holds a body with a singular K */
    /* r = P(r) */
    void (*project)(const uz_law *law, double *r, int64_t n);
    /* Is r in C? Without tolerance. */
    bool (*admissible)(const uz_law *law, const double *r, int64_t n);
    /* The norm of r - P(r + step g), step (n) > 0 and the same for all rows of a contact, each row times its scale
     * (NULL: 1): 0 for solutions, and only there. */
    double (*residual)(const uz_law *law, const double *r, const double *g, const double *step, const double *scale,
                       int64_t n);
    /* What r and g add to the duality gap: the largest g's over s in C, less g'r. At least 0 for r in C, INFINITY
     * where g is no gap that the law allows. */
    double (*gap_bound)(const uz_law *law, const double *r, const double *g, int64_t n);
    /* How far each gap is from one that the law allows. out may be g. */
    void (*penetration)(const uz_law *law, double *out, const double *g, int64_t n);
    /* Rows whose contact transmits a force: how many; in (n; NULL: not wanted): which. */
    int64_t (*active)(const uz_law *law, bool *in, const double *r, int64_t n);
    /* Rows that still do after a projected step from r: the prediction of the primal-dual active set. */
    void (*predict)(const uz_law *law, bool *in, const double *r, const double *g, const double *step, int64_t n);

    /* one_sided only, else NULL: */
    /* Rows of a solution for a guess of the active rows that refute it: active ones that pull, others that penetrate.
     * How many; wrong (n; NULL: not wanted): which. */
    int64_t (*refute)(const uz_law *law, bool *wrong, const bool *active, const double *r, const double *g, int64_t n);
    /* The longest step of each row along d that stays in C; 0 from outside, INFINITY where nothing ends it. */
    void (*reach)(const uz_law *law, double *out, const double *r, const double *d, int64_t n);
} uz_law_kind;

/* The law of a problem's contacts. */
struct uz_law {
    const uz_law_kind *kind;
    const double *coefficient; /* of each contact, such as a coefficient of friction; NULL: the law has none */
};

/* No friction: what a problem has that does not ask for another law. */
extern const uz_law uz_law_frictionless;

#endif
