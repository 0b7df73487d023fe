/* abaqus_deck.c: the lines of a deck of Abaqus or CalculiX that say what is done with its mesh: materials, supports,
 * loads, temperatures and contact pairs of the first step.
 *
 * Nothing is passed over in silence: a keyword is read, or says nothing about the answer, or is replaced by what is
 * meant to be the same, or left out, and each of the last three makes a note with its line.
 * Source: CalculiX CrunchiX user's manual, "Input deck format". */
#include "io/abaqus_deck.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { NOTES_MOST = 5000 };

uz_status deck_note(abaqus_deck *d, int64_t line, const char *keyword, uz_deck_effect effect, const char *format, ...)
{
    uz_deck *out = d->out;
    va_list args;
    if (out->n_notes == NOTES_MOST)
        return abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED, "more than %d lines of the deck have no place in a scene",
                           NOTES_MOST);
    if (!uz_grow(&out->notes, out->n_notes, 1, &d->notes_room, sizeof *out->notes))
        return abaqus_no_memory(&d->text);
    uz_deck_note *note = &out->notes[out->n_notes++];
    *note = (uz_deck_note){.line = line, .effect = effect};
    snprintf(note->keyword, sizeof note->keyword, "*%.30s", keyword);
    va_start(args, format);
    vsnprintf(note->text, sizeof note->text, format, args);
    va_end(args);
    return UZ_OK;
}

/* ---- parts of blocks */

static bool next_data(abaqus_deck *d)
{
    return abaqus_next_line(&d->text) && !abaqus_is_keyword(&d->text);
}

static void skip_data(abaqus_deck *d)
{
    while (next_data(d))
        continue;
}

/* A number, or `otherwise` where the line has no such field. */
static uz_status next_number(double *out, abaqus_deck *d, const char *what, double otherwise)
{
    char field[ABAQUS_FIELD];
    *out = otherwise;
    return abaqus_field(field, &d->text) && field[0] ? abaqus_real(out, field, what, &d->text) : UZ_OK;
}

/* Notes the parameters that are not in the list, which ends with NULL. */
static uz_status check_parameters(abaqus_deck *d, const abaqus_keyword *keyword, const char *const *read)
{
    uz_status status = UZ_OK;
    for (size_t at = strlen(keyword->text) + 1; at < keyword->length && status == UZ_OK;
         at += strlen(keyword->text + at) + 1) {
        const char *field = keyword->text + at;
        bool known = field[0] == '\0' || field[0] == '=';
        for (int i = 0; read[i] && !known; i++) {
            const char *behind = abaqus_behind(field, read[i]);
            known = behind && (*behind == '=' || *behind == '\0');
        }
        if (!known)
            status =
                deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT, "its parameter %.40s is left out", field);
    }
    return status;
}

/* What a line names: nodes by their indices, or elements by theirs in the file. */
typedef struct {
    int64_t count, one;
    const int64_t *index; /* NULL: one */
} targets;

static int64_t target(const targets *t, int64_t i)
{
    return t->index ? t->index[i] : t->one;
}

static uz_status find_targets(targets *out, abaqus_deck *d, abaqus_set_kind kind, const char *field)
{
    const bool nodes = kind == ABAQUS_NSET;
    *out = (targets){.count = 1};
    if (field[0] >= '0' && field[0] <= '9') {
        int64_t tag;
        const uz_status status =
            abaqus_int(&tag, field, nodes ? "the number of a node" : "the number of an element", &d->text);
        if (status != UZ_OK)
            return status;
        out->one = abaqus_tags_find(nodes ? &d->file->nodes : &d->file->elements, tag);
        return out->one >= 0 ? UZ_OK
                             : abaqus_fail(&d->text, UZ_ERR_FORMAT, "%s %lld is not there", nodes ? "node" : "element",
                                           (long long)tag);
    }
    const int64_t set = abaqus_set_find(d->file, kind, field);
    if (set < 0)
        return abaqus_fail(&d->text, UZ_ERR_FORMAT, "there is no set of %s \"%.60s\"", nodes ? "nodes" : "elements",
                           field);
    out->index = d->file->members[set].index;
    out->count = d->file->members[set].count;
    return UZ_OK;
}

/* ---- amplitudes */

static uz_status read_amplitude(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"NAME", "DEFINITION", "TIME", NULL}; /* one step: both times are the same */
    char name[ABAQUS_NAME];
    const char *definition = abaqus_parameter(keyword, "DEFINITION");
    uz_status status = abaqus_name(name, keyword, "NAME", true, &d->text);
    if (status == UZ_OK)
        status = check_parameters(d, keyword, READ);
    if (status == UZ_OK && definition && strcasecmp(definition, "TABULAR") != 0)
        status =
            abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED, "amplitudes are read as tables only, not as %.40s", definition);
    if (status == UZ_OK && !uz_grow(&d->amplitudes, d->n_amplitudes, 1, &d->amplitudes_room, sizeof *d->amplitudes))
        status = abaqus_no_memory(&d->text);
    if (status != UZ_OK)
        return status;
    deck_amplitude *to = &d->amplitudes[d->n_amplitudes++];
    memcpy(to->name, name, sizeof name);
    to->table = d->text;
    skip_data(d);
    return UZ_OK;
}

/* The value of a table of pairs of time and value, linear between them and constant beyond. */
static uz_status amplitude_at(double *out, const abaqus_deck *d, const deck_amplitude *amplitude, double time)
{
    abaqus_text table = amplitude->table;
    char field[2][ABAQUS_FIELD];
    double before[2] = {0, 0}, now[2];
    bool first = true;
    *out = 0.0;
    table.err = d->text.err;
    while (abaqus_next_line(&table) && !abaqus_is_keyword(&table))
        while (abaqus_field(field[0], &table) && abaqus_field(field[1], &table)) {
            uz_status status = abaqus_real(&now[0], field[0], "a time", &table);
            if (status == UZ_OK)
                status = abaqus_real(&now[1], field[1], "a value of the amplitude", &table);
            if (status != UZ_OK)
                return status;
            if (now[0] > time) {
                *out = first ? now[1] : before[1] + (now[1] - before[1]) * (time - before[0]) / (now[0] - before[0]);
                return UZ_OK;
            }
            *out = before[1] = now[1];
            before[0] = now[0];
            first = false;
        }
    return first ? abaqus_fail(&table, UZ_ERR_FORMAT, "the amplitude \"%.60s\" has no pairs of time and value",
                               amplitude->name)
                 : UZ_OK;
}

/* What the values of a block are multiplied by at the end of the step. */
static uz_status block_factor(double *out, abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *name = abaqus_parameter(keyword, "AMPLITUDE");
    *out = 1.0;
    for (int64_t i = d->n_amplitudes - 1; name && i >= 0; i--)
        if (strcasecmp(d->amplitudes[i].name, name) == 0)
            return amplitude_at(out, d, &d->amplitudes[i], d->period);
    return name ? abaqus_fail(&d->text, UZ_ERR_FORMAT, "there is no amplitude \"%.60s\"", name) : UZ_OK;
}

/* Parameters of what acts on nodes and elements: OP=NEW would take back what is said before the step. */
static uz_status begin_acting(double *factor, abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"OP", "AMPLITUDE", "FIXED", NULL};
    const char *op = abaqus_parameter(keyword, "OP");
    uz_status status = check_parameters(d, keyword, READ);
    if (status == UZ_OK && op && strcasecmp(op, "NEW") == 0)
        status = deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT,
                           "OP=NEW is left out: what was said before stays");
    return status == UZ_OK ? block_factor(factor, d, keyword) : status;
}

/* ---- rigid bodies */

/* A node that a parameter names by its number or by a set of one; -1: it does not. */
static uz_status node_parameter(int64_t *node, abaqus_deck *d, const abaqus_keyword *keyword, const char *parameter)
{
    const char *field = abaqus_parameter(keyword, parameter);
    targets at;
    *node = -1;
    if (!field)
        return UZ_OK;
    const uz_status status = find_targets(&at, d, ABAQUS_NSET, field);
    if (status == UZ_OK && at.count != 1)
        return abaqus_fail(&d->text, UZ_ERR_FORMAT, "%s is one node; \"%.60s\" are %lld", parameter, field,
                           (long long)at.count);
    *node = status == UZ_OK ? target(&at, 0) : -1;
    return status;
}

static uz_status add_rigid(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"NSET", "ELSET", "REF NODE", "ROT NODE", NULL};
    const char *nodes = abaqus_parameter(keyword, "NSET"), *elements = abaqus_parameter(keyword, "ELSET");
    deck_rigid made = {.line = keyword->line};
    targets at;
    uz_status status = check_parameters(d, keyword, READ);
    for (int c = 0; c < 6; c++)
        made.motion[c] = (double)NAN;
    if (status == UZ_OK && !nodes == !elements)
        status =
            abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED,
                        "a rigid body is read as an NSET or an ELSET; analytical surfaces are obstacles of a scene");
    if (status == UZ_OK)
        status = find_targets(&at, d, nodes ? ABAQUS_NSET : ABAQUS_ELSET, nodes ? nodes : elements);
    if (status == UZ_OK)
        status = node_parameter(&made.point, d, keyword, "REF NODE");
    if (status == UZ_OK)
        status = node_parameter(&made.turner, d, keyword, "ROT NODE");
    if (status != UZ_OK)
        return status;
    if (!uz_grow(&d->rigids, d->n_rigids, 1, &d->rigids_room, sizeof *d->rigids))
        return abaqus_no_memory(&d->text);
    made.of_nodes = nodes != NULL;
    made.count = at.count;
    made.index = at.index;
    made.one = at.one;
    d->rigids[d->n_rigids++] = made;
    return UZ_OK;
}

/* Which of the six motions of a rigid body a direction of a node is, and of which body; NULL: of none. The nodes of
 * both may be one, of which Abaqus names the rotations 4 to 6. */
static deck_rigid *rigid_motion(int *motion, const abaqus_deck *d, int64_t node, int64_t direction)
{
    for (int64_t i = 0; i < d->n_rigids; i++) {
        deck_rigid *rigid = &d->rigids[i];
        const bool turns = node == rigid->turner && direction <= 3;
        *motion = (int)direction - 1 + (turns ? 3 : 0);
        if (turns || node == rigid->point)
            return rigid;
    }
    return NULL;
}

/* Where a displacement (or a force, where `force`) of a node in a direction from 1 on is kept; NULL: it has no such
 * one. */
static double *place_at(const abaqus_deck *d, bool force, int64_t node, int64_t direction)
{
    const int dim = d->mesh->dim;
    int motion = 0;
    deck_rigid *rigid = direction >= 1 && direction <= 6 ? rigid_motion(&motion, d, node, direction) : NULL;
    if (rigid)
        return motion < dim || motion >= (dim == 2 ? 5 : 3) ? &(force ? rigid->force : rigid->motion)[motion] : NULL;
    return direction >= 1 && direction <= dim ? &(force ? d->force : d->fixed)[3 * node + direction - 1] : NULL;
}

/* ---- materials and sections */

static uz_status add_material(abaqus_deck *d, const abaqus_keyword *keyword)
{
    deck_material *to;
    if (!uz_grow(&d->materials, d->n_materials, 1, &d->materials_room, sizeof *d->materials))
        return abaqus_no_memory(&d->text);
    to = &d->materials[d->n_materials];
    *to = (deck_material){.line = keyword->line};
    const uz_status status = abaqus_name(to->name, keyword, "NAME", true, &d->text);
    d->n_materials += status == UZ_OK;
    return status;
}

/* What may be spoken of before it is there: materials, which sections name, and rigid bodies, whose points are held. */
static uz_status read_ahead(abaqus_deck *d)
{
    const abaqus_text begin = d->text;
    abaqus_keyword keyword;
    uz_status status = UZ_OK;
    while (status == UZ_OK && abaqus_next_line(&d->text)) {
        if (!abaqus_is_keyword(&d->text))
            continue;
        status = abaqus_read_keyword(&keyword, &d->text);
        if (status == UZ_OK && abaqus_keyword_is(&keyword, "MATERIAL"))
            status = add_material(d, &keyword);
        else if (status == UZ_OK && abaqus_keyword_is(&keyword, "RIGID BODY"))
            status = add_rigid(d, &keyword);
    }
    d->text = begin;
    return status;
}

static uz_status read_material(abaqus_deck *d, const abaqus_keyword *keyword)
{
    (void)keyword;
    d->n_met++;
    skip_data(d);
    return UZ_OK;
}

/* The material whose data these are. */
static uz_status current_material(deck_material **out, abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *type = abaqus_parameter(keyword, "TYPE");
    *out = d->n_met > 0 ? &d->materials[d->n_met - 1] : NULL;
    if (!*out)
        return abaqus_fail(&d->text, UZ_ERR_FORMAT, "*%.40s stands before any *MATERIAL", keyword->text);
    if (type && strncasecmp(type, "ISO", 3) != 0)
        return abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED,
                           "*%.40s, TYPE=%.20s is not modelled: materials are isotropic; give the constants of one",
                           keyword->text, type);
    return UZ_OK;
}

/* Up to two numbers of the first line; further lines are for other temperatures. */
static uz_status read_constants(abaqus_deck *d, const abaqus_keyword *keyword, double *first, double *second)
{
    uz_status status = UZ_OK;
    int lines = 0;
    while (status == UZ_OK && next_data(d)) {
        if (++lines == 2)
            status = deck_note(d, d->text.number, keyword->text, UZ_DECK_LEFT_OUT,
                               "what depends on temperature is left out: the first line holds for all");
        if (lines > 1)
            continue;
        status = next_number(first, d, "a constant of the material", 0.0);
        if (status == UZ_OK && second)
            status = next_number(second, d, "a constant of the material", 0.0);
    }
    return status == UZ_OK && lines == 0 ? abaqus_fail(&d->text, UZ_ERR_FORMAT, "*%.40s has no data", keyword->text)
                                         : status;
}

static uz_status read_elastic(abaqus_deck *d, const abaqus_keyword *keyword)
{
    deck_material *to;
    uz_status status = current_material(&to, d, keyword);
    if (status == UZ_OK)
        status = read_constants(d, keyword, &to->young, &to->poisson);
    if (status == UZ_OK)
        to->elastic = true;
    return status;
}

static uz_status read_density(abaqus_deck *d, const abaqus_keyword *keyword)
{
    deck_material *to;
    const uz_status status = current_material(&to, d, keyword);
    return status == UZ_OK ? read_constants(d, keyword, &to->density, NULL) : status;
}

/* The temperature of no strain, ZERO, cancels where the expansion is the same at all temperatures. */
static uz_status read_expansion(abaqus_deck *d, const abaqus_keyword *keyword)
{
    deck_material *to;
    const uz_status status = current_material(&to, d, keyword);
    return status == UZ_OK ? read_constants(d, keyword, &to->expansion, NULL) : status;
}

static uz_status read_section(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS", NULL};
    char name[ABAQUS_NAME], elements[ABAQUS_NAME];
    targets at = {0};
    int64_t material = -1;
    uz_status status = check_parameters(d, keyword, READ);
    if (status == UZ_OK)
        status = abaqus_name(name, keyword, "MATERIAL", true, &d->text);
    if (status == UZ_OK)
        status = abaqus_name(elements, keyword, "ELSET", true, &d->text);
    if (status == UZ_OK)
        status = find_targets(&at, d, ABAQUS_ELSET, elements);
    for (int64_t i = 0; i < d->n_materials && material < 0; i++)
        material = strcasecmp(d->materials[i].name, name) == 0 ? i : -1;
    if (status == UZ_OK && material < 0)
        status = abaqus_fail(&d->text, UZ_ERR_FORMAT, "there is no material \"%.60s\"", name);
    for (int64_t i = 0; i < at.count && status == UZ_OK; i++) {
        const int64_t e = d->new_element[target(&at, i)];
        if (e >= 0)
            d->material[e] = material;
    }
    if (status == UZ_OK && next_data(d)) {
        double thickness;
        status = next_number(&thickness, d, "a thickness", 0.0);
        if (status == UZ_OK && d->mesh->dim == 2 && thickness > 0) {
            if (d->thickness > 0 && d->thickness != thickness)
                status = deck_note(d, d->text.number, keyword->text, UZ_DECK_LEFT_OUT,
                                   "another thickness, %g, is left out: a scene has one", thickness);
            d->thickness = d->thickness > 0 ? d->thickness : thickness;
        }
        skip_data(d);
    }
    return status;
}

/* Which model the elements are of, and how they are integrated. */
static uz_status read_element_types(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const FAMILIES[] = {"CPS", "CPE", "CAX", "C3D"};
    const char *type = abaqus_parameter(keyword, "TYPE");
    uz_status status = UZ_OK;
    for (int m = 0; m < 4 && type; m++)
        if (strncasecmp(type, FAMILIES[m], 3) == 0) {
            const char *digits = type + 3, *suffix = digits + strspn(digits, "0123456789");
            const bool linear = suffix == digits + 1 && digits[0] == (m == UZ_SOLID ? '8' : '4');
            const bool modes = strpbrk(suffix, "iI") != NULL;
            d->models[m] = true;
            d->incompatible = d->incompatible || (linear && modes);
            d->plain_linear = d->plain_linear || (linear && !modes);
            if (strpbrk(suffix, "rR") && !d->reduced) {
                d->reduced = true;
                status = deck_note(d, keyword->line, keyword->text, UZ_DECK_REPLACED,
                                   "%.20s: integration that leaves no deformation without stiffness, in place of a "
                                   "reduced one",
                                   type);
            }
        }
    skip_data(d);
    return status;
}

/* ---- supports */

/* What Abaqus calls some supports: displacements and rotations as bits. */
static int named_support(const char *field)
{
    static const struct {
        const char *name;
        int components;
    } NAMED[] = {{"ENCASTRE", 077}, {"PINNED", 007}, {"XSYMM", 061}, {"YSYMM", 052}, {"ZSYMM", 034}};
    for (size_t i = 0; i < sizeof NAMED / sizeof NAMED[0]; i++)
        if (strcasecmp(NAMED[i].name, field) == 0)
            return NAMED[i].components;
    return 0;
}

static uz_status hold(abaqus_deck *d, const abaqus_keyword *keyword, const targets *at, double factor, bool *told)
{
    char field[ABAQUS_FIELD] = "";
    int64_t first = 0, last;
    double value;
    abaqus_field(field, &d->text);
    const int components = named_support(field);
    if (components == 0) {
        uz_status status = abaqus_int(&first, field, "a direction, 1 to 3", &d->text);
        last = first;
        if (status == UZ_OK && abaqus_field(field, &d->text) && field[0])
            status = abaqus_int(&last, field, "a last direction", &d->text);
        if (status == UZ_OK)
            status = next_number(&value, d, "a displacement", 0.0);
        if (status != UZ_OK)
            return status;
    } else {
        first = 1;
        last = 6;
        value = 0;
    }
    bool whole = last <= 6;
    for (int64_t c = first; c <= last && c <= 6; c++)
        for (int64_t i = 0; i < at->count; i++) {
            double *to = place_at(d, false, target(at, i), c);
            if (c >= 1 && components > 0 && (components >> (c - 1)) % 2 == 0)
                continue;
            if (to)
                *to = factor * value;
            whole = whole && (to || components > 0);
        }
    if (whole || *told)
        return UZ_OK;
    *told = true;
    return deck_note(d, d->text.number, keyword->text, UZ_DECK_IRRELEVANT,
                     "direction %lld is passed over: nodes of this body have %d, and no rotations or temperatures",
                     (long long)last, d->mesh->dim);
}

static uz_status read_boundary(abaqus_deck *d, const abaqus_keyword *keyword)
{
    char field[ABAQUS_FIELD];
    double factor;
    bool told = false;
    targets at;
    uz_status status = begin_acting(&factor, d, keyword);
    while (status == UZ_OK && next_data(d)) {
        abaqus_field(field, &d->text);
        status = find_targets(&at, d, ABAQUS_NSET, field);
        if (status == UZ_OK)
            status = hold(d, keyword, &at, factor, &told);
    }
    return status;
}

/* ---- loads */

static uz_status read_cload(abaqus_deck *d, const abaqus_keyword *keyword)
{
    char field[ABAQUS_FIELD];
    double factor, value;
    int64_t direction;
    targets at;
    uz_status status = begin_acting(&factor, d, keyword);
    while (status == UZ_OK && next_data(d)) {
        abaqus_field(field, &d->text);
        status = find_targets(&at, d, ABAQUS_NSET, field);
        if (status == UZ_OK) {
            field[0] = '\0';
            abaqus_field(field, &d->text);
            status = abaqus_int(&direction, field, "a direction, 1 to 3", &d->text);
        }
        if (status == UZ_OK)
            status = next_number(&value, d, "a force", 0.0);
        bool whole = true;
        for (int64_t i = 0; i < at.count && status == UZ_OK; i++) {
            double *to = place_at(d, true, target(&at, i), direction);
            if (to)
                *to += factor * value;
            whole = whole && to;
        }
        if (status == UZ_OK && !whole && value != 0.0)
            status = deck_note(d, d->text.number, keyword->text, UZ_DECK_LEFT_OUT,
                               "the load in direction %lld is left out: forces have %d components",
                               (long long)direction, d->mesh->dim);
    }
    return status;
}

static uz_status add_pressure(abaqus_deck *d, deck_pressure pressure)
{
    if (!uz_grow(&d->pressures, d->n_pressures, 1, &d->pressures_room, sizeof *d->pressures))
        return abaqus_no_memory(&d->text);
    pressure.line = d->text.number;
    d->pressures[d->n_pressures++] = pressure;
    return UZ_OK;
}

static uz_status press_sides(abaqus_deck *d, const targets *at, int face, double value)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < at->count && status == UZ_OK; i++) {
        const int64_t e = target(at, i);
        if (d->new_element[e] < 0 || !abaqus_side((uz_element_kind)d->file->type[e], face))
            status = abaqus_fail(&d->text, UZ_ERR_FORMAT, "element %lld has no side P%d",
                                 (long long)d->file->elements.tag[e], face);
        else
            status = add_pressure(d, (deck_pressure){.element = e, .face = face, .value = value});
    }
    return status;
}

/* Adds to what acts in the volume of the elements. */
static void pull(const abaqus_deck *d, double *to, const targets *at, const double v[3])
{
    for (int64_t i = 0; i < at->count; i++) {
        const int64_t e = d->new_element[target(at, i)];
        for (int c = 0; c < 3 && e >= 0; c++)
            to[3 * e + c] += v[c];
    }
}

static uz_status read_gravity(abaqus_deck *d, const targets *at, double value)
{
    double direction[3], length = 0;
    uz_status status = UZ_OK;
    for (int c = 0; c < 3 && status == UZ_OK; c++) {
        status = next_number(&direction[c], d, "a direction of gravity", 0.0);
        length += status == UZ_OK ? direction[c] * direction[c] : 0.0;
    }
    if (status == UZ_OK && !(length > 0))
        status = abaqus_fail(&d->text, UZ_ERR_FORMAT, "GRAV needs a size and a direction of three numbers");
    for (int c = 0; c < 3 && status == UZ_OK; c++)
        direction[c] *= value / sqrt(length);
    if (status == UZ_OK)
        pull(d, d->gravity, at, direction);
    return status;
}

static uz_status read_dload(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const BODY[] = {"BX", "BY", "BZ"};
    char field[ABAQUS_FIELD], label[ABAQUS_FIELD];
    double factor, value, v[3];
    targets at;
    uz_status status = begin_acting(&factor, d, keyword);
    while (status == UZ_OK && next_data(d)) {
        int body = -1;
        abaqus_field(field, &d->text);
        label[0] = '\0';
        abaqus_field(label, &d->text);
        for (int c = 0; c < d->mesh->dim; c++)
            body = strcasecmp(label, BODY[c]) == 0 ? c : body;
        const bool side = (label[0] == 'P' || label[0] == 'p') && label[1] >= '1' && label[1] <= '6' && !label[2];
        const bool gravity = strcasecmp(label, "GRAV") == 0;
        if (!side && !gravity && body < 0) {
            status = deck_note(d, d->text.number, keyword->text, UZ_DECK_LEFT_OUT,
                               "the load %.20s is left out; P1 to P6, GRAV, BX, BY and BZ are read", label);
            continue;
        }
        status = find_targets(&at, d, ABAQUS_ELSET, field);
        if (status == UZ_OK)
            status = next_number(&value, d, "a load", 0.0);
        if (status == UZ_OK && gravity)
            status = read_gravity(d, &at, factor * value);
        else if (status == UZ_OK && side)
            status = press_sides(d, &at, label[1] - '0', factor * value);
        for (int c = 0; c < 3; c++)
            v[c] = c == body ? factor * value : 0.0;
        if (status == UZ_OK && body >= 0)
            pull(d, d->body_force, &at, v);
    }
    return status;
}

static uz_status read_dsload(abaqus_deck *d, const abaqus_keyword *keyword)
{
    char field[ABAQUS_FIELD], label[ABAQUS_FIELD];
    double factor;
    uz_status status = begin_acting(&factor, d, keyword);
    while (status == UZ_OK && next_data(d)) {
        deck_pressure pressure = {.element = -1};
        abaqus_field(field, &d->text);
        label[0] = '\0';
        abaqus_field(label, &d->text);
        if (strcasecmp(label, "P") != 0) {
            status = deck_note(d, d->text.number, keyword->text, UZ_DECK_LEFT_OUT,
                               "the load %.20s is left out; P, a pressure, is read", label);
            continue;
        }
        snprintf(pressure.surface, sizeof pressure.surface, "%.63s", field);
        status = next_number(&pressure.value, d, "a pressure", 0.0);
        pressure.value *= factor;
        if (status == UZ_OK)
            status = add_pressure(d, pressure);
    }
    return status;
}

static uz_status read_temperatures(abaqus_deck *d, double *to, double factor)
{
    char field[ABAQUS_FIELD];
    double value;
    targets at;
    uz_status status = UZ_OK;
    while (status == UZ_OK && next_data(d)) {
        abaqus_field(field, &d->text);
        status = find_targets(&at, d, ABAQUS_NSET, field);
        if (status == UZ_OK)
            status = next_number(&value, d, "a temperature", 0.0);
        for (int64_t i = 0; i < at.count && status == UZ_OK; i++)
            to[target(&at, i)] = factor * value;
    }
    return status;
}

static uz_status read_temperature(abaqus_deck *d, const abaqus_keyword *keyword)
{
    double factor;
    const uz_status status = begin_acting(&factor, d, keyword);
    return status == UZ_OK ? read_temperatures(d, d->temperature, factor) : status;
}

static uz_status read_initial(abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *type = abaqus_parameter(keyword, "TYPE");
    if (type && strcasecmp(type, "TEMPERATURE") == 0)
        return read_temperatures(d, d->initial, 1.0);
    const bool moves = type && (strcasecmp(type, "VELOCITY") == 0 || strcasecmp(type, "DISPLACEMENT") == 0);
    skip_data(d);
    return deck_note(d, keyword->line, keyword->text, moves ? UZ_DECK_IRRELEVANT : UZ_DECK_LEFT_OUT,
                     "initial values of type %.40s are left out; TEMPERATURE is read", type ? type : "(none)");
}

/* ---- contact */

/* Lines of two surfaces, in contact or tied. */
static uz_status read_surfaces(abaqus_deck *d, const char *interaction, bool tie, double tolerance)
{
    uz_status status = UZ_OK;
    while (status == UZ_OK && next_data(d)) {
        char name[2][ABAQUS_FIELD] = {"", ""};
        abaqus_field(name[0], &d->text);
        if (!abaqus_field(name[1], &d->text) || !name[1][0])
            memcpy(name[1], name[0], sizeof name[0]); /* it may touch itself */
        if (strlen(name[0]) >= ABAQUS_NAME || strlen(name[1]) >= ABAQUS_NAME || !name[0][0])
            return abaqus_fail(&d->text, UZ_ERR_FORMAT, "two names of surfaces were expected");
        if (!uz_grow(&d->pairs, d->n_pairs, 1, &d->pairs_room, sizeof *d->pairs))
            return abaqus_no_memory(&d->text);
        deck_pair *to = &d->pairs[d->n_pairs++];
        *to = (deck_pair){.line = d->text.number, .tie = tie, .tolerance = tolerance};
        snprintf(to->interaction, sizeof to->interaction, "%s", interaction ? interaction : "");
        memcpy(to->slave, name[0], strlen(name[0]));
        memcpy(to->master, name[1], strlen(name[1]));
    }
    return status;
}

static uz_status read_pair(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"INTERACTION", "TYPE", "SMALL SLIDING", NULL};
    const uz_status status = check_parameters(d, keyword, READ);
    return status == UZ_OK ? read_surfaces(d, abaqus_parameter(keyword, "INTERACTION"), false, 0.0) : status;
}

/* Nodes that it would move to the other surface stay where they are. */
static uz_status read_tie(abaqus_deck *d, const abaqus_keyword *keyword)
{
    static const char *const READ[] = {"NAME", "POSITION TOLERANCE", "ADJUST", NULL};
    const char *given = abaqus_parameter(keyword, "POSITION TOLERANCE");
    double tolerance = 0.0;
    uz_status status = check_parameters(d, keyword, READ);
    if (status == UZ_OK && given)
        status = abaqus_real(&tolerance, given, "a tolerance", &d->text);
    return status == UZ_OK ? read_surfaces(d, NULL, true, tolerance) : status;
}

bool deck_is_tied(const abaqus_deck *d, const char *interaction)
{
    bool tied = false;
    for (int64_t i = 0; i < d->n_tied; i++)
        tied = tied || strcasecmp(d->tied[i].name, interaction) == 0;
    return tied;
}

static uz_status read_interaction(abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *name = abaqus_parameter(keyword, "NAME");
    snprintf(d->interaction, sizeof d->interaction, "%s", name ? name : "");
    skip_data(d);
    return UZ_OK;
}

/* What holds tied surfaces together: across them, and (behind the coefficient of friction) along them. */
static uz_status read_tied_spring(abaqus_deck *d, const abaqus_keyword *keyword)
{
    double stiffness;
    const uz_status status = next_number(&stiffness, d, "the stiffness of a tie", 0.0);
    if (status != UZ_OK)
        return status;
    skip_data(d);
    if (!uz_grow(&d->springs, d->n_springs, 1, &d->springs_room, sizeof *d->springs))
        return abaqus_no_memory(&d->text);
    d->springs[d->n_springs++] = (deck_spring){.line = keyword->line, .stiffness = stiffness, .tie = true};
    return UZ_OK;
}

/* The springs of CalculiX: p = K d; p = p0 exp(d ln 100 / c0), whose slope at d = 0 is p0 ln 100 / c0. */
static uz_status read_behavior(abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *kind = abaqus_parameter(keyword, "PRESSURE-OVERCLOSURE");
    const bool linear = kind && strcasecmp(kind, "LINEAR") == 0;
    double first = 0.0, second = 0.0;
    if (linear || (kind && strcasecmp(kind, "EXPONENTIAL") == 0)) {
        if (!next_data(d))
            return abaqus_fail(&d->text, UZ_ERR_FORMAT, "the stiffness of %.20s was expected", kind);
        uz_status status = next_number(&first, d, "what a spring between surfaces is made of", 0.0);
        if (status == UZ_OK)
            status = next_number(&second, d, "what a spring between surfaces is made of", 0.0);
        if (status != UZ_OK)
            return status;
        skip_data(d);
        if (!uz_grow(&d->springs, d->n_springs, 1, &d->springs_room, sizeof *d->springs))
            return abaqus_no_memory(&d->text);
        d->springs[d->n_springs++] =
            (deck_spring){.line = keyword->line, .stiffness = linear ? first : second * log(100.0) / first};
        return UZ_OK;
    }
    if (kind && strcasecmp(kind, "TIED") == 0) {
        if (!uz_grow(&d->tied, d->n_tied, 1, &d->tied_room, sizeof *d->tied))
            return abaqus_no_memory(&d->text);
        memcpy(d->tied[d->n_tied++].name, d->interaction, sizeof d->interaction);
        return next_data(d) ? read_tied_spring(d, keyword) : UZ_OK;
    }
    skip_data(d);
    if (!kind || strcasecmp(kind, "HARD") == 0)
        return UZ_OK;
    return deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT,
                     "%.20s: hard contact, without overclosure, in place of a spring between the surfaces", kind);
}

static uz_status read_friction(abaqus_deck *d, const abaqus_keyword *keyword)
{
    double coefficient = 0.0;
    uz_status status = UZ_OK;
    if (next_data(d)) {
        status = next_number(&coefficient, d, "a coefficient of friction", 0.0);
        if (status == UZ_OK && deck_is_tied(d, d->interaction)) /* which do not slide whatever it is */
            return read_tied_spring(d, keyword);
        skip_data(d);
    }
    return status == UZ_OK && coefficient > 0.0
               ? deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT,
                           "the coefficient %g is left out: contact is frictionless", coefficient)
               : status;
}

/* ---- steps */

static uz_status read_step(abaqus_deck *d, const abaqus_keyword *keyword)
{
    const char *large = abaqus_parameter(keyword, "NLGEOM");
    uz_status status = UZ_OK;
    if (++d->steps > 1) {
        d->ended = true;
        return deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT,
                         "the second step is left out, and all behind it: a scene is one static step");
    }
    skip_data(d);
    if (large && strcasecmp(large, "NO") != 0)
        status = deck_note(d, keyword->line, keyword->text, UZ_DECK_REPLACED,
                           "NLGEOM: strains and rotations are taken to be small, which the summary warns of where they "
                           "are not; contact follows what moves");
    if (status == UZ_OK && abaqus_parameter(keyword, "PERTURBATION"))
        status = deck_note(d, keyword->line, keyword->text, UZ_DECK_LEFT_OUT,
                           "PERTURBATION is left out: contact may open and close");
    return status;
}

static uz_status read_static(abaqus_deck *d, const abaqus_keyword *keyword)
{
    double first;
    uz_status status = UZ_OK;
    (void)keyword;
    d->is_static = true;
    if (next_data(d)) {
        status = next_number(&first, d, "a time", 1.0);
        if (status == UZ_OK)
            status = next_number(&d->period, d, "the time of the step", 1.0);
        skip_data(d);
    }
    return status;
}

/* What a step may be beside a static one. */
static bool is_procedure(const abaqus_keyword *keyword)
{
    static const char *const PROCEDURES[] = {"DYNAMIC",       "FREQUENCY",     "HEAT TRANSFER",       "BUCKLE",
                                             "MODAL DYNAMIC", "STEADY STATE",  "COUPLED TEMPERATURE", "UNCOUPLED",
                                             "ELECTROMAG",    "SUBSTRUCTURE",  "COMPLEX FREQUENCY",   "GREEN",
                                             "VISCO",         "SENSITIVITY",   "FEASIBLE DIRECTION",  "CFD",
                                             "CRACK",         "ROBUST DESIGN", "ROBUSTDESIGN",        "MASSLESS"};
    for (size_t i = 0; i < sizeof PROCEDURES / sizeof PROCEDURES[0]; i++)
        if (abaqus_behind(keyword->text, PROCEDURES[i]))
            return true;
    return false;
}

/* ---- the table of keywords */

static const struct {
    const char *name;
    uz_status (*read)(abaqus_deck *d, const abaqus_keyword *keyword);
    const char *text; /* without it: what is told of one that is left out */
} KEYWORDS[] = {
    {"AMPLITUDE", read_amplitude, NULL},
    {"MATERIAL", read_material, NULL},
    {"ELASTIC", read_elastic, NULL},
    {"DENSITY", read_density, NULL},
    {"EXPANSION", read_expansion, NULL},
    {"SOLID SECTION", read_section, NULL},
    {"ELEMENT", read_element_types, NULL},
    {"BOUNDARY", read_boundary, NULL},
    {"CLOAD", read_cload, NULL},
    {"DLOAD", read_dload, NULL},
    {"DSLOAD", read_dsload, NULL},
    {"TEMPERATURE", read_temperature, NULL},
    {"INITIAL CONDITIONS", read_initial, NULL},
    {"CONTACT PAIR", read_pair, NULL},
    {"TIE", read_tie, NULL},
    {"SURFACE INTERACTION", read_interaction, NULL},
    {"SURFACE BEHAVIOR", read_behavior, NULL},
    {"FRICTION", read_friction, NULL},
    {"STEP", read_step, NULL},
    {"STATIC", read_static, NULL},
    {"SHELL SECTION", NULL, "shells are not modelled, and are left out; their stiffness is not in the answer"},
    {"BEAM SECTION", NULL, "beams are not modelled, and are left out; their stiffness is not in the answer"},
    {"MEMBRANE SECTION", NULL, "membranes are not modelled, and are left out; their stiffness is not in the answer"},
    {"EQUATION", NULL, "equations between displacements are left out"},
    {"MPC", NULL, "constraints between displacements are left out"},
    {"TRANSFORM", NULL, "directions of nodes along other axes are left out: they are those of the file"},
    {"CYCLIC SYMMETRY MODEL", NULL, "cyclic symmetry is left out; give the whole ring, or hold planes of symmetry"},
    {"PRE-TENSION SECTION", NULL, "the pretension is left out"},
    {"MODEL CHANGE", NULL, "contact pairs and elements are not taken away or added"},
};
enum { N_KEYWORDS = sizeof KEYWORDS / sizeof KEYWORDS[0] };

/* Parts of the mesh, what is read ahead, and brackets: nothing is to be told. */
static const char *const SILENT[] = {"NODE",         "NSET",     "ELSET",       "SURFACE",  "RIGID BODY",
                                     "HEADING",      "END STEP", "PART",        "END PART", "ASSEMBLY",
                                     "END ASSEMBLY", "INSTANCE", "END INSTANCE"};

/* They say nothing about the answer. */
static const char *const IRRELEVANT[] = {
    "NODE PRINT",      "NODE FILE",    "NODE OUTPUT",       "EL PRINT",     "EL FILE",       "ELEMENT OUTPUT",
    "CONTACT PRINT",   "CONTACT FILE", "CONTACT OUTPUT",    "FACE PRINT",   "SECTION PRINT", "OUTPUT",
    "FILE FORMAT",     "FILTER",       "PREPRINT",          "MONITOR",      "PRINT",         "RESTART",
    "CONTROLS",        "TIME POINTS",  "ORIENTATION",       "CONDUCTIVITY", "SPECIFIC HEAT", "GAP CONDUCTANCE",
    "CONTACT DAMPING", "DAMPING",      "PHYSICAL CONSTANTS"};

#define IS_AMONG(keyword, list) is_among(keyword, list, sizeof(list) / sizeof(list)[0])
static bool is_among(const abaqus_keyword *keyword, const char *const *list, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (abaqus_keyword_is(keyword, list[i]))
            return true;
    return false;
}

static uz_status read_block(abaqus_deck *d)
{
    abaqus_keyword keyword;
    uz_status status = abaqus_read_keyword(&keyword, &d->text);
    int at = 0;
    if (status != UZ_OK)
        return status;
    while (at < N_KEYWORDS && !abaqus_keyword_is(&keyword, KEYWORDS[at].name))
        at++;
    if (at < N_KEYWORDS && KEYWORDS[at].read)
        return KEYWORDS[at].read(d, &keyword);
    const bool silent = IS_AMONG(&keyword, SILENT), irrelevant = IS_AMONG(&keyword, IRRELEVANT);
    if (at == N_KEYWORDS && !silent && !irrelevant && is_procedure(&keyword))
        return abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED, "the first step is *%.40s; a scene is a *STATIC one",
                           keyword.text);
    skip_data(d);
    if (silent)
        return UZ_OK;
    if (irrelevant)
        return deck_note(d, keyword.line, keyword.text, UZ_DECK_IRRELEVANT,
                         "it says nothing about the answer of a static step");
    return deck_note(d, keyword.line, keyword.text, UZ_DECK_LEFT_OUT, "%s",
                     at < N_KEYWORDS ? KEYWORDS[at].text : "a scene has no word for it, and it is left out");
}

uz_status deck_read_lines(abaqus_deck *d)
{
    uz_status status = read_ahead(d);
    abaqus_next_line(&d->text);
    while (status == UZ_OK && !d->ended && d->text.length > 0)
        status = read_block(d);
    if (status == UZ_OK && !d->is_static)
        status =
            abaqus_fail(&d->text, UZ_ERR_UNSUPPORTED,
                        "there is no *STEP with *STATIC in it: the deck says what the body is, and not what is done "
                        "with it");
    return status;
}
