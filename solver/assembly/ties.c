/* ties.c: hanging nodes follow those that they lie amid. */
#include "assembly/parts.h"

#include <string.h>

void uz_tie_nodes(uz_ties *ties, const uz_mesh *mesh, const int64_t *node, int count)
{
    *ties = (uz_ties){.own = count};
    for (int a = 0; a < count; a++)
        ties->hangs = ties->hangs || uz_mesh_hangs(mesh, node[a]);
    if (!ties->hangs) {
        memcpy(ties->node, node, (size_t)count * sizeof *node);
        ties->count = count;
        return;
    }
    for (int a = 0; a < count; a++) {
        const double whole = 1, *share = &whole;
        const int64_t *from = &node[a];
        const int parents = uz_mesh_hangs(mesh, node[a]) ? uz_mesh_amid(&from, &share, mesh, node[a]) : 1;
        for (int k = 0; k < parents; k++) {
            int at = 0;
            while (at < ties->count && ties->node[at] != from[k])
                at++;
            ties->node[at] = from[k];
            ties->share[a][at] = share[k];
            ties->count += at == ties->count;
        }
    }
}

void uz_tie_stiffness(double *out, const uz_ties *ties, const double *ke, int dim)
{
    const int own = ties->own, count = ties->count, n = own * dim, wide = count * dim;
    double half[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS]; /* ke S, own x count */
    memset(half, 0, (size_t)(n * wide) * sizeof *half);
    memset(out, 0, (size_t)(wide * wide) * sizeof *out);
    for (int i = 0; i < n; i++)
        for (int a = 0; a < own; a++)
            for (int k = 0; k < count; k++)
                for (int c = 0; c < dim && ties->share[a][k] != 0; c++)
                    half[i * wide + k * dim + c] += ke[i * n + a * dim + c] * ties->share[a][k];
    for (int a = 0; a < own; a++)
        for (int k = 0; k < count; k++)
            for (int c = 0; c < dim && ties->share[a][k] != 0; c++)
                for (int j = 0; j < wide; j++)
                    out[(k * dim + c) * wide + j] += ties->share[a][k] * half[(a * dim + c) * wide + j];
    for (int i = 0; i < wide; i++) /* symmetric to the last digit */
        for (int j = 0; j < i; j++)
            out[i * wide + j] = out[j * wide + i];
}
