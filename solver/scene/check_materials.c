/* check_materials.c: what elements are made of. */
#include "scene/check.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Positive strain energy needs -1 < poisson < 1/2; in plane stress 1/2 itself (incompressible) is harmless. */
static uz_status check_values(const uz_scene *scene, int64_t i, uz_error *err)
{
    static const char *const NAMES[] = {"", "in plane strain", "in a body of revolution", "in a solid"};
    char where[UZ_CHECK_POINTER];
    const uz_material *material = &scene->materials[i];
    const double young = material->young, poisson = material->poisson;
    uz_check_place(where, "materials", i, "young");
    if (!isfinite(young))
        return uz_fail(err, UZ_ERR_NOT_FINITE, where, "Young's modulus is not a finite number");
    if (young <= 0)
        return uz_fail(err, UZ_ERR_SCENE, where, "Young's modulus must be positive; it is %g", young);
    uz_check_place(where, "materials", i, "poisson");
    if (!isfinite(poisson))
        return uz_fail(err, UZ_ERR_NOT_FINITE, where, "Poisson's ratio is not a finite number");
    if (poisson == 0.5 && scene->model != UZ_PLANE_STRESS)
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "Poisson's ratio 0.5 makes the body infinitely stiff %s; use less, such as 0.49",
                       NAMES[scene->model]);
    if (poisson <= -1 || poisson > 0.5)
        return uz_fail(err, UZ_ERR_SCENE, where, "Poisson's ratio must lie between -1 and 0.5; it is %g", poisson);
    uz_status status = uz_check_number(material->density, "materials", i, "density", err);
    if (status == UZ_OK && material->density < 0)
        return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "materials", i, "density"),
                       "a density must not be negative; it is %g", material->density);
    if (status == UZ_OK)
        status = uz_check_number(material->yield, "materials", i, "yield", err);
    if (status == UZ_OK && material->yield < 0)
        return uz_fail(err, UZ_ERR_SCENE, uz_check_place(where, "materials", i, "yield"),
                       "a yield stress must not be negative; it is %g", material->yield);
    return status == UZ_OK ? uz_check_number(material->expansion, "materials", i, "expansion", err) : status;
}

/* Gives the elements of one material their number. of: n_elements, -1 where there is none yet. */
static uz_status cover(int32_t *of, const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    char where[UZ_CHECK_POINTER];
    const uz_group *group = uz_check_group(where, mesh, scene->materials[i].on, "materials", i, "on", err);
    if (!group)
        return UZ_ERR_SCENE;
    if (group->kind != UZ_GROUP_ELEMENTS)
        return uz_fail(err, UZ_ERR_SCENE, where, "\"%s\" is %s; a material fills elements: use \"all\"", group->name,
                       group->kind == UZ_GROUP_FACES ? "a side" : "made of nodes");
    for (int64_t k = 0; k < uz_group_element_count(mesh, group); k++) {
        const int64_t e = uz_group_element_at(group, k);
        if (of[e] >= 0 && group->everything)
            return uz_fail(err, UZ_ERR_SCENE, where, "the elements of \"%s\" already have material %lld", group->name,
                           (long long)of[e]);
        if (of[e] >= 0)
            return uz_fail(err, UZ_ERR_SCENE, where, "element %lld (%s) of \"%s\" already has material %lld",
                           (long long)e, uz_element_name((uz_element_kind)mesh->kind[e]), group->name,
                           (long long)of[e]);
        of[e] = (int32_t)i;
    }
    return UZ_OK;
}

uz_status uz_check_materials(const uz_scene *scene, const uz_mesh *mesh, uz_error *err)
{
    uz_status status = UZ_OK;
    if (scene->n_materials < 1)
        return uz_fail(err, UZ_ERR_SCENE, "/materials", "no material; give young and poisson on \"all\"");
    int32_t *of = uz_alloc(mesh->n_elements, sizeof *of);
    if (!of)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the materials of %lld elements",
                       (long long)mesh->n_elements);
    memset(of, 0xff, (size_t)mesh->n_elements * sizeof *of);
    for (int64_t i = 0; i < scene->n_materials && status == UZ_OK; i++) {
        status = cover(of, scene, mesh, i, err);
        if (status == UZ_OK)
            status = check_values(scene, i, err);
    }
    for (int64_t e = 0; e < mesh->n_elements && status == UZ_OK; e++)
        if (of[e] < 0) {
            const double *x = mesh->xyz + mesh->node[mesh->first[e]] * mesh->dim;
            char z[32] = "";
            if (mesh->dim == 3)
                snprintf(z, sizeof z, ", %g", x[2]);
            status = uz_fail(err, UZ_ERR_SCENE, "/materials",
                             "element %lld (%s, with a node at (%g, %g%s)) has no material; give one on a group that "
                             "it belongs to, such as \"all\"",
                             (long long)e, uz_element_name((uz_element_kind)mesh->kind[e]), x[0], x[1], z);
        }
    free(of);
    return status;
}
