/* Nodes of one body on the faces of another: closest points, weights, normals, borders, refusals. */
#include "core/alloc.h"
#include "core/random.h"
#include "harness.h"
#include "obstacle/box_tree.h"
#include "obstacle/face_point.h"
#include "obstacle/projection.h"

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * uz_uniform(seed);
}

static void near(double got, double want, double tolerance, const char *what)
{
    CHECK_MSG(fabs(got - want) <= tolerance, "%s: got %.17g, want %.17g", what, got, want);
}

static void *checked(void *block)
{
    if (!block)
        abort();
    return block;
}

/* A surface of n x n cells over [0, 1]^2 (2D: a line of n over [0, 1]), the master, and points over it, the slaves.
 * Elements: quad4 or quad8 below a line, hex8 below a surface. */
typedef struct {
    uz_mesh mesh;
    uz_group on, with;
} bodies;

typedef double surface_height(double x, double y);

static double flat(double x, double y)
{
    (void)x;
    (void)y;
    return 0;
}

static double hill(double x, double y)
{
    return 0.3 * sin(4 * x) * cos(3 * y);
}

static double roof(double x, double y)
{
    (void)y;
    return -fabs(x - 0.5);
}

static bodies make_bodies(int dim, uz_element_kind kind, int64_t n, int64_t slaves, surface_height *height)
{
    bodies b = {.on = {.name = "shoe", .kind = UZ_GROUP_NODES}, .with = {.name = "floor", .kind = UZ_GROUP_FACES}};
    const int per = uz_element_node_count(kind);
    const int64_t cells = dim == 2 ? n : n * n, line = kind == UZ_QUAD8 ? 2 * n + 1 : n + 1;
    const int64_t top = dim == 2 ? line : line * line;
    uz_mesh *m = &b.mesh;
    *m = (uz_mesh){.dim = dim, .n_nodes = 2 * top + slaves, .n_elements = cells, .extent = 2};
    m->xyz = checked(uz_alloc_zero(m->n_nodes * dim, sizeof *m->xyz));
    m->kind = checked(uz_alloc_zero(cells, 1));
    m->first = checked(uz_alloc_zero(cells + 1, sizeof *m->first));
    m->node = checked(uz_alloc_zero(cells * per, sizeof *m->node));
    b.on.node = checked(uz_alloc_zero(slaves, sizeof *b.on.node));
    b.with.face = checked(uz_alloc_zero(cells, sizeof *b.with.face));
    for (int64_t i = 0; i < 2 * top; i++) {
        const int64_t k = i % top, row = k / line;
        double *x = m->xyz + i * dim;
        x[0] = (double)(k % line) / (double)(line - 1);
        if (dim == 3)
            x[1] = (double)row / (double)(line - 1);
        x[dim - 1] = height(x[0], dim == 3 ? x[1] : 0) - (i < top ? 0 : 1);
    }
    for (int64_t e = 0; e < cells; e++) {
        int64_t *of = m->node + e * per;
        const int64_t step = kind == UZ_QUAD8 ? 2 : 1, a = dim == 2 ? step * e : e / n * line + e % n, below = top;
        const int64_t quad[8] = {a + step + below, a + below, a, a + step}, middle = a + 1;
        const int64_t hex[8] = {a + below, a + 1 + below, a + 1 + line + below, a + line + below,
                                a,         a + 1,         a + 1 + line,         a + line};
        memcpy(of, dim == 2 ? quad : hex, (size_t)per * sizeof *of);
        if (dim == 2) { /* the line has its body on the right; an edge has it on the left */
            of[0] = a + step;
            of[1] = a;
            of[2] = a + below;
            of[3] = a + step + below;
        }
        if (kind == UZ_QUAD8) {
            of[4] = middle;
            of[5] = of[6] = of[7] = middle + below;
        }
        m->kind[e] = (unsigned char)kind;
        m->first[e + 1] = (e + 1) * per;
        b.with.face[e] = (uz_face){e, dim == 2 ? 0 : 5};
    }
    b.with.n_faces = cells;
    b.on.n_nodes = slaves;
    for (int64_t i = 0; i < slaves; i++)
        b.on.node[i] = 2 * top + i;
    return b;
}

static double *slave(bodies *b, int64_t i)
{
    return b->mesh.xyz + b->on.node[i] * b->mesh.dim;
}

static void clear(bodies *b)
{
    uz_mesh_clear(&b->mesh);
    free(b->on.node);
    free(b->with.face);
}

static uz_contact_pair *rows_of(int64_t *count, const bodies *b)
{
    uz_contact_pair *row;
    uz_error err = {0};
    const uz_status status =
        uz_contact_pairs(&row, count, &b->mesh, &b->on, &b->with, 0, &(uz_own_place){0}, false, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return row;
}

/* What every row must be: weights of sum 1 that give the foot, a unit normal along foot to node, and so a gap that no
 * motion of both bodies together changes. tilt: sine of the angle that the border's tolerance allows. */
static void check_row(const bodies *b, const uz_contact_pair *row, double tilt)
{
    const int dim = b->mesh.dim;
    double sum = 0, foot[3] = {0}, off[3] = {0}, length = 0, gap = 0, across = 0;
    for (int j = 0; j < row->count; j++) {
        sum += row->weight[j];
        for (int c = 0; c < dim; c++)
            foot[c] += row->weight[j] * b->mesh.xyz[row->master[j] * dim + c];
    }
    for (int c = 0; c < dim; c++) {
        off[c] = b->mesh.xyz[row->node * dim + c] - foot[c];
        length += row->normal[c] * row->normal[c];
        gap += off[c] * row->normal[c];
    }
    for (int c = 0; c < dim; c++)
        across += fabs(off[c] - gap * row->normal[c]);
    near(sum, 1, 1e-14, "sum of weights");
    near(length, 1, 1e-14, "normal");
    near(row->gap, gap, 1e-14, "gap");
    near(across, 0, 1e-12 + tilt, "moment");
}

TEST(nodes_over_a_straight_edge)
{
    bodies b = make_bodies(2, UZ_QUAD4, 4, 3, flat);
    int64_t count;
    memcpy(slave(&b, 0), (double[]){0.3, 0.2}, 16);
    memcpy(slave(&b, 1), (double[]){0.75, -0.1}, 16);
    memcpy(slave(&b, 2), (double[]){0, 0}, 16);
    uz_contact_pair *row = rows_of(&count, &b);
    CHECK_INT(count, 3);
    near(row[0].gap, 0.2, 1e-16, "gap");
    CHECK(row[0].normal[0] == 0 && row[0].normal[1] == 1);
    CHECK_INT(row[0].face.element, 1);
    CHECK(row[0].master[0] == 2 && row[0].master[1] == 1);
    near(row[0].weight[0], 0.2, 1e-15, "weight");
    near(row[1].gap, -0.1, 1e-16, "overlap");
    CHECK(row[1].normal[0] == 0 && row[1].normal[1] == 1);
    CHECK(row[2].gap == 0 && row[2].normal[1] == 1);
    for (int i = 0; i < 3; i++)
        check_row(&b, &row[i], 0);
    free(row);
    clear(&b);
}

/* Each row against the best of all faces, each of them looked at alone. */
static void check_against_all(bodies *b, uint64_t *seed)
{
    int64_t count;
    const int dim = b->mesh.dim;
    for (int64_t i = 0; i < b->on.n_nodes; i++)
        for (int c = 0; c < dim; c++)
            slave(b, i)[c] = c < dim - 1 ? between(seed, 0.05, 0.95) : between(seed, -0.4, 0.6);
    uz_contact_pair *row = rows_of(&count, b);
    CHECK(count > b->on.n_nodes * 9 / 10);
    for (int64_t i = 0; i < count; i++) {
        double best = INFINITY, own = 0;
        for (int64_t f = 0; f < b->with.n_faces; f++) {
            double xyz[3 * UZ_FACE_NODES];
            int64_t node[UZ_FACE_NODES];
            uz_foot foot;
            const int nodes = uz_mesh_face(node, &b->mesh, b->with.face[f]);
            for (int j = 0; j < nodes * dim; j++)
                xyz[j] = b->mesh.xyz[node[j / dim] * dim + j % dim] - b->mesh.xyz[row[i].node * dim + j % dim];
            uz_face_closest(&foot, dim, nodes, xyz);
            best = fmin(best, foot.distance2);
            if (row[i].face.element == b->with.face[f].element)
                own = foot.distance2;
        }
        near(own, best, 1e-15, "nearest face");
        near(row[i].gap * row[i].gap, best, 3e-4 * best + 1e-15, "distance");
        check_row(b, &row[i], UZ_OVERHANG * 0.1);
    }
    free(row);
}

TEST(nearest_of_many_faces)
{
    uint64_t seed = 1;
    bodies line = make_bodies(2, UZ_QUAD4, 100, 300, hill), bent = make_bodies(2, UZ_QUAD8, 40, 300, hill);
    bodies wavy = make_bodies(3, UZ_HEX8, 12, 300, hill);
    check_against_all(&line, &seed);
    check_against_all(&bent, &seed);
    check_against_all(&wavy, &seed);
    clear(&line);
    clear(&bent);
    clear(&wavy);
}

/* Least distance from the origin over a fine lattice of the face's coordinates, by shape functions of its own. */
static double sampled(int count, const double *x)
{
    enum { N = 400 };
    double best = INFINITY;
    for (int i = 0; i <= N; i++)
        for (int j = 0; j <= N; j++) {
            const double s = (double)i / N, t = (double)j / N, l = 1 - s - t;
            double w[6] = {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t}, d = 0;
            if (count != 4 && i + j > N)
                continue;
            if (count == 3)
                memcpy(w, (double[]){l, s, t}, 3 * sizeof *w);
            if (count == 6)
                memcpy(w,
                       (double[]){l * (2 * l - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * l * s, 4 * s * t, 4 * t * l},
                       sizeof w);
            for (int c = 0; c < 3; c++) {
                double at = 0;
                for (int k = 0; k < count; k++)
                    at += w[k] * x[3 * k + c];
                d += at * at;
            }
            best = fmin(best, d);
        }
    return sqrt(best);
}

static void random_face(double *x, int count, uint64_t *seed)
{
    static const double QUAD[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const double TRI[6][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
    const double from[3] = {between(seed, -1, 1), between(seed, -1, 1), between(seed, -1, 1)};
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            x[3 * i + c] =
                from[c] - 0.5 + (c < 2 ? (count == 4 ? QUAD[i][c] : TRI[i][c]) : 0) + between(seed, -0.12, 0.12);
}

/* Things in a row, one at each whole number, of which `met` alone may be met. */
typedef struct {
    int64_t met;
    int *asked;
} row_of_things;

static double distance_in_row(const void *ctx, int64_t item, const double *x, double best)
{
    const row_of_things *row = ctx;
    (void)best;
    (*row->asked)++;
    return item == row->met ? (x[0] - (double)item) * (x[0] - (double)item) : (double)INFINITY;
}

/* Where nothing near may be met, as on a body's own back, all things would be looked at. */
TEST(nothing_is_looked_for_beyond_the_farthest)
{
    enum { THINGS = 1000 };
    double box[4 * THINGS];
    uz_box_tree tree;
    uz_error err = {0};
    for (int i = 0; i < 4 * THINGS; i++)
        box[i] = i % 2 == 0 ? i / 4 : 0;
    CHECK_INT(uz_box_tree_init(&tree, THINGS, 2, box, &err), UZ_OK);
    for (int k = 0; k < 4; k++) {
        int asked = 0;
        const row_of_things row = {k < 2 ? -1 : 503, &asked};
        const double x[2] = {500, 0}, farthest = k == 0 ? (double)INFINITY : k == 3 ? 8.9 : 9;
        CHECK_INT(uz_box_tree_nearest(&tree, x, farthest, distance_in_row, &row), k == 2 ? 503 : -1);
        CHECK_MSG(k == 0 ? asked == THINGS : asked < 20, "%d", asked);
    }
    uz_box_tree_clear(&tree);
}

TEST(closest_points_against_samples)
{
    uint64_t seed = 9;
    const int counts[] = {3, 4, 6};
    int places[3] = {0};
    for (int trial = 0; trial < 120; trial++) {
        double x[18], sum = 0, normal[3] = {0};
        const int count = counts[trial % 3];
        uz_foot foot;
        random_face(x, count, &seed);
        uz_face_closest(&foot, 3, count, x);
        const double got = sqrt(foot.distance2), want = sampled(count, x);
        CHECK_MSG(got <= want + 1e-12 && got >= want - 2e-3, "%d nodes: got %.17g, want %.17g", count, got, want);
        for (int i = 0; i < count; i++)
            sum += foot.weight[i];
        near(sum, 1, 1e-14, "sum of weights");
        places[foot.place]++;
        for (int c = 0; c < 3; c++)
            normal[c] = foot.normal[c] * foot.point[(c + 1) % 3] - foot.normal[(c + 1) % 3] * foot.point[c];
        if (foot.place == UZ_FACE_WITHIN) /* the face's normal leads to the point */
            near(fabs(normal[0]) + fabs(normal[1]) + fabs(normal[2]), 0, 1e-12, "normal");
    }
    CHECK(places[UZ_FACE_WITHIN] > 10 && places[UZ_FACE_EDGE] > 10 && places[UZ_FACE_CORNER] > 10);
}

/* A parabola y = -s^2 / 2 under the origin's neighbours: the foot solves a cubic. */
TEST(foot_on_a_parabola)
{
    uint64_t seed = 2;
    for (int trial = 0; trial < 50; trial++) {
        const double s = between(&seed, -0.9, 0.9), gap = between(&seed, -0.3, 2), w = sqrt(1 + s * s);
        const double at[2] = {s + gap * s / w, -0.5 * s * s + gap / w}; /* along the normal (s, 1) of the foot */
        const double x[6] = {1 - at[0], -0.5 - at[1], -1 - at[0], -0.5 - at[1], -at[0], -at[1]};
        uz_foot foot;
        uz_face_closest(&foot, 2, 3, x);
        near(foot.local[0], -s, 1e-13, "local"); /* from right to left: the body is below, on its left */
        near(sqrt(foot.distance2), fabs(gap), 1e-14, "distance");
        near(foot.normal[0], s / w, 1e-13, "normal x");
        near(foot.normal[1], 1 / w, 1e-13, "normal y");
    }
}

/* A point of the plane of a face has weights that no affine map changes; any point has those that no rotation does. */
TEST(projection_moves_with_the_bodies)
{
    uint64_t seed = 4;
    bodies b = make_bodies(3, UZ_HEX8, 5, 60, hill), moved = make_bodies(3, UZ_HEX8, 5, 60, hill);
    const double a = 0.7, t[3][3] = {{cos(a), -sin(a), 0},
                                     {0.6 * sin(a), 0.6 * cos(a), -0.8},
                                     {0.8 * sin(a), 0.8 * cos(a), 0.6}};
    int64_t count, again;
    for (int64_t i = 0; i < 60; i++)
        for (int c = 0; c < 3; c++)
            slave(&b, i)[c] = between(&seed, 0.1, 0.9);
    for (int64_t i = 0; i < b.mesh.n_nodes; i++)
        for (int c = 0; c < 3; c++) {
            const double *x = b.mesh.xyz + 3 * i;
            moved.mesh.xyz[3 * i + c] = 1000 * (t[c][0] * x[0] + t[c][1] * x[1] + t[c][2] * x[2] + 3);
        }
    moved.mesh.extent = 2000;
    uz_contact_pair *row = rows_of(&count, &b), *turned = rows_of(&again, &moved);
    CHECK_INT(count, again);
    for (int64_t i = 0; i < count && i < again; i++) {
        near(turned[i].gap / 1000, row[i].gap, 1e-13, "gap");
        for (int c = 0; c < 3; c++) {
            const double *n = row[i].normal;
            near(turned[i].normal[c], t[c][0] * n[0] + t[c][1] * n[1] + t[c][2] * n[2], 1e-11, "normal");
        }
    }
    free(row);
    free(turned);
    clear(&b);
    clear(&moved);
}

TEST(weights_are_affine_in_the_plane)
{
    uint64_t seed = 6;
    for (int trial = 0; trial < 40; trial++) {
        double p[9], q[9] = {0}, A[9];
        const double w[3] = {0.2, 0.5, 0.3};
        uz_foot foot, mapped;
        random_face(p, 3, &seed);
        for (int c = 0; c < 3; c++) {
            const double at = w[0] * p[c] + w[1] * p[3 + c] + w[2] * p[6 + c];
            for (int i = 0; i < 3; i++)
                p[3 * i + c] -= at;
        }
        for (int i = 0; i < 9; i++)
            A[i] = (i % 4 == 0 ? 1 : 0) + between(&seed, -0.3, 0.3);
        for (int i = 0; i < 9; i++)
            for (int k = 0; k < 3; k++)
                q[i] += A[3 * (i % 3) + k] * p[i / 3 * 3 + k];
        uz_face_closest(&foot, 3, 3, p);
        uz_face_closest(&mapped, 3, 3, q);
        for (int i = 0; i < 3; i++) {
            near(foot.weight[i], w[i], 1e-14, "weight");
            near(mapped.weight[i], w[i], 1e-13, "weight");
        }
    }
}

TEST(normal_turns_over_a_ridge)
{
    bodies b = make_bodies(2, UZ_QUAD4, 4, 4, roof), solid = make_bodies(3, UZ_HEX8, 4, 2, roof);
    const double s = sqrt(0.5);
    int64_t count;
    memcpy(slave(&b, 0), (double[]){0.5, 0.2}, 16);
    memcpy(slave(&b, 1), (double[]){0.53, 0.04}, 16);
    memcpy(slave(&b, 2), (double[]){0.5, 0}, 16);
    memcpy(slave(&b, 3), (double[]){0.5, -0.2}, 16); /* within: the nearer side, of two the first */
    uz_contact_pair *row = rows_of(&count, &b);
    CHECK_INT(count, 4);
    near(row[0].gap, 0.2, 1e-15, "gap");
    near(row[0].normal[1], 1, 1e-15, "normal");
    near(row[1].gap, 0.05, 1e-15, "gap");
    near(row[1].normal[0], 0.6, 1e-14, "normal");
    CHECK(row[2].gap == 0 && row[2].normal[0] == 0 && row[2].normal[1] == 1);
    near(row[3].gap, -0.2 * s, 1e-15, "gap");
    near(row[3].normal[0], -s, 1e-15, "normal");
    free(row);
    memcpy(slave(&solid, 0), (double[]){0.53, 0.3, 0.04}, 24);
    memcpy(slave(&solid, 1), (double[]){0.5, 0.5, 0}, 24);
    row = rows_of(&count, &solid);
    CHECK_INT(count, 2);
    near(row[0].gap, 0.05, 1e-14, "gap");
    near(row[0].normal[0], 0.6, 1e-14, "normal");
    near(row[0].normal[1], 0, 1e-14, "normal");
    near(row[1].normal[2], 1, 1e-14, "normal at a corner");
    free(row);
    clear(&b);
    clear(&solid);
}

TEST(nodes_beyond_the_border_have_no_row)
{
    bodies b = make_bodies(3, UZ_HEX8, 4, 5, flat);
    int64_t count;
    memcpy(slave(&b, 0), (double[]){-0.012, 0.4, 0.1}, 24); /* 0.05 of a face of 0.25 is 0.0125 */
    memcpy(slave(&b, 1), (double[]){-0.013, 0.4, 0.1}, 24);
    memcpy(slave(&b, 2), (double[]){1, 1, 0.1}, 24);
    memcpy(slave(&b, 3), (double[]){1.01, 1.01, -0.1}, 24);
    memcpy(slave(&b, 4), (double[]){0.5, 1.01, 0.3}, 24);
    uz_contact_pair *row = rows_of(&count, &b);
    CHECK_INT(count, 3);
    CHECK(count == 3 && row[0].node == b.on.node[0] && row[1].node == b.on.node[2] && row[2].node == b.on.node[4]);
    for (int64_t i = 0; i < count; i++) {
        CHECK(row[i].normal[0] == 0 && row[i].normal[1] == 0 && row[i].normal[2] == 1);
        near(row[i].gap, i == 2 ? 0.3 : 0.1, 1e-15, "gap");
    }
    free(row);
    clear(&b);
}

/* Each side of one tetrahedron under a node that stands off its middle. */
static void check_tetrahedron(uz_element_kind kind)
{
    static const int EDGE[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
    double xyz[33] = {0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3};
    unsigned char kinds[1] = {(unsigned char)kind};
    const int nodes = uz_element_node_count(kind), corners = 4;
    int64_t first[2] = {0, nodes}, node[10], shoe[1] = {nodes};
    for (int i = 0; i < nodes; i++)
        node[i] = i;
    for (int k = 0; k < 18 && nodes > corners; k++)
        xyz[12 + k] = 0.5 * (xyz[3 * EDGE[k / 3][0] + k % 3] + xyz[3 * EDGE[k / 3][1] + k % 3]);
    const uz_mesh mesh = {.dim = 3,
                          .n_nodes = nodes + 1,
                          .n_elements = 1,
                          .xyz = xyz,
                          .kind = kinds,
                          .first = first,
                          .node = node,
                          .extent = 4};
    for (int side = 0; side < 4; side++) {
        uz_face face = {0, side};
        const uz_group on = {.name = "shoe", .kind = UZ_GROUP_NODES, .n_nodes = 1, .node = shoe};
        const uz_group with = {.name = "side", .kind = UZ_GROUP_FACES, .n_faces = 1, .face = &face};
        int64_t of[UZ_FACE_NODES], count;
        uz_contact_pair *row;
        uz_error err = {0};
        double inner[3], *x = xyz + 3 * (size_t)nodes;
        const int per = uz_mesh_face(of, &mesh, face);
        for (int c = 0; c < 3; c++) { /* away from the tetrahedron's middle, through that of the side */
            const double middle = (xyz[3 * of[0] + c] + xyz[3 * of[1] + c] + xyz[3 * of[2] + c]) / 3;
            inner[c] = (xyz[c] + xyz[3 + c] + xyz[6 + c] + xyz[9 + c]) / 4;
            x[c] = middle + 0.1 * (middle - inner[c]);
        }
        CHECK_INT(uz_contact_pairs(&row, &count, &mesh, &on, &with, 0, &(uz_own_place){0}, false, &err), UZ_OK);
        CHECK_INT(count, 1);
        CHECK_INT(row->count, per);
        CHECK(row->gap > 0);
        for (int j = 0; j < per; j++) /* the foot's coordinates, from those of the nodes */
            for (int c = 0; c < 3; c++)
                x[c] -= row->weight[j] * xyz[3 * row->master[j] + c];
        for (int c = 0; c < 3; c++)
            near(x[c], row->gap * row->normal[c], 1e-14, "off the foot");
        free(row);
    }
}

TEST(sides_of_tetrahedra)
{
    check_tetrahedron(UZ_TET4);
    check_tetrahedron(UZ_TET10);
}

static void refused(const bodies *b, const uz_group *on, const uz_group *with, const char *where, const char *fragment)
{
    uz_contact_pair *row;
    int64_t count;
    uz_error err = {0};
    CHECK_INT(uz_contact_pairs(&row, &count, &b->mesh, on, with, 3, &(uz_own_place){0}, false, &err), UZ_ERR_SCENE);
    CHECK(!row && count == 0);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, fragment) != NULL, "\"%s\" lacks \"%s\"", err.message, fragment);
}

TEST(bad_groups_are_refused)
{
    bodies b = make_bodies(2, UZ_QUAD4, 4, 2, flat);
    memcpy(slave(&b, 0), (double[]){-3, 0.2}, 16);
    memcpy(slave(&b, 1), (double[]){3, 0.2}, 16);
    refused(&b, &b.on, &b.with, "/contacts/3/on", "no node of \"shoe\" faces \"floor\"");
    refused(&b, &b.on, &b.on, "/contacts/3/with", "\"shoe\" has no faces");
    b.on.node[0] = 2;
    refused(&b, &b.on, &b.with, "/contacts/3/on", "node 2 is in \"shoe\"");
    b.on.node[0] = b.mesh.n_nodes - 2;
    b.mesh.xyz[0] = b.mesh.xyz[2]; /* the first face's ends are one place: all of them have y = 0 */
    memcpy(slave(&b, 0), (double[]){0.25, 0.1}, 16);
    refused(&b, &b.on, &b.with, "/contacts/3/with", "has no area");
    clear(&b);
}
