/* abaqus_sets.c: sets and surfaces of an input file of Abaqus or CalculiX, and the groups of a mesh that they are.
 *
 * The formats have a name for nodes, one for elements and one for sides; a group of a mesh has one name. So where names
 * are the same, sides keep it, then nodes, then elements, and the others are NAME.nodes and NAME.elements. Only where
 * the nodes are just those of the sides or elements they say nothing of their own, and are left out. */
#include "core/alloc.h"
#include "core/order.h"
#include "io/abaqus.h"
#include "scene/given.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- while the file is read */

/* The slot of the set, or the empty one where it would be. There are fewer sets than slots. */
static int32_t *slot_of(abaqus_file *file, abaqus_set_kind kind, const char *name)
{
    uint32_t hash = 2166136261u + (uint32_t)kind; /* FNV-1a */
    for (const char *c = name; *c; c++)
        hash = (hash ^ (uint32_t)tolower((unsigned char)*c)) * 16777619u;
    for (uint32_t at = hash % ABAQUS_SLOTS;; at = (at + 1) % ABAQUS_SLOTS) {
        const abaqus_set *set = file->slot[at] > 0 ? &file->sets[file->slot[at] - 1] : NULL;
        if (!set || (set->kind == kind && strcasecmp(set->name, name) == 0))
            return &file->slot[at];
    }
}

int64_t abaqus_set_find(abaqus_file *file, abaqus_set_kind kind, const char *name)
{
    return (int64_t)*slot_of(file, kind, name) - 1;
}

uz_status abaqus_set_of(int64_t *out, abaqus_file *file, abaqus_set_kind kind, const char *name)
{
    int32_t *slot = slot_of(file, kind, name);
    *out = (int64_t)*slot - 1;
    if (*slot > 0)
        return UZ_OK;
    if (file->n_sets == UZ_MESH_MAX_GROUPS)
        return abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED, "there are more than %d sets and surfaces",
                           UZ_MESH_MAX_GROUPS);
    if (!uz_grow(&file->sets, file->n_sets, 1, &file->sets_room, sizeof *file->sets))
        return abaqus_no_memory(&file->text);
    abaqus_set *set = &file->sets[file->n_sets];
    *set = (abaqus_set){.kind = kind};
    snprintf(set->name, sizeof set->name, "%s", name);
    *out = file->n_sets++;
    *slot = (int32_t)file->n_sets;
    return UZ_OK;
}

uz_status abaqus_set_add(abaqus_file *file, int64_t at, abaqus_item item)
{
    abaqus_set *set = &file->sets[at];
    abaqus_item *last = set->n_items > 0 ? &set->item[set->n_items - 1] : NULL;
    if (last && last->set < 0 && item.set < 0 && last->face == item.face && !last->generated && !item.generated &&
        item.first - 1 == last->last) { /* numbers may be the largest that there is */
        last->last = item.last;
        return UZ_OK;
    }
    if (!uz_grow(&set->item, set->n_items, 1, &set->room, sizeof *set->item))
        return abaqus_no_memory(&file->text);
    set->item[set->n_items++] = item;
    return UZ_OK;
}

static bool is_number(const char *field)
{
    return *field >= '0' && *field <= '9';
}

/* A member: a number, or the name of a set of that kind before this one. */
static uz_status read_member(abaqus_item *out, abaqus_file *file, abaqus_set_kind kind, const char *field)
{
    *out = (abaqus_item){.line = file->text.number, .step = 1, .set = -1};
    uz_status status = UZ_OK;
    if (is_number(field)) {
        status = abaqus_int(&out->first, field,
                            kind == ABAQUS_NSET ? "the number of a node" : "the number of an element", &file->text);
        out->last = out->first;
    } else {
        out->set = abaqus_set_find(file, kind, field);
        if (out->set < 0)
            status = abaqus_fail(&file->text, UZ_ERR_FORMAT, "there is no set of %s \"%.60s\" before this line",
                                 kind == ABAQUS_NSET ? "nodes" : "elements", field);
    }
    return status;
}

/* first, last[, step] */
static uz_status read_range(abaqus_item *out, abaqus_text *text)
{
    char field[ABAQUS_FIELD];
    int64_t value[3] = {0, 0, 1};
    int count = 0;
    uz_status status = UZ_OK;
    for (; status == UZ_OK && abaqus_field(field, text); count++)
        status = count < 3 ? abaqus_int(&value[count], field, "a number of first, last, step", text)
                           : abaqus_fail(text, UZ_ERR_FORMAT, "a generated range has first, last and step");
    if (status == UZ_OK && (count < 2 || value[2] < 1 || value[1] < value[0]))
        status = abaqus_fail(text, UZ_ERR_FORMAT, "a generated range goes from a first to a larger last number");
    *out = (abaqus_item){
        .line = text->number, .first = value[0], .last = value[1], .step = value[2], .set = -1, .generated = true};
    return status;
}

uz_status abaqus_read_set(abaqus_file *file, const abaqus_keyword *keyword, abaqus_set_kind kind)
{
    char name[ABAQUS_NAME], field[ABAQUS_FIELD];
    const bool generate = abaqus_parameter(keyword, "GENERATE") != NULL;
    const char *of_elements = kind == ABAQUS_NSET ? abaqus_parameter(keyword, "ELSET") : NULL;
    uz_status status = abaqus_name(name, keyword, kind == ABAQUS_NSET ? "NSET" : "ELSET", true, &file->text);
    int64_t set = -1;
    if (status == UZ_OK)
        status = abaqus_set_of(&set, file, kind, name);
    if (status == UZ_OK && of_elements) {
        abaqus_item item = {.line = keyword->line, .step = 1, .face = -1};
        item.set = abaqus_set_find(file, ABAQUS_ELSET, of_elements);
        status = item.set < 0 ? abaqus_fail(&file->text, UZ_ERR_FORMAT,
                                            "there is no set of elements \"%.60s\" before this line", of_elements)
                              : abaqus_set_add(file, set, item);
    }
    while (status == UZ_OK && abaqus_next_line(&file->text) && !abaqus_is_keyword(&file->text)) {
        abaqus_item item;
        if (generate) {
            status = read_range(&item, &file->text);
            if (status == UZ_OK)
                status = abaqus_set_add(file, set, item);
        }
        while (!generate && status == UZ_OK && abaqus_field(field, &file->text)) {
            if (field[0] == '\0')
                continue;
            status = read_member(&item, file, kind, field);
            if (status == UZ_OK && item.set == set)
                status = abaqus_fail(&file->text, UZ_ERR_FORMAT, "the set \"%s\" is a member of itself", name);
            if (status == UZ_OK)
                status = abaqus_set_add(file, set, item);
        }
    }
    return status;
}

/* "S3" or "3": the number of a side; 0: no such name. */
static int side_of(const char *field)
{
    const char *digit = field + (*field == 'S' || *field == 's');
    return digit[0] >= '1' && digit[0] <= '6' && digit[1] == '\0' ? digit[0] - '0' : 0;
}

/* Elements, or a set of them, and a side; of a surface of nodes, nodes or sets of them. */
uz_status abaqus_read_surface(abaqus_file *file, const abaqus_keyword *keyword)
{
    char name[ABAQUS_NAME], member[ABAQUS_FIELD], side[ABAQUS_FIELD];
    const char *type = abaqus_parameter(keyword, "TYPE");
    const bool nodes = type && strcasecmp(type, "NODE") == 0;
    if (type && !nodes && strcasecmp(type, "ELEMENT") != 0)
        return abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED,
                           "a surface of type %.40s is not read; of types ELEMENT and NODE it is", type);
    uz_status status = abaqus_name(name, keyword, "NAME", true, &file->text);
    int64_t set = -1;
    if (status == UZ_OK)
        status = abaqus_set_of(&set, file, nodes ? ABAQUS_NSET : ABAQUS_SURFACE, name);
    while (status == UZ_OK && abaqus_next_line(&file->text) && !abaqus_is_keyword(&file->text)) {
        abaqus_item item = {0};
        abaqus_field(member, &file->text);
        status = read_member(&item, file, nodes ? ABAQUS_NSET : ABAQUS_ELSET, member);
        const bool sided = abaqus_field(side, &file->text);
        if (status == UZ_OK && !nodes) {
            item.face = sided ? side_of(side) : 0;
            if (sided && (strcasecmp(side, "SPOS") == 0 || strcasecmp(side, "SNEG") == 0))
                status = abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED,
                                     "%s is a side of a shell or a membrane, which are not modelled; give it its "
                                     "thickness in solid elements (C3D20, C3D10)",
                                     side);
            else if (item.face == 0)
                status = abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED,
                                     "a side of elements, S1 to S6, was expected behind \"%.40s\"%s", member,
                                     sided ? "" : "; give the sides of the surface one by one");
        }
        if (status == UZ_OK && item.set != set) /* a surface of nodes may have the name of the set that it is */
            status = abaqus_set_add(file, set, item);
    }
    return status;
}

/* ---- members */

typedef struct {
    abaqus_file *file;
    uz_given_mesh *out;
    const int64_t *new_element;
    abaqus_members *list;  /* n_sets */
    int64_t *seen;         /* as many as nodes or elements: the last set that has it, from 1 */
    uint64_t looked, most; /* members that were gone through, and how many may be */
} set_work;

static uz_status fail_at(const set_work *w, int64_t line, uz_status status, const char *format, const char *name,
                         int64_t number)
{
    return abaqus_fail(ABAQUS_LINE(&w->file->text, line), status, format, name, (long long)number);
}

static uz_status take(set_work *w, int64_t set, int64_t index, int face)
{
    abaqus_members *to = &w->list[set];
    const bool sides = w->file->sets[set].kind == ABAQUS_SURFACE;
    if (w->looked++ > w->most)
        return fail_at(w, w->file->text.number, UZ_ERR_LIMIT, "the sets need more memory than is allowed: \"%s\"",
                       w->file->sets[set].name, 0);
    if (!sides && w->seen[index] == set + 1)
        return UZ_OK;
    w->seen[index] = set + 1;
    if ((sides && !uz_grow(&to->face, to->count, 1, &to->face_room, sizeof *to->face)) ||
        !uz_grow(&to->index, to->count, 1, &to->room, sizeof *to->index))
        return abaqus_no_memory(&w->file->text);
    if (sides)
        to->face[to->count] = (unsigned char)face;
    to->index[to->count++] = index;
    return UZ_OK;
}

static uz_status take_numbers(set_work *w, int64_t set, const abaqus_item *item, const abaqus_tags *tags)
{
    const bool nodes = w->file->sets[set].kind == ABAQUS_NSET;
    int64_t found = 0;
    uz_status status = UZ_OK;
    for (int64_t at = abaqus_tags_at(tags, item->first); at < tags->count && status == UZ_OK; at++) {
        const int64_t index = abaqus_tags_index(tags, at), tag = tags->tag[index];
        if (tag > item->last || w->looked++ > w->most)
            break;
        if ((tag - item->first) % item->step != 0)
            continue;
        found++;
        status = take(w, set, index, item->face);
    }
    if (status == UZ_OK && !item->generated && found < item->last - item->first + 1)
        status = fail_at(w, item->line, UZ_ERR_FORMAT,
                         nodes ? "the set \"%s\" has nodes from %lld on of which one is not there"
                               : "\"%s\" has elements from %lld on of which one is not there",
                         w->file->sets[set].name, item->first);
    return status;
}

/* The nodes of a set of elements; those of another set. */
static uz_status take_set(set_work *w, int64_t set, const abaqus_item *item)
{
    const abaqus_file *file = w->file;
    const abaqus_members *from = &w->list[item->set];
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < from->count && status == UZ_OK; i++) {
        const int64_t e = from->index[i];
        if (item->face >= 0)
            status = take(w, set, e, item->face);
        for (int64_t q = file->first[e]; item->face < 0 && q < file->first[e + 1] && status == UZ_OK; q++)
            status = take(w, set, abaqus_tags_find(&file->nodes, file->node[q]), 0);
    }
    return status;
}

/* Elements before nodes and sides, which may be theirs; each kind in the order of the file, as sets name those before.
 */
static uz_status list_members(set_work *w)
{
    static const abaqus_set_kind ORDER[] = {ABAQUS_ELSET, ABAQUS_NSET, ABAQUS_SURFACE};
    abaqus_file *file = w->file;
    uz_status status = UZ_OK;
    for (int k = 0; k < 3; k++) {
        const abaqus_tags *tags = ORDER[k] == ABAQUS_NSET ? &file->nodes : &file->elements;
        memset(w->seen, 0, (size_t)(file->nodes.count + file->elements.count) * sizeof *w->seen);
        for (int64_t s = 0; s < file->n_sets && status == UZ_OK; s++) {
            const abaqus_set *set = &file->sets[s];
            for (int64_t i = 0; set->kind == ORDER[k] && i < set->n_items && status == UZ_OK; i++)
                status = set->item[i].set < 0 ? take_numbers(w, s, &set->item[i], tags) : take_set(w, s, &set->item[i]);
            if (status == UZ_OK && set->kind == ORDER[k] && set->kind != ABAQUS_SURFACE && w->list[s].count > 1)
                qsort(w->list[s].index, (size_t)w->list[s].count, sizeof *w->list[s].index, uz_ascending);
        }
    }
    return status;
}

/* ---- groups */

/* The sides of an element by its dimension and corners, in the numbering of the file; corners from 1. */
static const char *const SIDES[][6] = {
    {"12", "23", "31"},                               /* triangle */
    {"12", "23", "34", "41"},                         /* quadrilateral */
    {"123", "142", "243", "341"},                     /* tetrahedron */
    {"123", "465", "1452", "2563", "3641"},           /* wedge */
    {"1234", "5876", "1562", "2673", "3784", "4851"}, /* hexahedron */
};

const char *abaqus_side(uz_element_kind kind, int face)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const int row = type->dim == 2 ? type->corners - 3 : type->corners == 4 ? 2 : type->corners == 6 ? 3 : 4;
    return face < 1 || face > 6 ? NULL : SIDES[row][face - 1];
}

/* The sides of a surface; sides of elements that are no part of the body are refused. */
static uz_status add_surface(uz_given_group *to, const set_work *w, int64_t set)
{
    const abaqus_file *file = w->file;
    const abaqus_members *list = &w->list[set];
    uz_given_members members = {.to = to};
    for (int64_t i = 0; i < list->count; i++) {
        const int64_t e = list->index[i];
        if (w->new_element[e] < 0)
            return abaqus_type_of(file->type[e]).family
                       ? abaqus_fail_no_body(file, e)
                       : fail_at(w, file->line[e], UZ_ERR_UNSUPPORTED,
                                 "the surface \"%s\" has element %lld, of a plane body beside a solid one",
                                 file->sets[set].name, file->elements.tag[e]);
        const char *corner = abaqus_side((uz_element_kind)file->type[e], list->face[i]);
        if (!corner)
            return fail_at(w, file->line[e], UZ_ERR_UNSUPPORTED,
                           "the surface \"%s\" has a side, S%lld, that this element has not", file->sets[set].name,
                           list->face[i]);
        int64_t node[4], n = 0;
        for (; *corner; corner++)
            node[n++] = abaqus_tags_find(&file->nodes, file->node[file->first[e] + (*corner - '1')]);
        if (!uz_given_add(&members, UZ_GIVEN_SIDE, -1, node, n))
            return abaqus_no_memory(&file->text);
    }
    return UZ_OK;
}

/* What of a set of elements is of the dimension of the body (elements), of one less (sides), or still less (nodes). */
static uz_status add_elements(uz_given_group *to, const set_work *w, int64_t set, uz_given_way way)
{
    const abaqus_file *file = w->file;
    const abaqus_members *list = &w->list[set];
    uz_given_members members = {.to = to};
    for (int64_t i = 0; i < list->count; i++) {
        const int64_t e = list->index[i], from = file->first[e], n = file->first[e + 1] - from;
        int64_t node[UZ_ELEMENT_NODES];
        if (w->out->dim - abaqus_type_of(file->type[e]).dim != (int)way)
            continue;
        for (int64_t q = 0; q < n; q++)
            node[q] = abaqus_tags_find(&file->nodes, file->node[from + q]);
        if (!uz_given_add(&members, way, w->new_element[e], node, n))
            return abaqus_no_memory(&file->text);
    }
    return UZ_OK;
}

/* Are the nodes (ascending, each once) just those of the group's sides and elements? */
static bool same_nodes(set_work *w, const abaqus_members *nodes, const uz_given_group *sides,
                       const uz_given_group *elements)
{
    const abaqus_file *file = w->file;
    const int64_t n = file->nodes.count;
    int64_t count = 0;
    memset(w->seen, 0, (size_t)n * sizeof *w->seen);
    for (int64_t i = 0; i < nodes->count; i++)
        w->seen[nodes->index[i]] = 1;
    for (int64_t q = 0; sides->n_faces > 0 && q < sides->face_first[sides->n_faces]; q++) {
        count += w->seen[sides->face_node[q]] == 1;
        if (w->seen[sides->face_node[q]]++ == 0)
            return false;
    }
    for (int64_t i = 0; i < elements->n_elements; i++)
        for (int64_t q = w->out->first[elements->element[i]]; q < w->out->first[elements->element[i] + 1]; q++) {
            count += w->seen[w->out->node[q]] == 1;
            if (w->seen[w->out->node[q]]++ == 0)
                return false;
        }
    return count == nodes->count;
}

enum { BY_SIDES, BY_NODES, BY_ELEMENTS, WAYS };

/* Names what of one name there is (uz_given_group WAYS), and drops what says nothing. */
static uz_status name_groups(set_work *w, uz_given_group made[WAYS], const char *name, const abaqus_members *nodes)
{
    static const char *const SUFFIX[WAYS] = {"", ".nodes", ".elements"};
    const bool there[WAYS] = {made[BY_SIDES].n_faces > 0, made[BY_NODES].n_nodes > 0, made[BY_ELEMENTS].n_elements > 0};
    const uz_given_group none = {.n_faces = 0};
    bool named = false;
    for (int k = 0; k < WAYS; k++) {
        if (!there[k])
            continue;
        if (k == BY_NODES && nodes &&
            ((there[BY_SIDES] && same_nodes(w, nodes, &made[BY_SIDES], &none)) ||
             (!there[BY_SIDES] && there[BY_ELEMENTS] && same_nodes(w, nodes, &none, &made[BY_ELEMENTS])))) {
            free(made[k].node);
            made[k] = none;
            continue;
        }
        const int length = snprintf(made[k].name, sizeof made[k].name, "%s%s", name, named ? SUFFIX[k] : "");
        if (length >= (int)sizeof made[k].name)
            return abaqus_fail(&w->file->text, UZ_ERR_UNSUPPORTED,
                               "\"%s\" is the name of nodes, sides and elements that differ, and too long for another "
                               "one",
                               name);
        named = true;
    }
    return UZ_OK;
}

/* The groups of all sets whose name is that of set s; none where an earlier one has it. */
static uz_status add_groups(set_work *w, int64_t s)
{
    const abaqus_file *file = w->file;
    const char *name = file->sets[s].name;
    uz_given_group made[WAYS] = {{.n_nodes = 0}};
    const abaqus_members *nodes = NULL;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < file->n_sets && status == UZ_OK; k++) {
        if (strcasecmp(file->sets[k].name, name) != 0)
            continue;
        if (k < s)
            return UZ_OK;
        if (file->sets[k].kind == ABAQUS_SURFACE && w->list[k].count > 0) {
            /* a set of elements that are sides may have the name already */
            status =
                made[BY_SIDES].n_faces == 0
                    ? add_surface(&made[BY_SIDES], w, k)
                    : fail_at(w, file->text.number, UZ_ERR_UNSUPPORTED,
                              "\"%s\" is the name of a surface and of a set of sides; give one another name", name, 0);
        }
        if (file->sets[k].kind == ABAQUS_ELSET) {
            status = add_elements(&made[BY_ELEMENTS], w, k, UZ_GIVEN_ELEMENT);
            if (status == UZ_OK && made[BY_SIDES].n_faces == 0)
                status = add_elements(&made[BY_SIDES], w, k, UZ_GIVEN_SIDE);
            if (status == UZ_OK && made[BY_NODES].n_nodes == 0)
                status = add_elements(&made[BY_NODES], w, k, UZ_GIVEN_NODES);
        }
        if (file->sets[k].kind == ABAQUS_NSET && w->list[k].count > 0) {
            free(made[BY_NODES].node);
            nodes = &w->list[k];
            made[BY_NODES].node = uz_alloc(nodes->count, sizeof *nodes->index);
            made[BY_NODES].n_nodes = nodes->count;
            if (made[BY_NODES].node)
                memcpy(made[BY_NODES].node, nodes->index, (size_t)nodes->count * sizeof *nodes->index);
            else
                status = abaqus_no_memory(&file->text);
        }
    }
    if (status == UZ_OK)
        status = name_groups(w, made, name, nodes);
    for (int k = 0; k < WAYS; k++)
        if (status == UZ_OK && made[k].name[0]) {
            w->out->groups[w->out->n_groups++] = made[k];
        } else {
            uz_free_all(made[k].node, made[k].face_first, made[k].face_node, made[k].element);
        }
    return status;
}

uz_status abaqus_make_groups(uz_given_mesh *out, abaqus_file *file, const int64_t *new_element)
{
    const int64_t n_seen = file->nodes.count + file->elements.count;
    set_work w = {.file = file, .out = out, .new_element = new_element, .most = UINT64_MAX};
    if (file->max_bytes > 0)
        w.most = file->max_bytes / sizeof(int64_t);
    w.list = file->members = uz_alloc_zero(file->n_sets, sizeof *w.list);
    w.seen = uz_alloc(n_seen, sizeof *w.seen);
    out->groups = uz_alloc_zero(WAYS * file->n_sets, sizeof *out->groups);
    uz_status status = w.list && w.seen && out->groups ? list_members(&w) : abaqus_no_memory(&file->text);
    for (int64_t s = 0; s < file->n_sets && status == UZ_OK; s++)
        status = add_groups(&w, s);
    free(w.seen);
    return status;
}
