/* npz_write.c: arrays as an archive of NumPy's, each as it stands in memory, so that it is read without a copy.
 * Formats: see numpy.h. */
#include "core/error.h"
#include "text/buffer.h"

#include <libdeflate.h>
#include <stdio.h>
#include <string.h>

enum { VERSION = 20, LOCAL = 30, DAY = 0x21 }; /* DAY: the first one that there is; no clock is in a file */

typedef struct {
    uint32_t at, size, checksum;
} member;

static void put_number(uz_buffer *to, uint32_t value, int bytes)
{
    for (int i = 0; i < bytes; i++, value >>= 8) {
        const unsigned char byte = (unsigned char)value;
        uz_buffer_put(to, &byte, 1);
    }
}

/* What local header and directory both say, behind their signatures. */
static void put_head(uz_buffer *to, const member *of, size_t name)
{
    const struct {
        uint32_t value;
        int bytes;
    } FIELDS[] = {
        {VERSION, 2},        {0, 2}, {0, 2}, {0, 2}, {DAY, 2}, {of->checksum, 4}, {of->size, 4}, {of->size, 4},
        {(uint32_t)name, 2}, {0, 2}};
    for (size_t i = 0; i < sizeof FIELDS / sizeof FIELDS[0]; i++)
        put_number(to, FIELDS[i].value, FIELDS[i].bytes);
}

/* Its numbers begin at a multiple of 64 bytes behind the header's begin, as NumPy has them. */
static void put_array(uz_buffer *to, const uz_npz_array *array)
{
    static const char BLANKS[64] = "                                                               ";
    const char order = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? '<' : '>';
    char shape[64], text[160];
    snprintf(shape, sizeof shape, array->columns > 0 ? "(%lld, %d)" : "(%lld,)", (long long)array->rows,
             array->columns);
    const int used = snprintf(text, sizeof text, "{'descr': '%c%c8', 'fortran_order': False, 'shape': %s, }", order,
                              array->whole ? 'i' : 'f', shape);
    const size_t blanks = 63 - (10 + (size_t)used) % 64;
    uz_buffer_put(to, "\x93NUMPY\x01", 8); /* with the NUL: version 1.0 */
    put_number(to, (uint32_t)((size_t)used + blanks + 1), 2);
    uz_buffer_put(to, text, (size_t)used);
    uz_buffer_put(to, BLANKS, blanks);
    uz_buffer_put(to, "\n", 1);
    const int64_t count = array->rows * (array->columns > 0 ? array->columns : 1);
    if (!array->whole)
        uz_buffer_put(to, array->x, (size_t)count * sizeof *array->x);
    for (int64_t i = 0; array->whole && i < count; i++) {
        const int64_t whole = (int64_t)array->x[i];
        uz_buffer_put(to, &whole, sizeof whole);
    }
}

static const char *ending_of(const uz_npz_array *array)
{
    return array->text ? "" : ".npy";
}

/* A local header, whose numbers are filled in once the content is there, and the content. */
static void put_member(uz_buffer *to, member *out, const uz_npz_array *array)
{
    const size_t at = to->len, name = strlen(array->name) + strlen(ending_of(array));
    uz_buffer head = {.data = NULL};
    uz_buffer_put(to, "PK\3\4", 4);
    put_head(to, &(member){.size = 0}, name);
    uz_buffer_print(to, "%s%s", array->name, ending_of(array));
    if (array->text)
        uz_buffer_put(to, array->text, strlen(array->text));
    else
        put_array(to, array);
    if (to->failed || to->len > UINT32_MAX) {
        *out = (member){.at = UINT32_MAX};
        return;
    }
    const char *content = to->data + at + LOCAL + name;
    const size_t size = to->len - at - LOCAL - name;
    *out = (member){(uint32_t)at, (uint32_t)size, libdeflate_crc32(0, content, size)};
    put_head(&head, out, name);
    if (!head.failed)
        memcpy(to->data + at + 4, head.data, head.len);
    to->failed = to->failed || head.failed;
    uz_buffer_drop(&head);
}

static void put_directory(uz_buffer *to, const member *members, const uz_npz_array *list, size_t n)
{
    const size_t at = to->len;
    uint32_t count = 0;
    for (size_t i = 0; i < n; i++) {
        if (!list[i].text && !list[i].x)
            continue;
        uz_buffer_put(to, "PK\1\2", 4);
        put_number(to, VERSION, 2);
        put_head(to, &members[i], strlen(list[i].name) + strlen(ending_of(&list[i])));
        put_number(to, 0, 2 + 2 + 2); /* no comment, the first disk, no attributes */
        put_number(to, 0, 4);
        put_number(to, members[i].at, 4);
        uz_buffer_print(to, "%s%s", list[i].name, ending_of(&list[i]));
        count++;
    }
    const uint32_t size = (uint32_t)(to->len - at);
    uz_buffer_put(to, "PK\5\6\0\0\0", 8);
    put_number(to, count, 2);
    put_number(to, count, 2);
    put_number(to, size, 4);
    put_number(to, (uint32_t)at, 4);
    put_number(to, 0, 2);
}

uz_status uz_npz_write(char **file, size_t *len, const uz_npz_array *list, size_t n, uz_error *err)
{
    uz_buffer out = {.data = NULL};
    member members[UZ_NPZ_ARRAYS];
    bool fits = true;
    *file = NULL;
    *len = 0;
    uz_error_reset(err);
    if (n > UZ_NPZ_ARRAYS)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "more than %d arrays", UZ_NPZ_ARRAYS);
    for (size_t i = 0; i < n && fits && !out.failed; i++)
        if (list[i].text || list[i].x) {
            put_member(&out, &members[i], &list[i]);
            fits = out.failed || members[i].at < UINT32_MAX;
        }
    if (fits)
        put_directory(&out, members, list, n);
    if (fits && (out.failed || out.len <= UINT32_MAX))
        return uz_buffer_finish(file, len, &out, err);
    uz_buffer_drop(&out);
    return uz_fail(err, UZ_ERR_LIMIT, "",
                   "the arrays together take more than 4 GB, which an archive of this kind ends at");
}
