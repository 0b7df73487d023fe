/* nearby.h: where a load case begins: at answers to former cases of the same call, as far as their loads are near.
 *
 * As long as the same rows press, an answer is linear in its load (p, h): the sum of answers whose loads sum up to this
 * one. Where rows change it is off by the square of how far the loads are apart, in direction alone, as t (p, h) has t
 * times the answer for any t > 0. Loads are told by their coordinates in an orthonormal basis of all so far, which has
 * as many vectors as they are independent: two for any number of cases that differ by two factors. Nothing that is
 * proved of an answer follows from where it began. */
#ifndef UZ_NEARBY_H
#define UZ_NEARBY_H

#include "uzawa.h"

/* A sum of answers: share[k] of that of case of[k]. */
enum { UZ_NEARBY_MOST = 8 };
typedef struct {
    int count;
    int64_t of[UZ_NEARBY_MOST];
    double share[UZ_NEARBY_MOST];
} uz_nearby_sum;

typedef struct uz_nearby uz_nearby;
/* For n cases with d dofs and m rows. NULL: no memory; so are all cases begun as the first is. */
uz_nearby *uz_nearby_new(int64_t n, int64_t d, int64_t m);
void uz_nearby_free(uz_nearby *nearby); /* NULL is fine */
/* The load of case i is p (d), h (m). */
void uz_nearby_place(uz_nearby *nearby, int64_t i, const double *p, const double *h);
/* Case i has been answered: later ones may begin there. */
void uz_nearby_answered(uz_nearby *nearby, int64_t i);
/* A sum that is near the answer of case i, which has been placed: it is off by about `near` of the load at most, as the
 * distances tell. false: there is none. */
bool uz_nearby_find(uz_nearby_sum *out, const uz_nearby *nearby, int64_t i, double near);

#endif
