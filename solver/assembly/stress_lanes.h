/* stress_lanes.h: what the error estimate does with the stresses of a few elements of one kind at once. */
#ifndef UZ_ASSEMBLY_STRESS_LANES_H
#define UZ_ASSEMBLY_STRESS_LANES_H

#include "assembly/strain_group.h"

/* Rows of sums, one for each place: the components of stress, each times volume, then the volume, then what fills the
 * row up. */
int uz_stress_row_size(uz_model model);
/* place[lane][node]: the row of each node of each element. */
void uz_stress_rows_add(double *rows, const uz_strain_group *group, const int64_t *const place[UZ_STRAIN_LANES]);
/* rows: divided by their volumes. Adds the integral of (s* - s)' C^-1 (s* - s) and of strain' C strain. */
void uz_stress_rows_compare(double *eta2, double *energy2, const double *rows, const uz_strain_group *group,
                            const int64_t *const place[UZ_STRAIN_LANES]);

#endif
