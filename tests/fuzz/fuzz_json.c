/* The scanner against an independent parser: what one takes as JSON, so does the other. */
#include "codec/json.h"

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void expect(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_json: %s\n", what);
    abort();
}

/* jansson, told to be as strict. Two of its ways are kept away from it: it takes some NUL bytes, and it refuses a key
 * with an escaped one. */
static bool jansson_takes(const char *text, size_t size)
{
    json_error_t error;
    json_t *value = json_loadb(text, size, JSON_DECODE_ANY | JSON_ALLOW_NUL | JSON_DECODE_INT_AS_REAL, &error);
    json_decref(value);
    return value != NULL;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    json_tree doc;
    problem_details problem;
    const char *text = (const char *)data;
    bool good = json_scan(&doc, text, size, &problem);
    bool no_json = strcmp(problem.code, "json_syntax") == 0;
    expect(good == (problem.status == 0), "a verdict without a status");
    expect(good || (problem.code[0] && problem.detail[0] && !doc.root), "a refusal that says nothing");
    json_clear(&doc);
    if (memchr(text, '\0', size))
        expect(no_json || strcmp(problem.code, "json_depth") == 0, "a NUL byte was taken");
    else if (good && !memmem(text, size, "\\u0000", 6))
        expect(jansson_takes(text, size), "taken, but jansson refuses it");
    else if (no_json)
        expect(!jansson_takes(text, size), "refused, but jansson takes it");
    return 0;
}
