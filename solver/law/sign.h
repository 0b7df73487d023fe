/* sign.h: the sign rule of frictionless contact, row by row: obstacles push and never pull, r <= 0, and nothing
 * penetrates, g >= 0. It is written here and nowhere else (but for the certificate's own statement of it): for the law
 * (frictionless.c), and for the forms of the dual operator, whose loops over rows ask for one row at a time. */
#ifndef UZ_SIGN_H
#define UZ_SIGN_H

#include <stdbool.h>

static inline bool uz_reaction_pulls(double r)
{
    return r > 0.0;
}

static inline bool uz_reaction_presses(double r)
{
    return r < 0.0;
}

/* The nearest reaction that an obstacle can give. -0 stays -0; NaN becomes 0. */
static inline double uz_reaction_cut(double r)
{
    return r <= 0.0 ? r : 0.0;
}

static inline bool uz_gap_penetrates(double g)
{
    return g < 0.0;
}

/* false for NaN, as uz_gap_penetrates is. */
static inline bool uz_gap_is_open(double g)
{
    return g >= 0.0;
}

/* How deep a row penetrates, 0 where it doesn't. */
static inline double uz_gap_penetration(double g)
{
    return uz_gap_penetrates(g) ? -g : 0.0;
}

/* The part of a gap that has to be lifted for nothing to penetrate: g itself where it does. NaN becomes 0. */
static inline double uz_gap_to_lift(double g)
{
    return g <= 0.0 ? g : 0.0;
}

#endif
