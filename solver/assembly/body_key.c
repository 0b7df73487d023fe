/* body_key.c: the canonical bytes of what determines K and N. The rule of the format: two scenes may share a key only
 * if uz_body_model_build gives them the same model. Whoever makes the body depend on something new adds it here. */
#include "assembly/assembly.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    unsigned char *bytes;
    size_t len, capacity;
    bool failed;
} key_buffer;

static void put(key_buffer *key, const void *bytes, size_t len)
{
    if (key->failed)
        return;
    if (len > key->capacity - key->len) {
        size_t wanted = 2 * key->capacity + len + 256;
        unsigned char *grown = uz_realloc(key->bytes, (int64_t)wanted, 1);
        if (!grown) {
            key->failed = true;
            return;
        }
        key->bytes = grown;
        key->capacity = wanted;
    }
    memcpy(key->bytes + key->len, bytes, len);
    key->len += len;
}

static void put_int(key_buffer *key, int64_t value)
{
    put(key, &value, sizeof value);
}

static void put_double(key_buffer *key, double value)
{
    value += 0.0; /* -0 and 0 are the same */
    put(key, &value, sizeof value);
}

/* Length first, so that names cannot run into what follows. */
static void put_name(key_buffer *key, const char *name, size_t size)
{
    const size_t len = strnlen(name, size);
    put_int(key, (int64_t)len);
    put(key, name, len);
}

static void put_box(key_buffer *key, const uz_box *box)
{
    put_int(key, box->dim);
    put_name(key, box->element, sizeof box->element);
    for (int c = 0; c < box->dim && c < 3; c++) {
        put_double(key, box->origin[c]);
        put_double(key, box->size[c]);
        put_int(key, box->cells[c]);
    }
}

static void put_materials(key_buffer *key, const uz_scene *scene)
{
    put_int(key, scene->n_materials);
    for (int64_t i = 0; i < scene->n_materials; i++) {
        put_name(key, scene->materials[i].on, sizeof scene->materials[i].on);
        put_double(key, scene->materials[i].young);
        put_double(key, scene->materials[i].poisson);
    }
}

static int directions_held(const uz_support *support, int dim)
{
    int mask = 0;
    for (int c = 0; c < dim && c < 3; c++)
        if (!isnan(support->u[c]))
            mask |= 1 << c;
    return mask;
}

static int by_group(const void *a, const void *b)
{
    const uz_support *const *left = a, *const *right = b;
    return strncmp((*left)->on, (*right)->on, sizeof(*left)->on);
}

/* Which directions each group is held in: neither the values nor the order of the supports matter. */
static void put_supports(key_buffer *key, const uz_scene *scene)
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
        for (; i < scene->n_supports && by_group(&first, &sorted[i]) == 0; i++)
            mask |= directions_held(sorted[i], scene->box.dim);
        put_name(key, first->on, sizeof first->on);
        put_int(key, mask);
    }
    put_int(key, -1);
    free(sorted);
}

static void put_contacts(key_buffer *key, const uz_scene *scene)
{
    put_int(key, scene->n_contacts);
    for (int64_t i = 0; i < scene->n_contacts; i++) {
        double normal[3];
        uz_unit_normal(normal, scene->contacts[i].normal, scene->box.dim > 3 ? 3 : scene->box.dim);
        put_name(key, scene->contacts[i].on, sizeof scene->contacts[i].on);
        for (int c = 0; c < 3; c++)
            put_double(key, normal[c]);
    }
}

uz_status uz_scene_body_key(unsigned char **out, size_t *len, const uz_scene *scene, uz_error *err)
{
    static const char format[] = "uzawa body 1";
    key_buffer key = {NULL, 0, 0, false};
    *out = NULL;
    *len = 0;
    put(&key, format, sizeof format);
    put_int(&key, (int64_t)scene->model);
    put_double(&key, scene->thickness);
    put_box(&key, &scene->box);
    put_materials(&key, scene);
    put_supports(&key, scene);
    put_contacts(&key, scene);
    if (key.failed) {
        free(key.bytes);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the key of a body");
    }
    *out = key.bytes;
    *len = key.len;
    return UZ_OK;
}
