/* deck.c: a deck of Abaqus or CalculiX as a request: POST /v1/decks. In: schemas/deck.json, read by the solver's one
 * reader of the format. Out: schemas/translation.json, whose request is one as any other, with the mesh in numbers. */
#include "codec/decode.h"
#include "codec/room.h"
#include "codec/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool codec_decode_deck(codec_deck *out, const char *body, size_t len, store *uploads, problem_details *problem)
{
    json_tree tree;
    decoding d = {.store = uploads, .bound = (size_t)64 << 20, .problem = problem};
    uz_error err = {.status = UZ_OK};
    decode_source file;
    memset(out, 0, sizeof *out);
    if (!json_scan(&tree, body, len, problem))
        return false;
    const json_value *source = json_get(tree.root, "abaqus");
    bool good =
        schemas_check(decode_schemas(), "deck.json", tree.root, problem) && decode_source_open(&file, &d, source);
    if (good) {
        good = uz_deck_read(&out->deck, file.data, file.len, d.bound + 32 * file.len,
                            json_truth(json_get(tree.root, "leave_out")), &err) == UZ_OK;
        decode_source_close(&file);
        strcpy(err.where, "/mesh/abaqus"); /* whose codes of errors are those of a deck */
        if (!good) {
            codec_problem_from_error(problem, &err, UZ_PROBLEM_SCENE);
            json_pointer(problem->pointer, sizeof problem->pointer, source);
        }
    }
    if (d.n_uploads > 0)
        memcpy(out->upload, d.uploads[0], sizeof out->upload);
    free(d.uploads);
    json_clear(&tree);
    return good;
}

void codec_deck_clear(codec_deck *deck)
{
    uz_deck_clear(&deck->deck);
}

/* ---- the mesh */

static void put_name(text *t, const char *name)
{
    text_string(t, NULL, name);
    text_put(t, ":");
}

/* Elements are numbered kind by kind in a request: number (elements) is where each comes to be. */
static void put_elements(text *t, const uz_given_mesh *mesh, int64_t *number)
{
    int64_t next = 0;
    text_open(t, "elements", '{');
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const int64_t before = next;
        for (int64_t e = 0; e < mesh->n_elements; e++) {
            if (mesh->kind[e] != k)
                continue;
            if (next == before)
                text_open(t, uz_element_name((uz_element_kind)k), '[');
            number[e] = next++;
            text_integers(t, NULL, mesh->node + mesh->first[e], mesh->first[e + 1] - mesh->first[e]);
        }
        if (next > before)
            text_close(t, ']');
    }
    text_close(t, '}');
}

static void put_groups(text *t, const uz_given_mesh *mesh, const int64_t *number)
{
    text_open(t, "groups", '{');
    for (int64_t g = 0; g < mesh->n_groups; g++) {
        const uz_given_group *group = &mesh->groups[g];
        put_name(t, group->name);
        text_open(t, NULL, '{');
        if (group->n_nodes > 0)
            text_integers(t, "nodes", group->node, group->n_nodes);
        if (group->n_faces > 0) {
            text_open(t, mesh->dim == 2 ? "edges" : "faces", '[');
            for (int64_t i = 0; i < group->n_faces; i++)
                text_integers(t, NULL, group->face_node + group->face_first[i],
                              group->face_first[i + 1] - group->face_first[i]);
            text_close(t, ']');
        }
        if (group->n_elements > 0) {
            text_open(t, "elements", '[');
            for (int64_t i = 0; i < group->n_elements; i++)
                text_integer(t, NULL, number[group->element[i]]);
            text_close(t, ']');
        }
        text_close(t, '}');
    }
    text_close(t, '}');
}

static void put_mesh(text *t, const uz_given_mesh *mesh)
{
    int64_t *number = room_for((size_t)mesh->n_elements, sizeof *number);
    t->failed = t->failed || !number;
    text_open(t, "mesh", '{');
    text_open(t, "nodes", '[');
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        text_numbers(t, NULL, mesh->xyz + i * mesh->dim, mesh->dim);
    text_close(t, ']');
    if (number) {
        put_elements(t, mesh, number);
        put_groups(t, mesh, number);
    }
    text_close(t, '}');
    free(number);
}

/* ---- what is done with it */

static void put_materials(text *t, const uz_scene *scene)
{
    text_open(t, "materials", '[');
    for (int64_t i = 0; i < scene->n_materials; i++) {
        const uz_material *m = &scene->materials[i];
        text_open(t, NULL, '{');
        text_string(t, "on", m->on);
        text_number(t, "young", m->young);
        text_number(t, "poisson", m->poisson);
        if (m->density > 0.0 || m->density < 0.0)
            text_number(t, "density", m->density);
        if (m->expansion > 0.0 || m->expansion < 0.0)
            text_number(t, "expansion", m->expansion);
        text_close(t, '}');
    }
    text_close(t, ']');
}

static void put_supports(text *t, const uz_scene *scene)
{
    static const char *const COMPONENTS[] = {"ux", "uy", "uz"}, *const TURNS[] = {"rx", "ry", "rz"};
    const int dim = uz_scene_dim(scene);
    text_open(t, "supports", '[');
    for (int64_t i = 0; i < scene->n_supports; i++) {
        const uz_support *support = &scene->supports[i];
        const bool rigid = support->kind == UZ_SUPPORT_RIGID; /* others have components, in a deck */
        text_open(t, NULL, '{');
        text_string(t, "on", support->on);
        if (rigid) {
            text_open(t, "rigid", '{');
            text_numbers(t, "point", support->about, dim);
        }
        for (int c = 0; c < dim; c++)
            if (!isnan(support->u[c]))
                text_number(t, COMPONENTS[c], support->u[c]);
        for (int c = 0; rigid && c < 3; c++)
            if (!isnan(support->turn[c]))
                text_number(t, TURNS[c], support->turn[c] * (180 / 3.14159265358979323846));
        if (rigid)
            text_close(t, '}');
        text_close(t, '}');
    }
    text_close(t, ']');
}

static void put_loads(text *t, const uz_scene *scene)
{
    static const char *const NAMES[UZ_LOAD_KINDS] = {[UZ_LOAD_PRESSURE] = "pressure",
                                                     [UZ_LOAD_FORCE] = "force",
                                                     [UZ_LOAD_BODY_FORCE] = "body_force",
                                                     [UZ_LOAD_GRAVITY] = "gravity",
                                                     [UZ_LOAD_TEMPERATURE] = "temperature"}; /* others are in no deck */
    const int dim = uz_scene_dim(scene);
    text_open(t, "loads", '[');
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const uz_load *load = &scene->loads[i];
        text_open(t, NULL, '{');
        text_string(t, "on", load->on);
        if (load->kind == UZ_LOAD_PRESSURE || load->kind == UZ_LOAD_TEMPERATURE)
            text_number(t, NAMES[load->kind], load->value);
        else
            text_numbers(t, NAMES[load->kind], load->v, dim);
        if (load->has_point) {
            text_numbers(t, "at", load->point, dim);
            text_numbers(t, "moment", load->moment + (dim == 2 ? 2 : 0), dim == 2 ? 1 : 3);
        }
        text_close(t, '}');
    }
    text_close(t, ']');
}

/* A contact or a tie of two groups. */
static void put_pair(text *t, const char *on, const char *other_key, const char *other, double tolerance)
{
    text_open(t, NULL, '{');
    text_string(t, "on", on);
    text_string(t, other_key, other);
    if (tolerance > 0.0)
        text_number(t, "tolerance", tolerance);
    text_close(t, '}');
}

static void put_pairs(text *t, const uz_scene *scene)
{
    if (scene->n_ties > 0) {
        text_open(t, "ties", '[');
        for (int64_t i = 0; i < scene->n_ties; i++)
            put_pair(t, scene->ties[i].on, "to", scene->ties[i].to, scene->ties[i].tolerance);
        text_close(t, ']');
    }
    text_open(t, "contacts", '[');
    for (int64_t i = 0; i < scene->n_contacts; i++)
        put_pair(t, scene->contacts[i].on, "with", scene->contacts[i].with, 0.0);
    text_close(t, ']');
}

static void put_scene(text *t, const uz_scene *scene)
{
    static const char *const MODELS[] = {"plane_stress", "plane_strain", "axisymmetric", "solid"};
    static const char *const FORMULATIONS[UZ_FORMULATIONS] = {"auto", "standard", "bbar", "incompatible_modes"};
    text_open(t, "problem", '{');
    text_string(t, "kind", "scene");
    text_string(t, "model", MODELS[scene->model]);
    if (scene->model == UZ_PLANE_STRESS || scene->model == UZ_PLANE_STRAIN)
        text_number(t, "thickness", scene->thickness);
    if (scene->formulation != UZ_FORMULATION_AUTO)
        text_string(t, "formulation", FORMULATIONS[scene->formulation]);
    put_materials(t, scene);
    put_supports(t, scene);
    put_loads(t, scene);
    put_pairs(t, scene);
    put_mesh(t, &scene->given); /* last: whoever reads it sees the rest first */
    text_close(t, '}');
}

char *codec_encode_deck(const codec_deck *deck)
{
    static const char *const EFFECTS[] = {"irrelevant", "replaced", "left_out"};
    text t = {0};
    text_open(&t, NULL, '{');
    text_open(&t, "notes", '[');
    for (int64_t i = 0; i < deck->deck.n_notes; i++) {
        const uz_deck_note *note = &deck->deck.notes[i];
        text_open(&t, NULL, '{');
        text_integer(&t, "line", note->line);
        text_string(&t, "keyword", note->keyword);
        text_string(&t, "effect", EFFECTS[note->effect]);
        text_string(&t, "text", note->text);
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_integers(&t, "node_numbers", deck->deck.node_number, deck->deck.scene.given.n_nodes);
    text_open(&t, "request", '{');
    put_scene(&t, &deck->deck.scene);
    text_close(&t, '}');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}
