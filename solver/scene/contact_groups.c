/* contact_groups.c: several groups of a mesh as one surface of a contact. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "scene/check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int by_name(const void *a, const void *b)
{
    return strncmp(a, b, sizeof(char[64]));
}

void uz_name_together(char name[64], uz_names *groups)
{
    enum { NUMBER = 12 }; /* bytes of " ...#0123abcd" less its end */
    int64_t kept = 0;
    size_t used = 0;
    if (groups->n > 1)
        qsort(groups->name, (size_t)groups->n, sizeof *groups->name, by_name);
    for (int64_t i = 0; i < groups->n; i++)
        if (i == 0 || by_name(groups->name[i], groups->name[kept - 1]) != 0)
            memmove(groups->name[kept++], groups->name[i], sizeof *groups->name);
    groups->n = kept;
    for (int64_t i = 0; i < groups->n; i++)
        used += strnlen(groups->name[i], 64) + (i > 0 ? 3 : 0);
    const bool whole = used < 64;
    name[0] = '\0';
    used = 0;
    for (int64_t i = 0; i < groups->n; i++) {
        const size_t more = strnlen(groups->name[i], 63) + (i > 0 ? 3 : 0);
        if (used + more > (whole ? 63 : 63 - NUMBER))
            break;
        used += (size_t)snprintf(name + used, 64 - used, "%s%.63s", i > 0 ? " + " : "", groups->name[i]);
    }
    if (whole)
        return;
    /* FNV-1a (G. Fowler, L. Noll, K. Vo): long lists that begin alike are called differently */
    uint32_t sum = 2166136261u;
    for (int64_t i = 0; i < groups->n; i++)
        for (int k = 0; k < 64 && (k == 0 || groups->name[i][k - 1]); k++)
            sum = (sum ^ (unsigned char)groups->name[i][k]) * 16777619u;
    snprintf(name + used, 64 - used, "%s#%08x", used > 0 ? " + " : "", (unsigned)sum);
}

int uz_face_order(const void *a, const void *b)
{
    const uz_face *x = a, *y = b;
    return x->element != y->element ? (x->element > y->element) - (x->element < y->element) : x->side - y->side;
}

/* All sides of the groups, by element. */
static uz_status join(uz_group *out, const uz_mesh *mesh, const uz_names *groups, const char *where, uz_error *err)
{
    int64_t faces = 0, nodes = 0;
    for (int64_t i = 0; i < groups->n; i++) {
        const uz_group *group = uz_mesh_group(mesh, groups->name[i], where, err);
        if (!group)
            return UZ_ERR_SCENE;
        if (group->kind != UZ_GROUP_FACES)
            return uz_fail(err, UZ_ERR_SCENE, where, "\"%.63s\" is not made of %s; name the sides that can touch",
                           group->name, mesh->dim == 2 ? "edges" : "faces");
        faces += group->n_faces;
        nodes += group->n_nodes;
    }
    out->kind = UZ_GROUP_FACES;
    out->face = uz_alloc(faces, sizeof *out->face);
    out->node = uz_alloc(nodes, sizeof *out->node);
    if (!out->face || !out->node)
        return uz_no_memory(err, "the groups of a contact");
    for (int64_t i = 0; i < groups->n; i++) {
        const uz_group *group = uz_mesh_group(mesh, groups->name[i], where, err);
        memcpy(out->face + out->n_faces, group->face, (size_t)group->n_faces * sizeof *out->face);
        memcpy(out->node + out->n_nodes, group->node, (size_t)group->n_nodes * sizeof *out->node);
        out->n_faces += group->n_faces;
        out->n_nodes += group->n_nodes;
        out->n_inner += group->n_inner;
    }
    qsort(out->face, (size_t)out->n_faces, sizeof *out->face, uz_face_order);
    faces = 0;
    for (int64_t i = 0; i < out->n_faces; i++)
        if (i == 0 || uz_face_order(&out->face[i], &out->face[faces - 1]) != 0)
            out->face[faces++] = out->face[i];
    out->n_faces = faces;
    out->n_nodes = uz_sort_unique(out->node, out->n_nodes);
    return UZ_OK;
}

uz_status uz_mesh_join_groups(uz_mesh *mesh, const uz_scene *scene, uz_error *err)
{
    const int64_t own = mesh->n_groups;
    int64_t lists = 0;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < scene->n_contacts; k++)
        lists += (scene->contacts[k].on_groups.n > 0) + (scene->contacts[k].with_groups.n > 0);
    if (lists == 0)
        return UZ_OK;
    uz_group *groups = uz_realloc(mesh->groups, own + lists, sizeof *groups);
    if (!groups)
        return uz_no_memory(err, "the groups of a contact");
    mesh->groups = groups;
    for (int64_t k = 0; k < 2 * scene->n_contacts && status == UZ_OK; k++) {
        const uz_contact *contact = &scene->contacts[k / 2];
        const uz_names *names = k % 2 == 0 ? &contact->on_groups : &contact->with_groups;
        const char *name = k % 2 == 0 ? contact->on : contact->with;
        int64_t known = -1;
        if (names->n == 0)
            continue;
        const char *where = UZ_PLACE("contacts", k / 2, k % 2 == 0 ? "on" : "with");
        for (int64_t i = 0; i < mesh->n_groups && known < 0; i++)
            known = strncmp(mesh->groups[i].name, name, sizeof mesh->groups[i].name) == 0 ? i : -1;
        if (known >= own)
            continue; /* of another contact, too */
        if (known >= 0 && names->n > 1)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "these groups together are called \"%.63s\", as a group of the mesh; give that another name",
                           name);
        if (known >= 0)
            continue;
        uz_group *out = &mesh->groups[mesh->n_groups]; /* no group yet of those that messages list */
        *out = (uz_group){.n_nodes = 0};
        memcpy(out->name, name, sizeof out->name);
        status = join(out, mesh, names, where, err);
        mesh->n_groups++;
    }
    return status;
}
