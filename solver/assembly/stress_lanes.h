/* stress_lanes.h: sums at nodes and their comparison with the elements, for a few elements of one kind at once. */
#ifndef UZ_ASSEMBLY_STRESS_LANES_H
#define UZ_ASSEMBLY_STRESS_LANES_H

#include "assembly/strain_group.h"

/* rows: `size` numbers for each place: the strains, each times volume, the volume, the free strain times volume where
 * there is room, then what fills the row up. 4 is room for 3 strains and the volume, 8 for all.
 * place[lane][node]: the row of each node of each element. share[node][sample]: what the group's points give to it;
 * NULL: the linear function of the place that fits them best, which they must determine. */
void uz_strain_rows_add(double *rows, int size, const uz_strain_group *group,
                        const int64_t *const place[UZ_STRAIN_LANES], const double share[][UZ_ELEMENT_SAMPLES]);
/* The squared error in parts of the squared difference of strains and their means at nodes, which hides a part of it;
 * rows: with the volumes at nodes behind what is compared. One number for each lane. */
void uz_whole_difference(uz_lanes *times, const double *rows, int size, const uz_strain_group *group,
                         const int64_t *const place[UZ_STRAIN_LANES]);
/* Integrals over elements. */
typedef struct {
    bool hidden;     /* given: eta2 has also what is hidden in the difference (uz_whole_difference) */
    bool steepness;  /* given: steep2 is wanted */
    double eta2;     /* of (s* - s)' C^-1 (s* - s) */
    double stress;   /* of strain' C strain, of the strain that makes stress */
    double whole;    /* the same of all of the strain */
    double *eta2_of; /* NULL, or eta2 of each element */
    bool others;     /* than linear simplices were among the elements */
    uz_lanes steep2; /* largest square of a slope of the displacements from an element's first node to others of it */
} uz_stress_sums;
/* rows: stresses s*. */
void uz_stress_rows_compare(uz_stress_sums *sums, const double *rows, int size, const uz_strain_group *group,
                            const int64_t *const place[UZ_STRAIN_LANES]);

#endif
