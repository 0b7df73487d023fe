/* lanes.h: certificates of several answers on one body, with one pass over K for UZ_CERTIFY_LANES of them.
 *
 * What a certificate prepares from K and N alone is made once, and what touches the contact only is done on the contact
 * only. An answer that needs more than that is left to uz_certify, whose certificates these are but for rounding. */
#ifndef UZ_CERTIFY_LANES_H
#define UZ_CERTIFY_LANES_H

#include "certificate/certificate.h"

enum { UZ_CERTIFY_LANES = 8 };

typedef struct uz_lane_certifier uz_lane_certifier; /* one thread */

/* inverse_norm of UZ_CERTIFY_LANES vectors side by side (see uz_certify_lanes), which may be overwritten. */
typedef uz_status (*uz_inverse_norms)(void *ctx, double squares[UZ_CERTIFY_LANES], double *E, uz_error *err);

/* Of `in` what belongs to K and N, which are borrowed: also inverse_bound, spares, measure_doubt and ctx, that of
 * inverse_norms too. inverse_norms: read where `spares` is false. */
uz_status uz_lane_certifier_create(uz_lane_certifier **out, const uz_certify_input *in, uz_inverse_norms inverse_norms,
                                   uz_error *err);
void uz_lane_certifier_free(uz_lane_certifier *certifier);

typedef struct {
    double *r;       /* m: cut at 0 */
    double *g;       /* m: out */
    const double *h; /* m */
    double sharp;    /* see uz_certify_input */
    bool moved;      /* the same */
    uz_acting acting;
    double whole_norm;
    uz_certificate certificate;
    bool certified; /* false: certificate is not filled */
} uz_lane_answer;

/* U, P (d x UZ_CERTIFY_LANES): entry j of answer l at U[j * UZ_CERTIFY_LANES + l]. count <= UZ_CERTIFY_LANES answers;
 * the other lanes hold finite numbers. A certificate does not depend on its neighbours or its lane. */
void uz_certify_lanes(uz_lane_certifier *certifier, uz_lane_answer *answers, int count, const double *U,
                      const double *P);

#endif
