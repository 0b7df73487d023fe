/* Uploads in the store: what the API tests can't reach or would wait for. */
#include "codec/codec.h"
#include "store/engine_base.h"
#include "upload_place.h"

#include <zlib.h>

STORE_TEST(an_upload_is_named_by_its_digest)
{
    place p;
    upload_info info;
    upload_text text;
    bool known = true;
    if (!place_begin(&p))
        return;
    CHECK_INT(files_in(&p), p.database[0] ? 0 : -1); /* no folder before it is needed */
    CHECK_INT(send(p.s, "abc", 3, 1, false, &info, &known), UPLOAD_OK);
    CHECK(!known && info.bytes == 3 && info.jobs == 0 && info.created > 1e9 && info.used == info.created);
    CHECK_STR(info.id, ABC);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    CHECK(known && info.used >= info.created);
    CHECK_INT(files_in(&p), 1);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_OK);
    CHECK(text.len == 3 && memcmp(text.data, "abc", 3) == 0);
    CHECK_INT(store_upload_delete(p.s, ABC, NULL), STORE_OK);
    CHECK(memcmp(text.data, "abc", 3) == 0); /* who reads it reads on */
    store_upload_text_done(&text);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_NOT_FOUND);
    CHECK_INT(store_upload_delete(p.s, ABC, NULL), STORE_NOT_FOUND);
    CHECK_INT(files_in(&p), 0);
    end_place(&p);
}

static size_t squeeze(unsigned char *out, size_t room, const char *text, size_t len)
{
    z_stream z = {.next_in = (unsigned char *)(uintptr_t)text, .avail_in = (unsigned)len, .next_out = out};
    z.avail_out = (unsigned)room;
    CHECK_INT(deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    CHECK_INT(deflate(&z, Z_FINISH), Z_STREAM_END);
    deflateEnd(&z);
    return z.total_out;
}

STORE_TEST(gzip_in_pieces_of_any_size)
{
    enum { LEN = 200000 };
    place p;
    upload_info info, plain;
    bool known;
    if (!place_begin(&p))
        return;
    char *text = malloc(LEN);
    unsigned char *small = malloc(LEN);
    for (int i = 0; i < LEN; i++)
        text[i] = (char)('a' + i % 7 + (i / 1000) % 3);
    CHECK_INT(send(p.s, text, LEN, LEN, false, &plain, &known), UPLOAD_OK);
    size_t first = squeeze(small, LEN, text, 70000);
    size_t len = first + squeeze(small + first, LEN - first, text + 70000, LEN - 70000);
    for (size_t piece = 1; piece <= len; piece = piece * 3 + 1) {
        CHECK_INT(send(p.s, small, len, piece, true, &info, &known), UPLOAD_OK);
        CHECK(known);
        CHECK_STR(info.id, plain.id);
    }
    for (size_t cut = 1; cut < len; cut += 97) /* cut where the first member ends, it is a whole stream */
        CHECK_INT(send(p.s, small, cut, 50, true, &info, &known), cut == first ? UPLOAD_OK : UPLOAD_BAD_GZIP);
    small[first / 2] ^= 1;
    CHECK_INT(send(p.s, small, len, 4096, true, &info, &known), UPLOAD_BAD_GZIP);
    CHECK(files_in(&p) >= 1 && files_in(&p) <= 2);
    end_place(&p);
    free(text);
    free(small);
}

STORE_TEST(limits_of_one_and_of_all)
{
    place p;
    upload_info info;
    bool known;
    char data[100] = {0};
    if (!place_begin(&p))
        return;
    p.s->settings = (store_settings){.uploads = {.one = 50, .all = 100, .keep_s = 0}};
    CHECK_INT(send(p.s, data, 51, 7, false, &info, &known), UPLOAD_TOO_LARGE);
    CHECK_INT(send(p.s, data, 50, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(send(p.s, data, 40, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(send(p.s, data, 11, 7, false, &info, &known), UPLOAD_NO_ROOM);
    CHECK_INT(send(p.s, data, 10, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(files_in(&p), 3);
    place_reopen(&p); /* counts what is there; limits are not kept */
    p.s->settings = (store_settings){.uploads = {.one = 50, .all = 100}};
    CHECK_INT(send(p.s, data, 1, 7, false, &info, &known), UPLOAD_NO_ROOM);
    end_place(&p);
}

STORE_TEST(an_upload_in_use_stays)
{
    place p;
    upload_info info;
    bool known, repeated;
    job j = {0};
    int64_t count, counts[STORE_COUNTS];
    job_status was;
    if (!place_begin(&p))
        return;
    const char ids[][65] = {ABC}, unknown[][65] = {ABC, "00"};
    store_request request = {.body = "{}", .body_len = 2, .uploads = ids, .n_uploads = 1};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_NOT_FOUND);
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_ACCEPTED], 0);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    request.uploads = unknown;
    request.n_uploads = 2;
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_NOT_FOUND);
    request.uploads = ids;
    request.n_uploads = 1;
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    /* To a process that solves it is open by the job that names it, and by no other. */
    int fd;
    int64_t bytes;
    CHECK_INT(store_upload_descriptor(p.s, ABC, "00", &fd, &bytes), STORE_NOT_FOUND);
    CHECK_INT(fd, -1);
    CHECK_INT(store_upload_descriptor(p.s, ABC, j.id, &fd, &bytes), STORE_OK);
    CHECK(fd >= 0 && bytes == 3 && close(fd) == 0);
    CHECK_INT(store_upload_delete(p.s, ABC, NULL), STORE_CONFLICT);
    p.s->settings = (store_settings){.uploads = {.keep_s = 1e-6}};
    CHECK_INT(store_collect_uploads(p.s, &count), STORE_OK);
    CHECK(count == 0 && files_in(&p) == 1);
    CHECK_INT(store_dismiss(p.s, j.id, &was), STORE_OK);
    CHECK_INT(store_dismiss(p.s, j.id, &was), STORE_OK); /* deleted */
    CHECK_INT(store_collect_uploads(p.s, &count), STORE_OK);
    CHECK(count == 1 && files_in(&p) == 0);
    job_clear(&j);
    end_place(&p);
}

/* How many bytes the request has beside the file decides nothing: a shorter one takes the mesh that a longer one left.
 */
STORE_TEST(a_mesh_is_kept_for_shorter_requests)
{
    static const char MESH[] = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
                               "$Elements\n1\n1 2 0 1 2 3\n$EndElements\n";
    enum { LEN = 2 << 20 };
    place p;
    upload_info info;
    bool known;
    char why[256] = "";
    if (!place_begin(&p))
        return;
    CHECK_MSG(codec_init(NULL, why, sizeof why), "%s", why);
    char *text = malloc(LEN), body[1024];
    uz_cache *cache = uz_cache_new(1 << 20);
    memset(text, '\n', LEN);
    memcpy(text, MESH, sizeof MESH - 1);
    CHECK_INT(send(p.s, text, LEN, LEN, false, &info, &known), UPLOAD_OK);
    const double *xyz = NULL;
    for (int spaces = 100; spaces >= 0; spaces -= 50) {
        codec_request request;
        problem_details problem = {0};
        const int len = snprintf(
            body, sizeof body,
            "{\"problem\":{\"kind\":\"scene\",\"model\":\"plane_strain\",\"mesh\":{\"gmsh\":{\"upload\":\"%s\"}},"
            "\"materials\":[{\"on\":\"all\",\"young\":1,\"poisson\":0.3}],"
            "\"supports\":[{\"on\":{\"where\":{\"y\":0}},\"ux\":0,\"uy\":0}]}}%*s",
            info.id, spaces, "");
        CHECK_MSG(codec_decode_kept(&request, CODEC_SOLVE, body, (size_t)len, p.s, cache, &problem), "%s",
                  problem.detail);
        CHECK(request.problem.scene.given.lender && (!xyz || request.problem.scene.given.xyz == xyz));
        xyz = request.problem.scene.given.xyz;
        codec_request_clear(&request);
    }
    codec_end();
    uz_cache_free(cache);
    free(text);
    end_place(&p);
}
