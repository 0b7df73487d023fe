/* mean_piola.h: the certificate's own statement of mean dilatation: an element's W is that of s F, whose determinant is
 * the mean theta of det F over the volume at rest. */
#ifndef UZ_CERTIFICATE_MEAN_PIOLA_H
#define UZ_CERTIFICATE_MEAN_PIOLA_H

#include "certificate/piola.h"

/* At a point. In plane strain the stretch across the plane is not shared in, and nothing has values there. */
typedef struct {
    uz_piola at;          /* W, P = dW/dF and A at a given theta */
    long double F[9];     /* s F */
    long double along[9]; /* d det F / dF */
    long double pressure; /* dW / dtheta */
    double slope;         /* and its derivative by theta */
    double cross[9];      /* dP / dtheta */
} uz_mean_piola;

/* F: as uz_piola_at has it, det > 0 its determinant; space: of solids, ring: of rings, else of plane strain. */
void uz_mean_piola_at(uz_mean_piola *out, uz_elasticity law, long double lambda, long double mu, const long double F[9],
                      long double det, long double theta, bool space, bool ring);

/* P and A become those of the element's energy, whose mean of dW / dtheta is `pressure`. */
void uz_mean_piola_press(uz_mean_piola *x, long double pressure, long double det, bool space, bool ring);

#endif
