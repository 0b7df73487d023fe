/* body_model.c: the chain from a scene to matrices. */
#include "assembly/parts.h"

#include "scene/grids.h"
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void uz_mesh_info_clear(uz_mesh_info *info)
{
    if (!info)
        return;
    uz_free_all(info->xyz, info->contact_node, info->contact_area, info->contact_normal, info->contact_of,
                info->contact_face, info->rotated_node, info->frame);
    memset(info, 0, sizeof *info);
}

void uz_contact_sites_clear(uz_contact_sites *sites)
{
    uz_free_all(sites->gap, sites->normal, sites->first, sites->node, sites->weight, sites->face, sites->at,
                sites->area, sites->ends, sites->zone, sites->rank, sites->of, sites->inner, sites->flank, sites->bows);
    *sites = (uz_contact_sites){.n = 0};
}

static void free_sites(uz_contact_sites *sites, int64_t n)
{
    for (int64_t k = 0; sites && k < n; k++)
        uz_contact_sites_clear(&sites[k]);
    free(sites);
}

void uz_body_model_clear(uz_body_model *model)
{
    if (!model)
        return;
    model->info.xyz = NULL; /* the mesh frees it */
    if (model->is_place) {  /* and another model what is not of its rows */
        model->info.rotated_node = NULL;
        model->info.frame = NULL;
    }
    uz_mesh_info_clear(&model->info);
    uz_csc_clear(&model->N);
    free(model->row_place);
    free(model->row_ends);
    free_sites(model->sites, model->n_sites);
    free(model->place);
    if (!model->is_place) {
        uz_mesh_clear(&model->mesh);
        uz_csc_clear(&model->K);
        uz_csc_clear(&model->K_fixed);
        uz_free_all(model->brick, model->dof, model->frame_of, model->modes, model->materials, model->material_of,
                    model->spring, model->rigid, model->rigid_of);
        uz_followers_clear(&model->follow);
        uz_csc_clear(&model->tied.share);
    }
    memset(model, 0, sizeof *model);
}

size_t uz_body_model_bytes(const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    const size_t nodes = (size_t)mesh->n_nodes, elements = (size_t)mesh->n_elements, rows = (size_t)model->m;
    const size_t dim = (size_t)mesh->dim;
    size_t bytes = uz_csc_bytes(&model->N) + rows * 8 * (5 + dim + (model->row_ends ? 2 : 0));
    bytes += model->place ? 8 * nodes * dim : 0;
    if (!model->is_place) {
        bytes += uz_csc_bytes(&model->K) + uz_csc_bytes(&model->K_fixed) + (model->brick ? sizeof *model->brick : 0);
        bytes += nodes * 8 * (2 * dim + (model->frame_of ? 1 : 0) + (model->spring ? dim : 0));
        bytes +=
            8 * (elements + 1) + elements + 8 * (size_t)mesh->first[elements] + (model->material_of ? 4 * elements : 0);
        const size_t new = mesh->from_first ? nodes - (size_t)mesh->n_given : 0;
        bytes += new > 0 ? 8 * (new + 1) + 16 * (size_t)mesh->from_first[new] : 0;
        bytes += mesh->part_of ? elements * sizeof *mesh->part_of : 0;
        bytes += mesh->hangs ? nodes + elements : 0;
        bytes += (size_t)model->info.n_rotated * 8 * (1 + dim * dim);
        bytes += (size_t)model->d * (size_t)model->n_modes * 8;
        bytes += (size_t)model->n_rigid * sizeof *model->rigid + (model->rigid_of ? 12 * nodes : 0);
        bytes += uz_csc_bytes(&model->tied.share);
        bytes += model->follow.first ? (size_t)model->follow.first[nodes] * 8 * (1 + dim * dim) : 0;
    }
    for (int64_t k = 0; k < model->n_sites; k++) {
        const uz_contact_sites *s = &model->sites[k];
        const size_t n = (size_t)s->n;
        bytes += n * 8 * (1 + dim) + (s->first ? 16 * n + 16 * (size_t)s->first[n] : 0) + (s->at ? 33 * n : 0) +
                 8 * (size_t)(s->n_sides + 2 * s->n_ranks) + (size_t)s->n_inner * sizeof *s->inner +
                 8 * (size_t)s->n_flanks;
    }
    return bytes;
}

/* The sites at scene->place in place of those before anything moves. */
static uz_status displace(uz_body_model *model, const uz_body_model *rest, const uz_scene *scene, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    model->sites = NULL;
    model->n_sites = 0;
    model->place = uz_alloc(n, sizeof *model->place);
    if (!model->place)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the place of %lld nodes", (long long)model->mesh.n_nodes);
    memcpy(model->place, scene->place, (size_t)n * sizeof *model->place);
    return uz_find_sites(model, rest, scene, err);
}

uz_status uz_body_model_build(uz_body_model *model, const uz_scene *scene, uz_body_extent extent, uz_error *err)
{
    const bool cells = extent == UZ_BODY_CELLS || extent == UZ_BODY_COUNTED,
               held = extent != UZ_BODY_SUPPORTED && !cells;
    bool by_cells = false;
    memset(model, 0, sizeof *model);
    uz_status status = uz_mesh_from_scene(&model->mesh, scene, err);
    if (status == UZ_OK)
        status = uz_smooth_refined(&model->mesh, scene, err);
    if (status == UZ_OK)
        status = uz_scene_check_body(scene, &model->mesh, err);
    if (status != UZ_OK) {
        uz_body_model_clear(model);
        return status;
    }
    model->info.dim = model->mesh.dim;
    model->info.n_nodes = model->mesh.n_nodes;
    model->info.n_elements = model->mesh.n_elements;
    model->info.xyz = model->mesh.xyz;
    status = uz_take_materials(model, scene, err);
    if (status == UZ_OK)
        status = uz_number_dofs(model, scene, err);
    if (status == UZ_OK)
        status = uz_spread_springs(model, scene, err);
    if (status == UZ_OK && !held)
        status = uz_check_rigid_modes(model, err);
    if (status == UZ_OK)
        status = uz_find_sites(model, NULL, scene, err);
    if (status == UZ_OK)
        status = uz_choose_frames(model, scene, err);
    if (status == UZ_OK)
        status = uz_find_followers(model, NULL, err);
    if (status == UZ_OK && scene->place) {
        const uz_body_model rest = *model;
        status = displace(model, &rest, scene, err);
        free_sites(rest.sites, rest.n_sites);
    }
    if (status == UZ_OK)
        status = uz_build_contact_rows(model, scene, err);
    if (status == UZ_OK && held)
        status = uz_rigid_modes(&model->modes, &model->n_modes, model, err);
    if (status == UZ_OK && cells)
        status = uz_build_cells(&by_cells, model, scene, extent == UZ_BODY_CELLS, err);
    if (status == UZ_OK && extent != UZ_BODY_OUTLINE && !by_cells)
        status = uz_build_stiffness(model, scene, err);
    if (status != UZ_OK)
        uz_body_model_clear(model);
    return status;
}

uz_status uz_body_model_assemble(uz_body_model *model, uz_error *err)
{
    uz_csc_clear(&model->K);
    free(model->brick);
    model->brick = NULL;
    return uz_build_stiffness(model, NULL, err);
}

uz_status uz_body_model_move(uz_body_model *out, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    *out = *model;
    out->is_place = true;
    out->m = out->n_pair_rows = 0;
    memset(&out->N, 0, sizeof out->N);
    out->row_place = out->row_ends = NULL;
    out->info.contact_node = out->info.contact_of = out->info.contact_face = NULL;
    out->info.contact_area = out->info.contact_normal = NULL;
    uz_status status = displace(out, model, scene, err);
    if (status == UZ_OK)
        status = uz_build_contact_rows(out, scene, err);
    if (status != UZ_OK)
        uz_body_model_clear(out);
    return status;
}

static uz_status check_finite(const double *x, int64_t n, const char *where, uz_error *err)
{
    for (int64_t i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return uz_fail(err, UZ_ERR_NOT_FINITE, where, "the numbers overflow; use other units");
    return UZ_OK;
}

/* h (m) and the prescribed values (n_fixed). */
static uz_status find_gaps(double *h, double *prescribed, const uz_body_model *model, const uz_scene *scene,
                           uz_error *err)
{
    uz_status status = uz_prescribed_values(prescribed, model, scene, err);
    if (status == UZ_OK)
        status = uz_initial_gaps(h, prescribed, model, scene, err);
    return status == UZ_OK ? check_finite(h, model->m, "/contacts", err) : status;
}

uz_status uz_body_model_gaps(double *h, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    double *prescribed = uz_alloc(model->n_fixed, sizeof *prescribed);
    const uz_status status =
        prescribed ? find_gaps(h, prescribed, model, scene, err)
                   : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld supported dofs", (long long)model->n_fixed);
    free(prescribed);
    return status;
}

uz_status uz_body_model_load(double *p, double *h, double *prescribed, const uz_body_model *model,
                             const uz_scene *scene, uz_error *err)
{
    double *own = NULL, *f = NULL;
    uz_status status = uz_scene_check_load(scene, &model->mesh, err);
    if (status != UZ_OK)
        return status;
    if (!prescribed && !(prescribed = own = uz_alloc(model->n_fixed, sizeof *own)))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld supported dofs", (long long)model->n_fixed);
    status = find_gaps(h, prescribed, model, scene, err);
    if (status == UZ_OK && !(f = uz_alloc(model->mesh.n_nodes * model->mesh.dim, sizeof *f)))
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld nodes", (long long)model->mesh.n_nodes);
    if (status == UZ_OK)
        status = uz_nodal_loads(f, model, scene, err);
    if (status == UZ_OK) {
        uz_gather_nodal(p, model, f);
        if (!model->brick)
            uz_csc_gaxpy(p, &model->K_fixed, -1, prescribed);
        else if (uz_is_moved(model, prescribed))
            status = uz_brick_subtract_moved(p, model->brick, prescribed, err);
    }
    if (status == UZ_OK)
        status = check_finite(p, model->d, "/loads", err);
    free(own);
    free(f);
    return status;
}

/* The same with vectors of its own; the caller frees them, also on failure. */
static uz_status new_load(double **p, double **h, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    *p = uz_alloc(model->d, sizeof **p);
    *h = uz_alloc(model->m, sizeof **h);
    if (!*p || !*h)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld loads", (long long)model->d);
    return uz_body_model_load(*p, *h, NULL, model, scene, err);
}

uz_status uz_scene_to_qp(uz_qp *qp, uz_mesh_info *info, const uz_scene *scene, uz_error *err)
{
    uz_body_model model;
    double *p = NULL, *h = NULL;
    uz_error_reset(err);
    memset(qp, 0, sizeof *qp);
    if (info)
        memset(info, 0, sizeof *info);
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_SUPPORTED, err);
    if (status == UZ_OK)
        status = new_load(&p, &h, &model, scene, err);
    if (status == UZ_OK) {
        *qp = (uz_qp){model.K, model.N, p, h};
        memset(&model.K, 0, sizeof model.K);
        memset(&model.N, 0, sizeof model.N);
        p = h = NULL;
    }
    if (status == UZ_OK && info) {
        *info = model.info;
        memset(&model.info, 0, sizeof model.info);
        model.mesh.xyz = NULL;
    }
    free(p);
    free(h);
    uz_body_model_clear(&model);
    return status;
}

uz_status uz_scene_check(const uz_scene *scene, uz_error *err)
{
    uz_scene first = *scene; /* borrows all it has */
    uz_body_model model;
    double *p = NULL, *h = NULL;
    uz_error_reset(err);
    if (scene->source == UZ_MESH_BOX && scene->box.automatic) {
        const uz_grids grids = uz_grids_of_scene(scene, 0.0);
        first.box = uz_grid(&grids, grids.first);
    }
    scene = &first;
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK)
        status = uz_check_elements(&model, err);
    if (status == UZ_OK)
        status = new_load(&p, &h, &model, scene, err);
    if (status == UZ_OK)
        status = uz_check_pressed(&model, p, err);
    free(p);
    free(h);
    uz_body_model_clear(&model);
    return status;
}

uz_status uz_scene_sizes(int *dim, int64_t *n_nodes, int64_t *m, const uz_scene *scene, uz_error *err)
{
    uz_body_model model;
    uz_error_reset(err);
    *dim = 0;
    *n_nodes = *m = 0;
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK) {
        *dim = model.mesh.dim;
        *n_nodes = model.mesh.n_nodes;
        *m = model.m;
    }
    uz_body_model_clear(&model);
    return status;
}
