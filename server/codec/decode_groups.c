/* decode_groups.c: which parts of the mesh a request names, and those that it gives by where they are. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"
#include "text/edit_distance.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    MOST_SELECTIONS = 1000, /* each looks at the whole mesh */
    MOST_SHOWN = 64,        /* names that a misspelt one is compared with */
    MOST_LISTED = 12
};

/* Sides of boxes, and what they are called, too. */
static const struct {
    const char *name, *other;
} SIDES[] = {{"left", "-x"}, {"right", "+x"}, {"bottom", "-y"}, {"top", "+y"}, {"back", "-z"}, {"front", "+z"}};

/* ---- where a group is */

/* A coordinate, or between which it is. */
static bool read_ranges(uz_selection *to, decoding *d, const json_value *where, int dim)
{
    static const char *const AXES[] = {"x", "y", "z"};
    for (int c = 0; c < 3; c++) {
        const json_value *value = json_get(where, AXES[c]);
        const bool exact = json_is(value, JSON_IS_NUMBER);
        to->low[c] = json_number(exact ? value : json_get(value, "min"), -HUGE_VAL);
        to->high[c] = json_number(exact ? value : json_get(value, "max"), HUGE_VAL);
        if (value && c >= dim)
            return decode_refuse(d, "not_allowed", value, "is for solids; the model is one in the plane.");
        if (!(to->low[c] <= to->high[c]))
            return decode_refuse(d, "out_of_range", value, "has min %.15g above max %.15g: nothing is between them.",
                                 to->low[c], to->high[c]);
        to->by |= value ? UZ_SELECT_RANGE : 0u;
    }
    return true;
}

static bool read_where(uz_selection *to, decoding *d, const json_value *where, int dim)
{
    static const char *const KINDS[UZ_SELECT_KINDS] = {"", "sides", "nodes", "elements"};
    const json_value *plane = json_get(where, "plane"), *circle = json_get(where, "circle"),
                     *sphere = json_get(where, "sphere"), *cylinder = json_get(where, "cylinder"),
                     *facing = json_get(where, "normal"), *nearest = json_get(where, "nearest"),
                     *of = json_get(where, "of"), *round = dim == 3 ? sphere : circle;
    const json_value *wrong = dim == 3 ? circle : sphere ? sphere : cylinder;
    if (wrong)
        return decode_refuse(d, "not_allowed", wrong,
                             dim == 3 ? "is for models in the plane; in solids it is a sphere."
                                      : "is for solids; in the plane it is a circle.");
    if (!read_ranges(to, d, where, dim))
        return false;
    for (int k = 0; k < (int)UZ_SELECT_KINDS; k++)
        if (json_text_is(of, KINDS[k]))
            to->kind = (uz_select_kind)k;
    to->by |= (plane ? UZ_SELECT_PLANE : 0u) | (round ? UZ_SELECT_ROUND : 0u) | (cylinder ? UZ_SELECT_CYLINDER : 0u) |
              (facing ? UZ_SELECT_FACING : 0u) | (nearest ? UZ_SELECT_NEAREST : 0u);
    to->radius = json_number(json_get(round, "radius"), 0);
    to->axis_radius = json_number(json_get(cylinder, "radius"), 0);
    to->within = facing ? json_number(json_get(facing, "within"), 30) : 0;
    to->tolerance = json_number(json_get(where, "tolerance"), 0);
    if (to->by == 0)
        return decode_refuse(d, "missing_key", where,
                             "says nothing about where: give x, y, z, plane, %s, normal or "
                             "nearest.",
                             dim == 3 ? "sphere, cylinder" : "circle");
    if (facing && of && to->kind != UZ_SELECT_SIDES)
        return decode_refuse(d, "not_allowed", of, "must be sides where a normal is asked for: only these have one.");
    if (nearest && (facing || (of && to->kind != UZ_SELECT_NODES)))
        return decode_refuse(d, "not_allowed", nearest,
                             "is a node: it goes neither with a normal nor with sides or "
                             "elements.");
    const struct {
        double *out;
        const json_value *object;
        const char *key, *what;
    } VECTORS[] = {{to->plane_point, plane, "point", NULL},
                   {to->plane_normal, plane, "normal", "it must be the direction of the plane's normal"},
                   {to->centre, round, "center", NULL},
                   {to->axis_point, cylinder, "point", NULL},
                   {to->axis, cylinder, "axis", "it must be the direction of the axis"},
                   {to->facing, facing, "direction", "it must be the direction that the sides look in"},
                   {to->nearest, nearest ? where : NULL, "nearest", NULL}};
    for (size_t i = 0; i < sizeof VECTORS / sizeof VECTORS[0]; i++)
        if (VECTORS[i].object &&
            !decode_components(VECTORS[i].out, d, VECTORS[i].object, VECTORS[i].key, 0, dim, VECTORS[i].what))
            return false;
    return true;
}

/* ---- what a group without a name is called */

/* Words of a name, as far as there is room for them. */
typedef struct {
    char text[400];
    size_t used;
} wording;

static void say(wording *w, const char *what, const double *numbers, int count)
{
    int added = snprintf(w->text + w->used, sizeof w->text - w->used, "%s%s", w->used ? " " : "", what);
    w->used += (size_t)(added > 0 ? added : 0);
    for (int i = 0; i < count && w->used < sizeof w->text; i++) {
        added = snprintf(w->text + w->used, sizeof w->text - w->used, "%s%.9g", i ? "," : "", numbers[i] + 0.0);
        w->used += (size_t)(added > 0 ? added : 0);
    }
    w->used = w->used < sizeof w->text ? w->used : sizeof w->text - 1;
}

/* "z=10", "x>=0 x<=2 normal 0,1": what it says, in one order. */
static void describe(wording *w, const uz_selection *s, int dim)
{
    static const char *const LEAST[] = {"x>=", "y>=", "z>="}, *const MOST[] = {"x<=", "y<=", "z<="},
                             *const EXACTLY[] = {"x=", "y=", "z="},
                             *const KINDS[UZ_SELECT_KINDS] = {NULL, "sides", "nodes", "elements"};
    if (KINDS[s->kind])
        say(w, KINDS[s->kind], NULL, 0);
    for (int c = 0; c < dim && (s->by & UZ_SELECT_RANGE); c++) {
        const bool exact = !(s->low[c] < s->high[c]);
        if (isfinite(s->low[c]))
            say(w, exact ? EXACTLY[c] : LEAST[c], &s->low[c], 1);
        if (!exact && isfinite(s->high[c]))
            say(w, MOST[c], &s->high[c], 1);
    }
    if (s->by & UZ_SELECT_PLANE) {
        say(w, "plane ", s->plane_point, dim);
        say(w, "normal to ", s->plane_normal, dim);
    }
    if (s->by & UZ_SELECT_ROUND) {
        say(w, dim == 3 ? "sphere " : "circle ", s->centre, dim);
        say(w, "radius ", &s->radius, 1);
    }
    if (s->by & UZ_SELECT_CYLINDER) {
        say(w, "cylinder ", s->axis_point, dim);
        say(w, "axis ", s->axis, dim);
        say(w, "radius ", &s->axis_radius, 1);
    }
    if (s->by & UZ_SELECT_FACING) {
        say(w, "normal ", s->facing, dim);
        say(w, "within ", &s->within, 1);
    }
    if (s->by & UZ_SELECT_NEAREST)
        say(w, "nearest ", s->nearest, dim);
    if (s->tolerance > 0)
        say(w, "tolerance ", &s->tolerance, 1);
}

/* Do two of them select the same? Names and places aside. */
static bool selects_the_same(const uz_selection *a, const uz_selection *b)
{
    uz_selection x;
    memcpy(&x, a, sizeof x);
    memcpy(x.name, b->name, sizeof x.name);
    memcpy(x.place, b->place, sizeof x.place);
    return memcmp(&x, b, sizeof x) == 0;
}

/* The n-th name of what is described so: whole, or its beginning with a number behind it. */
static void make_name(char name[64], const wording *w, int n)
{
    char number[16] = "";
    if (n > 1 || w->used >= 64)
        snprintf(number, sizeof number, "...#%d", n);
    snprintf(name, 64, "%.*s%s", (int)(63 - strlen(number)), w->text, number);
}

/* ---- the list of a scene, and what says `on` */

/* Room for one more, zeroed to the last byte: they are compared whole. NULL: the problem says why. */
static uz_selection *new_selection(decoding *d, const json_value *where)
{
    uz_scene *scene = d->scene;
    char place[sizeof d->problem->pointer];
    if (scene->n_selections >= MOST_SELECTIONS) {
        decode_refuse(d, "out_of_range", where, "is one more than the %d places that a request may give.",
                      MOST_SELECTIONS);
        return NULL;
    }
    uz_selection *grown = room_grow(scene->selections, (size_t)scene->n_selections + 1, sizeof *grown);
    if (!grown) {
        problem_no_memory(d->problem);
        return NULL;
    }
    scene->selections = grown;
    uz_selection *to = memset(&grown[scene->n_selections], 0, sizeof *grown);
    json_pointer(place, sizeof place, where);
    const char *within = strncmp(place, "/problem/", 9) == 0 ? place + 8 : place; /* of the problem, as the library's */
    snprintf(to->place, sizeof to->place, "%.*s", (int)sizeof to->place - 1, within);
    return to;
}

static uz_selection *add_selection(decoding *d, const json_value *where)
{
    uz_selection *to = new_selection(d, where);
    return to && read_where(to, d, where, uz_scene_dim(d->scene)) ? to : NULL;
}

static bool is_selected(const uz_scene *scene, const char *name)
{
    for (int64_t i = 0; i < scene->n_selections; i++)
        if (strcmp(scene->selections[i].name, name) == 0)
            return true;
    return false;
}

/* The group `name` of all outer sides; nothing, where one is called so. */
static bool select_outer_sides(decoding *d, const char *name, const json_value *value)
{
    if (is_selected(d->scene, name))
        return true;
    uz_selection *to = new_selection(d, value);
    if (!to)
        return false;
    snprintf(to->name, sizeof to->name, "%s", name);
    to->kind = UZ_SELECT_SIDES; /* and no condition */
    d->scene->n_selections++;
    return true;
}

bool decode_everywhere(char name[64], decoding *d, const json_value *value)
{
    memcpy(name, "every outer side", sizeof "every outer side");
    return select_outer_sides(d, name, value);
}

bool decode_selections(uz_scene *out, decoding *d, const json_value *list)
{
    for (size_t i = 0; i < json_size(list); i++) {
        const json_value *name = json_get(&list->items[i], "name");
        uz_selection *to = add_selection(d, json_get(&list->items[i], "where"));
        if (!to || !decode_label(to->name, d, name, name->text, name->count, "A name of a group"))
            return false;
        for (int64_t k = 0; k < out->n_selections; k++)
            if (strcmp(out->selections[k].name, to->name) == 0)
                return decode_refuse(d, "not_allowed", name, "is the name of another of these groups, too.");
        out->n_selections++;
    }
    return true;
}

/* Names that a group may have, and the one that was asked for among them. */
typedef struct {
    const char *asked, *shown[MOST_SHOWN];
    size_t count; /* of all; the first MOST_SHOWN are kept */
    bool found;
} known_names;

static void offer(known_names *known, const char *name)
{
    if (known->count < MOST_SHOWN)
        known->shown[known->count] = name;
    known->count++;
    known->found = known->found || strcmp(name, known->asked) == 0;
}

/* Is there a group of that name, and can it be what is wanted? Of files and numbers what it is made of is the
 * library's matter. */
static bool check_name(decoding *d, const json_value *value, const char *name, group_use use)
{
    const uz_scene *scene = d->scene;
    const bool box = scene->source == UZ_MESH_BOX, all = strcmp(name, "all") == 0;
    known_names known = {.asked = name};
    for (int i = 0; box && i < 2 * uz_scene_dim(scene); i++)
        offer(&known, SIDES[i].name);
    for (int64_t i = 0; !box && i < scene->given.n_groups; i++)
        offer(&known, scene->given.groups[i].name);
    for (int64_t i = 0; i < scene->n_selections; i++)
        offer(&known, scene->selections[i].name);
    offer(&known, "all");
    offer(&known, "boundary");
    if (known.found && box && use == GROUP_OF_SIDES && all)
        return decode_refuse(d, "not_allowed", value, "is \"all\", every element of the box; name sides of it.");
    if (known.found && box && use == GROUP_OF_ELEMENTS && !all && !is_selected(scene, name))
        return decode_refuse(d, "not_allowed", value,
                             "is of the box's surface, and must be \"all\" or elements by where they are.");
    if (known.found)
        return true;
    const size_t shown = known.count < MOST_SHOWN ? known.count : MOST_SHOWN;
    const int closest = uz_closest(name, strlen(name), known.shown, shown);
    decode_refuse(d, "not_allowed", value, "is \"%s\", which is no group of the mesh; there are", name);
    for (size_t i = 0; i < shown && i < MOST_LISTED; i++)
        problem_add(d->problem, "%s \"%s\"", i ? "," : "", known.shown[i]);
    problem_add(d->problem, known.count > MOST_LISTED ? ", ..." : ".");
    if (closest >= 0)
        problem_add(d->problem, " Did you mean \"%s\"?", known.shown[closest]);
    return false;
}

static bool decode_place(char name[64], decoding *d, const json_value *where)
{
    const uz_scene *scene = d->scene;
    wording words = {.used = 0};
    uz_selection *to = add_selection(d, where);
    if (!to)
        return false;
    describe(&words, to, uz_scene_dim(scene));
    for (int n = 1;; n++) { /* one that says the same is taken, and its name, or the next that is free */
        const uz_selection *there = NULL;
        make_name(to->name, &words, n);
        for (int64_t k = 0; k < scene->n_selections && !there; k++)
            there = strcmp(scene->selections[k].name, to->name) == 0 ? &scene->selections[k] : NULL;
        if (there && !selects_the_same(to, there))
            continue;
        memcpy(name, to->name, sizeof to->name);
        d->scene->n_selections += !there;
        return true;
    }
}

bool decode_group(char name[64], decoding *d, const json_value *value, group_use use)
{
    const bool box = d->scene && d->scene->source == UZ_MESH_BOX;
    const char *text = json_text(value);
    const bool whole = text && strlen(text) == value->count;
    if (json_is(value, JSON_IS_OBJECT))
        return decode_place(name, d, json_get(value, "where"));
    name[0] = '\0';
    if (!value)
        return true;
    for (size_t i = 0; text && box && i < sizeof SIDES / sizeof SIDES[0]; i++)
        if (strcmp(text, SIDES[i].other) == 0)
            text = SIDES[i].name;
    if (whole && strlen(text) < 64)
        memcpy(name, text, strlen(text) + 1);
    if (use != GROUP_OR_CONTACT && !check_name(d, value, name, use))
        return false;
    return !box || strcmp(name, "boundary") != 0 || select_outer_sides(d, name, value); /* other meshes have it */
}
