/* divide.h: points shared out over processes by where they are. */
#ifndef UZ_GROUP_DIVIDE_H
#define UZ_GROUP_DIVIDE_H

#include <stdbool.h>
#include <stdint.h>

/* part (n): of each of n points at x (n x dim) its process, each process as many but for one. False: no memory. */
bool uz_divide(int32_t *part, const double *x, int64_t n, int dim, int64_t processes);

#endif
