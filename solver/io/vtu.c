#include "io/vtu.h"

#include "core/alloc.h"

#include <libdeflate.h>
#include <string.h>

/* Of numbers before compression; a reader needs one block at a time. */
enum { BLOCK = 1 << 20 };
/* Of libdeflate, whose fastest level takes two thirds of zlib's time on noisy digits, for three quarters of the size.
 */
enum { LEVEL = 1 };

void uz_vtu_array(uz_buffer *vtu, const char *name, uz_vtu_type type, const void *data, int64_t count, int components,
                  const char *const *labels)
{
    static const struct {
        const char *name;
        size_t size;
    } TYPES[] = {{"Float64", sizeof(double)}, {"Int64", sizeof(int64_t)}, {"UInt8", 1}};
    uz_buffer_print(vtu, "        <DataArray type=\"%s\" Name=\"%s\"", TYPES[type].name, name);
    if (components > 1)
        uz_buffer_print(vtu, " NumberOfComponents=\"%d\"", components);
    for (int c = 0; labels && c < components; c++)
        uz_buffer_print(vtu, " ComponentName%d=\"%s\"", c, labels[c]);
    uz_buffer_print(vtu, " format=\"binary\">");
    /* The numbers of blocks and their sizes (3 + blocks), then the compressed blocks. */
    const size_t n = (size_t)count * (size_t)components * TYPES[type].size, blocks = (n + BLOCK - 1) / BLOCK;
    const unsigned char *bytes = data;
    size_t packed = 0;
    uint64_t *head = uz_alloc((int64_t)blocks + 3, sizeof *head);
    unsigned char *out = uz_alloc((int64_t)(blocks * libdeflate_zlib_compress_bound(NULL, BLOCK)), 1);
    struct libdeflate_compressor *compressor = head && out ? libdeflate_alloc_compressor(LEVEL) : NULL;
    bool ok = compressor != NULL;
    if (ok) {
        head[0] = blocks;
        head[1] = BLOCK;
        head[2] = n % BLOCK; /* 0: the last one is whole */
    }
    for (size_t b = 0; ok && b < blocks; b++) {
        const size_t size = b + 1 < blocks || n % BLOCK == 0 ? (size_t)BLOCK : n % BLOCK;
        const size_t room = libdeflate_zlib_compress_bound(compressor, size);
        head[3 + b] = libdeflate_zlib_compress(compressor, bytes + b * BLOCK, size, out + packed, room);
        packed += head[3 + b];
        ok = head[3 + b] > 0;
    }
    libdeflate_free_compressor(compressor);
    if (ok) {
        uz_buffer_put_base64(vtu, head, (3 + blocks) * sizeof *head);
        uz_buffer_put_base64(vtu, out, packed);
    }
    vtu->failed = vtu->failed || !ok;
    uz_free_all(head, out);
    uz_buffer_print(vtu, "</DataArray>\n");
}

void uz_vtu_begin(uz_buffer *vtu, const uz_mesh *mesh)
{
    const bool little = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
    memset(vtu, 0, sizeof *vtu);
    uz_buffer_print(vtu,
                    "<?xml version=\"1.0\"?>\n"
                    "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\" "
                    "compressor=\"vtkZLibDataCompressor\">\n"
                    "  <UnstructuredGrid>\n"
                    "    <Piece NumberOfPoints=\"%lld\" NumberOfCells=\"%lld\">\n",
                    little ? "LittleEndian" : "BigEndian", (long long)mesh->n_nodes, (long long)mesh->n_elements);
    double *xyz = uz_alloc_zero(mesh->n_nodes * 3, sizeof *xyz);
    unsigned char *type = uz_alloc(mesh->n_elements, sizeof *type);
    vtu->failed = vtu->failed || !xyz || !type;
    /* A point has three coordinates there, whatever the model. */
    for (int64_t a = 0; xyz && a < mesh->n_nodes; a++)
        memcpy(xyz + 3 * a, mesh->xyz + a * mesh->dim, (size_t)mesh->dim * sizeof *xyz);
    /* Node order of all kinds is VTK's own. */
    for (int64_t e = 0; type && e < mesh->n_elements; e++)
        type[e] = (unsigned char)uz_element_type_of((uz_element_kind)mesh->kind[e])->vtk;
    if (!vtu->failed) {
        uz_buffer_print(vtu, "      <Points>\n");
        uz_vtu_array(vtu, "Points", UZ_VTU_DOUBLE, xyz, mesh->n_nodes, 3, NULL);
        uz_buffer_print(vtu, "      </Points>\n");
        uz_buffer_print(vtu, "      <Cells>\n");
        uz_vtu_array(vtu, "connectivity", UZ_VTU_INT64, mesh->node, mesh->first[mesh->n_elements], 1, NULL);
        uz_vtu_array(vtu, "offsets", UZ_VTU_INT64, mesh->first + 1, mesh->n_elements, 1, NULL);
        uz_vtu_array(vtu, "types", UZ_VTU_BYTE, type, mesh->n_elements, 1, NULL);
        uz_buffer_print(vtu, "      </Cells>\n");
    }
    uz_free_all(xyz, type);
}

uz_status uz_vtu_finish(char **text, size_t *len, uz_buffer *vtu, uz_error *err)
{
    uz_buffer_print(vtu, "    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
    return uz_buffer_finish(text, len, vtu, err);
}
