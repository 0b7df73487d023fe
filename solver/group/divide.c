/* divide.c: recursive inertial bisection: points are halved by the plane across the line that is nearest to them all,
 * and the halves likewise (H. Simon, "Partitioning of unstructured problems for parallel processing", Computing Systems
 * in Engineering 2 (1991) 135-148). */
#include "group/divide.h"

#include "core/alloc.h"
#include "core/select.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POWER_STEPS = 30 };

/* The direction in which the points vary most, about; of unit length. M: their covariances. */
static void find_line(double line[3], double M[3][3], int dim)
{
    int widest = 0;
    for (int c = 1; c < dim; c++)
        widest = M[c][c] > M[widest][widest] ? c : widest;
    for (int c = 0; c < dim; c++)
        line[c] = c == widest;
    for (int k = 0; k < POWER_STEPS; k++) {
        double image[3] = {0}, square = 0.0;
        for (int i = 0; i < dim; i++) {
            for (int j = 0; j < dim; j++)
                image[i] += M[i][j] * line[j];
            square += image[i] * image[i];
        }
        for (int i = 0; i < dim && square > 0.0; i++)
            line[i] = image[i] / sqrt(square);
    }
}

/* Where n points are along their line. */
static void place_points(uz_placed *points, int64_t n, const double *x, int dim)
{
    double mean[3] = {0}, M[3][3] = {{0}}, line[3];
    for (int64_t k = 0; k < n; k++)
        for (int c = 0; c < dim; c++)
            mean[c] += x[points[k].item * dim + c] / (double)n;
    for (int64_t k = 0; k < n; k++)
        for (int i = 0; i < dim; i++)
            for (int j = 0; j < dim; j++)
                M[i][j] += (x[points[k].item * dim + i] - mean[i]) * (x[points[k].item * dim + j] - mean[j]);
    find_line(line, M, dim);
    for (int64_t k = 0; k < n; k++) {
        points[k].along = 0.0;
        for (int c = 0; c < dim; c++)
            points[k].along += line[c] * (x[points[k].item * dim + c] - mean[c]);
    }
}

static void divide(int32_t *part, uz_placed *points, int64_t n, const double *x, int dim, int64_t first,
                   int64_t processes)
{
    if (processes == 1) {
        for (int64_t k = 0; k < n; k++)
            part[points[k].item] = (int32_t)first;
        return;
    }
    const int64_t left = processes / 2, of_left = n * left / processes;
    place_points(points, n, x, dim);
    uz_select_first(points, n, of_left);
    divide(part, points, of_left, x, dim, first, left);
    divide(part, points + of_left, n - of_left, x, dim, first + left, processes - left);
}

bool uz_divide(int32_t *part, const double *x, int64_t n, int dim, int64_t processes)
{
    uz_placed *points = uz_alloc(n, sizeof *points);
    for (int64_t k = 0; points && k < n; k++)
        points[k].item = k;
    if (points)
        divide(part, points, n, x, dim, 0, processes);
    free(points);
    return points != NULL;
}
