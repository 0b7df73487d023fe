/* Each allocation on the way from a file, numbers or a box to a mesh fails once: the call must say so, publish nothing
 * and keep nothing. Linked with malloc, calloc, realloc and free wrapped. */
#include "core/error.h"
#include "failing_heap.h"
#include "gmsh_text.h"
#include "harness.h"
#include "io/mesh_reader.h"
#include "scene/mesh.h"
#include "scene/subdivide.h"

/* Runs with the 1st, 2nd, ... allocation failing until it succeeds. Returns how many could fail. */
static long fail_each(uz_status (*run)(uz_error *err))
{
    for (long n = 0; n < 1000; n++) {
        uz_error err = {0};
        heap_watch(n);
        const uz_status status = run(&err);
        heap.watching = false;
        CHECK_MSG(heap.live == 0, "%d blocks leaked where allocation %ld fails", heap.live, n);
        CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "%s after %ld allocations (%s)",
                  uz_status_name(status), n, err.message);
        CHECK(!heap.failed || (err.status == UZ_ERR_MEMORY && err.message[0]));
        if (!heap.failed)
            return n;
    }
    return -1;
}

static gmsh_writer file;

static uz_status read_and_mesh(uz_error *err)
{
    uz_given_mesh given;
    uz_mesh mesh = {0};
    uz_status status = uz_gmsh_read(&given, file.text, file.len, 0, err);
    CHECK((given.xyz != NULL) == (status == UZ_OK));
    if (status == UZ_OK)
        status = uz_mesh_from_given(&mesh, &given, 3, err);
    CHECK((mesh.xyz != NULL) == (status == UZ_OK));
    uz_mesh_clear(&mesh);
    uz_given_mesh_clear(&given);
    return status;
}

TEST(gmsh_files)
{
    for (int k = 0; k < 4; k++) {
        write_gmsh(&file, &TET_SOURCE, k < 2 ? 22 : 41, k % 2);
        CHECK(fail_each(read_and_mesh) > 25);
    }
}

/* Into a cache, and out of it. */
static uz_status read_kept(uz_error *err)
{
    static char text[(1 << 20) + GMSH_TEXT_ROOM];
    uz_given_mesh given = {0};
    uz_cache *cache = uz_cache_new(1 << 20);
    uz_status status = cache ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no cache");
    memset(text, '\n', sizeof text);
    memcpy(text, file.text, file.len);
    for (int k = 0; k < 2 && status == UZ_OK; k++) {
        uz_given_mesh_clear(&given);
        status = uz_mesh_read_kept(&given, cache, "one", "gmsh", text, sizeof text, 0, err);
        CHECK((given.xyz != NULL) == (status == UZ_OK));
    }
    uz_given_mesh_clear(&given);
    uz_cache_free(cache);
    return status;
}

TEST(gmsh_files_that_are_kept)
{
    write_gmsh(&file, &TET_SOURCE, 41, false);
    CHECK(fail_each(read_kept) > 25);
}

/* Tags too far apart for a table. */
TEST(gmsh_files_with_wild_numbers)
{
    static const char text[] = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n99999999 1 0 0\n7 0 1 0\n"
                               "8 0 0 1\n$EndNodes\n$Elements\n1\n1 4 0 1 99999999 7 8\n$EndElements\n";
    file.len = 0;
    put_text(&file, text);
    CHECK(fail_each(read_and_mesh) > 15);
}

static uz_status read_abaqus(uz_error *err)
{
    static const char text[] = "*NODE,NSET=N\n9,0,0\n2,1,0\n3,0,1\n*ELEMENT,TYPE=CPS3,ELSET=E\n7,9,2,3\n"
                               "*ELEMENT,TYPE=T2D2,ELSET=L\n3,9,2\n*NSET,NSET=E\n2\n*SURFACE,NAME=S\nE,S1\n7,S2\n";
    uz_given_mesh given;
    const uz_status status = uz_abaqus_read(&given, text, sizeof text - 1, 0, err);
    CHECK((given.xyz != NULL) == (status == UZ_OK));
    uz_given_mesh_clear(&given);
    return status;
}

TEST(abaqus_files)
{
    CHECK(fail_each(read_abaqus) > 25);
}

static uz_status read_nastran(uz_error *err)
{
    static const char text[] = "GRID,9,,0.,0.\nGRID,2,,1.,0.\nGRID,3,,0.,1.\nCTRIA3,7,1,9,2,3\nPLOTEL,3,9,2\n"
                               "SET3,1,GRID,9,2\nSET3,2,ELEM,3,THRU,7\n";
    uz_given_mesh given;
    const uz_status status = uz_nastran_read(&given, text, sizeof text - 1, 0, err);
    CHECK((given.xyz != NULL) == (status == UZ_OK));
    uz_given_mesh_clear(&given);
    return status;
}

TEST(nastran_files)
{
    CHECK(fail_each(read_nastran) > 25);
}

static uz_status read_vtk(uz_error *err)
{
    static const char xml[] =
        "<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"3\" NumberOfCells=\"1\"><Points>"
        "<DataArray type=\"Int8\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0</DataArray></Points>"
        "<Cells><DataArray type=\"Int8\" Name=\"connectivity\" format=\"binary\">AwAAAA==AAEC"
        "</DataArray><DataArray type=\"Int8\" Name=\"offsets\">3</DataArray><DataArray type=\"Int8\" "
        "Name=\"types\">5</DataArray></Cells><CellData><DataArray type=\"Int8\" Name=\"a\">1"
        "</DataArray></CellData></Piece></VTKFile>";
    static const char old[] =
        "# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 int\n0 0 0 1 0 0 "
        "0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\nPOINT_DATA 3\nSCALARS a int\n1 2 2\n";
    uz_given_mesh given;
    uz_status status = uz_vtk_read(&given, xml, sizeof xml - 1, 0, err);
    CHECK((given.xyz != NULL) == (status == UZ_OK));
    uz_given_mesh_clear(&given);
    if (status == UZ_OK)
        status = uz_vtk_read(&given, old, sizeof old - 1, 0, err);
    uz_given_mesh_clear(&given);
    return status;
}

TEST(vtk_files)
{
    CHECK(fail_each(read_vtk) > 40);
}

static uz_status read_deck(uz_error *err)
{
    static const char text[] =
        "*NODE,NSET=N\n1,0,0\n2,1,0\n3,0,1\n4,1,1\n9,3,3\n*ELEMENT,TYPE=CPS3,ELSET=E\n7,1,2,3\n8,2,4,3\n"
        "*MATERIAL,NAME=M\n*ELASTIC\n1.,.3\n*EXPANSION\n1.\n*SOLID SECTION,ELSET=E,MATERIAL=M\n"
        "*SURFACE,NAME=S,TYPE=NODE\n1\n2\n*SURFACE,NAME=T\n8,S2\n*CONTACT PAIR,INTERACTION=I\nS,T\n"
        "*RIGID BODY,ELSET=E,REF "
        "NODE=9\n*AMPLITUDE,NAME=A\n0.,0.,1.,2.\n*FRICTION\n.1\n*STEP\n*STATIC\n*BOUNDARY\n1,1,2\n3,1\n9,1\n"
        "*CLOAD,AMPLITUDE=A\n4,1,1.\n9,6,1.\n*DLOAD\n8,P2,1.\nE,GRAV,1.,0.,1.,0.\n*TEMPERATURE\nN,5.\n*END STEP\n";
    uz_deck deck;
    const uz_status status = uz_deck_read(&deck, text, sizeof text - 1, 0, true, err);
    CHECK((deck.notes != NULL) == (status == UZ_OK));
    uz_deck_clear(&deck);
    return status;
}

TEST(decks)
{
    CHECK(fail_each(read_deck) > 50);
}

static uz_status make_box(uz_error *err)
{
    uz_mesh mesh;
    const uz_box box = {.size = {1, 1, 1}, .cells = {2, 1, 1}, .element = "tet10", .dim = 3};
    const uz_status status = uz_mesh_from_box(&mesh, &box, err);
    CHECK((mesh.xyz != NULL) == (status == UZ_OK));
    uz_mesh_clear(&mesh);
    return status;
}

TEST(boxes)
{
    CHECK(fail_each(make_box) > 10);
}

static uz_status select_in_box(uz_error *err)
{
    uz_selection places[] = {{.name = "a", .by = UZ_SELECT_FACING, .facing = {0, 0, 1}},
                             {.name = "b", .by = UZ_SELECT_NEAREST},
                             {.name = "c", .by = UZ_SELECT_RANGE, .high = {1, 1, 1}, .kind = UZ_SELECT_ELEMENTS}};
    uz_mesh mesh;
    uz_scene scene = {.model = UZ_SOLID, .selections = places, .n_selections = 3};
    scene.box = (uz_box){.size = {1, 1, 1}, .cells = {2, 1, 1}, .element = "tet4", .dim = 3};
    const uz_status status = uz_mesh_from_scene(&mesh, &scene, err);
    CHECK((mesh.xyz != NULL) == (status == UZ_OK));
    uz_mesh_clear(&mesh);
    return status;
}

TEST(groups_by_where_they_are)
{
    CHECK(fail_each(select_in_box) > 15);
}

static uz_status refine_box(uz_error *err)
{
    static const int64_t MARKED[] = {2, 0, 7, 1, 12};
    uz_mesh mesh;
    uz_scene scene = {.model = UZ_SOLID, .refine = true, .bisected = MARKED, .n_bisected = 5};
    scene.box = (uz_box){.size = {1, 1, 1}, .cells = {2, 1, 1}, .element = "tet10", .dim = 3};
    const uz_status status = uz_mesh_from_scene(&mesh, &scene, err);
    CHECK((mesh.xyz != NULL) == (status == UZ_OK));
    uz_mesh_clear(&mesh);
    return status;
}

TEST(refined_boxes)
{
    CHECK(fail_each(refine_box) > 30);
}

static uz_status subdivide_box(uz_error *err)
{
    static const int64_t MARKED[] = {UZ_SUBDIVIDED, 1, 0, 2, 0, 5};
    const uz_box box = {.size = {1, 1, 1}, .cells = {2, 1, 1}, .element = "hex20", .dim = 3};
    uz_mesh mesh;
    uz_status status = uz_mesh_from_box(&mesh, &box, err);
    if (status == UZ_OK)
        status = uz_mesh_subdivide(&mesh, MARKED, 6, err);
    uz_mesh_clear(&mesh);
    return status;
}

TEST(subdivided_boxes)
{
    CHECK(fail_each(subdivide_box) > 30);
}
