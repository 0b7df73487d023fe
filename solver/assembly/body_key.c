/* body_key.c: the canonical bytes of what determines K and N. The rule of the format: two scenes may share a key only
 * if uz_body_model_build gives them the same model. Whoever makes the body depend on something new adds it here. */
#include "assembly/assembly.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "text/buffer.h"
#include "core/digest.h"
#include "core/error.h"
#include "obstacle/shape.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put_int(uz_buffer *key, int64_t value)
{
    uz_buffer_put(key, &value, sizeof value);
}

static void put_double(uz_buffer *key, double value)
{
    value += 0.0; /* -0 and 0 are the same */
    uz_buffer_put(key, &value, sizeof value);
}

/* Length first, so that names cannot run into what follows. */
static void put_name(uz_buffer *key, const char *name, size_t size)
{
    const size_t len = strnlen(name, size);
    put_int(key, (int64_t)len);
    uz_buffer_put(key, name, len);
}

static void put_names(uz_buffer *key, const uz_names *names)
{
    put_int(key, names->n);
    for (int64_t i = 0; i < names->n; i++)
        put_name(key, names->name[i], sizeof names->name[i]);
}

static void put_doubles(uz_buffer *key, const double *x, int64_t n)
{
    put_int(key, x ? n : -1);
    for (int64_t i = 0; x && i < n; i++)
        put_double(key, x[i]);
}

/* A mesh in numbers is as large as a request may be: a digest stands for them, "" for one that was not made. */
static void put_digest(uz_buffer *key, const char digest[65])
{
    key->failed |= !digest[0];
    uz_buffer_put(key, digest, 65);
}

static void put_given(uz_buffer *key, const uz_given_mesh *mesh)
{
    char digest[65];
    put_int(key, mesh->dim);
    put_int(key, mesh->n_groups);
    put_int(key, mesh->from_file != NULL);
    uz_given_digest(digest, mesh);
    put_digest(key, digest);
}

static void put_triangles(uz_buffer *key, const uz_contact *contact)
{
    uz_digest *digest = uz_digest_new();
    const double *const list[3] = {contact->x, contact->y, contact->z};
    char hex[65] = "";
    for (int c = 0; digest && c < 3; c++)
        uz_digest_add_list(digest, list[c], contact->n_x, sizeof **list);
    if (digest)
        uz_digest_end(digest, hex);
    put_digest(key, hex);
}

/* Groups by where they are. All of them: what a load pushes on must be there in the body that is found. */
static void put_selections(uz_buffer *key, const uz_scene *scene)
{
    put_int(key, scene->n_selections);
    for (int64_t i = 0; i < scene->n_selections; i++) {
        const uz_selection *s = &scene->selections[i];
        const double *const points[] = {s->low,        s->high, s->plane_point, s->plane_normal, s->centre,
                                        s->axis_point, s->axis, s->facing,      s->nearest};
        const double numbers[] = {s->radius, s->axis_radius, s->within, s->tolerance};
        put_name(key, s->name, sizeof s->name);
        put_int(key, s->kind);
        put_int(key, s->by);
        for (size_t k = 0; k < sizeof points / sizeof points[0]; k++)
            put_doubles(key, points[k], 3);
        put_doubles(key, numbers, sizeof numbers / sizeof numbers[0]);
    }
}

static void put_ties(uz_buffer *key, const uz_scene *scene)
{
    put_int(key, scene->n_ties);
    for (int64_t i = 0; i < scene->n_ties; i++) {
        put_name(key, scene->ties[i].on, sizeof scene->ties[i].on);
        put_name(key, scene->ties[i].to, sizeof scene->ties[i].to);
        put_double(key, scene->ties[i].tolerance);
    }
}

static int by_group(const void *a, const void *b)
{
    const uz_support *const *left = a, *const *right = b;
    return strncmp((*left)->on, (*right)->on, sizeof(*left)->on);
}

/* Which directions each group is held in: neither the values nor the order of the supports matter. */
static void put_supports(uz_buffer *key, const uz_scene *scene, int dim)
{
    const uz_support **sorted = uz_alloc(scene->n_supports, sizeof *sorted);
    if (!sorted) {
        key->failed = true;
        return;
    }
    for (int64_t i = 0; i < scene->n_supports; i++)
        sorted[i] = &scene->supports[i];
    qsort(sorted, (size_t)scene->n_supports, sizeof *sorted, by_group);
    for (int64_t i = 0; i < scene->n_supports;) {
        const uz_support *first = sorted[i];
        int mask = 0;
        for (; i < scene->n_supports && by_group(&first, &sorted[i]) == 0; i++) {
            double u[3];
            uz_support_values(u, sorted[i], dim);
            for (int c = 0; c < dim; c++)
                mask |= isnan(u[c]) ? 0 : 1 << c;
        }
        put_name(key, first->on, sizeof first->on);
        put_int(key, mask);
    }
    put_int(key, -1);
    free(sorted);
    /* What stands in no axis's way: springs, rigid groups, and inclined normals, which turn nodes in
     * their order. */
    double n[3] = {0};
    for (int64_t i = 0; i < scene->n_supports; i++) {
        const uz_support *support = &scene->supports[i];
        const bool inclined = uz_support_is_inclined(n, support, dim);
        if (!inclined && support->kind != UZ_SUPPORT_SPRING && support->kind != UZ_SUPPORT_RIGID)
            continue;
        put_int(key, support->kind);
        put_name(key, support->on, sizeof support->on);
        if (support->kind == UZ_SUPPORT_RIGID) {
            int free = 0;    /* which of its motions are */
            put_int(key, i); /* a group knows its support by its place in the list */
            for (int c = 0; c < 6; c++)
                free |= isnan(c < 3 ? support->u[c] : support->turn[c - 3]) ? 1 << c : 0;
            put_int(key, free);
        }
        put_doubles(key, inclined ? n : support->kind == UZ_SUPPORT_RIGID ? support->about : support->spring, dim);
    }
    put_int(key, -1);
}

/* Of a plane only the normal: where it is, is the load's matter. Of others the normals of the rows depend on all. */
static void put_contacts(uz_buffer *key, const uz_scene *scene, int dim)
{
    put_int(key, scene->n_contacts);
    put_int(key, scene->all_candidates);
    for (int64_t i = 0; i < scene->n_contacts; i++) {
        const uz_contact *contact = &scene->contacts[i];
        double normal[3];
        int64_t n[3] = {0};
        const uz_obstacle_shape *shape = uz_obstacle_shape_of(contact->kind);
        uz_unit_normal(normal, contact->normal, dim);
        put_name(key, contact->on, sizeof contact->on);
        put_names(key, &contact->on_groups);
        put_doubles(key, normal, 3);
        put_int(key, contact->kind);
        put_int(key, contact->faceted); /* where nodes are that refinement puts on facets */
        put_double(key, contact->feature_angle);
        if (contact->kind == UZ_OBSTACLE_PLANE)
            continue;
        if (shape && shape->lists)
            shape->lists(n, contact);
        put_doubles(key, contact->point, 3);
        put_double(key, contact->radius);
        put_int(key, contact->inside);
        if (contact->kind == UZ_OBSTACLE_SURFACE) {
            put_triangles(key, contact);
        } else {
            put_doubles(key, contact->x, n[0]);
            put_doubles(key, contact->y, n[1]);
            put_doubles(key, contact->z, n[2]);
        }
        put_name(key, contact->with, sizeof contact->with);
        put_names(key, &contact->with_groups);
        put_int(key, contact->between);
    }
}

uz_status uz_scene_body_key(unsigned char **out, size_t *len, const uz_scene *scene, uz_error *err)
{
    static const char format[] = "uzawa body 8";
    uz_buffer key = {0};
    char *text = NULL;
    const int dim = uz_scene_dim(scene);
    *out = NULL;
    *len = 0;
    uz_buffer_put(&key, format, sizeof format);
    put_int(&key, (int64_t)scene->model);
    put_double(&key, scene->thickness);
    put_int(&key, scene->formulation);
    put_int(&key, scene->source);
    if (scene->source == UZ_MESH_GIVEN) {
        put_given(&key, &scene->given);
    } else {
        put_int(&key, scene->box.dim);
        put_name(&key, scene->box.element, sizeof scene->box.element);
        for (int c = 0; c < scene->box.dim && c < 3; c++) {
            const double grading = scene->box.grading[c];
            put_double(&key, scene->box.origin[c]);
            put_double(&key, scene->box.size[c]);
            put_int(&key, scene->box.cells[c]);
            put_double(&key, grading == 0 ? 1 : grading);
        }
    }
    put_selections(&key, scene);
    put_int(&key, scene->n_bisected);
    if (scene->n_bisected > 0)
        uz_buffer_put(&key, scene->bisected, (size_t)scene->n_bisected * sizeof *scene->bisected);
    put_int(&key, scene->n_materials);
    for (int64_t i = 0; i < scene->n_materials; i++) {
        put_name(&key, scene->materials[i].on, sizeof scene->materials[i].on);
        put_int(&key, scene->materials[i].law);
        put_double(&key, scene->materials[i].young);
        put_double(&key, scene->materials[i].poisson);
        put_double(&key, scene->materials[i].density); /* not in K, but kept with the body */
        put_double(&key, scene->materials[i].expansion);
        put_int(&key, scene->materials[i].is_orthotropic);
        if (scene->materials[i].is_orthotropic)
            put_doubles(&key, (const double *)&scene->materials[i].orthotropic,
                        sizeof(uz_orthotropic) / sizeof(double));
    }
    put_supports(&key, scene, dim);
    put_contacts(&key, scene, dim);
    put_ties(&key, scene);
    if (uz_buffer_finish(&text, len, &key, NULL) != UZ_OK)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the key of a body");
    *out = (unsigned char *)text;
    return UZ_OK;
}
