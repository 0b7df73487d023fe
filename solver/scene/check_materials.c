/* check_materials.c: what elements are made of. */
#include "scene/check.h"

#include "core/alloc.h"
#include "core/error.h"
#include "element/element.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of uz_orthotropic_energy; of an isotropic material it is this at a Poisson's ratio of 0.5 - 2e-13. */
#define LEAST_ENERGY 1e-12
#define ACROSS       1e-6 /* cosine of the angle of axes that are across each other */

bool uz_expands(const uz_material *material)
{
    const double *own = material->orthotropic.expansion;
    return material->is_orthotropic ? own[0] != 0 || own[1] != 0 || own[2] != 0 : material->expansion != 0;
}

/* Moduli, ratios and expansions by themselves. */
static uz_status check_components(const uz_orthotropic *own, int64_t i, uz_error *err)
{
    const struct {
        const char *key;
        const double *value;
        bool modulus;
    } LISTS[] = {{"young", own->young, true},
                 {"poisson", own->poisson, false},
                 {"shear", own->shear, true},
                 {"expansion", own->expansion, false}};
    char key[40];
    for (size_t k = 0; k < sizeof LISTS / sizeof LISTS[0]; k++)
        for (int c = 0; c < 3; c++) {
            snprintf(key, sizeof key, "orthotropic/%s/%d", LISTS[k].key, c);
            const uz_status status = uz_check_number(LISTS[k].value[c], "materials", i, key, err);
            if (status != UZ_OK)
                return status;
            if (LISTS[k].modulus && !(LISTS[k].value[c] > 0))
                return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, key), "a modulus must be positive; it is %g",
                               LISTS[k].value[c]);
        }
    return UZ_OK;
}

/* Positive energy of every strain: each pair of directions, then all three. */
static uz_status check_energy(const uz_orthotropic *own, int64_t i, uz_error *err)
{
    static const char *const PAIRS[] = {"xy", "yz", "xz"};
    static const int OF[3][2] = {{0, 1}, {1, 2}, {0, 2}};
    char key[40];
    double pair[3];
    const double energy = uz_orthotropic_energy(pair, own);
    for (int k = 0; k < 3; k++) {
        snprintf(key, sizeof key, "orthotropic/poisson/%d", k);
        if (!(pair[k] > 0))
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, key),
                           "Poisson's ratio %s is %g, and with these moduli must be less than %g in magnitude, or "
                           "some strain would set energy free; it is the strain along %c under a pull along %c: if "
                           "it was measured the other way round, multiply it by young %c / young %c",
                           PAIRS[k], own->poisson[k], sqrt(own->young[OF[k][0]] / own->young[OF[k][1]]), PAIRS[k][1],
                           PAIRS[k][0], PAIRS[k][0], PAIRS[k][1]);
    }
    if (!(energy > LEAST_ENERGY))
        return uz_fail(
            err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "orthotropic/poisson"),
            "Poisson's ratios %g, %g, %g (xy, yz, xz) do not go with each other: some strain would set energy "
            "free or cost none, as 1 - nu_xy nu_yx - nu_yz nu_zy - nu_xz nu_zx - 2 nu_yx nu_zy nu_xz is %g "
            "and must be positive; make them smaller",
            own->poisson[0], own->poisson[1], own->poisson[2], energy);
    return UZ_OK;
}

static uz_status check_axes(const uz_scene *scene, const uz_orthotropic *own, int64_t i, uz_error *err)
{
    double unit[2][3], along = 0;
    bool any = false;
    uz_status status = UZ_OK;
    for (int k = 0; k < 2 && status == UZ_OK; k++)
        status = uz_check_vector(own->axes[k], 3, "materials", i, k ? "orthotropic/axes/y" : "orthotropic/axes/x", err);
    for (int c = 0; c < 6 && status == UZ_OK; c++)
        any = any || own->axes[c / 3][c % 3] != 0;
    if (!any)
        return status;
    for (int k = 0; k < 2; k++)
        if (!uz_unit_normal(unit[k], own->axes[k], 3))
            return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, k ? "orthotropic/axes/y" : "orthotropic/axes/x"),
                           "the direction is zero; it must be that of the material's %c", k ? 'y' : 'x');
    for (int c = 0; c < 3; c++)
        along += unit[0][c] * unit[1][c];
    if (fabs(along) > ACROSS)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "orthotropic/axes/y"),
                       "x and y of the material are not across each other: the cosine of their angle is %g", along);
    if (scene->model != UZ_SOLID && (unit[0][2] != 0 || unit[1][2] != 0))
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "orthotropic/axes"),
                       "of a plane body and of one of revolution the material's z is across the plane; turn x and y in "
                       "it, by an angle");
    return UZ_OK;
}

static uz_status check_orthotropic(const uz_scene *scene, int64_t i, uz_error *err)
{
    const uz_material *material = &scene->materials[i];
    if (material->law != UZ_ELASTIC_LINEAR)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "law"),
                       "orthotropic materials are of the linear law; leave it out");
    if (material->yield != 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "yield"),
                       "von Mises' stress says nothing about when an orthotropic material yields; leave it out");
    if (material->expansion != 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "expansion"),
                       "an orthotropic material has an expansion along each of its axes; give orthotropic.expansion");
    uz_status status = check_components(&material->orthotropic, i, err);
    if (status == UZ_OK)
        status = check_energy(&material->orthotropic, i, err);
    return status == UZ_OK ? check_axes(scene, &material->orthotropic, i, err) : status;
}

static uz_status check_isotropic(const uz_scene *scene, int64_t i, uz_error *err);

static uz_status check_values(const uz_scene *scene, int64_t i, uz_error *err)
{
    const uz_material *material = &scene->materials[i];
    uz_status status = uz_check_number(material->density, "materials", i, "density", err);
    if (status == UZ_OK && material->density < 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "density"),
                       "a density must not be negative; it is %g", material->density);
    if (status == UZ_OK)
        status = uz_check_number(material->yield, "materials", i, "yield", err);
    if (status == UZ_OK && material->yield < 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "yield"),
                       "a yield stress must not be negative; it is %g", material->yield);
    if (status == UZ_OK)
        status = uz_check_number(material->expansion, "materials", i, "expansion", err);
    if (status != UZ_OK)
        return status;
    return material->is_orthotropic ? check_orthotropic(scene, i, err) : check_isotropic(scene, i, err);
}

/* Positive strain energy needs -1 < poisson < 1/2; in plane stress 1/2 itself (incompressible) is harmless. */
static uz_status check_isotropic(const uz_scene *scene, int64_t i, uz_error *err)
{
    static const char *const NAMES[] = {"", "in plane strain", "in a body of revolution", "in a solid"};
    const uz_material *material = &scene->materials[i];
    const double young = material->young, poisson = material->poisson;
    if (!isfinite(young))
        return uz_fail(err, UZ_ERR_NOT_FINITE, UZ_PLACE("materials", i, "young"),
                       "Young's modulus is not a finite number");
    if (young <= 0)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "young"),
                       "Young's modulus must be positive; it is %g", young);
    if (!isfinite(poisson))
        return uz_fail(err, UZ_ERR_NOT_FINITE, UZ_PLACE("materials", i, "poisson"),
                       "Poisson's ratio is not a finite number");
    if (poisson == 0.5 && scene->model != UZ_PLANE_STRESS)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "poisson"),
                       "Poisson's ratio 0.5 makes the body infinitely stiff %s; use less, such as 0.49",
                       NAMES[scene->model]);
    if (poisson <= -1 || poisson > 0.5)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("materials", i, "poisson"),
                       "Poisson's ratio must lie between -1 and 0.5; it is %g", poisson);
    return UZ_OK;
}

/* Gives the elements of one material their number. of: n_elements, -1 where there is none yet. */
static uz_status cover(int32_t *of, const uz_scene *scene, const uz_mesh *mesh, int64_t i, uz_error *err)
{
    const char *where = UZ_PLACE("materials", i, "on");
    const uz_group *group = uz_check_group(mesh, scene->materials[i].on, "materials", i, "on", err);
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
