/* npz.c: an archive of arrays: the directory at its end, and members, stored or deflated. What the local headers say
 * again is not looked at but for their length. */
#include "core/alloc.h"
#include "core/error.h"
#include "io/numpy.h"

#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

enum { END = 22, ENTRY = 46, LOCAL = 30, LONGEST_COMMENT = 65535 };
enum { STORED = 0, DEFLATED = 8 };

static uint32_t number(const unsigned char *at, int bytes)
{
    uint32_t value = 0;
    for (int i = bytes; i > 0; i--)
        value = value << 8 | at[i - 1];
    return value;
}

static bool begins(const unsigned char *at, char third, char fourth)
{
    return at[0] == 'P' && at[1] == 'K' && at[2] == (unsigned char)third && at[3] == (unsigned char)fourth;
}

bool npz_recognises(const char *data, size_t len)
{
    return len >= END && (begins((const unsigned char *)data, 3, 4) || begins((const unsigned char *)data, 5, 6));
}

static uz_status fail(uz_error *err, const char *what)
{
    return uz_fail(err, UZ_ERR_FORMAT, "/numpy", "the archive %s: send the whole file that NumPy wrote", what);
}

/* ---- the directory */

/* The record at the end, behind which nothing but its comment stands. NULL: there is none. */
static const unsigned char *find_end(const unsigned char *data, size_t len)
{
    for (size_t comment = 0; comment <= LONGEST_COMMENT && comment + END <= len; comment++) {
        const unsigned char *at = data + len - END - comment;
        if (begins(at, 5, 6) && number(at + 20, 2) == comment)
            return at;
    }
    return NULL;
}

/* The entry at *at, which ends before `end`. */
static uz_status read_entry(npz_file *file, const unsigned char **at, const unsigned char *end, uz_error *err)
{
    const unsigned char *entry = *at;
    if (end - entry < ENTRY || !begins(entry, 1, 2))
        return fail(err, "has no directory where its end says that it is");
    const size_t name = number(entry + 28, 2), rest = number(entry + 30, 2) + number(entry + 32, 2);
    const uint32_t flags = number(entry + 8, 2), method = number(entry + 10, 2);
    if ((size_t)(end - entry) - ENTRY < name + rest)
        return fail(err, "has no directory where its end says that it is");
    npz_member *to = &file->member[file->count++];
    const size_t kept = name < sizeof to->name - 1 ? name : sizeof to->name - 1;
    *to = (npz_member){.at = number(entry + 42, 4),
                       .packed = number(entry + 20, 4),
                       .size = number(entry + 24, 4),
                       .checksum = number(entry + 16, 4),
                       .is_packed = method == DEFLATED};
    memcpy(to->name, entry + ENTRY, kept);
    for (size_t i = 0; i < kept; i++)
        if (to->name[i] < ' ' || to->name[i] > '~')
            to->name[i] = '?';
    *at = entry + ENTRY + name + rest;
    if (flags & 1 || (method != STORED && method != DEFLATED))
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy",
                       "%s of the archive is %s, which is not read: save it by numpy.savez or scipy.sparse.save_npz",
                       to->name, flags & 1 ? "encrypted" : "packed in another way than NumPy does");
    if (to->at == UINT32_MAX || to->packed == UINT32_MAX || to->size == UINT32_MAX)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy", "%s of the archive is too large: 4 GB are the most",
                       to->name);
    if (method == STORED && to->packed != to->size)
        return fail(err, "has a stored member of two lengths");
    return UZ_OK;
}

uz_status npz_open(npz_file *out, const char *data, size_t len, size_t max_bytes, uz_error *err)
{
    const unsigned char *bytes = (const unsigned char *)data, *end = find_end(bytes, len);
    *out = (npz_file){.data = bytes, .left = max_bytes};
    if (!end)
        return fail(err, "is cut off");
    const uint32_t disk = number(end + 4, 2), of_disk = number(end + 6, 2), count = number(end + 10, 2);
    const uint32_t size = number(end + 12, 4), offset = number(end + 16, 4);
    const size_t before = (size_t)(end - bytes);
    if (count == UINT16_MAX || offset == UINT32_MAX)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy", "the archive is too large: 4 GB are the most");
    if (disk || of_disk || offset > before || size > before - offset)
        return fail(err, "has no directory where its end says that it is");
    if (count > NPZ_MEMBERS)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy",
                       "the archive has %u members, and a matrix or a vector has no more than %d", count, NPZ_MEMBERS);
    out->end = offset;
    uz_status status = UZ_OK;
    const unsigned char *at = bytes + offset, *last = at + size;
    for (uint32_t i = 0; i < count && status == UZ_OK; i++)
        status = read_entry(out, &at, last, err);
    return status;
}

void npz_close(npz_file *file)
{
    for (int i = 0; i < file->count; i++)
        free(file->member[i].unpacked);
    file->count = 0;
}

npz_member *npz_find(npz_file *file, const char *name)
{
    for (int i = 0; i < file->count; i++)
        if (strcmp(file->member[i].name, name) == 0)
            return &file->member[i];
    return NULL;
}

/* ---- members */

static uz_status unpack(npz_member *member, const unsigned char *from, uz_error *err)
{
    struct libdeflate_decompressor *tool = libdeflate_alloc_decompressor();
    free(member->unpacked);
    member->unpacked = uz_alloc((int64_t)member->size, 1);
    uz_status status = tool && member->unpacked ? UZ_OK : uz_no_memory(err, "an array");
    if (status == UZ_OK && libdeflate_deflate_decompress(tool, from, member->packed, member->unpacked, member->size,
                                                         NULL) != LIBDEFLATE_SUCCESS)
        status = uz_fail(err, UZ_ERR_FORMAT, "/numpy", "%s of the archive is damaged: it does not unpack to its length",
                         member->name);
    if (tool)
        libdeflate_free_decompressor(tool);
    return status;
}

uz_status npz_take(npy_array *out, npz_file *file, npz_member *member, uz_error *err)
{
    const unsigned char *head = file->data + member->at;
    if (member->at > file->end || file->end - member->at < LOCAL || !begins(head, 3, 4))
        return fail(err, "has no member where its directory says that one is");
    const size_t skip = LOCAL + (size_t)number(head + 26, 2) + number(head + 28, 2);
    if (file->end - member->at < skip || file->end - member->at - skip < member->packed)
        return fail(err, "has no member where its directory says that one is");
    const unsigned char *content = head + skip;
    if (member->is_packed) {
        if (member->size > file->left)
            return uz_fail(err, UZ_ERR_LIMIT, "/numpy", "%s unpacked takes more memory than is allowed here",
                           member->name);
        const uz_status status = unpack(member, content, err);
        if (status != UZ_OK)
            return status;
        file->left -= member->size;
        content = member->unpacked;
    }
    if (libdeflate_crc32(0, content, member->size) != member->checksum)
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy", "%s of the archive is damaged: its checksum is another one",
                       member->name);
    return npy_open(out, member->name, content, member->size, err);
}
