/* Facets that are refined: new nodes are where the smooth surface is, elements stay sound, and each allocation on the
 * way fails once. Linked with malloc, calloc, realloc and free wrapped. */
#include "failing_heap.h"

#include "assembly/parts.h"
#include "body_fixture.h"
#include "sanitized.h"

#define RADIUS 2.0
#define INNER  1.0

/* A quarter of a ring, in space of a tube: x goes round, y outwards. */
static void bend(double x[3])
{
    const double angle = 0.5 * acos(-1.0) * (1 - x[0]), radius = INNER + (RADIUS - INNER) * x[1];
    x[0] = radius * cos(angle);
    x[1] = radius * sin(angle);
}

/* Thin at the outer side: the facets' sagitta is more than an element is thick. */
static void bend_thin(double x[3])
{
    x[1] = 1 - 0.02 * (1 - x[1]);
    bend(x);
}

static uz_scene ring(const char *element, int64_t around, body_map map)
{
    const bool solid = uz_element_type_of(UZ_TET4)->dim == 3 && strncmp(element, "tet", 3) == 0;
    uz_scene s =
        body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, element, (double[]){1, 1, 1}, (int64_t[]){around, 2, 1});
    uz_contact *contact = &s.contacts[s.n_contacts++];
    *contact = (uz_contact){.kind = UZ_OBSTACLE_BODY, .on = "top", .with = "bottom"};
    body_give_mesh(&s, map);
    s.refine = true;
    return s;
}

/* All elements bisected `rounds` times: the list. *n: its length. */
static int64_t *everything(int64_t *n, const uz_scene *scene, int rounds)
{
    int64_t *list = NULL;
    *n = 0;
    for (int k = 0; k < rounds; k++) {
        uz_mesh mesh;
        uz_scene s = *scene;
        uz_error err = {0};
        s.bisected = list;
        s.n_bisected = *n;
        CHECK_MSG(uz_mesh_from_scene(&mesh, &s, &err) == UZ_OK, "%s", err.message);
        list = realloc(list, (size_t)(*n + mesh.n_elements + 1) * sizeof *list);
        list[(*n)++] = mesh.n_elements;
        for (int64_t e = 0; e < mesh.n_elements; e++)
            list[(*n)++] = e;
        uz_mesh_clear(&mesh);
    }
    return list;
}

/* How far the new nodes of a group are from the circle or the cylinder, at most. */
static double off_circle(const uz_mesh *mesh, const char *name, double radius)
{
    double most = 0;
    const uz_group *group = uz_mesh_group(mesh, name, "", NULL);
    for (int64_t k = 0; k < group->n_nodes; k++) {
        const double *x = mesh->xyz + uz_group_node_at(group, k) * mesh->dim;
        most = fmax(most, fabs(hypot(x[0], x[1]) - radius));
    }
    return most;
}

static uz_mesh refined(uz_scene *s, int rounds)
{
    uz_mesh mesh;
    uz_error err = {0};
    int64_t *list = everything(&s->n_bisected, s, rounds);
    s->bisected = list;
    CHECK_MSG(uz_mesh_from_scene(&mesh, s, &err) == UZ_OK, "%s", err.message);
    CHECK_MSG(uz_smooth_refined(&mesh, s, &err) == UZ_OK, "%s", err.message);
    free(list);
    s->bisected = NULL;
    s->n_bisected = 0;
    return mesh;
}

TEST(new_nodes_are_where_the_smooth_surface_is)
{
    static const char *const ELEMENTS[] = {"tri3", "quad4", "tri6", "quad8", "tet4"};
    for (size_t k = 0; k < sizeof ELEMENTS / sizeof ELEMENTS[0]; k++)
        for (int faceted = 0; faceted < 2; faceted++) {
            const bool quadratic = strchr("68", ELEMENTS[k][strlen(ELEMENTS[k]) - 1]) != NULL;
            const double sagitta = RADIUS * (1 - cos(acos(-1.0) / (quadratic ? 64 : 32)));
            uz_scene s = ring(ELEMENTS[k], 8, bend);
            s.contacts[0].faceted = faceted;
            uz_mesh mesh = refined(&s, 2);
            const double off = fmax(off_circle(&mesh, "top", RADIUS), off_circle(&mesh, "bottom", INNER));
            /* of parabolas what is off is of fourth order already */
            if (faceted)
                CHECK_MSG(quadratic || fabs(off / sagitta - 1) < 1e-6, "%s: %g of %g", ELEMENTS[k], off, sagitta);
            else
                CHECK_MSG(off < 3e-4 * sagitta, "%s: %g of %g", ELEMENTS[k], off, sagitta);
            uz_mesh_clear(&mesh);
            uz_scene_clear(&s);
        }
}

/* Twice as wide as high. */
static void flatten(double x[3])
{
    bend(x);
    x[1] *= 0.5;
}

TEST(what_is_round_before_an_obstacle_stays_so)
{
    static const char *const ELEMENTS[] = {"tri3", "quad4", "tet4"};
    for (size_t k = 0; k < sizeof ELEMENTS / sizeof ELEMENTS[0]; k++)
        for (int oval = 0; oval < 2; oval++) {
            uz_scene s = ring(ELEMENTS[k], 8, oval ? flatten : bend), still;
            s.contacts[0] = (uz_contact){.kind = UZ_OBSTACLE_PLANE, .on = "top", .normal = {0, 1, 0}};
            uz_mesh mesh = refined(&s, 1);
            still = s;
            still.n_contacts = 0;
            uz_mesh facets = refined(&still, 1);
            const size_t size = (size_t)(mesh.n_nodes * mesh.dim) * sizeof *mesh.xyz;
            CHECK_INT(mesh.n_nodes, facets.n_nodes);
            CHECK((memcmp(mesh.xyz, facets.xyz, size) == 0) == oval);
            CHECK(oval || off_circle(&mesh, "top", RADIUS) < 1e-5);
            CHECK(oval || off_circle(&mesh, "bottom", INNER) > 1e-3); /* which touches nothing */
            uz_mesh_clear(&mesh);
            uz_mesh_clear(&facets);
            uz_scene_clear(&s);
        }
}

/* The inner side goes into elements that are thinner than its sagitta; new nodes within follow, or all stays. */
TEST(elements_stay_sound)
{
    static const char *const ELEMENTS[] = {"tri3", "quad4", "tet4"};
    for (size_t k = 0; k < sizeof ELEMENTS / sizeof ELEMENTS[0]; k++) {
        uz_scene s = ring(ELEMENTS[k], 4, bend_thin);
        uz_mesh mesh = refined(&s, 3);
        double least = INFINITY;
        for (int64_t e = 0; e < mesh.n_elements; e++) {
            const int64_t *node = mesh.node + mesh.first[e];
            const int dim = mesh.dim;
            double edge[3][3] = {{0}};
            for (int j = 0; j < dim; j++)
                for (int c = 0; c < dim; c++)
                    edge[j][c] = mesh.xyz[node[j + 1] * dim + c] - mesh.xyz[node[0] * dim + c];
            const double size = dim == 2 ? edge[0][0] * edge[1][1] - edge[0][1] * edge[1][0]
                                         : edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) -
                                               edge[0][1] * (edge[1][0] * edge[2][2] - edge[1][2] * edge[2][0]) +
                                               edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
            least = fmin(least, size);
        }
        CHECK_MSG(least > 0, "%s: %g", ELEMENTS[k], least);
        uz_mesh_clear(&mesh);
        uz_scene_clear(&s);
    }
}

TEST(allocations)
{
    uz_scene s = ring("quad4", 4, bend);
    int64_t n = 0, *list = everything(&n, &s, 1);
    s.bisected = list;
    s.n_bisected = n;
    for (long k = 0;; k = next_allocation(k)) {
        uz_error err = {0};
        uz_mesh mesh;
        CHECK_INT(uz_mesh_from_scene(&mesh, &s, &err), UZ_OK);
        heap_watch(k);
        const uz_status status = uz_smooth_refined(&mesh, &s, &err);
        heap.watching = false;
        CHECK_MSG(heap.live == 0, "%d blocks leaked where allocation %ld fails", heap.live, k);
        CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "%s after %ld allocations (%s)",
                  uz_status_name(status), k, err.message);
        uz_mesh_clear(&mesh);
        if (!heap.failed) {
            CHECK(k > 20);
            break;
        }
    }
    free(list);
    uz_scene_clear(&s);
}
