/* abaqus_scene.c: the scene that a deck of Abaqus or CalculiX is: groups of nodes, sides and elements that are treated
 * alike, and what is done with them. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "io/abaqus_deck.h"
#include "scene/given.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LIST_MOST = 1000 }; /* of each kind in a scene, by schemas/request.json */

/* ---- groups of what is alike */

/* A node, side or element, and what is said of it: 0 where less than three numbers. */
typedef struct {
    double key[3];
    int64_t index;
} alike;

static int compare_alike(const void *a, const void *b)
{
    const alike *x = a, *y = b;
    for (int c = 0; c < 3; c++) {
        const bool p = isnan(x->key[c]), q = isnan(y->key[c]);
        if (p || q) {
            if (p != q)
                return p - q;
        } else if (x->key[c] != y->key[c]) {
            return (x->key[c] > y->key[c]) - (x->key[c] < y->key[c]);
        }
    }
    return (x->index > y->index) - (x->index < y->index);
}

/* The end of the run of equal keys that begins at i. */
static int64_t run_end(const alike *list, int64_t n, int64_t i)
{
    alike first = list[i];
    int64_t end = i + 1;
    for (; end < n; end++) {
        first.index = list[end].index;
        if (compare_alike(&first, &list[end]) != 0)
            break;
    }
    return end;
}

static uz_given_group *find_group(const uz_given_mesh *mesh, const char *name)
{
    for (int64_t i = 0; i < mesh->n_groups; i++)
        if (strcasecmp(mesh->groups[i].name, name) == 0)
            return &mesh->groups[i];
    return NULL;
}

/* A group of a name that no other has: "what 1". */
static uz_given_group *new_group(abaqus_deck *d, const char *what)
{
    uz_given_mesh *mesh = d->mesh;
    if (mesh->n_groups == UZ_MESH_MAX_GROUPS)
        return NULL;
    uz_given_group *groups = uz_realloc(mesh->groups, mesh->n_groups + 1, sizeof *groups);
    if (!groups)
        return NULL;
    mesh->groups = groups;
    uz_given_group *to = &groups[mesh->n_groups];
    *to = (uz_given_group){.n_nodes = 0};
    for (int number = 1; to->name[0] == '\0' || find_group(mesh, to->name); number++)
        snprintf(to->name, sizeof to->name, "%s %d", what, number);
    mesh->n_groups++;
    return to;
}

/* The group of these nodes, or elements: one of the deck's own where it is that. name: "" on failure. */
static uz_status group_of(char name[64], abaqus_deck *d, const char *what, bool nodes, const alike *list, int64_t n)
{
    uz_given_mesh *mesh = d->mesh;
    name[0] = '\0';
    if (n == (nodes ? mesh->n_nodes : mesh->n_elements)) {
        memcpy(name, "all", 4);
        return UZ_OK;
    }
    for (int64_t g = 0; g < mesh->n_groups; g++) {
        const uz_given_group *have = &mesh->groups[g];
        const int64_t *index = nodes ? have->node : have->element;
        int64_t same = 0;
        if ((nodes ? have->n_nodes : have->n_elements) != n)
            continue;
        while (same < n && index[same] == list[same].index)
            same++;
        if (same == n) {
            memcpy(name, have->name, sizeof have->name);
            return UZ_OK;
        }
    }
    uz_given_group *to = new_group(d, what);
    int64_t *index = to ? uz_alloc(n, sizeof *index) : NULL;
    if (!index)
        return to || d->mesh->n_groups < UZ_MESH_MAX_GROUPS
                   ? abaqus_no_memory(&d->text)
                   : abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED, "there are more than %d groups", UZ_MESH_MAX_GROUPS);
    for (int64_t i = 0; i < n; i++)
        index[i] = list[i].index;
    *(nodes ? &to->node : &to->element) = index;
    *(nodes ? &to->n_nodes : &to->n_elements) = n;
    memcpy(name, to->name, sizeof to->name);
    return UZ_OK;
}

static uz_status too_many(const abaqus_deck *d, const char *what)
{
    return abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED,
                       "the deck has more than %d %s that differ; a scene has at most so many", LIST_MOST, what);
}

/* Calls `make` for each set of nodes (or elements) whose three numbers are the same; those of zeros or NaN are passed
 * over. width: numbers of each. */
static uz_status for_alike(abaqus_deck *d, const double *key, int width, bool nodes, const char *what,
                           uz_status (*make)(abaqus_deck *d, const char *group, const double key[3], int64_t count))
{
    const int64_t n = nodes ? d->mesh->n_nodes : d->mesh->n_elements;
    alike *list = uz_alloc(n, sizeof *list);
    int64_t used = 0;
    uz_status status = list ? UZ_OK : abaqus_no_memory(&d->text);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        bool said = false;
        list[used] = (alike){.index = i};
        for (int c = 0; c < width; c++) {
            list[used].key[c] = key[width * i + c];
            said = said || (nodes && key == d->fixed ? !isnan(key[width * i + c]) : key[width * i + c] != 0.0);
        }
        used += said;
    }
    if (status == UZ_OK)
        qsort(list, (size_t)used, sizeof *list, compare_alike);
    for (int64_t i = 0, end; i < used && status == UZ_OK; i = end) {
        char name[64];
        end = run_end(list, used, i);
        status = group_of(name, d, what, nodes, list + i, end - i);
        if (status == UZ_OK)
            status = make(d, name, list[i].key, end - i);
    }
    free(list);
    return status;
}

/* ---- nodes that no element has */

/* Keeps of what is said of nodes (width numbers each) that of the first of new_node >= 0. */
static void keep(double *of, int width, const int64_t *new_node, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        for (int c = 0; c < width && new_node[i] >= 0; c++)
            of[width * new_node[i] + c] = of[width * i + c];
}

static void keep_in_groups(uz_given_mesh *mesh, const int64_t *new_node)
{
    int64_t kept = 0;
    for (int64_t g = 0; g < mesh->n_groups; g++) {
        uz_given_group *group = &mesh->groups[g];
        int64_t nodes = 0;
        for (int64_t i = 0; i < group->n_nodes; i++)
            if (new_node[group->node[i]] >= 0)
                group->node[nodes++] = new_node[group->node[i]];
        group->n_nodes = nodes;
        for (int64_t i = 0; group->n_faces > 0 && i < group->face_first[group->n_faces]; i++)
            group->face_node[i] = new_node[group->face_node[i]];
        if (nodes + group->n_faces + group->n_elements > 0) {
            mesh->groups[kept++] = *group;
            continue;
        }
        uz_free_all(group->node, group->face_first, group->face_node, group->element);
    }
    mesh->n_groups = kept;
}

/* Takes them out of the mesh. Forces on them are left out, with a note. */
static uz_status drop_nodes(abaqus_deck *d)
{
    uz_given_mesh *mesh = d->mesh;
    const int64_t n = mesh->n_nodes, places = mesh->first[mesh->n_elements];
    int64_t *new_node = uz_alloc_zero(n, sizeof *new_node), used = 0, pulled = 0, first = -1;
    if (!new_node)
        return abaqus_no_memory(&d->text);
    for (int64_t q = 0; q < places; q++)
        new_node[mesh->node[q]] = 1;
    for (int64_t i = 0; i < n; i++) {
        new_node[i] = new_node[i] ? used++ : -1;
        if (new_node[i] < 0 && (d->force[3 * i] != 0 || d->force[3 * i + 1] != 0 || d->force[3 * i + 2] != 0)) {
            first = pulled++ == 0 ? d->file->nodes.tag[i] : first;
        }
    }
    d->out->node_number = uz_alloc(used, sizeof *d->out->node_number);
    if (!d->out->node_number) {
        free(new_node);
        return abaqus_no_memory(&d->text);
    }
    for (int64_t i = 0; i < n; i++)
        if (new_node[i] >= 0)
            d->out->node_number[new_node[i]] = d->file->nodes.tag[i];
    keep(mesh->xyz, mesh->dim, new_node, n);
    keep(d->fixed, 3, new_node, n);
    keep(d->force, 3, new_node, n);
    keep(d->temperature, 1, new_node, n);
    keep(d->initial, 1, new_node, n);
    for (int64_t q = 0; q < places; q++)
        mesh->node[q] = new_node[mesh->node[q]];
    keep_in_groups(mesh, new_node);
    mesh->n_nodes = used;
    mesh->from_file = NULL;
    free(new_node);
    return pulled == 0 ? UZ_OK
                       : deck_note(d, d->text.number, "CLOAD", UZ_DECK_LEFT_OUT,
                                   "forces on %lld nodes that no element has are left out, the first on node %lld",
                                   (long long)pulled, (long long)first);
}

/* ---- what the scene says */

/* Room for one more in a list of the scene, which has count of them. */
static uz_status one_more(abaqus_deck *d, void *list, int64_t count, size_t size, const char *what)
{
    int64_t room = count;
    if (count == LIST_MOST)
        return too_many(d, what);
    return uz_grow(list, count, 1, &room, size) ? UZ_OK : abaqus_no_memory(&d->text);
}

static uz_status add_support(abaqus_deck *d, uz_support support, const char *group)
{
    uz_scene *scene = &d->out->scene;
    const uz_status status = one_more(d, &scene->supports, scene->n_supports, sizeof support, "supports");
    snprintf(support.on, sizeof support.on, "%.63s", group);
    if (status == UZ_OK)
        scene->supports[scene->n_supports++] = support;
    return status;
}

static uz_status add_held(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    const double z = d->mesh->dim == 3 ? key[2] : (double)NAN;
    (void)count;
    return add_support(d, (uz_support){.kind = UZ_SUPPORT_COMPONENTS, .u = {key[0], key[1], z}}, group);
}

static uz_status add_load(abaqus_deck *d, uz_load load, const char *group)
{
    uz_scene *scene = &d->out->scene;
    const uz_status status = one_more(d, &scene->loads, scene->n_loads, sizeof load, "loads");
    snprintf(load.on, sizeof load.on, "%.63s", group);
    if (status == UZ_OK)
        scene->loads[scene->n_loads++] = load;
    return status;
}

static uz_status add_force(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    const double n = (double)count; /* each node has it; a load is the sum */
    return add_load(d, (uz_load){.kind = UZ_LOAD_FORCE, .v = {n * key[0], n * key[1], n * key[2]}}, group);
}

static uz_status add_gravity(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    (void)count;
    return add_load(d, (uz_load){.kind = UZ_LOAD_GRAVITY, .v = {key[0], key[1], key[2]}}, group);
}

static uz_status add_body_force(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    (void)count;
    return add_load(d, (uz_load){.kind = UZ_LOAD_BODY_FORCE, .v = {key[0], key[1], key[2]}}, group);
}

static uz_status add_temperature(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    (void)count;
    return add_load(d, (uz_load){.kind = UZ_LOAD_TEMPERATURE, .value = key[0]}, group);
}

/* The group of nodes that a rigid body is, and their middle. */
static uz_status group_of_rigid(char name[64], double middle[3], abaqus_deck *d, const deck_rigid *rigid)
{
    const uz_given_mesh *mesh = d->mesh;
    const int64_t n = mesh->n_nodes;
    bool *marked = uz_alloc_zero(n, sizeof *marked);
    alike *list = uz_alloc_zero(n, sizeof *list);
    int64_t count = 0;
    uz_status status = marked && list ? UZ_OK : abaqus_no_memory(&d->text);
    for (int64_t i = 0; i < rigid->count && status == UZ_OK; i++) {
        const int64_t one = rigid->index ? rigid->index[i] : rigid->one;
        const int64_t e = rigid->of_nodes ? -1 : d->new_element[one];
        if (rigid->of_nodes)
            marked[one] = true;
        for (int64_t q = e < 0 ? 0 : mesh->first[e]; e >= 0 && q < mesh->first[e + 1]; q++)
            marked[mesh->node[q]] = true;
    }
    for (int64_t i = 0; i < n && status == UZ_OK; i++)
        if (marked[i])
            list[count++].index = i;
    for (int64_t i = 0; i < count; i++)
        for (int c = 0; c < mesh->dim; c++)
            middle[c] += mesh->xyz[mesh->dim * list[i].index + c] / (double)count;
    if (status == UZ_OK)
        status = group_of(name, d, "rigid", true, list, count);
    uz_free_all(list, marked);
    return status;
}

/* While nodes are those of the file. */
static uz_status make_rigid(abaqus_deck *d, const deck_rigid *rigid)
{
    const uz_given_mesh *mesh = d->mesh;
    const double *motion = rigid->motion, *force = rigid->force;
    const bool ring = d->out->scene.model == UZ_AXISYMMETRIC;
    uz_support support = {.kind = UZ_SUPPORT_RIGID};
    uz_load load = {.kind = UZ_LOAD_FORCE, .has_point = true};
    bool loaded = false;
    char name[64];
    uz_status status = group_of_rigid(name, support.about, d, rigid);
    for (int c = 0; c < mesh->dim && rigid->point >= 0; c++)
        support.about[c] = mesh->xyz[mesh->dim * rigid->point + c];
    for (int c = 0; c < 3; c++) {
        if (ring && c != 1 && (motion[c] < 0 || motion[c] > 0 || motion[3 + c] < 0 || motion[3 + c] > 0))
            return abaqus_fail(ABAQUS_LINE(&d->text, rigid->line), UZ_ERR_UNSUPPORTED,
                               "a rigid body of revolution moves along its axis only");
        support.u[c] = ring && c != 1 ? (double)NAN : motion[c];
        support.turn[c] = ring ? (double)NAN : motion[3 + c];
        load.point[c] = support.about[c];
        load.v[c] = force[c];
        load.moment[c] = force[3 + c];
        loaded = loaded || force[c] != 0.0 || force[3 + c] != 0.0;
    }
    if (status == UZ_OK)
        status = add_support(d, support, name);
    return status == UZ_OK && loaded ? add_load(d, load, name) : status;
}

static uz_status make_rigids(abaqus_deck *d)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < d->n_rigids && status == UZ_OK; i++)
        status = make_rigid(d, &d->rigids[i]);
    return status;
}

/* key: the index of the material + 1. */
static uz_status add_material(abaqus_deck *d, const char *group, const double key[3], int64_t count)
{
    uz_scene *scene = &d->out->scene;
    const deck_material *from = &d->materials[(int64_t)key[0] - 1];
    (void)count;
    if (!from->elastic)
        return abaqus_fail(ABAQUS_LINE(&d->text, from->line), UZ_ERR_UNSUPPORTED,
                           "the material \"%.60s\" has no *ELASTIC", from->name);
    const uz_status status = one_more(d, &scene->materials, scene->n_materials, sizeof *scene->materials, "materials");
    if (status != UZ_OK)
        return status;
    uz_material *to = &scene->materials[scene->n_materials++];
    *to = (uz_material){.law = UZ_ELASTIC_LINEAR,
                        .young = from->young,
                        .poisson = from->poisson,
                        .density = from->density,
                        .expansion = from->expansion};
    memcpy(to->on, group, sizeof to->on);
    return UZ_OK;
}

static uz_status make_materials(abaqus_deck *d)
{
    const int64_t n = d->mesh->n_elements;
    double *key = uz_alloc(n, sizeof *key);
    uz_status status = key ? UZ_OK : abaqus_no_memory(&d->text);
    for (int64_t e = 0; e < n && status == UZ_OK; e++)
        key[e] = (double)(d->material[e] + 1);
    for (int64_t f = 0; f < d->file->elements.count && status == UZ_OK; f++)
        if (d->new_element[f] >= 0 && d->material[d->new_element[f]] < 0)
            status = abaqus_fail(ABAQUS_LINE(&d->text, d->file->line[f]), UZ_ERR_FORMAT,
                                 "element %lld is in no *SOLID SECTION, and has no material",
                                 (long long)d->file->elements.tag[f]);
    if (status == UZ_OK)
        status = for_alike(d, key, 1, false, "section", add_material);
    free(key);
    return status;
}

/* The rise of temperature of each element, of which nodes tell: the mean where they differ. */
static uz_status make_temperatures(abaqus_deck *d)
{
    const uz_given_mesh *mesh = d->mesh;
    double *rise = uz_alloc_zero(mesh->n_elements, sizeof *rise);
    uz_status status = rise ? UZ_OK : abaqus_no_memory(&d->text);
    int64_t uneven = 0;
    for (int64_t e = 0; e < mesh->n_elements && status == UZ_OK; e++) {
        const int64_t from = mesh->first[e], to = mesh->first[e + 1];
        double low = INFINITY, high = -INFINITY;
        if (d->materials[d->material[e]].expansion == 0.0)
            continue;
        for (int64_t q = from; q < to; q++) {
            const double before = isnan(d->initial[mesh->node[q]]) ? 0.0 : d->initial[mesh->node[q]];
            const double now = d->temperature[mesh->node[q]], more = isnan(now) ? 0.0 : now - before;
            low = fmin(low, more);
            high = fmax(high, more);
            rise[e] += more / (double)(to - from);
        }
        uneven += high - low > 1e-9 * fmax(fabs(low), fabs(high));
        rise[e] = high - low > 1e-9 * fmax(fabs(low), fabs(high)) ? rise[e] : high;
    }
    if (status == UZ_OK && uneven > 0)
        status =
            deck_note(d, d->text.number, "TEMPERATURE", UZ_DECK_LEFT_OUT,
                      "temperature varies within %lld elements, which have the mean of their nodes", (long long)uneven);
    if (status == UZ_OK)
        status = for_alike(d, rise, 1, false, "heated", add_temperature);
    free(rise);
    return status;
}

/* ---- sides */

/* A side by its element in the mesh or in the file, and the nodes of its corners in the mesh, ascending. */
typedef struct {
    int64_t corner[4], node[4]; /* sorted; in the order of the element */
    int count;
    double value;
} side;

static int compare_sides(const void *a, const void *b)
{
    return memcmp(((const side *)a)->corner, ((const side *)b)->corner, sizeof((const side *)a)->corner);
}

static int by_value(const void *a, const void *b)
{
    const side *x = a, *y = b;
    return x->value != y->value ? (x->value > y->value) - (x->value < y->value) : compare_sides(a, b);
}

static uz_status group_of_sides(char name[64], abaqus_deck *d, const char *what, const side *list, int64_t n)
{
    uz_given_group *to = new_group(d, what);
    name[0] = '\0';
    if (!to)
        return d->mesh->n_groups < UZ_MESH_MAX_GROUPS
                   ? abaqus_no_memory(&d->text)
                   : abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED, "there are more than %d groups", UZ_MESH_MAX_GROUPS);
    uz_given_members members = {.to = to};
    for (int64_t i = 0; i < n; i++)
        if (!uz_given_add(&members, UZ_GIVEN_SIDE, -1, list[i].node, list[i].count))
            return abaqus_no_memory(&d->text);
    memcpy(name, to->name, sizeof to->name);
    return UZ_OK;
}

static side side_of_nodes(const int64_t *node, int count)
{
    side made = {.corner = {-1, -1, -1, -1}, .count = count};
    for (int k = 0; k < count; k++)
        made.corner[k] = made.node[k] = node[k];
    qsort(made.corner, 4, sizeof made.corner[0], uz_ascending);
    return made;
}

/* Side `face` of an element of the file. */
static side side_of_file(const abaqus_deck *d, int64_t f, int face)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)d->file->type[f]);
    const int64_t *nodes = d->mesh->node + d->mesh->first[d->new_element[f]];
    const char *corner = abaqus_side((uz_element_kind)d->file->type[f], face);
    int64_t list[4];
    int count = 0;
    for (; *corner; corner++) {
        const int place = *corner - '1'; /* in the file's order */
        int at = place;
        for (int i = 0; type->abaqus_node && i < type->nodes; i++)
            at = type->abaqus_node[i] == place ? i : at;
        list[count++] = nodes[at];
    }
    return side_of_nodes(list, count);
}

/* Pressures on sides of elements, of which the last said counts; and on surfaces. */
static uz_status make_pressures(abaqus_deck *d)
{
    side *list = uz_alloc(d->n_pressures, sizeof *list);
    int64_t n = 0;
    uz_status status = list ? UZ_OK : abaqus_no_memory(&d->text);
    for (int64_t i = 0; i < d->n_pressures && status == UZ_OK; i++) {
        const deck_pressure *from = &d->pressures[i];
        if (from->element < 0) {
            const uz_given_group *group = find_group(d->mesh, from->surface);
            status = group && group->n_faces > 0
                         ? add_load(d, (uz_load){.kind = UZ_LOAD_PRESSURE, .value = from->value}, group->name)
                         : abaqus_fail(ABAQUS_LINE(&d->text, from->line), UZ_ERR_FORMAT,
                                       "there is no surface of sides \"%.60s\"", from->surface);
        } else {
            list[n] = side_of_file(d, from->element, from->face);
            list[n++].value = from->value;
        }
    }
    if (status == UZ_OK)
        qsort(list, (size_t)n, sizeof *list, by_value);
    for (int64_t i = 0, end; i < n && status == UZ_OK; i = end) {
        char name[64];
        for (end = i + 1; end < n && list[end].value == list[i].value;)
            end++;
        if (list[i].value == 0.0)
            continue;
        status = group_of_sides(name, d, "pressed", list + i, end - i);
        if (status == UZ_OK)
            status = add_load(d, (uz_load){.kind = UZ_LOAD_PRESSURE, .value = list[i].value}, name);
    }
    free(list);
    return status;
}

/* ---- contacts */

/* The sides of the body whose corners are all marked, but not those between two elements. */
static uz_status outer_sides(side **out, int64_t *n, const abaqus_deck *d, const bool *marked)
{
    const uz_given_mesh *mesh = d->mesh;
    int64_t room = 0, kept = 0;
    side *list = NULL;
    *n = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        for (int s = 0; s < type->sides; s++) {
            int64_t node[4] = {0};
            bool whole = true;
            for (int k = 0; k < type->side[s].corners; k++) {
                node[k] = mesh->node[mesh->first[e] + type->side[s].node[k]];
                whole = whole && marked[node[k]];
            }
            if (whole && !uz_grow(&list, *n, 1, &room, sizeof *list)) {
                free(list);
                return abaqus_no_memory(&d->text);
            }
            if (whole)
                list[(*n)++] = side_of_nodes(node, type->side[s].corners);
        }
    }
    if (*n > 0)
        qsort(list, (size_t)*n, sizeof *list, compare_sides);
    for (int64_t i = 0, end; i < *n; i = end) {
        for (end = i + 1; end < *n && compare_sides(&list[i], &list[end]) == 0;)
            end++;
        if (end == i + 1)
            list[kept++] = list[i];
    }
    *n = kept;
    *out = list;
    return UZ_OK;
}

/* A surface that is given by its nodes, as sides. name "": it has none. */
static uz_status sides_of_nodes(char name[64], abaqus_deck *d, int64_t line, const uz_given_group *from)
{
    const uz_given_mesh *mesh = d->mesh;
    bool *marked = uz_alloc_zero(mesh->n_nodes, sizeof *marked);
    side *list = NULL;
    int64_t n = 0, alone = 0;
    char what[64];
    uz_status status = marked ? UZ_OK : abaqus_no_memory(&d->text);
    name[0] = '\0';
    snprintf(what, sizeof what, "%.50s.sides", from->name);
    for (int64_t i = 0; i < from->n_nodes && status == UZ_OK; i++)
        marked[from->node[i]] = true;
    if (status == UZ_OK)
        status = outer_sides(&list, &n, d, marked);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < list[i].count; k++)
            marked[list[i].node[k]] = false;
    for (int64_t e = 0; e < mesh->n_elements && status == UZ_OK; e++) { /* middles of edges belong to their sides */
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        for (int64_t q = mesh->first[e] + corners; q < mesh->first[e + 1]; q++)
            marked[mesh->node[q]] = false;
    }
    for (int64_t i = 0; i < mesh->n_nodes && status == UZ_OK; i++)
        alone += marked[i];
    if (status == UZ_OK && n > 0 && alone > 0)
        status = deck_note(d, line, "CONTACT PAIR", UZ_DECK_LEFT_OUT,
                           "%lld nodes of \"%.60s\" have no side of the body with it, and do not touch",
                           (long long)alone, from->name);
    if (status == UZ_OK && n > 0)
        status = group_of_sides(name, d, what, list, n);
    uz_free_all(list, marked);
    return status;
}

/* The group of sides of a surface; name "": it is made of single nodes. */
static uz_status surface_of(char name[64], abaqus_deck *d, int64_t line, const char *surface)
{
    char nodes[80];
    const uz_given_group *group = find_group(d->mesh, surface);
    name[0] = '\0';
    if (group && group->n_faces > 0) {
        memcpy(name, group->name, sizeof group->name);
        return UZ_OK;
    }
    snprintf(nodes, sizeof nodes, "%.63s.nodes", surface);
    if (!group || group->n_nodes == 0)
        group = find_group(d->mesh, nodes);
    if (!group || group->n_nodes == 0)
        return abaqus_fail(ABAQUS_LINE(&d->text, line), UZ_ERR_FORMAT, "there is no surface \"%.60s\"", surface);
    const uz_given_group copy = *group; /* of a list that grows */
    return sides_of_nodes(name, d, line, &copy);
}

static bool is_tied(const abaqus_deck *d, const deck_pair *pair)
{
    return pair->tie || deck_is_tied(d, pair->interaction);
}

static uz_status make_contacts(abaqus_deck *d)
{
    uz_scene *scene = &d->out->scene;
    uz_status status = UZ_OK;
    if (d->n_pairs > LIST_MOST)
        return too_many(d, "contact pairs");
    scene->contacts = uz_alloc_zero(d->n_pairs, sizeof *scene->contacts);
    scene->ties = uz_alloc_zero(d->n_pairs, sizeof *scene->ties);
    if (!scene->contacts || !scene->ties)
        return abaqus_no_memory(&d->text);
    for (int64_t i = 0; i < d->n_pairs && status == UZ_OK; i++) {
        const deck_pair *pair = &d->pairs[i];
        const bool tie = is_tied(d, pair);
        uz_contact *contact = &scene->contacts[scene->n_contacts];
        uz_tie *to = &scene->ties[scene->n_ties];
        *to = (uz_tie){.tolerance = pair->tolerance};
        status = surface_of(to->on, d, pair->line, pair->slave);
        if (status == UZ_OK)
            status = surface_of(to->to, d, pair->line, pair->master);
        if (status != UZ_OK)
            break;
        if (!to->on[0] || !to->to[0]) {
            status = deck_note(d, pair->line, pair->tie ? "TIE" : "CONTACT PAIR", UZ_DECK_LEFT_OUT,
                               "the %s is left out: the nodes of \"%.60s\" make no side of the body",
                               tie ? "tie" : "contact", to->on[0] ? pair->master : pair->slave);
        } else if (tie) {
            scene->n_ties++;
        } else {
            *contact = (uz_contact){.kind = UZ_OBSTACLE_BODY, .between = UZ_CONTACT_SURFACES};
            memcpy(contact->on, to->on, sizeof contact->on);
            memcpy(contact->with, to->to, sizeof contact->with);
            scene->n_contacts++;
        }
    }
    return status;
}

/* Hard contact stands for springs that give way by less of what a body does; for softer ones it is another scene. */
#define STIFF 0.05

/* A spring of stiffness K gives way by p / K under a pressure p, a body of thickness L by about p L / E. */
static uz_status note_springs(abaqus_deck *d)
{
    const uz_given_mesh *mesh = d->mesh;
    double thickness = INFINITY, young = 0.0;
    uz_status status = UZ_OK;
    for (int axis = 0; axis < mesh->dim; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (int64_t a = 0; a < mesh->n_nodes; a++) {
            low = fmin(low, mesh->xyz[a * mesh->dim + axis]);
            high = fmax(high, mesh->xyz[a * mesh->dim + axis]);
        }
        thickness = fmin(thickness, high - low);
    }
    for (int64_t i = 0; i < d->n_materials; i++)
        young = fmax(young, d->materials[i].young);
    for (int64_t i = 0; i < d->n_springs && status == UZ_OK; i++) {
        const double part = young / (d->springs[i].stiffness * thickness);
        const bool stiff = part >= 0.0 && part < STIFF;
        status =
            deck_note(d, d->springs[i].line, "SURFACE BEHAVIOR", stiff ? UZ_DECK_REPLACED : UZ_DECK_LEFT_OUT,
                      "%s in place of a spring of %.3g between the surfaces, which gives way by about %.2g of what "
                      "the body does",
                      d->springs[i].tie ? "a tie" : "hard contact", d->springs[i].stiffness, part);
    }
    return status;
}

/* ---- the whole */

static uz_status choose_model(abaqus_deck *d)
{
    uz_scene *scene = &d->out->scene;
    int count = 0;
    for (int m = 0; m < 4; m++)
        if (d->models[m] && (m == UZ_SOLID) == (d->mesh->dim == 3)) {
            scene->model = (uz_model)m;
            count++;
        }
    if (count != 1)
        return abaqus_fail(
            &d->text, UZ_ERR_UNSUPPORTED,
            "there are elements of plane stress (CPS), plane strain (CPE) and of revolution (CAX) in one "
            "body; a scene is of one kind");
    scene->source = UZ_MESH_GIVEN;
    scene->thickness =
        d->thickness > 0 && (scene->model == UZ_PLANE_STRESS || scene->model == UZ_PLANE_STRAIN) ? d->thickness : 1.0;
    /* Both programs integrate C3D8, CPE4 and CAX4 with the mean dilatation. */
    if (d->incompatible && !d->plain_linear)
        scene->formulation = UZ_FORMULATION_INCOMPATIBLE;
    else if (d->plain_linear && scene->model != UZ_PLANE_STRESS)
        scene->formulation = UZ_FORMULATION_BBAR;
    return UZ_OK;
}

/* Makes of the lines what the scene has beside the mesh. */
static uz_status make_scene(abaqus_deck *d)
{
    uz_status status = choose_model(d);
    if (status == UZ_OK)
        status = make_rigids(d);
    if (status == UZ_OK)
        status = drop_nodes(d);
    if (status == UZ_OK)
        status = make_materials(d);
    if (status == UZ_OK)
        status = for_alike(d, d->fixed, 3, true, "held", add_held);
    if (status == UZ_OK)
        status = for_alike(d, d->force, 3, true, "pulled", add_force);
    if (status == UZ_OK)
        status = make_pressures(d);
    if (status == UZ_OK)
        status = for_alike(d, d->gravity, 3, false, "heavy", add_gravity);
    if (status == UZ_OK)
        status = for_alike(d, d->body_force, 3, false, "drawn", add_body_force);
    if (status == UZ_OK)
        status = make_temperatures(d);
    if (status == UZ_OK)
        status = make_contacts(d);
    return status == UZ_OK ? note_springs(d) : status;
}

static int by_line(const void *a, const void *b)
{
    const uz_deck_note *x = a, *y = b;
    return x->line != y->line ? (x->line > y->line) - (x->line < y->line) : strcmp(x->text, y->text);
}

/* Refuses what is left out, all of it in one message as far as it has room. */
static uz_status refuse_left_out(const abaqus_deck *d)
{
    char list[280] = "";
    int64_t count = 0, first = 0;
    for (int64_t i = 0; i < d->out->n_notes; i++) {
        const uz_deck_note *note = &d->out->notes[i];
        const size_t used = strlen(list);
        if (note->effect != UZ_DECK_LEFT_OUT)
            continue;
        if (count++ == 0) {
            first = note->line;
            snprintf(list, sizeof list, "%s: %.180s", note->keyword, note->text);
        } else if (used + 50 < sizeof list) {
            snprintf(list + used, sizeof list - used, "; line %lld: %s", (long long)note->line, note->keyword);
        }
    }
    return count == 0 ? UZ_OK
                      : abaqus_fail(ABAQUS_LINE(&d->text, first), UZ_ERR_UNSUPPORTED,
                                    "%s%s. Allow leaving it out, or change the deck", list,
                                    count > 1 ? " (and the answer would be another one with each of these)" : "");
}

/* Numbers for each node and element of the body. */
static bool make_room(abaqus_deck *d)
{
    const int64_t n = d->mesh->n_nodes, m = d->mesh->n_elements;
    d->fixed = uz_alloc(3 * n, sizeof *d->fixed);
    d->force = uz_alloc_zero(3 * n, sizeof *d->force);
    d->temperature = uz_alloc(n, sizeof *d->temperature);
    d->initial = uz_alloc(n, sizeof *d->initial);
    d->material = uz_alloc(m, sizeof *d->material);
    d->gravity = uz_alloc_zero(3 * m, sizeof *d->gravity);
    d->body_force = uz_alloc_zero(3 * m, sizeof *d->body_force);
    if (!d->fixed || !d->force || !d->temperature || !d->initial || !d->material || !d->gravity || !d->body_force)
        return false;
    for (int64_t i = 0; i < 3 * n; i++)
        d->fixed[i] = (double)NAN;
    for (int64_t i = 0; i < n; i++)
        d->temperature[i] = d->initial[i] = (double)NAN;
    for (int64_t e = 0; e < m; e++)
        d->material[e] = -1;
    return true;
}

static void clear_deck(abaqus_deck *d)
{
    uz_free_all(d->materials, d->amplitudes, d->pairs, d->tied, d->springs, d->pressures, d->rigids, d->fixed, d->force,
                d->temperature, d->initial, d->material, d->gravity, d->body_force);
}

void uz_deck_clear(uz_deck *deck)
{
    if (!deck)
        return;
    uz_scene_clear(&deck->scene);
    uz_free_all(deck->notes, deck->node_number);
    memset(deck, 0, sizeof *deck);
}

uz_status uz_deck_read(uz_deck *out, const char *text, size_t len, size_t max_bytes, bool leave_out, uz_error *err)
{
    abaqus_file file = {.text = {.at = text, .end = text + len, .err = err}, .max_bytes = max_bytes};
    abaqus_deck d = {.file = &file, .out = out, .mesh = &out->scene.given, .text = file.text, .period = 1.0};
    int64_t *new_element;
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status = abaqus_read_mesh(&out->scene.given, &file, &new_element);
    d.new_element = new_element;
    if (status == UZ_OK && !make_room(&d))
        status = abaqus_no_memory(&d.text);
    if (status == UZ_OK)
        status = deck_read_lines(&d);
    if (status == UZ_OK)
        status = make_scene(&d);
    if (status == UZ_OK && out->n_notes > 0)
        qsort(out->notes, (size_t)out->n_notes, sizeof *out->notes, by_line);
    if (status == UZ_OK && !leave_out)
        status = refuse_left_out(&d);
    clear_deck(&d);
    abaqus_clear(&file);
    free(new_element);
    if (status != UZ_OK)
        uz_deck_clear(out);
    return status;
}
