/* cost.h: what a form of the dual operator is expected to take: seconds, bytes and flops. Models count the work that
 * dominates: flops of the factorization, entries of K and L that are passed through. */
#ifndef UZ_DUAL_COST_H
#define UZ_DUAL_COST_H

#include "factor/factor.h"
#include "uzawa.h"

typedef struct {
    int64_t d, m, n_b; /* dofs, rows, dofs that rows touch */
    int64_t k_entries; /* of K's lower triangle */
    int64_t n_entries; /* of N */
    int modes;         /* of the near-null space */
    bool active_set;   /* the active set is to solve */
    bool bounds;       /* and with the free dofs only */
    bool alone;        /* a form without a factor was asked for by name */
    double by_cells;   /* bytes of a multigrid on equal cells, where K has its diagonal only; else 0 */
    double stretch;    /* longest over shortest distance of an element's corners, of a solid */
    double slender;    /* longest over second longest side of the box around a solid */
    double firmness;   /* what its material resists of a change of volume, over that of a Poisson's ratio of 0.3 */
    bool irregular;    /* tetrahedra that lie as in no grid */
    double entry_s;    /* for an entry of K (uz_cost_rates), where K is large; 0: that of the machine */
    double cycle_s;    /* likewise, where a multigrid is worth its while */
    int64_t cases;     /* loads on the body */
} uz_cost_size;

typedef struct {
    uz_operator op;
    double setup_s, case_s; /* once for the body, and for a load */
    double next_s;          /* for each further load of a call; 0: as for the first */
    /* Of these, what conjugate gradients on multigrid take where the bound on the spectrum takes so many steps; they
     * grow with them. */
    double steps, setup_steps_s, case_steps_s, next_steps_s;
    double bytes; /* K and N included */
    double flops; /* of the setup and one load */
    bool fits;
} uz_cost_estimate;

typedef struct {
    double flop_s;  /* seconds for each flop of a dense kernel */
    double entry_s; /* for each stored entry of a sparse matrix, times a vector */
    double cycle_s; /* for each entry that two sweeps of a multigrid read; on equal cells for each dof of a step of the
                       smoother */
} uz_cost_rates;

/* Large supernodes are updated at somewhat more than the rate of the dense kernel that is timed, and each entry of L
 * costs assembling and page faults as much as 17 passes; a substitution 1.5. Measured on plane and solid bodies of
 * 2,500 to 540,000 dofs (make bench-predictions), every other one of which they were fitted to. */
#define UZ_COST_FACTOR_FLOPS  0.85
#define UZ_COST_FACTOR_PASSES 17.0
#define UZ_COST_SOLVE_PASSES  1.5
/* Iterations that are needed where rows have several entries. */
#define UZ_COST_ITERATIONS 330.0
/* Vectors of d numbers that are alive together at the most crowded moment of a load, with a factor. */
#define UZ_COST_VECTORS 35.0

#endif
