/* bound.h: from the terms of a certificate to its bound; what one answer and answers in lanes have in common. */
#ifndef UZ_BOUND_H
#define UZ_BOUND_H

#include "uzawa.h"

#include <float.h>

/* Of the norm of a motion: less than what places of nodes are rounded by presses on nobody. */
#define UZ_TOUCHING (8 * DBL_EPSILON)

/* What acts on a body beside its supports. */
typedef enum {
    UZ_ACTING_NOTHING,
    UZ_ACTING_ROWS, /* they touch it, and may press, if only by what rounding hides */
    UZ_ACTING_LOADS /* they deform it, whether or not that is seen */
} uz_acting;

typedef struct {
    double stiffness;         /* u'Ku */
    double energy, margin;    /* pi(u), and what rounding may hide of pi(v) */
    double change;            /* c'(K u - p + 1/2 K c) */
    double correction_energy; /* c'K c */
    double square;            /* bound on e'K^-1 e, with all that rounding may hide; INFINITY: none */
    double e1, force;         /* ||K u - p - N'r||, ||p|| */
    double span;              /* the largest |N_ij| times the largest |u_j| */
    double complementarity;   /* -r'g(v + delta) */
    double settled, pressed;  /* ||delta||_K, -r'|g(v)|: it is v + delta that is feasible; 0 where delta is 0 */
    double positive_part;     /* of the reactions that were given */
    bool moved;               /* supports move the body: */
    uz_acting acting;         /* what else acts on it, and */
    double whole_norm;        /* ||u||_K with the supported dofs */
    bool anything;            /* some entry of u, c or K u - p - N'r is not zero */
} uz_bound_terms;

/* Sums over the dofs of what pi(u) = 1/2 u'Ku - u'p is made of, and of magnitudes. */
typedef struct {
    double load, load_low, load_size; /* u'p as the pair that Dot2 gives, |u|'|p| */
    double work, work_size;           /* u'e, |u|'|e| with e = K u - p - N'r in double-double precision */
    double noise;                     /* u_j^2 K_jj + (|K u|_j + |p_j|)^2 / K_jj */
    double change_size;               /* |c|'(|K u| + |p| + |K c|) */
    double correction;                /* the sum of K_jj c_j^2 */
    double pressed;                   /* of |r_i| times what the gap of row i is the difference of */
    double rows;                      /* (|N|'|r|)_j^2 / K_jj */
    int64_t terms;                    /* uz_most_terms, or more */
} uz_energy_sums;

/* t->energy and margin by u'Ku = u'e + u'p + r'(h - g): what is left of rounding is that of u'p, r'h and r'g, which are
 * summed in double-double precision (Ogita, Rump and Oishi's bound), and of single terms. r (<= 0), g, h: m. */
void uz_bound_energy(uz_bound_terms *t, const uz_energy_sums *s, const double *r, const double *g, const double *h,
                     int64_t d, int64_t m);

/* r (<= 0), g, h: m. Everything of *out is filled; without a feasible v the terms of c and square are not read. */
void uz_bound_conclude(uz_certificate *out, const uz_bound_terms *t, bool feasible, const double *r, const double *g,
                       const double *h, int64_t m);

/* Does *out miss the request, and may it be for `square` alone? A blunt bound on it must not make the difference:
 * whether one is known depends on whom the body has served before. */
bool uz_bound_blames_distance(const uz_certificate *out, double square, double requested);

/* e'K^-1 e, enlarged by what the rounding of the factor (relative part `doubt`) and of sums may hide of it: of those in
 * double-double arithmetic, of K c and of e to doubles. inverse: e'K^-1 e <= inverse e'W e; weighted: e'W e. Proofs of
 * this and of uz_bound_rounding: docs/theory.md, rounding of sums. */
double uz_bound_enlarge(double square, double doubt, double inverse, double weighted, const uz_energy_sums *s);

/* How much the factor's rounding may falsify e'K^-1 e, relative, where the inverse of diag(K)^-1/2 K diag(K)^-1/2 has
 * the norm `inverse`: the factor is that of K + E with |E_ij| within d eps, in practice sqrt(d) eps, of the root of
 * K_ii K_jj. Good enough to see where it does not matter; elsewhere uz_distrust measures it. */
double uz_bound_doubt(double inverse, int64_t d);
/* A doubt that does no harm need not be measured. */
#define UZ_BOUND_HARMLESS 1e-2

/* What the rounding of K c and of the sum, both in double precision, may hide of c'K c. */
double uz_bound_rounding(const uz_energy_sums *s, int64_t d);

/* What an error is relative to where supports move the body. u'Ku over the free dofs counts that motion as if it tore
 * the body off its supports: an error relative to free_norm says nothing of strain and reactions. So it is whole_norm,
 * of which rigid motions are no part; but for a body that nothing but its supports moves, and that is surely not
 * deformed beyond the rounding of its motion. One that is loaded is deformed, whether or not that is seen; one that
 * rows may press, unless the bound on how much, whole_norm + error, is about that rounding itself. */
double uz_bound_reference(double whole_norm, double free_norm, double error, uz_acting acting);

/* 2-norm without overflow. */
double uz_bound_norm(const double *x, int64_t n);
/* The largest magnitude. */
double uz_bound_largest(const double *x, int64_t n);

#endif
