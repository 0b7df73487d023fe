/* finite.h: what can be said of an answer to a scene of finite kinematics, whoever made it.
 *
 * Nothing here is shared with the iteration (finite/, run/finite.c) but the scene's data: forces and tangent follow
 * from the first Piola-Kirchhoff stress as a function of F, in extended precision, and the factor is one of its own. */
#ifndef UZ_CERTIFICATE_FINITE_H
#define UZ_CERTIFICATE_FINITE_H

#include "assembly/assembly.h"
#include "core/hooks.h"

typedef struct {
    const uz_body_model *model; /* at the place u: its rows are those that the answer has there */
    const uz_body_model *rest;  /* the same before anything moves */
    const uz_scene *scene;      /* with the loads, supports and obstacles that the answer is for */
    const double *u;            /* n_nodes x dim */
    const double *r, *g;        /* m: reactions, and gaps at the place */
    const double *prescribed;   /* n_fixed */
    const double *free_strain;  /* n_elements: what each would be larger by in all directions without stress, as the
                                 * loads have it; NULL: no temperature */
} uz_finite_answer;

typedef struct {
    bool stopped;     /* before the end: nothing else is told */
    double bytes;     /* what its tangent and its factor took */
    double energy;    /* strain energy, of the law's W, and that of springs */
    double least_det; /* of F, at quadrature points, corners and along edges that bend */
    /* (f' H^-1 f + 2 |r'g|)^(1/2) over the root of twice the energy: H is the second derivatives of the Lagrangian with
     * stiffness along the pressed rows, f what the forces on free dofs leave over, with what that stiffness makes of
     * gaps of these rows; r'g of the others. To first order a bound on the distance from the equilibrium, in the norm
     * of H. INFINITY where H is not positive definite */
    double residual;
    double rounding; /* less than this of `residual` may be rounding of F, as where strains are tiny, or of gaps */
    double distance; /* the largest coordinate over the body's extent where there are rows, else, and at least, 1 */
    bool unstrained; /* no element has more strain than what solves and rounding leave of its own F and way */
    /* A Cholesky factor of H exists: the energy grows along every small motion that leaves the pressed rows closed, so
     * that the equilibrium is a strict local minimum of what the mesh can do */
    bool definite;
    double worst_reaction; /* the largest, > 0: an obstacle that pulls; relative to the largest in size */
    double worst_support;  /* by how much a supported dof is off what is prescribed, or a tied node off what it follows,
                            * or one of a rigid group off what the group's motion has it at: a length */
    double least_gap;      /* of the obstacles from points on the deformed sides, a length: SAMPLES a side, nodes, and
                            * where a side is closest */
    double least_part;     /* the same over the length of the side there */
    double pressed_apart;  /* the farthest that the sides around a node with a pressed row are from the obstacle, over
                            * their length; 0: none is apart */
    double touches_nowhere; /* the same of the nearest in a contact of which all are apart, of these the farthest */
    double least_at_rows;   /* of g */
    double least_at_nodes;  /* of the obstacles, which have no overlap left, from the nodes that have rows */
    bool swallows;          /* an obstacle is inside of the body (swallowed.h) */
} uz_finite_certificate;

/* stop (NULL: never) is asked between elements, blocks of the factor and places beside this one. Errors: UZ_ERR_MEMORY,
 * and those of obstacles. */
uz_status uz_certify_finite(uz_finite_certificate *out, const uz_finite_answer *answer, const uz_stop *stop,
                            uz_error *err);

/* What a certificate takes with the tangent K, but for its factor (envelope.h). */
double uz_finite_certificate_bytes(const uz_body_model *model, const uz_csc *K);

#endif
