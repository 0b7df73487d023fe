#include "scene/breadth.h"

#include "core/alloc.h"
#include "element/element.h"

#include <math.h>

/* Slabs across an axis, each as thick as two layers of nodes are, so that it does not fall apart where these are
 * uneven.
 */
enum { LAYERS = 2 };

typedef struct {
    const uz_mesh *mesh;
    int axis;
    double low, thickness;
    int64_t slabs;
    int64_t *slab;  /* n_nodes: where each is */
    int64_t *above; /* n_nodes: another node of the same piece, its own number where it is the piece's first */
    int64_t *count; /* n_nodes: nodes of the piece, by its first one */
} slicing;

static double place(const slicing *x, int64_t node)
{
    return x->mesh->xyz[node * x->mesh->dim + x->axis];
}

/* The longest side of the bounding box. */
static double choose_axis(slicing *x)
{
    const uz_mesh *mesh = x->mesh;
    double longest = 0.0;
    for (int c = 0; c < mesh->dim; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int64_t i = 0; i < mesh->n_nodes; i++) {
            const double at = mesh->xyz[i * mesh->dim + c];
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        if (high - low > longest) {
            longest = high - low;
            x->axis = c;
            x->low = low;
        }
    }
    return longest;
}

/* Between layers of nodes, on an average: half of an element where it has nodes on its edges. */
static double layer_distance(const slicing *x)
{
    const uz_mesh *mesh = x->mesh;
    double sum = 0.0;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        double low = INFINITY, high = -INFINITY;
        for (int64_t q = mesh->first[e]; q < mesh->first[e + 1]; q++) {
            const double at = place(x, mesh->node[q]);
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        sum += (high - low) / (type->nodes > type->corners ? 2 : 1);
    }
    return sum / (double)mesh->n_elements;
}

static int64_t first_of(slicing *x, int64_t node)
{
    while (x->above[node] != node)
        node = x->above[node] = x->above[x->above[node]];
    return node;
}

/* Nodes of an element that lie in one slab are of one piece. */
static void unite(slicing *x)
{
    const uz_mesh *mesh = x->mesh;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        const int64_t slab = (int64_t)((place(x, i) - x->low) / x->thickness);
        x->slab[i] = slab < x->slabs ? slab : x->slabs - 1;
        x->above[i] = i;
        x->count[i] = 1;
    }
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t q = mesh->first[e] + 1; q < mesh->first[e + 1]; q++)
            for (int64_t s = mesh->first[e]; s < q; s++) {
                if (x->slab[mesh->node[s]] != x->slab[mesh->node[q]])
                    continue;
                const int64_t a = first_of(x, mesh->node[s]), b = first_of(x, mesh->node[q]);
                if (a != b) {
                    x->above[b] = a;
                    x->count[a] += x->count[b];
                }
                break;
            }
}

/* Of the slabs, the nodes of their largest pieces. */
static double sum_largest(const slicing *x, int64_t *largest)
{
    double sum = 0.0;
    for (int64_t i = 0; i < x->mesh->n_nodes; i++) {
        const int64_t slab = x->slab[i];
        if (x->above[i] == i && x->count[i] > largest[slab])
            largest[slab] = x->count[i];
    }
    for (int64_t k = 0; k < x->slabs; k++)
        sum += (double)largest[k];
    return sum;
}

double uz_mesh_breadth(const uz_mesh *mesh)
{
    slicing x = {.mesh = mesh};
    double breadth = 0.0;
    if (mesh->dim != 3 || mesh->n_elements == 0)
        return 0.0;
    const double length = choose_axis(&x);
    x.thickness = LAYERS * layer_distance(&x);
    const double slabs = length / x.thickness;
    if (!(slabs < (double)mesh->n_nodes)) /* also where there is no thickness */
        return 0.0;
    x.slabs = slabs > 1.0 ? (int64_t)ceil(slabs) : 1;
    x.slab = uz_alloc(mesh->n_nodes, sizeof *x.slab);
    x.above = uz_alloc(mesh->n_nodes, sizeof *x.above);
    x.count = uz_alloc(mesh->n_nodes, sizeof *x.count);
    int64_t *largest = uz_alloc_zero(x.slabs, sizeof *largest);
    if (x.slab && x.above && x.count && largest) {
        unite(&x);
        breadth = sum_largest(&x, largest) / (LAYERS * fmax(1.0, slabs));
    }
    uz_free_all(x.slab, x.above, x.count, largest);
    return breadth;
}
