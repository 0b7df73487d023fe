/* tractions.c: forces per area on edges, as the equivalent forces of their nodes. */
#include "assembly/parts.h"

#include <math.h>

double uz_edge_area(const uz_body_model *model, const int64_t ends[2])
{
    const int dim = model->mesh.dim;
    const double *a = model->mesh.xyz + ends[0] * dim, *b = model->mesh.xyz + ends[1] * dim;
    return hypot(b[0] - a[0], b[1] - a[1]) * model->thickness;
}

/* Linear shape functions on a straight edge: each end carries half of traction x length x thickness. What falls on a
 * supported dof goes into the support. */
static void add_edge(double *p, const uz_body_model *model, const int64_t ends[2], const double *traction)
{
    const int dim = model->mesh.dim;
    const double half = 0.5 * uz_edge_area(model, ends);
    for (int end = 0; end < 2; end++) {
        double local[3];
        uz_to_frame(local, model, ends[end], traction);
        for (int c = 0; c < dim; c++) {
            const int64_t dof = model->dof[ends[end] * dim + c];
            if (dof >= 0)
                p[dof] += half * local[c];
        }
    }
}

void uz_add_tractions(double *p, const uz_body_model *model, const uz_scene *scene)
{
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const uz_group *group = uz_mesh_group(&model->mesh, scene->loads[i].on, "", NULL);
        for (int64_t e = 0; group && e < group->n_faces; e++) {
            int64_t ends[UZ_FACE_NODES];
            uz_mesh_face(ends, &model->mesh, group->face[e]);
            add_edge(p, model, ends, scene->loads[i].v);
        }
    }
}
