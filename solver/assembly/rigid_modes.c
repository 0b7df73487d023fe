/* rigid_modes.c: which rigid-body motions the supports leave to each connected part of the body.
 *
 * A small motion of a plane part is q = (translation x, translation y, rotation times size), about its centre. A
 * supported dof forbids one combination of the three: u_x = q0 - q2 (y - cy)/size, u_y = q1 + q2 (x - cx)/size. The
 * part stays in place when these combinations span all of q. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "semicoercive/pressed.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIM = 2, MODES = 3 };
static const double DEPENDENT = 1e-9; /* a unit row that differs less from the span of others adds nothing */

typedef struct {
    int64_t node; /* one of its nodes */
    double low[DIM], high[DIM];
    int rank;
    double held[MODES][MODES]; /* rank orthonormal rows: combinations of q that supports forbid */
} part;

/* The connected parts of a mesh. */
typedef struct {
    int64_t count, *of; /* of: n_nodes */
    part *list;
} body_parts;

/* Representative of a node's part; halves the path on its way. */
static int64_t find_root(int64_t *parent, int64_t a)
{
    while (parent[a] != a) {
        parent[a] = parent[parent[a]];
        a = parent[a];
    }
    return a;
}

/* part_of[node] = number of its connected part, parts numbered by their first node. Returns how many, -1: no memory. */
static int64_t number_parts(int64_t *part_of, const uz_mesh *mesh)
{
    int64_t count = 0;
    int64_t *parent = uz_alloc(mesh->n_nodes, sizeof *parent);
    if (!parent)
        return -1;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        parent[a] = a;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e] + 1; i < mesh->first[e + 1]; i++) {
            int64_t a = find_root(parent, mesh->node[i]);
            int64_t b = find_root(parent, mesh->node[mesh->first[e]]);
            parent[a > b ? a : b] = a > b ? b : a; /* the lesser node leads, so a root is met before its followers */
        }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        part_of[a] = parent[a] == a ? count++ : part_of[find_root(parent, a)];
    free(parent);
    return count;
}

/* v minus its projection on the rows, twice for accuracy; returns the length of what is left. */
static double reject(double v[MODES], double rows[][MODES], int n)
{
    for (int twice = 0; twice < 2; twice++)
        for (int i = 0; i < n; i++) {
            double dot = v[0] * rows[i][0] + v[1] * rows[i][1] + v[2] * rows[i][2];
            for (int k = 0; k < MODES; k++)
                v[k] -= dot * rows[i][k];
        }
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Appends v to the orthonormal rows unless they span it already. */
static void extend(double rows[][MODES], int *n, const double v[MODES])
{
    double rest[MODES] = {v[0], v[1], v[2]};
    if (*n == MODES)
        return;
    double length = reject(rest, rows, *n);
    if (length <= DEPENDENT)
        return;
    for (int k = 0; k < MODES; k++)
        rows[*n][k] = rest[k] / length;
    (*n)++;
}

static double part_size(const part *p)
{
    double size = 0.5 * hypot(p->high[0] - p->low[0], p->high[1] - p->low[1]);
    return size > 0 ? size : 1;
}

static double part_centre(const part *p, int axis)
{
    return 0.5 * p->low[axis] + 0.5 * p->high[axis];
}

static void hold(part *p, const double *x, int axis)
{
    const double across = (x[1 - axis] - part_centre(p, 1 - axis)) / part_size(p);
    const double row[MODES] = {axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, axis == 0 ? -across : across};
    extend(p->held, &p->rank, row);
}

static void measure_parts(part *parts, int64_t n_parts, const int64_t *part_of, const uz_mesh *mesh)
{
    for (int64_t i = 0; i < n_parts; i++)
        for (int c = 0; c < DIM; c++) {
            parts[i].low[c] = DBL_MAX;
            parts[i].high[c] = -DBL_MAX;
        }
    for (int64_t a = mesh->n_nodes - 1; a >= 0; a--) {
        part *p = &parts[part_of[a]];
        p->node = a;
        for (int c = 0; c < DIM; c++) {
            p->low[c] = fmin(p->low[c], mesh->xyz[a * DIM + c]);
            p->high[c] = fmax(p->high[c], mesh->xyz[a * DIM + c]);
        }
    }
}

static void hold_parts(part *parts, const int64_t *part_of, const uz_body_model *model)
{
    for (int64_t a = 0; a < model->mesh.n_nodes; a++)
        for (int c = 0; c < DIM; c++)
            if (model->dof[a * DIM + c] < 0)
                hold(&parts[part_of[a]], &model->mesh.xyz[a * DIM], c);
}

/* What is zero but for rounding reads as zero. */
static double tidy(double value, double scale)
{
    return fabs(value) > 1e-9 * scale ? value : 0;
}

static void name_mode(char *text, size_t size, const part *p, const double q[MODES])
{
    const double length = hypot(q[0], q[1]);
    if (fabs(q[2]) <= 1e-7 * length) {
        const double x = tidy(q[0] / length, 1), y = tidy(q[1] / length, 1);
        if (x == 0 || y == 0)
            snprintf(text, size, "translation along %s", y == 0 ? "x" : "y");
        else
            snprintf(text, size, "translation along (%.6g, %.6g)", x, y);
        return;
    }
    /* The point that stays where it is. */
    const double L = part_size(p);
    const double x = part_centre(p, 0) - tidy(q[1] / q[2], 1) * L, y = part_centre(p, 1) + tidy(q[0] / q[2], 1) * L;
    snprintf(text, size, "rotation about (%.6g, %.6g)", tidy(x, L), tidy(y, L));
}

/* Orthonormal modes that no support holds, translations first. Returns how many. */
static int free_modes(double mode[MODES][MODES], const part *p)
{
    static const double axis[MODES][MODES] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double rows[MODES][MODES];
    int n = p->rank;
    memcpy(rows, p->held, sizeof rows);
    for (int k = 0; k < MODES; k++)
        extend(rows, &n, axis[k]);
    memcpy(mode, rows[p->rank], (size_t)(n - p->rank) * sizeof rows[0]);
    n -= p->rank;
    /* Two modes are a plane: turn them so that the first one does not rotate. */
    const double spin = n == 2 ? hypot(mode[0][2], mode[1][2]) : 0;
    if (spin > 0) {
        const double c = mode[1][2] / spin, s = mode[0][2] / spin;
        for (int k = 0; k < MODES; k++) {
            const double still = c * mode[0][k] - s * mode[1][k], turning = s * mode[0][k] + c * mode[1][k];
            mode[0][k] = still;
            mode[1][k] = turning;
        }
    }
    return n;
}

static void name_modes(char *names, size_t size, const part *p)
{
    char name[96];
    double mode[MODES][MODES];
    const int n = free_modes(mode, p);
    names[0] = '\0';
    for (int i = 0; i < n; i++) {
        const size_t used = strlen(names);
        name_mode(name, sizeof name, p, mode[i]);
        snprintf(names + used, size - used, "%s%s", i ? ", " : "", name);
    }
}

static uz_status refuse(const part *p, int64_t n_parts, const char *who, uz_error *err)
{
    char names[300], which[96] = "";
    name_modes(names, sizeof names, p);
    if (n_parts > 1)
        snprintf(which, sizeof which, " of the part with node %lld", (long long)p->node);
    return uz_fail(err, UZ_ERR_FREE_BODY, "/supports", "%s leave %s%s free; hold it by further supports", who, names,
                   which);
}

static void clear_parts(body_parts *all)
{
    free(all->list);
    free(all->of);
}

/* The parts, and what supports hold of them. clear_parts also after a failure. */
static uz_status find_parts(body_parts *all, const uz_body_model *model, uz_error *err)
{
    *all = (body_parts){0};
    all->of = uz_alloc(model->mesh.n_nodes, sizeof *all->of);
    all->count = all->of ? number_parts(all->of, &model->mesh) : -1;
    all->list = all->count >= 0 ? uz_alloc_zero(all->count, sizeof *all->list) : NULL;
    if (!all->list)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the parts of %lld nodes", (long long)model->mesh.n_nodes);
    measure_parts(all->list, all->count, all->of, &model->mesh);
    hold_parts(all->list, all->of, model);
    return UZ_OK;
}

uz_status uz_check_rigid_modes(const uz_body_model *model, uz_error *err)
{
    body_parts all;
    uz_status status = find_parts(&all, model, err);
    for (int64_t i = 0; status == UZ_OK && i < all.count; i++)
        if (all.list[i].rank < MODES)
            status = refuse(&all.list[i], all.count, "the supports", err);
    clear_parts(&all);
    return status;
}

/* Place of a node in its part: from the centre, over the size. */
static void place_in_part(double place[DIM], const part *p, const uz_mesh *mesh, int64_t node)
{
    for (int c = 0; c < DIM; c++)
        place[c] = (mesh->xyz[node * DIM + c] - part_centre(p, c)) / part_size(p);
}

/* An obstacle stands in the way of one combination of the motions of its part, from one side. */
static void hold_by_contacts(body_parts *all, const uz_body_model *model)
{
    for (int64_t i = 0; i < model->m; i++) {
        const int64_t node = model->info.contact_node[i];
        const double *n = model->info.contact_normal + i * DIM;
        part *p = &all->list[all->of[node]];
        double at[DIM];
        place_in_part(at, p, &model->mesh, node);
        const double row[MODES] = {n[0], n[1], n[1] * at[0] - n[0] * at[1]};
        extend(p->held, &p->rank, row);
    }
}

/* Displacements of the free dofs (d) for the motion q of part i. */
static void move_part(double *z, const body_parts *all, int64_t i, const double q[MODES], const uz_body_model *model)
{
    const part *p = &all->list[i];
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        if (all->of[a] != i)
            continue;
        double at[DIM];
        place_in_part(at, p, &model->mesh, a);
        const double u[3] = {q[0] - q[2] * at[1], q[1] + q[2] * at[0], 0};
        double local[3];
        uz_to_frame(local, model, a, u);
        for (int c = 0; c < DIM; c++)
            if (model->dof[a * DIM + c] >= 0)
                z[model->dof[a * DIM + c]] = local[c];
    }
}

uz_status uz_rigid_modes(double **modes, int64_t *count, const uz_body_model *model, uz_error *err)
{
    body_parts all;
    double *z = NULL, mode[MODES][MODES];
    int64_t n = 0;
    *modes = NULL;
    *count = 0;
    uz_status status = find_parts(&all, model, err);
    for (int64_t i = 0; status == UZ_OK && i < all.count; i++)
        n += MODES - all.list[i].rank;
    if (status == UZ_OK && n > 0 && !(z = uz_alloc_zero(n * model->d, sizeof *z)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid-body modes", (long long)n);
    for (int64_t i = 0, at = 0; status == UZ_OK && i < all.count; i++) {
        const int own = free_modes(mode, &all.list[i]);
        for (int k = 0; k < own; k++)
            move_part(z + (at++) * model->d, &all, i, mode[k], model);
    }
    if (status == UZ_OK)
        hold_by_contacts(&all, model);
    for (int64_t i = 0; status == UZ_OK && i < all.count; i++)
        if (all.list[i].rank < MODES)
            status = refuse(&all.list[i], all.count, model->m > 0 ? "the supports and obstacles" : "the supports", err);
    clear_parts(&all);
    if (status == UZ_OK) {
        *modes = z;
        *count = n;
    } else {
        free(z);
    }
    return status;
}

/* "translation along +y", "rotation about (30, 0), clockwise". */
static void name_direction(char *text, size_t size, const part *p, const double q[MODES])
{
    name_mode(text, size, p, q);
    const size_t used = strlen(text);
    const char axis = used > 0 ? text[used - 1] : '\0';
    if (axis == 'x' || axis == 'y')
        snprintf(text + used - 1, size - used + 1, "%c%c", q[axis == 'x' ? 0 : 1] < 0 ? '-' : '+', axis);
    else if (fabs(q[2]) > 1e-7 * hypot(q[0], q[1]))
        snprintf(text + used, size - used, ", %s", q[2] < 0 ? "clockwise" : "counterclockwise");
}

void uz_name_motion(char *text, size_t size, const uz_body_model *model, const double *y)
{
    body_parts all;
    double mode[MODES][MODES], largest = 0;
    snprintf(text, size, "a rigid motion");
    if (find_parts(&all, model, NULL) == UZ_OK)
        for (int64_t i = 0, at = 0; i < all.count; i++) {
            double q[MODES] = {0, 0, 0};
            const int own = free_modes(mode, &all.list[i]);
            for (int k = 0; k < own; k++, at++)
                for (int c = 0; c < MODES; c++)
                    q[c] += y[at] * mode[k][c];
            const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
            if (length <= largest)
                continue;
            largest = length;
            name_direction(text, size, &all.list[i], q);
            const size_t used = strlen(text);
            if (all.count > 1)
                snprintf(text + used, size - used, " of the part with node %lld", (long long)all.list[i].node);
        }
    clear_parts(&all);
}

/* Loads this small beside those that balance in a mode are rounding. */
#define BALANCED 1e-9

uz_status uz_check_pressed(const uz_body_model *model, const double *p, uz_error *err)
{
    uz_pressing how = UZ_PRESSED_ON;
    char motion[200];
    double *y = uz_alloc_zero(model->n_modes, sizeof *y);
    if (!y)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid-body modes", (long long)model->n_modes);
    uz_status status = uz_load_on_modes(&how, y, model->modes, model->n_modes, &model->N, p, BALANCED, true, err);
    if (status == UZ_OK && how != UZ_PRESSED_ON) {
        uz_name_motion(motion, sizeof motion, model, y);
        status = uz_fail(err, UZ_ERR_FREE_BODY, "/loads",
                         how == UZ_PUSHED_AWAY
                             ? "the loads push the body away: %s; no obstacle or support stands in its way"
                             : "the loads do not press the body on: %s costs nothing; only an obstacle could hold it",
                         motion);
    }
    free(y);
    return status;
}
