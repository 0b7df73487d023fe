/* What a scene on a mesh with groups is refused for: materials, supports, loads, contacts, model. */
#include "core/alloc.h"
#include "core/aside.h"
#include "harness.h"
#include "scene/mesh.h"
#include "scene/scene.h"

#include <math.h>

/* Two triangles, a square of side 1: nodes 0 1 2 3 counterclockwise, triangles 0 1 2 and 0 2 3. */
typedef struct {
    double xyz[8];
    unsigned char kind[2];
    int64_t first[3], node[6], list[8], face_first[4];
    uz_given_group groups[5];
    uz_material materials[2];
    uz_support supports[1];
    uz_load loads[1];
    uz_contact contacts[2];
    uz_scene scene;
} square;

static void make_square(square *s)
{
    *s = (square){.xyz = {0, 0, 1, 0, 1, 1, 0, 1}, .first = {0, 3, 6}, .node = {0, 1, 2, 0, 2, 3}};
    const int64_t list[8] = {0, 1, 0, 1, 0, 2, 2, 3}; /* elements; bottom, diagonal, top */
    memcpy(s->list, list, sizeof list);
    for (int i = 0; i < 4; i++)
        s->face_first[i] = 2 * i;
    s->kind[0] = s->kind[1] = UZ_TRI3;
    s->groups[0] = (uz_given_group){.name = "lower", .n_elements = 1, .element = s->list};
    s->groups[1] = (uz_given_group){.name = "upper", .n_elements = 1, .element = s->list + 1};
    s->groups[2] = (uz_given_group){.name = "corner", .n_nodes = 1, .node = s->list};
    s->groups[3] = (uz_given_group){.name = "bottom", .n_faces = 1, .face_first = s->face_first};
    s->groups[3].face_node = s->list + 2;
    s->groups[4] = (uz_given_group){.name = "cut", .n_faces = 3, .face_first = s->face_first};
    s->groups[4].face_node = s->list + 2;
    s->materials[0] = (uz_material){.on = "all", .young = 1, .poisson = 0.3};
    s->materials[1] = (uz_material){.on = "upper", .young = 1, .poisson = 0.3};
    uz_given_mesh given = {.dim = 2, .n_nodes = 4, .xyz = s->xyz, .n_elements = 2, .kind = s->kind};
    given.first = s->first;
    given.node = s->node;
    given.groups = s->groups;
    given.n_groups = 5;
    s->scene = (uz_scene){.model = UZ_PLANE_STRESS, .thickness = 1, .source = UZ_MESH_GIVEN, .given = given};
    s->scene.materials = s->materials;
    s->scene.n_materials = 1;
    s->scene.supports = s->supports;
    s->scene.loads = s->loads;
    s->scene.contacts = s->contacts;
}

static void expect(const uz_scene *scene, uz_status status, const char *where, const char *fragment)
{
    uz_mesh mesh;
    uz_error err = {0};
    uz_status got = uz_mesh_from_scene(&mesh, scene, &err);
    if (got == UZ_OK)
        got = uz_scene_check_body(scene, &mesh, &err);
    if (got == UZ_OK)
        got = uz_scene_check_load(scene, &mesh, &err);
    CHECK_MSG(got == status, "%s: %s (%s)", where, uz_status_name(got), err.message);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, fragment) != NULL, "\"%s\" lacks \"%s\"", err.message, fragment);
    uz_mesh_clear(&mesh);
}

#define EXPECT(change, status, where, fragment)                                                                        \
    do {                                                                                                               \
        square s;                                                                                                      \
        make_square(&s);                                                                                               \
        change;                                                                                                        \
        expect(&s.scene, status, where, fragment);                                                                     \
    } while (0)
#define REFUSED(change, where, fragment) EXPECT(change, UZ_ERR_SCENE, where, fragment)
#define TAKEN(change)                    EXPECT(change, UZ_OK, "", "")

TEST(every_element_has_one_material)
{
    TAKEN((void)0);
    TAKEN((snprintf(s.materials[0].on, 64, "lower"), s.scene.n_materials = 2));
    REFUSED(snprintf(s.materials[0].on, 64, "lower"), "/materials", "element 1 (tri3, with a node at (0, 0)) has no");
    REFUSED(s.scene.n_materials = 2, "/materials/1/on", "element 1 (tri3) of \"upper\" already has material 0");
    REFUSED((s.scene.n_materials = 2, s.materials[1] = s.materials[0]), "/materials/1/on",
            "the elements of \"all\" already have material 0");
    REFUSED(snprintf(s.materials[0].on, 64, "corner"), "/materials/0/on", "made of nodes");
    REFUSED(snprintf(s.materials[0].on, 64, "bottom"), "/materials/0/on", "is a side");
    REFUSED(s.materials[0].density = -1, "/materials/0/density", "negative");
    EXPECT(s.materials[0].density = (double)NAN, UZ_ERR_NOT_FINITE, "/materials/0/density", "finite");
    EXPECT(s.materials[0].expansion = (double)INFINITY, UZ_ERR_NOT_FINITE, "/materials/0/expansion", "finite");
    REFUSED((s.materials[0].poisson = 0.5, s.scene.model = UZ_AXISYMMETRIC), "/materials/0/poisson",
            "stiff in a body of revolution");
}

TEST(models_fit_meshes)
{
    TAKEN(s.scene.model = UZ_AXISYMMETRIC);
    TAKEN((s.scene.model = UZ_AXISYMMETRIC, s.scene.thickness = 0));
    REFUSED((s.scene.model = UZ_AXISYMMETRIC, s.xyz[6] = -0.5), "/mesh", "node 3 at (-0.5, 1) has a negative x");
    TAKEN((s.scene.model = UZ_AXISYMMETRIC, s.xyz[6] = -1e-16));
    REFUSED(s.scene.model = UZ_SOLID, "/mesh/nodes", "mesh in 2 dimensions");
    REFUSED(s.scene.formulation = UZ_FORMULATION_BBAR, "/formulation", "quad4 and hex8");
    REFUSED(s.scene.formulation = UZ_FORMULATIONS, "/formulation", "unknown");
}

static void support(square *s, uz_support_kind kind, const char *on, double x, double y)
{
    s->scene.n_supports = 1;
    s->supports[0] = (uz_support){.kind = kind, .u = {x, y, NAN}, .normal = {x, y}, .spring = {x, y}};
    snprintf(s->supports[0].on, 64, "%s", on);
}

TEST(supports_of_every_kind)
{
    TAKEN(support(&s, UZ_SUPPORT_COMPONENTS, "corner", 0, NAN));
    TAKEN(support(&s, UZ_SUPPORT_NORMAL, "lower", 1, -1));
    TAKEN(support(&s, UZ_SUPPORT_SPRING, "bottom", 0, 5));
    EXPECT(support(&s, (uz_support_kind)9, "corner", 0, 1), UZ_ERR_ARGUMENT, "/supports/0", "unknown kind");
    REFUSED(support(&s, UZ_SUPPORT_COMPONENTS, "corner", NAN, NAN), "/supports/0", "no direction");
    REFUSED(support(&s, UZ_SUPPORT_NORMAL, "corner", 0, -0.0), "/supports/0/normal", "zero");
    EXPECT(support(&s, UZ_SUPPORT_NORMAL, "corner", NAN, 0), UZ_ERR_NOT_FINITE, "/supports/0/normal/0", "finite");
    EXPECT((support(&s, UZ_SUPPORT_NORMAL, "corner", 1, 0), s.supports[0].value = (double)NAN), UZ_ERR_NOT_FINITE,
           "/supports/0/u", "finite");
    REFUSED(support(&s, UZ_SUPPORT_SPRING, "bottom", 0, -5), "/supports/0/spring/1", "negative");
    REFUSED(support(&s, UZ_SUPPORT_SPRING, "bottom", 0, 0), "/supports/0/spring", "no stiffness");
    REFUSED(support(&s, UZ_SUPPORT_SPRING, "corner", 0, 1), "/supports/0/on", "made of nodes");
    REFUSED(support(&s, UZ_SUPPORT_SPRING, "all", 0, 1), "/supports/0/on", "name the sides that stand on it");
}

static void load(square *s, uz_load_kind kind, const char *on, double value)
{
    s->scene.n_loads = 1;
    s->loads[0] = (uz_load){.kind = kind, .v = {value, 1}, .value = value};
    snprintf(s->loads[0].on, 64, "%s", on);
}

TEST(loads_suit_their_groups)
{
    TAKEN(load(&s, UZ_LOAD_TRACTION, "cut", 1));
    TAKEN(load(&s, UZ_LOAD_PRESSURE, "bottom", 1));
    TAKEN(load(&s, UZ_LOAD_FORCE, "corner", 1));
    TAKEN(load(&s, UZ_LOAD_FORCE, "cut", 1));
    TAKEN(load(&s, UZ_LOAD_BODY_FORCE, "upper", 1));
    TAKEN((load(&s, UZ_LOAD_GRAVITY, "all", 1), s.materials[0].density = 1));
    TAKEN((load(&s, UZ_LOAD_TEMPERATURE, "lower", 1), s.materials[0].expansion = -1));
    TAKEN((load(&s, UZ_LOAD_NODE_FORCE, "", 1), s.loads[0].node = 3));
    REFUSED(load(&s, UZ_LOAD_TRACTION, "lower", 1), "/loads/0/on", "made of elements");
    REFUSED(load(&s, UZ_LOAD_TRACTION, "corner", 1), "/loads/0/on", "made of nodes");
    REFUSED(load(&s, UZ_LOAD_PRESSURE, "cut", 1), "/loads/0/on", "1 faces of \"cut\" lie between two elements");
    REFUSED(load(&s, UZ_LOAD_FORCE, "upper", 1), "/loads/0/on", "body_force");
    REFUSED(load(&s, UZ_LOAD_BODY_FORCE, "bottom", 1), "/loads/0/on", "body_force acts on elements");
    REFUSED(load(&s, UZ_LOAD_GRAVITY, "all", 1), "/loads/0/gravity", "no material has a density");
    REFUSED(load(&s, UZ_LOAD_TEMPERATURE, "all", 1), "/loads/0/temperature", "no material has an expansion");
    REFUSED((load(&s, UZ_LOAD_NODE_FORCE, "", 1), s.loads[0].node = 4), "/loads/0/node", "0 to 3");
    REFUSED((load(&s, UZ_LOAD_NODE_FORCE, "", 1), s.loads[0].node = -1), "/loads/0/node", "no node -1");
    REFUSED(load(&s, UZ_LOAD_FORCE, "nowhere", 1), "/loads/0/on", "no group \"nowhere\"");
    EXPECT(load(&s, UZ_LOAD_PRESSURE, "bottom", NAN), UZ_ERR_NOT_FINITE, "/loads/0/pressure", "finite");
    EXPECT(load(&s, UZ_LOAD_FORCE, "bottom", NAN), UZ_ERR_NOT_FINITE, "/loads/0/force/0", "finite");
    EXPECT((load(&s, UZ_LOAD_TEMPERATURE, "all", INFINITY), s.materials[0].expansion = 1), UZ_ERR_NOT_FINITE,
           "/loads/0/temperature", "finite");
}

static void contact(square *s, uz_obstacle_kind kind, const char *on, const char *with)
{
    s->scene.n_contacts = 1;
    s->contacts[0] = (uz_contact){.kind = kind, .normal = {0, 1}};
    snprintf(s->contacts[0].on, 64, "%s", on);
    snprintf(s->contacts[0].with, 64, "%s", with);
}

static void contacts(square *s, uz_obstacle_kind kind, const char *on, const char *with)
{
    contact(s, UZ_OBSTACLE_BODY, on, with);
    s->contacts[1] = s->contacts[0];
    contact(s, kind, "boundary", "bottom");
    s->scene.n_contacts = 2;
}

TEST(sides_touch_by_one_contact)
{
    REFUSED(contacts(&s, UZ_OBSTACLE_BODY, "bottom", "boundary"), "/contacts/1", "contact 0");
    REFUSED(contacts(&s, UZ_OBSTACLE_BODY, "boundary", "bottom"), "/contacts/1", "each pair once");
    TAKEN(contacts(&s, UZ_OBSTACLE_PLANE, "boundary", "bottom"));
}

TEST(contacts_suit_their_groups)
{
    TAKEN(contact(&s, UZ_OBSTACLE_PLANE, "bottom", ""));
    TAKEN(contact(&s, UZ_OBSTACLE_BODY, "bottom", "boundary"));
    REFUSED(contact(&s, UZ_OBSTACLE_PLANE, "corner", ""), "/contacts/0/on", "made of nodes");
    REFUSED(contact(&s, UZ_OBSTACLE_PLANE, "cut", ""), "/contacts/0/on", "between two elements");
    TAKEN(contact(&s, UZ_OBSTACLE_BODY, "bottom", "bottom"));
    REFUSED(contact(&s, UZ_OBSTACLE_BODY, "bottom", "lower"), "/contacts/0/with", "made of elements");
    REFUSED(contact(&s, UZ_OBSTACLE_BODY, "bottom", "ground"), "/contacts/0/with", "no group");
}

/* A strip of triangles, two of which are inverted: the first one is told of, whoever finds which first. */
TEST(threads_find_the_first_element_that_is_wrong)
{
    enum { N = 40000, FIRST = 20003, SECOND = 39001, THREADS = 3 };
    uz_given_mesh given = {.dim = 2, .n_nodes = N + 2, .n_elements = N};
    double *xyz = malloc((N + 2) * 2 * sizeof *xyz);
    unsigned char *kind = malloc(N);
    int64_t *first = malloc((N + 1) * sizeof *first), *node = malloc((size_t)N * 3 * sizeof *node);
    CHECK(xyz && kind && first && node);
    for (int i = 0; i < N + 2; i++) {
        const int column = i / 2;
        xyz[2 * i] = column;
        xyz[2 * i + 1] = i % 2;
    }
    for (int e = 0; e <= N; e++)
        first[e] = 3 * e;
    for (int e = 0; e < N; e++) {
        const bool turned = (e % 2 == 0) == (e == FIRST || e == SECOND);
        kind[e] = UZ_TRI3;
        node[3 * e] = e;
        node[3 * e + 1] = turned ? e + 1 : e + 2;
        node[3 * e + 2] = turned ? e + 2 : e + 1;
    }
    given.xyz = xyz;
    given.kind = kind;
    given.first = first;
    given.node = node;
    const uz_scene scene = {.model = UZ_PLANE_STRESS, .thickness = 1, .source = UZ_MESH_GIVEN, .given = given};
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int threads = 1; threads <= THREADS; threads++) {
        uz_mesh mesh;
        uz_error err = {0};
        uz_aside_allow(threads);
        CHECK_INT(uz_mesh_from_scene(&mesh, &scene, &err), UZ_ERR_SCENE);
        CHECK_MSG(strstr(err.message, "element 20003 "), "%s", err.message);
    }
    uz_aside_allow(1);
    uz_free_all(xyz, kind, first, node);
}
