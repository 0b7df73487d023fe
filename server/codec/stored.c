/* stored.c: what this service wrote itself, read back: summaries and errors of jobs. */
#include "codec/codec.h"
#include "codec/json.h"
#include "codec/quantity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* False: no memory. */
static bool read_own(json_tree *tree, const char *json)
{
    problem_details problem;
    return json_scan(tree, json, strlen(json), &problem);
}

bool codec_decode_problem(problem_details *out, const char *json)
{
    json_tree tree;
    memset(out, 0, sizeof *out);
    if (!read_own(&tree, json))
        return false;
    const json_value *object = tree.root;
    const bool good = json_is(object, JSON_IS_OBJECT);
    out->status = (int)json_number(json_get(object, "status"), 0);
    out->line = (int64_t)json_number(json_get(object, "line"), 0);
    const struct {
        const char *key;
        char *out;
        size_t size;
    } TEXTS[] = {{"code", out->code, sizeof out->code},
                 {"title", out->title, sizeof out->title},
                 {"detail", out->detail, sizeof out->detail},
                 {"pointer", out->pointer, sizeof out->pointer}};
    for (size_t i = 0; i < sizeof TEXTS / sizeof TEXTS[0]; i++) {
        const char *text = json_text_of(object, TEXTS[i].key);
        snprintf(TEXTS[i].out, TEXTS[i].size, "%s", text ? text : "");
    }
    json_clear(&tree);
    return good;
}

struct codec_summary {
    json_tree tree;
};

codec_summary *codec_summary_read(const char *json)
{
    codec_summary *summary = calloc(1, sizeof *summary);
    if (summary && read_own(&summary->tree, json))
        return summary;
    free(summary);
    return NULL;
}

void codec_summary_free(codec_summary *summary)
{
    if (summary)
        json_clear(&summary->tree);
    free(summary);
}

bool codec_summary_number(double *value, const codec_summary *summary, const char *name)
{
    return quantity_read(value, summary->tree.root, name);
}

const char *codec_summary_outcome(const codec_summary *summary)
{
    const char *outcome = json_text_of(summary->tree.root, "outcome");
    return outcome ? outcome : "";
}

bool codec_read_trade(codec_trade *out, const char *summary)
{
    json_tree tree;
    if (!read_own(&tree, summary))
        return false;
    const json_value *root = tree.root;
    out->mesh_error = json_number(json_get(root, "discretization_error"), (double)NAN);
    out->solver_error = json_number(json_get(json_get(root, "certificate"), "relative_error"), (double)NAN);
    out->is_scene = json_text_is(json_get(json_get(root, "problem"), "kind"), "scene");
    out->has_answer = !json_text_is(json_get(root, "outcome"), "infeasible");
    json_clear(&tree);
    return true;
}

void codec_read_method(char *method, char *op, size_t size, const char *summary)
{
    json_tree tree; /* left empty where there is no memory */
    read_own(&tree, summary);
    const char *of_method = json_text_of(tree.root, "method"), *of_op = json_text_of(tree.root, "operator");
    snprintf(method, size, "%s", of_method ? of_method : "");
    snprintf(op, size, "%s", of_op ? of_op : "");
    json_clear(&tree);
}
