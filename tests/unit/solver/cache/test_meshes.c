/* Meshes of files that a cache keeps: the same as what the file says, for whoever names it. */
#include "cache/table.h"
#include "harness.h"
#include "scene/scene.h"
#include "uzawa.h"

#include <stdlib.h>
#include <string.h>

enum { PAD = 1 << 20 };

/* A tetrahedron whose fourth corner is as high as this, behind which the file goes on: free(). */
static char *large_file(size_t *len, double height)
{
    char *text = malloc(PAD + 1024);
    CHECK(text != NULL);
    if (!text)
        return NULL;
    *len = (size_t)snprintf(text, 1024,
                            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"base\"\n3 2 \"body\"\n"
                            "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 %.17g\n$EndNodes\n"
                            "$Elements\n2\n1 2 2 1 1 1 2 3\n2 4 2 2 1 1 2 3 4\n$EndElements\n$Comments\n",
                            height);
    memset(text + *len, 'x', PAD);
    *len += PAD;
    *len += (size_t)snprintf(text + *len, 64, "\n$EndComments\n");
    return text;
}

static void read_kept(uz_given_mesh *out, uz_cache *cache, const char *digest, const char *text, size_t len)
{
    uz_error err = {0};
    CHECK_MSG(uz_mesh_read_kept(out, cache, digest, "gmsh", text, len, 0, &err) == UZ_OK, "%s", err.message);
}

TEST(a_mesh_is_read_once)
{
    size_t len, other_len;
    char *text = large_file(&len, 1), *other_text = large_file(&other_len, 2), fresh[65];
    uz_cache *cache = uz_cache_new(1 << 20);
    uz_given_mesh plain, first, second, other;
    uz_error err = {0};
    CHECK(uz_mesh_read(&plain, "gmsh", text, len, 0, &err) == UZ_OK);
    CHECK_STR(plain.digest, "");
    read_kept(&first, cache, "one", text, len);
    read_kept(&second, cache, "one", text, len);
    read_kept(&other, cache, "two", other_text, other_len);
    CHECK(first.xyz == second.xyz && first.xyz != other.xyz);
    CHECK(memcmp(first.xyz, plain.xyz, 12 * sizeof *plain.xyz) == 0 && first.n_groups == plain.n_groups);
    CHECK(other.xyz[11] == 2 && strcmp(first.from_file, "/mesh/gmsh") == 0);
    uz_given_digest(fresh, &plain);
    CHECK_STR(first.digest, fresh);
    CHECK(strcmp(other.digest, fresh) != 0);
    uz_given_mesh_clear(&first);
    CHECK(first.xyz == NULL && second.xyz[11] == 1);
    uz_given_mesh_clear(&second);
    uz_given_mesh_clear(&other);
    read_kept(&second, cache, "one", NULL, len); /* the text is not read */
    CHECK(second.xyz && second.xyz[11] == 1);
    uz_given_mesh_clear(&second);
    uz_given_mesh_clear(&plain);
    uz_cache_free(cache);
    free(text);
    free(other_text);
}

TEST(refusals_are_those_of_the_reader)
{
    size_t len;
    char *text = large_file(&len, 1);
    uz_cache *cache = uz_cache_new(1 << 20);
    uz_given_mesh mesh;
    uz_error err = {0}, wanted = {0};
    for (int k = 0; k < 2; k++) { /* nobody has read it; somebody has, with another bound and in another format */
        CHECK(uz_mesh_read(&mesh, "gmsh", text, len, 100, &wanted) == UZ_ERR_LIMIT);
        CHECK_INT(uz_mesh_read_kept(&mesh, cache, "one", "gmsh", text, len, 100, &err), UZ_ERR_LIMIT);
        CHECK_STR(err.message, wanted.message);
        CHECK(mesh.xyz == NULL);
        CHECK(uz_mesh_read(&mesh, "vtk", text, len, 0, &wanted) == UZ_ERR_FORMAT);
        CHECK_INT(uz_mesh_read_kept(&mesh, cache, "one", "vtk", text, len, 0, &err), UZ_ERR_FORMAT);
        CHECK_STR(err.message, wanted.message);
        CHECK_INT(uz_mesh_read_kept(&mesh, cache, "one", "gmsh", text, len, 100000, &err), UZ_OK);
        uz_given_mesh_clear(&mesh);
    }
    CHECK_INT(uz_mesh_read_kept(&mesh, cache, "one", "gmsh", text, len, 200000, &err), UZ_OK);
    CHECK(mesh.lender != NULL);
    uz_given_mesh_clear(&mesh);
    uz_cache_free(cache);
    free(text);
}

/* One that is larger than the cache is there as long as somebody has it. */
TEST(bytes_are_bounded)
{
    size_t len;
    char *text = large_file(&len, 1);
    uz_cache *cache = uz_cache_new(100);
    uz_given_mesh mesh, second;
    uz_error err = {0};
    read_kept(&mesh, cache, "one", text, len);
    read_kept(&second, cache, "one", text, len);
    CHECK(mesh.xyz == second.xyz);
    uz_given_mesh_clear(&mesh);
    CHECK(second.xyz[11] == 1);
    uz_given_mesh_clear(&second);
    text[0] = '?'; /* it is gone, and read again */
    CHECK_INT(uz_mesh_read_kept(&mesh, cache, "one", "gmsh", text, len, 0, &err), UZ_ERR_FORMAT);
    uz_cache_free(cache);
    free(text);
}

static void count(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx)
{
    (void)object, (void)digest, (void)hits, (void)bytes;
    ++*(int *)ctx;
}

static int count_of(uz_cache *cache, uz_item_kind kind)
{
    int found = 0;
    uz_table_visit(cache, kind, count, &found);
    return found;
}

static void publish_factor(uz_cache *cache, const char *name, size_t bytes)
{
    char digest[65] = "";
    uz_item *item;
    bool create;
    snprintf(digest, sizeof digest, "%s", name);
    CHECK(uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, digest, NULL, NULL) == UZ_OK && create);
    uz_table_publish(cache, item, malloc(1), bytes, free);
    uz_table_release(cache, item);
}

/* A factor takes longer to make than a mesh to read, however long nobody has used it. */
TEST(meshes_give_way_to_factors)
{
    size_t len;
    char *text = large_file(&len, 1);
    uz_cache *cache = uz_cache_new(100000);
    uz_given_mesh mesh;
    publish_factor(cache, "old", 50000);
    read_kept(&mesh, cache, "one", text, len);
    uz_given_mesh_clear(&mesh);
    CHECK_INT(count_of(cache, UZ_ITEM_MESH), 1);
    publish_factor(cache, "new", 50000);
    CHECK_INT(count_of(cache, UZ_ITEM_MESH), 0);
    CHECK_INT(count_of(cache, UZ_ITEM_FACTOR), 2);
    publish_factor(cache, "newest", 50000);
    CHECK_INT(count_of(cache, UZ_ITEM_FACTOR), 2);
    uz_cache_free(cache);
    free(text);
}

/* Nor does one that a job has push out factors: without a cache it would be in memory as well. */
TEST(meshes_in_use_take_no_room_from_factors)
{
    size_t len;
    char *text = large_file(&len, 1);
    uz_cache *cache = uz_cache_new(100000);
    uz_given_mesh mesh;
    publish_factor(cache, "old", 50000);
    read_kept(&mesh, cache, "one", text, len);
    publish_factor(cache, "new", 49990);
    CHECK_INT(count_of(cache, UZ_ITEM_FACTOR), 2);
    publish_factor(cache, "newest", 100);
    CHECK_INT(count_of(cache, UZ_ITEM_FACTOR), 2);
    CHECK_INT(count_of(cache, UZ_ITEM_MESH), 1);
    uz_given_mesh_clear(&mesh);
    CHECK_INT(count_of(cache, UZ_ITEM_MESH), 1);
    publish_factor(cache, "last", 49850);
    CHECK_INT(count_of(cache, UZ_ITEM_MESH), 0);
    CHECK_INT(count_of(cache, UZ_ITEM_FACTOR), 3);
    uz_cache_free(cache);
    free(text);
}

/* Small files are read again, as without a cache. */
TEST(small_files_are_not_kept)
{
    size_t len;
    char *text = large_file(&len, 1);
    uz_cache *cache = uz_cache_new(1 << 20);
    uz_given_mesh mesh;
    uz_error err = {0};
    const size_t mesh_len = (size_t)(strstr(text, "$Comments") - text);
    CHECK(uz_mesh_read_kept(&mesh, cache, "one", "gmsh", text, mesh_len, 0, &err) == UZ_OK && !mesh.lender);
    uz_given_mesh_clear(&mesh);
    CHECK(uz_mesh_read_kept(&mesh, NULL, "one", "gmsh", text, len, 0, &err) == UZ_OK && !mesh.lender);
    uz_given_mesh_clear(&mesh);
    uz_cache_free(cache);
    free(text);
}
