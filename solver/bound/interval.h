/* interval.h: where a quantity of the continuum is, guaranteed, from a displacement and a stress for it.
 *
 * A quantity Q is the work of a load l, or the force of contacts, or of supports against a direction. Let w be a
 * displacement with w_n near om at obstacles (1 where the force is asked for, 0 elsewhere), and at supports minus the
 * direction where they are asked for, 0 elsewhere; tau a stress that balances l, with whatever pressure q on obstacles.
 * With loads f, gaps g, pressure r, gap s, d = eps(w) - C^-1 tau, and R what tau lacks of equilibrium,
 *
 *     Q = f(w) - int sigma : d + int q g - tau n . (values at supports) + int tau : expansion + R(u)
 *           - int (r (w_n - om) + q s)
 *
 * Of a pair with |w_n - om| <= m s_h and |q| <= m r_h the last term is at most m (int r s_h + int r_h s) =: m P; and P
 * is a term of the gap between u_h and sigma_h (bound.h): about their mean sigma_m the stress sigma is in a ball,
 *
 *     |sigma - sigma_m|^2 = |e_u|^2 / 2 + |e_sigma|^2 / 2 - |sigma_h - C eps(u_h)|^2 / 4 <= H - P,
 *
 * H = (G + int r_h s_h) / 2, more where u_h has to be taken out of the obstacle by a displacement (check.c),
 *
 * so that Q is within |d| sqrt(H - P) + m P of what is known, of second order in the mesh's error. All that is not
 * exact is in the interval: what both stresses lack of equilibrium, w where it is nearer or farther than it may be. */
#ifndef UZ_BOUND_INTERVAL_H
#define UZ_BOUND_INTERVAL_H

#include "bound/bound.h"

typedef struct {
    /* The body with the load l alone (traction, force) and w's displacement at supports (value); no expansion. The rest
     * is that of the body itself. */
    const uz_bound_body *adjoint;
    double *w;            /* n_nodes x 2; its nodes are brought to where they may be before obstacles */
    const double *stress; /* tau, as uz_bound_stress has it */
    const double *wanted; /* n_contacts: om */
    double share;         /* m > 0 */
} uz_bound_pair;

typedef struct {
    double middle;         /* what is known of Q */
    double apart;          /* |d|, from above */
    double share;          /* m */
    double bulge, pressed; /* norm of what takes w to where w_n may be, along edges; what r_h does on it */
    double rounding;       /* of the middle, from above */
    double lacking;        /* as uz_bound_lacking, but for that of the residual */
    double *residual;      /* as many as unknowns: what edges lack of equilibrium; the caller frees it */
    double *local;         /* n_elements: half of what each has of |d|^2; the caller frees it */
    char fault[96];        /* what is wrong, a clause: nothing is proved; "" */
} uz_bound_interval;

/* open: n_nodes, how far |w_n - om| / m may be from zero at nodes before obstacles, by the gap that the answer leaves,
 * in the middle of a quadratic edge the coefficient of the Bernstein polynomial; of others INFINITY. */
void uz_bound_openings(double *open, const uz_bound_body *body, const uz_bound_check_result *checked);
/* |eps(w) - C^-1 tau|, as it is. UZ_ERR_MEMORY. */
uz_status uz_bound_apart(double *apart, const uz_bound_pair *pair, uz_error *err);

/* All of it but the middle, what is known of which takes longer, and with that rounding and residual: how wide an
 * interval would be. The caller frees out->local. UZ_ERR_MEMORY. */
uz_status uz_bound_width(uz_bound_interval *out, const uz_bound_pair *pair, const uz_bound_body *body,
                         const uz_bound_check_result *checked, uz_error *err);
/* What is known of a quantity. u, stress: of the answer, as checked. UZ_ERR_MEMORY. */
uz_status uz_bound_weigh(uz_bound_interval *out, const uz_bound_pair *pair, const uz_bound_body *body,
                         const uz_scene *scene, const int64_t *dof, int64_t n_dofs, const double *u,
                         const double *stress, const uz_bound_check_result *checked, uz_error *err);

/* Q is within so much of the middle. residual_norm: of the answer's stress; own_norm: of the pair's. */
double uz_bound_half(const uz_bound_interval *interval, const uz_bound_check_result *checked, double residual_norm,
                     double own_norm);
/* H above, with what the answer's own stress lacks of equilibrium. */
double uz_bound_ball(const uz_bound_check_result *checked, double residual_norm);

#endif
