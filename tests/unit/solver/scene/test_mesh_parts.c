/* Parts of a mesh, and whether the body lies all the way between two of its sides: a strip folded so that its ends
 * overlap, and a plate beside it. */
#include "body_fixture.h"
#include "harness.h"
#include "scene/mesh_parts.h"

/* From 5 to 7 along the strip a half circle about (5, 1.45); the upper arm comes down to the lower one at its end. */
static void fold(double x[3])
{
    const double turn = (x[0] - 5) / 2 * acos(-1), r = 1.45 - x[1], s = x[0];
    if (s <= 5)
        return;
    x[0] = s < 7 ? 5 + r * sin(turn) : 5 - (s - 7);
    x[1] = s < 7 ? 1.45 - r * cos(turn) : 1.45 + r - 0.25 * (s - 7);
}

TEST(the_back_of_a_body_is_where_it_ends_on_the_way_through_it)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){12, 1, 0}, (int64_t[3]){12, 1, 0});
    uz_mesh mesh;
    uz_own_body *own;
    uz_error err = {0};
    body_give_mesh(&s, fold);
    CHECK_INT(uz_mesh_from_scene(&mesh, &s, &err), UZ_OK);
    const uz_group *inner = uz_mesh_group(&mesh, "top", "", &err), *outer = uz_mesh_group(&mesh, "bottom", "", &err);
    int64_t part[26];
    CHECK_INT(mesh.n_nodes, 26);
    CHECK_INT(uz_mesh_number_parts(part, &mesh), 1);
    CHECK_INT(uz_own_body_new(&own, &mesh, inner, outer, &err), UZ_OK);
    CHECK(own && uz_own_body_same(own, 0, 11));
    CHECK_INT(uz_own_body_way(own, 2, (double[]){2.5, 0}, 2, (double[]){2.5, 1}),
              UZ_WAY_BACK); /* through the lower arm */
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.5, 0}, 4, (double[]){4.5, 1}), UZ_WAY_BACK); /* along it */
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.5, 1}, 11, (double[]){0.5, 0.775}),
              UZ_WAY_OVERLAP); /* the arms overlap */
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.5, 0}, 11, (double[]){0.5, 1.775}), UZ_WAY_APART); /* through both */
    CHECK_INT(uz_own_body_way(own, 3, (double[]){3.5, 1}, 8, (double[]){3.5, 1.65}), UZ_WAY_APART); /* across the gap */
    CHECK_INT(uz_own_body_way(NULL, 2, (double[]){2.5, 0}, 2, (double[]){2.5, 1}), UZ_WAY_OVERLAP);
    uz_own_body_free(own);
    CHECK_INT(uz_groups_share_face(&mesh, inner, inner), 1);
    CHECK_INT(uz_groups_share_face(&mesh, inner, outer), 0);
    uz_mesh_clear(&mesh);
    uz_scene_clear(&s);
}

/* The first side of the lower arm bulges to 0.835 at x = 0.7, above all of its nodes; the upper arm is at 0.825. */
static void bulging_fold(double x[3])
{
    const double off = 2 * x[0] - 1.4;
    if (x[0] <= 1)
        x[1] *= 0.835 - 0.2 * off * off;
    fold(x);
}

TEST(curved_sides_overlap_outside_the_box_of_their_nodes)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad8", (double[3]){12, 1, 0}, (int64_t[3]){12, 1, 0});
    uz_mesh mesh;
    uz_own_body *own;
    uz_error err = {0};
    body_give_mesh(&s, bulging_fold);
    CHECK_INT(uz_mesh_from_scene(&mesh, &s, &err), UZ_OK);
    const uz_group *inner = uz_mesh_group(&mesh, "top", "", &err);
    CHECK_INT(uz_own_body_new(&own, &mesh, inner, inner, &err), UZ_OK);
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.7, 0.835}, 11, (double[]){0.7, 0.825}), UZ_WAY_OVERLAP);
    CHECK_INT(uz_own_body_way(own, 11, (double[]){0.7, 0.825}, 0, (double[]){0.7, 0.835}), UZ_WAY_OVERLAP);
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.7, 0.835}, 0, (double[]){0.7, 0}), UZ_WAY_BACK);
    uz_own_body_free(own);
    uz_mesh_clear(&mesh);
    uz_scene_clear(&s);
}

TEST(parts_without_sides_of_both_groups_have_no_back)
{
    static double xyz[16] = {0, 0, 1, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 2, 0, 2};
    static int64_t first[3] = {0, 4, 8}, node[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    static unsigned char kind[2] = {UZ_QUAD4, UZ_QUAD4};
    uz_face bottom[2] = {{0, 0}, {1, 0}}, top[2] = {{0, 2}, {1, 2}};
    const uz_mesh mesh = {
        .dim = 2, .n_nodes = 8, .n_elements = 2, .xyz = xyz, .kind = kind, .first = first, .node = node};
    const uz_group bottoms = {.kind = UZ_GROUP_FACES, .n_faces = 2, .face = bottom};
    const uz_group tops = {.kind = UZ_GROUP_FACES, .n_faces = 2, .face = top};
    const uz_group low = {.kind = UZ_GROUP_FACES, .n_faces = 1, .face = bottom};
    const uz_group high = {.kind = UZ_GROUP_FACES, .n_faces = 1, .face = top + 1};
    int64_t part[8];
    uz_own_body *own;
    uz_error err = {0};
    CHECK_INT(uz_mesh_number_parts(part, &mesh), 2);
    CHECK(part[3] == 0 && part[4] == 1);
    CHECK_INT(uz_own_body_new(&own, &mesh, &low, &high, &err), UZ_OK);
    CHECK(!own);
    CHECK_INT(uz_own_body_new(&own, &mesh, &bottoms, &tops, &err), UZ_OK);
    CHECK(own && !uz_own_body_same(own, 0, 1));
    CHECK_INT(uz_own_body_way(own, 1, (double[]){0.5, 1}, 1, (double[]){0.5, 2}), UZ_WAY_BACK);
    CHECK_INT(uz_own_body_way(own, 0, (double[]){0.5, 0}, 1, (double[]){0.5, 2}), UZ_WAY_OVERLAP); /* two parts */
    uz_own_body_free(own);
}
