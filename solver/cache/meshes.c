/* meshes.c: meshes of files that come again, as of one upload that many jobs name: reading a large one takes as long as
 * a job whose body is there already spends on anything but its iterations. */
#include "cache/table.h"

#include "core/alloc.h"
#include "core/digest.h"
#include "core/error.h"
#include "scene/scene.h"

#include <stdlib.h>
#include <string.h>

#define LEAST ((size_t)1 << 20) /* bytes of a file: smaller ones are read in milliseconds */

typedef struct {
    uz_given_mesh mesh;
    size_t max_bytes; /* that it was read with */
    uz_cache *cache;
    uz_item *item;
} kept_mesh;

static void destroy(void *object)
{
    kept_mesh *kept = object;
    uz_given_mesh_clear(&kept->mesh);
    free(kept);
}

static void give_back(void *lender)
{
    const kept_mesh *kept = lender;
    uz_table_release(kept->cache, kept->item);
}

static size_t bytes_of(const uz_given_mesh *mesh)
{
    size_t numbers = (size_t)mesh->n_nodes * (size_t)mesh->dim + (size_t)mesh->n_elements + 1;
    numbers += (size_t)mesh->first[mesh->n_elements];
    for (int64_t i = 0; i < mesh->n_groups; i++) {
        const uz_given_group *group = &mesh->groups[i];
        numbers += (size_t)(group->n_nodes + group->n_elements + group->n_faces + 1);
        numbers += group->n_faces > 0 ? (size_t)group->face_first[group->n_faces] : 0;
    }
    return sizeof(kept_mesh) + 8 * numbers + (size_t)mesh->n_elements + (size_t)mesh->n_groups * sizeof *mesh->groups;
}

/* A new one, read; NULL: *status. */
static kept_mesh *make(uz_status *status, const char *format, const char *text, size_t len, size_t max_bytes,
                       uz_error *err)
{
    kept_mesh *made = uz_alloc_zero(1, sizeof *made);
    *status = made ? uz_mesh_read(&made->mesh, format, text, len, max_bytes, err) : uz_no_memory(err, "a mesh");
    if (*status == UZ_OK)
        uz_given_digest(made->mesh.digest, &made->mesh);
    if (*status == UZ_OK && !made->mesh.digest[0])
        *status = uz_no_memory(err, "the digest of a mesh");
    if (*status == UZ_OK) {
        made->max_bytes = max_bytes;
        return made;
    }
    if (made)
        destroy(made);
    return NULL;
}

/* Is what is read with one bound read with the other? 0: none. */
static bool suffices(size_t was, size_t max_bytes)
{
    return max_bytes == 0 || (was != 0 && was <= max_bytes);
}

static bool name_of(char name[65], const char *digest, const char *format)
{
    uz_digest *both = uz_digest_new();
    if (!both)
        return false;
    uz_digest_add(both, format, strlen(format));
    uz_digest_add(both, digest, strlen(digest));
    return uz_digest_end(both, name);
}

uz_status uz_mesh_read_kept(uz_given_mesh *out, uz_cache *cache, const char *digest, const char *format,
                            const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    char name[65];
    uz_item *item;
    bool create;
    uz_status status = UZ_OK;
    if (!cache || len < LEAST)
        return uz_mesh_read(out, format, text, len, max_bytes, err);
    memset(out, 0, sizeof *out);
    uz_error_reset(err);
    if (!name_of(name, digest, format))
        return uz_no_memory(err, "the digest of a mesh");
    status = uz_table_acquire(&item, &create, cache, UZ_ITEM_MESH, name, NULL, err);
    if (status != UZ_OK)
        return status;
    kept_mesh *kept = create ? make(&status, format, text, len, max_bytes, err) : uz_item_object(item);
    if (!kept) {
        uz_table_abandon(cache, item);
        return status;
    }
    if (!create && !suffices(kept->max_bytes, max_bytes)) {
        uz_table_release(cache, item);
        return uz_mesh_read(out, format, text, len, max_bytes, err);
    }
    if (create) {
        kept->cache = cache;
        kept->item = item;
        uz_table_publish(cache, item, kept, bytes_of(&kept->mesh), destroy);
    }
    *out = kept->mesh;
    out->lender = kept;
    out->give_back = give_back;
    return UZ_OK;
}
