/* decode_pieces.c: names, numbers, vectors and texts of a request, however they are written. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"
#include "text/utf8.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool decode_refuse(decoding *d, const char *code, const json_value *at, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    problem_set(d->problem, 422, code, at, "%s", "");
    problem_add(d->problem, "%s %s", d->problem->pointer, text);
    return false;
}

bool decode_refuse_file(decoding *d, const uz_error *err, const json_value *at)
{
    codec_problem_from_error(d->problem, err, UZ_PROBLEM_MATRICES);
    json_pointer(d->problem->pointer, sizeof d->problem->pointer, at);
    return false;
}

void *decode_room(decoding *d, const json_value *list, size_t size, int64_t *count)
{
    void *room = calloc(json_size(list) + 1, size);
    *count = room ? (int64_t)json_size(list) : 0;
    if (!room)
        problem_no_memory(d->problem);
    return room;
}

/* ---- names and small vectors */

void decode_name(char *out, size_t size, const json_value *object, const char *key, const char *otherwise)
{
    const json_value *value = json_get(object, key);
    const char *text = value ? json_text(value) : otherwise;
    const size_t len = text ? strlen(text) : size;
    const bool whole = len < size && (!value || value->count == len);
    memcpy(out, whole ? text : "", whole ? len + 1 : 1);
}

bool decode_unsafe(const char *text, size_t len)
{
    for (size_t i = 0; i < len; i++)
        if (uz_utf8_unsafe(text + i, len - i) > 0)
            return true;
    return false;
}

bool decode_label(char out[64], decoding *d, const json_value *at, const char *label, size_t len, const char *what)
{
    const bool fits = len > 0 && len < 64 && !decode_unsafe(label, len);
    if (fits)
        memcpy(out, label, len + 1);
    else
        problem_set(
            d->problem, 422, "out_of_range", at,
            "%s has 1 to 63 bytes and no characters that control a terminal or the order of others; this one %s.", what,
            len == 0   ? "is empty"
            : len < 64 ? "has one"
                       : "is longer");
    return fits;
}

bool decode_components(double out[3], decoding *d, const json_value *object, const char *key, double otherwise, int dim,
                       const char *what)
{
    const json_value *value = json_get(object, key);
    if (value && json_size(value) != (size_t)dim) {
        problem_set(d->problem, 422, "out_of_range", value,
                    "A vector must have %d numbers here, not %zu: the model is %s.", dim, json_size(value),
                    dim == 3 ? "solid" : "one in the plane");
        return false;
    }
    for (int i = 0; i < 3; i++)
        out[i] = i >= dim ? 0 : value ? value->numbers[i] : otherwise;
    return !what || out[0] != 0 || out[1] != 0 || out[2] != 0 ||
           decode_refuse(d, "out_of_range", value, "is zero; %s.", what);
}

/* ---- texts, in the request or uploaded before */

static bool open_source(decode_source *out, decoding *d, const json_value *value)
{
    const json_value *upload = json_get(value, "upload");
    const char *id = json_text(upload);
    *out = (decode_source){.data = NULL};
    if (!id) {
        out->copy = value->is_long ? json_copy_text(value) : NULL;
        out->data = value->is_long ? out->copy : value->text;
        out->len = value->count;
        return out->data || problem_no_memory(d->problem);
    }
    const store_status status = d->store ? store_upload_text(d->store, id, &out->mapped) : STORE_NOT_FOUND;
    if (status == STORE_OK) {
        out->data = out->mapped.data;
        out->len = out->mapped.len;
        out->digest = id;
        for (size_t i = 0; i < d->n_uploads; i++) /* each is noted once */
            if (strcmp(d->uploads[i], id) == 0)
                return true;
        char(*grown)[65] = room_grow(d->uploads, d->n_uploads + 1, sizeof *grown);
        if (!grown) {
            decode_source_close(out);
            return problem_no_memory(d->problem);
        }
        d->uploads = grown;
        snprintf(d->uploads[d->n_uploads++], sizeof *grown, "%s", id);
        return true;
    }
    if (status == STORE_NOT_FOUND)
        return decode_refuse(d, "unknown_upload", upload,
                             "names no upload of this server: send the text to POST /v1/uploads first.");
    if (status == STORE_AWAY) {
        decode_refuse(d, "store_unavailable", upload, "names an upload that can't be reached now: try again later.");
        d->problem->status = 503;
        return false;
    }
    decode_refuse(d, status == STORE_DAMAGED ? "stored_data_damaged" : "store_error", upload,
                  status == STORE_DAMAGED
                      ? "names an upload whose file is not what was sent, by its digest: send the text to POST "
                        "/v1/uploads again, which mends it."
                      : "names an upload that could not be read.");
    d->problem->status = 500;
    return false;
}

/* Programs of Windows may begin a text by a byte order mark, which no format here has. */
bool decode_source_open(decode_source *out, decoding *d, const json_value *value)
{
    static const char UTF8[] = "\xef\xbb\xbf", UTF16[2][3] = {"\xff\xfe", "\xfe\xff"};
    if (!open_source(out, d, value))
        return false;
    if (out->len >= 3 && memcmp(out->data, UTF8, 3) == 0) {
        out->data += 3;
        out->len -= 3;
    }
    if (out->len < 2 || (memcmp(out->data, UTF16[0], 2) != 0 && memcmp(out->data, UTF16[1], 2) != 0))
        return true;
    decode_source_close(out);
    return decode_refuse(d, "text_encoding", value, "is text in UTF-16: save it as UTF-8 or ASCII.");
}

void decode_source_close(decode_source *source)
{
    store_upload_text_done(&source->mapped);
    free(source->copy);
    *source = (decode_source){.data = NULL};
}

/* ---- vectors */

/* columns: NULL, or where the size of a point goes. */
static bool read_vector(double **out, int64_t *n, int *columns, decoding *d, const json_value *value)
{
    uz_error err = {.status = UZ_OK};
    decode_source source;
    if (json_is_list(value)) { /* one of anything but numbers is empty: the schema saw to it */
        *n = (int64_t)value->count;
        *out = value->kind == JSON_IS_NUMBERS ? json_take_numbers(value) : room_for(0, sizeof **out);
        return *out || problem_no_memory(d->problem);
    }
    if (!decode_source_open(&source, d, value))
        return false;
    const size_t bound = d->bound + 32 * source.len;
    const bool good = uz_vector_read(out, n, columns, source.data, source.len, bound, &err) == UZ_OK;
    decode_source_close(&source);
    return good || decode_refuse_file(d, &err, value);
}

bool decode_vector(double **out, int64_t *n, decoding *d, const json_value *value)
{
    return read_vector(out, n, NULL, d, value);
}

bool decode_points(double **out, int64_t *n, int *columns, decoding *d, const json_value *value)
{
    json_value room, other;
    const json_value *first = json_item(value, 0, &room);
    *columns = 0;
    for (size_t i = 0; json_is(value, JSON_IS_ARRAY) && i < value->count; i++) {
        const json_value *item = json_item(value, i, &other);
        if (json_is(first, JSON_IS_NUMBERS) ? item->kind != JSON_IS_NUMBERS || item->count != first->count
                                            : item->kind != JSON_IS_NUMBER)
            return decode_refuse(d, "wrong_type", item,
                                 "is not what the items before it are: give numbers, or points of the same size.");
    }
    if (!read_vector(out, n, columns, d, value))
        return false;
    if (json_is(value, JSON_IS_NUMBERS) && value->columns > 0) {
        *columns = (int)value->columns;
        *n *= value->columns;
    }
    return true;
}
