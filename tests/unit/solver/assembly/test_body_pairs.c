/* Contact between two parts of one mesh. */
#include "body_fixture.h"
#include "core/alloc.h"
#include "internal_forces.h"

/* Adds a box, its groups called "a left", ...; its nodes moved. */
static void add_box(uz_scene *s, const uz_box *box, char name, body_map map)
{
    uz_scene part = {.box = *box};
    uz_given_mesh *to = &s->given, *from = &part.given;
    body_give_mesh(&part, map);
    const int64_t nodes = to->n_nodes, elements = to->n_elements, ends = to->first ? to->first[elements] : 0;
    const int64_t more = from->first[from->n_elements];
    double *xyz = body_room((nodes + from->n_nodes) * from->dim, sizeof *xyz);
    unsigned char *kind = body_room(elements + from->n_elements, 1);
    int64_t *first = body_room(elements + from->n_elements + 1, sizeof *first);
    int64_t *node = body_room(ends + more, sizeof *node);
    uz_given_group *groups = body_room(to->n_groups + from->n_groups + 8, sizeof *groups);
    for (int64_t i = 0; i < (nodes + from->n_nodes) * from->dim; i++)
        xyz[i] = i < nodes * from->dim ? to->xyz[i] : from->xyz[i - nodes * from->dim];
    for (int64_t e = 0; e < elements + from->n_elements; e++) {
        kind[e] = e < elements ? to->kind[e] : from->kind[e - elements];
        first[e + 1] = e < elements ? to->first[e + 1] : ends + from->first[e - elements + 1];
    }
    for (int64_t i = 0; i < ends + more; i++)
        node[i] = i < ends ? to->node[i] : nodes + from->node[i - ends];
    for (int64_t i = 0; i < to->n_groups + from->n_groups; i++) {
        uz_given_group *group = &groups[i];
        *group = i < to->n_groups ? to->groups[i] : from->groups[i - to->n_groups];
        if (i < to->n_groups)
            continue;
        memmove(group->name + 2, group->name, sizeof group->name - 3);
        group->name[0] = name;
        group->name[1] = ' ';
        for (int64_t k = 0; group->n_faces > 0 && k < group->face_first[group->n_faces]; k++)
            group->face_node[k] += nodes;
        for (int64_t k = 0; k < group->n_elements; k++)
            group->element[k] += elements;
    }
    to->n_groups += from->n_groups;
    from->n_groups = 0; /* their lists have moved */
    uz_free_all(to->groups, to->xyz, to->kind, to->first, to->node);
    to->groups = groups;
    to->xyz = xyz;
    to->kind = kind;
    to->first = first;
    to->node = node;
    to->dim = from->dim;
    to->n_nodes += from->n_nodes;
    to->n_elements += from->n_elements;
    uz_given_mesh_clear(from);
    s->source = UZ_MESH_GIVEN;
}

static void lift(double x[3])
{
    x[1] += 1;
}

/* Two boxes of 3 x 1 (x 2), the second on the first: of the same cells, or not. */
static uz_scene stack(uz_model model, const char *below, const char *above, int64_t cells, int64_t cells_above)
{
    uz_scene s = body_scene(model, below, (double[3]){3, 1, 2}, (int64_t[3]){cells, cells, cells});
    uz_box upper = s.box;
    snprintf(upper.element, sizeof upper.element, "%s", above);
    for (int c = 0; c < upper.dim; c++)
        upper.cells[c] = cells_above;
    add_box(&s, &s.box, 'a', NULL);
    add_box(&s, &upper, 'b', lift);
    return s;
}

static void put_pair(uz_scene *s, const char *on, const char *with)
{
    uz_contact *x = body_plane(s, on, (double[3]){0}, (double[3]){0});
    x->kind = UZ_OBSTACLE_BODY;
    snprintf(x->with, sizeof x->with, "%s", with);
}

static void hold_sides(uz_scene *s, char part)
{
    char name[16];
    snprintf(name, sizeof name, "%c left", part);
    if (s->model != UZ_AXISYMMETRIC)
        body_hold(s, name, 0, NAN, NAN);
    snprintf(name, sizeof name, "%c back", part);
    if (s->model == UZ_SOLID)
        body_hold(s, name, NAN, NAN, 0);
}

/* Two blocks pressed are one of twice the height where their nodes meet: uniform stress, and the pressure goes over. */
static void check_pressed(uz_model model, const char *element)
{
    const double q = 12, E = 200e3, along = model == UZ_PLANE_STRAIN ? (1 - 0.09) / E : 1 / E;
    uz_scene s = stack(model, element, element, 2, 2);
    hold_sides(&s, 'a');
    hold_sides(&s, 'b');
    body_hold(&s, "a bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "b top", q, 0, 0);
    put_pair(&s, "b bottom", "a top");
    uz_result *x = body_solve(&s, 1e-9);
    const int dim = x->summary.dim;
    CHECK_INT(x->summary.semicoercive.free_modes, 1);
    for (int64_t a = 0; a < x->n_nodes; a++)
        CHECK_MSG(fabs(x->u[a * dim + 1] + q * along * x->mesh.xyz[a * dim + 1]) < 1e-6 * 2 * q * along, "%s: %g at %g",
                  element, x->u[a * dim + 1], x->mesh.xyz[a * dim + 1]);
    for (int64_t i = 0; i < x->m; i++) {
        CHECK(fabs(x->r[i] + q * x->mesh.contact_area[i]) < 1e-5 * q);
        CHECK_INT(x->mesh.contact_of[i], 0);
        CHECK(x->mesh.contact_face[2 * i] >= 0 && x->mesh.contact_face[2 * i + 1] >= 0);
    }
    uz_result_free(x);
    uz_scene_clear(&s);
}

TEST(two_blocks_pressed_are_one)
{
    check_pressed(UZ_PLANE_STRESS, "quad4");
    check_pressed(UZ_PLANE_STRAIN, "tri3");
    check_pressed(UZ_AXISYMMETRIC, "quad4");
    check_pressed(UZ_SOLID, "hex8");
    check_pressed(UZ_SOLID, "tet4");
    check_pressed(UZ_SOLID, "hex20");
    check_pressed(UZ_SOLID, "wedge6");
    check_pressed(UZ_SOLID, "wedge15");
    check_pressed(UZ_PLANE_STRESS, "quad8");
}

/* Nothing but the floor holds the lower block down, nothing but the lower block the upper one. */
TEST(a_stack_on_a_floor)
{
    const double q = 12, along = 1 / 200e3;
    uz_scene s = stack(UZ_PLANE_STRESS, "quad4", "quad4", 2, 2);
    hold_sides(&s, 'a');
    hold_sides(&s, 'b');
    body_load(&s, UZ_LOAD_PRESSURE, "b top", q, 0, 0);
    body_plane(&s, "a bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    put_pair(&s, "b bottom", "a top");
    uz_result *x = body_solve(&s, 1e-9);
    CHECK_INT(x->summary.semicoercive.free_modes, 2);
    for (int64_t a = 0; a < x->n_nodes; a++)
        CHECK(fabs(x->u[2 * a + 1] + q * along * x->mesh.xyz[2 * a + 1]) < 1e-6 * 2 * q * along);
    CHECK_REL(x->summary.force[1], 2 * 36.0, 1e-6); /* of both contacts */
    uz_result_free(x);
    uz_error err = {0};
    s.n_contacts = 1; /* the upper block is held by nothing */
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_FREE_BODY);
    CHECK_MSG(strstr(err.message, "leave translation along y of the part with node 9 free"), "%s", err.message);
    uz_scene_clear(&s);
}

/* Meshes that do not match: the forces on both bodies balance, and no node is inside of the other body. */
TEST(blocks_of_other_meshes)
{
    static const struct {
        uz_model model;
        const char *below, *above;
        int64_t cells, cells_above;
    } kinds[] = {{UZ_PLANE_STRESS, "quad4", "tri6", 3, 5}, {UZ_PLANE_STRAIN, "quad8", "quad4", 4, 7},
                 {UZ_SOLID, "hex8", "tet4", 2, 3},         {UZ_SOLID, "tet10", "hex8", 2, 4},
                 {UZ_SOLID, "hex20", "tet10", 2, 3},       {UZ_SOLID, "hex8", "hex20", 3, 2},
                 {UZ_SOLID, "wedge15", "wedge6", 2, 3}};
    for (int k = 0; k < 4; k++) {
        uz_scene s = stack(kinds[k].model, kinds[k].below, kinds[k].above, kinds[k].cells, kinds[k].cells_above);
        hold_sides(&s, 'a');
        hold_sides(&s, 'b');
        body_hold(&s, "a bottom", NAN, 0, NAN);
        body_load(&s, UZ_LOAD_TRACTION, "b top", 0, -6, 0);
        body_load(&s, UZ_LOAD_TRACTION, "b right", 0, 4, 0);
        put_pair(&s, "b bottom", "a top");
        uz_result *x = body_solve(&s, 1e-9);
        uz_body_model model = body_model(&s);
        const int dim = x->summary.dim;
        double *f = body_room(x->n_nodes * dim, sizeof *f), reaction = 0;
        CHECK(x->summary.active > 0 && x->summary.active < x->m);
        CHECK(internal_forces(f, &model, x->u));
        for (int64_t a = 0; a < x->n_nodes; a++)
            if (x->mesh.xyz[a * dim + 1] == 0)
                reaction += f[a * dim + 1];
        CHECK_REL(reaction, dim == 3 ? 28.0 : 14.0, 1e-6);
        CHECK_REL(x->summary.force[1], dim == 3 ? 28.0 : 14.0, 1e-6);
        CHECK(x->summary.max_penetration < 1e-9);
        free(f);
        uz_body_model_clear(&model);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* A support that moves the master, all of whose nodes are held, closes the gap: the block above it is strained by it.
 */
TEST(a_moved_master_presses)
{
    uz_scene s = stack(UZ_PLANE_STRESS, "quad4", "quad4", 2, 3);
    hold_sides(&s, 'b');
    body_hold(&s, "a all", 0, 1e-3, NAN);
    body_hold(&s, "b top", NAN, 0, NAN);
    put_pair(&s, "b bottom", "a top");
    uz_result *x = body_solve(&s, 1e-10);
    CHECK_INT(x->summary.active, 4);
    CHECK_REL(x->summary.force[1], 200e3 * 1e-3 * 3, 1e-8);
    uz_result_free(x);
    body_hold(&s, "b all", NAN, 0, NAN); /* now no node can give way */
    uz_error err = {0};
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/contacts/0");
    CHECK_MSG(strstr(err.message, "inside the obstacle and cannot give way"), "%s", err.message);
    uz_scene_clear(&s);
}

TEST(a_body_that_nothing_holds_is_named)
{
    uz_scene s = stack(UZ_PLANE_STRESS, "quad4", "quad4", 2, 2);
    uz_error err = {0};
    body_hold(&s, "a bottom", 0, 0, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "b top", 1, 0, 0);
    put_pair(&s, "b bottom", "a top");
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_FREE_BODY);
    CHECK_MSG(strstr(err.message, "leave translation along x of the part with node 9 free"), "%s", err.message);
    body_hold(&s, "b left", 0, NAN, NAN);
    memset(&err, 0, sizeof err);
    CHECK_MSG(uz_scene_check(&s, &err) == UZ_OK, "%s", err.message);
    s.loads[0].value = -1;
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_FREE_BODY);
    CHECK_STR(err.where, "/loads");
    CHECK_MSG(strstr(err.message, "translation along +y of the part with node 9"), "%s", err.message);
    uz_scene_clear(&s);
}

static void sink(double x[3])
{
    x[1] -= 1.25;
}

/* A clamp around a plate: its lower jaw is behind the plate's top, and did not come through it. */
TEST(the_far_side_of_a_clamp_has_no_rows)
{
    static const char *const elements[] = {"quad4", "quad8", "hex8", "tet10"};
    for (int k = 0; k < 4; k++) {
        uz_scene s = stack(k < 2 ? UZ_PLANE_STRESS : UZ_SOLID, elements[k], elements[k], 2, 3);
        uz_mesh_info info;
        uz_qp qp;
        uz_error err = {0};
        add_box(&s, &s.box, 'c', sink);
        for (int64_t g = 0; g < s.given.n_groups; g++)
            if (strcmp(s.given.groups[g].name, "c top") == 0) /* groups of one name are one */
                snprintf(s.given.groups[g].name, sizeof s.given.groups[g].name, "b bottom");
        body_hold(&s, "a bottom", 0, 0, s.model == UZ_SOLID ? 0 : NAN);
        body_hold(&s, "b top", 0, 0, s.model == UZ_SOLID ? 0 : NAN);
        body_hold(&s, "c bottom", 0, 0, s.model == UZ_SOLID ? 0 : NAN);
        put_pair(&s, "b bottom", "a top");
        CHECK_MSG(uz_scene_to_qp(&qp, &info, &s, &err) == UZ_OK, "%s: %s", err.where, err.message);
        CHECK(qp.N.rows > 0);
        for (int64_t i = 0; i < qp.N.rows; i++) {
            const double y = info.xyz[info.contact_node[i] * info.dim + 1];
            CHECK_MSG(y == 1 && fabs(qp.h[i]) < 1e-14, "%s: row %lld at y = %g", elements[k], (long long)i, y);
        }
        uz_qp_clear(&qp);
        uz_mesh_info_clear(&info);
        uz_scene_clear(&s);
    }
}

/* ------------------------------------------------------------------- roller */

enum { RADIUS = 50 };

/* The right half of a disc from [0, 1] x [0, 2] by the map of a square onto it, X = x sqrt(1 - y^2 / 2). Its bottom is
 * the arc of 45 degrees around the origin. */
static void half_disc(double x[3])
{
    const double a = x[0], b = x[1] - 1;
    x[0] = RADIUS * a * sqrt(1 - 0.5 * b * b);
    x[1] = RADIUS + RADIUS * b * sqrt(1 - 0.5 * a * a);
}

static void below(double x[3])
{
    x[0] *= 2 * RADIUS;
    x[1] = 2 * RADIUS * (x[1] - 1);
}

/* NAFEMS's roller in short (Konter, "Advanced finite element contact benchmarks" (2006), benchmark 1): a steel cylinder
 * on an aluminium block, 35 kN per mm, plane strain; half of both, held sideways by symmetry, the cylinder downwards by
 * contact only. Hertz: half width 6.215 mm, peak 3585 MPa. */
TEST(a_roller_on_a_block)
{
    const double force = 17500, peak = 3585, half_width = 6.215;
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){1, 2, 0}, (int64_t[3]){32, 32, 0});
    uz_box disc = s.box, ground = s.box;
    disc.grading[0] = disc.grading[1] = 12;
    ground.size[1] = 1;
    ground.grading[0] = 40;
    ground.grading[1] = 1.0 / 40;
    s.materials[0] = (uz_material){.on = "b all", .young = 210e3, .poisson = 0.3};
    s.materials[s.n_materials++] = (uz_material){.on = "a all", .young = 70e3, .poisson = 0.3};
    add_box(&s, &ground, 'a', below);
    add_box(&s, &disc, 'b', half_disc);
    body_hold(&s, "a left", 0, NAN, NAN);
    body_hold(&s, "b left", 0, NAN, NAN);
    body_hold(&s, "a bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "b top", 0, -force, 0);
    put_pair(&s, "b bottom", "a top");
    uz_result *x = body_solve(&s, 1e-8);
    double sum = 0, moment = 0; /* of Hertz's half ellipse: a^2 / 4 is the mean square of the place */
    for (int64_t i = 0; i < x->m; i++) {
        const double at = x->mesh.xyz[2 * x->mesh.contact_node[i]];
        const double push = fabs(x->r[i] * x->mesh.contact_normal[2 * i + 1]);
        sum += push;
        moment += push * at * at;
    }
    const double a = 2 * sqrt(moment / sum), p0 = 4 * sum / (acos(-1) * a);
    CHECK_INT(x->summary.semicoercive.free_modes, 1);
    CHECK_REL(sum, force, 1e-6);
    CHECK_MSG(fabs(a / half_width - 1) < 0.03, "half width %g", a);
    CHECK_MSG(fabs(p0 / peak - 1) < 0.03, "peak %g", p0);
    uz_result_free(x);
    uz_scene_clear(&s);
}
