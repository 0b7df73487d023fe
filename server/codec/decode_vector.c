/* decode_vector.c: numbers of a request, however they are written. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A matrix that can be solved has an entry of at least six bytes of text for each unknown, so no honest request comes
 * near this; a size line alone must not fill the machine. */
size_t decode_memory_bound(size_t body_len)
{
    return ((size_t)64 << 20) + 32 * body_len;
}

const char *decode_text(const json_doc *doc, const json_t *value, size_t *len)
{
    const json_lifted *lifted = json_doc_lifted(doc, value);
    *len = lifted ? lifted->len : json_string_length(value);
    return lifted ? lifted->text : json_string_value(value);
}

void decode_text_done(const json_doc *doc, const json_t *value)
{
    json_lifted *lifted = json_doc_lifted(doc, value);
    if (!lifted)
        return;
    free(lifted->text);
    lifted->text = NULL;
    lifted->len = 0;
}

bool decode_no_memory(problem_details *problem)
{
    problem_set(problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return false;
}

static bool copy_numbers(double **out, int64_t *n, const json_t *array, problem_details *problem)
{
    size_t count = json_array_size(array);
    *out = room_for(count, sizeof **out);
    if (!*out)
        return decode_no_memory(problem);
    for (size_t i = 0; i < count; i++)
        (*out)[i] = json_real_value(json_array_get(array, i));
    *n = (int64_t)count;
    return true;
}

bool decode_vector(double **out, int64_t *n, json_doc *doc, const json_t *value, size_t bound, const char *where,
                   problem_details *problem)
{
    uz_error err = {.status = UZ_OK};
    json_lifted *lifted = json_doc_lifted(doc, value);
    decode_source text;
    if (lifted && !lifted->is_text) {
        *out = lifted->numbers;
        *n = lifted->count;
        lifted->numbers = NULL;
        return true;
    }
    if (json_is_array(value))
        return copy_numbers(out, n, value, problem);
    if (!decode_source_open(&text, doc, value, where, problem))
        return false;
    bool good = uz_mm_read_vector(out, n, text.data, text.len, bound + 32 * text.len, &err) == UZ_OK;
    decode_source_close(&text, doc, value);
    if (good)
        return true;
    snprintf(err.where, sizeof err.where, "%s", where);
    codec_problem_from_error(problem, &err, UZ_PROBLEM_MATRICES);
    return false;
}

/* ---- points */

static bool refuse_mixture(size_t i, const char *where, problem_details *problem)
{
    problem_set(problem, 422, "wrong_type", NULL,
                "%s/%zu is not what the items before it are: give numbers, or points of the same size.", where, i);
    snprintf(problem->pointer, sizeof problem->pointer, "%s/%zu", where, i);
    return false;
}

/* Numbers in each item: 0 where the items are numbers. */
static size_t item_size(const json_t *item)
{
    return json_is_array(item) ? json_array_size(item) : 0;
}

static bool copy_points(double **out, int64_t *n, int *columns, const json_t *array, const char *where,
                        problem_details *problem)
{
    size_t count = json_array_size(array), size = item_size(json_array_get(array, 0));
    *out = room_for(count, size * sizeof **out);
    if (!*out)
        return decode_no_memory(problem);
    for (size_t i = 0; i < count; i++) {
        const json_t *point = json_array_get(array, i);
        if (item_size(point) != size)
            return refuse_mixture(i, where, problem);
        for (size_t j = 0; j < size; j++)
            (*out)[i * size + j] = json_real_value(json_array_get(point, j));
    }
    *n = (int64_t)(count * size);
    *columns = (int)size;
    return true;
}

bool decode_points(double **out, int64_t *n, int *columns, json_doc *doc, const json_t *value, size_t bound,
                   const char *where, problem_details *problem)
{
    json_lifted *lifted = json_doc_lifted(doc, value);
    size_t i;
    json_t *item;
    *columns = 0;
    if (lifted && lifted->columns > 0) {
        *out = lifted->numbers;
        *n = lifted->count * lifted->columns;
        *columns = (int)lifted->columns;
        lifted->numbers = NULL;
        return true;
    }
    if (item_size(json_array_get(value, 0)) > 0)
        return copy_points(out, n, columns, value, where, problem);
    json_array_foreach(value, i, item)
    {
        if (!json_is_real(item))
            return refuse_mixture(i, where, problem);
    }
    return decode_vector(out, n, doc, value, bound, where, problem);
}
