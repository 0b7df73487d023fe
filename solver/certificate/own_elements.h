/* own_elements.h: is a point of a body's boundary within another place of the body? Between two of its own surfaces the
 * nearest one behind a point may be the back of what the point is on, as of a strip: that it has been passed only the
 * elements tell. */
#ifndef UZ_CERTIFICATE_OWN_ELEMENTS_H
#define UZ_CERTIFICATE_OWN_ELEMENTS_H

#include "assembly/assembly.h"

typedef struct {
    const uz_body_model *model;
    double *xyz, *box; /* nodes where they are; of each element its lowest and highest corner */
    int64_t n, *near;  /* the elements that are looked at */
} uz_own_elements;

/* Of the body displaced by u; *out without xyz where no part of it has sides of both groups. The caller clears *out in
 * every case. UZ_ERR_MEMORY */
uz_status uz_own_elements_init(uz_own_elements *out, const uz_body_model *model, const uz_group *const group[2],
                               const double *u, uz_error *err);
void uz_own_elements_clear(uz_own_elements *own);

/* Looks at what meets a ball (middle: dim). */
void uz_own_elements_near(uz_own_elements *own, const double *middle, double reach);
/* Is the point, of that ball, within one of them, and not only on a side of it? */
bool uz_own_elements_hold(const uz_own_elements *own, const double *x);

/* A point of the boundary: its outward normal, of any length; is it within an element? */
typedef struct {
    double normal[3];
    bool held;
} uz_own_look;
/* May it be before a side with this normal, or, held, have passed it? */
bool uz_own_may_meet(const uz_own_look *point, const double normal[3]);

/* Have two sides, of n and m nodes, a node in common? */
bool uz_own_adjoin(const int64_t *one, int n, const int64_t *other, int m);

/* Less than this part of a side behind another one a point touches it, though it is within no element. */
#define UZ_OWN_TOUCHES 1e-5

#endif
