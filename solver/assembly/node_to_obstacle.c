/* node_to_obstacle.c: contact of a surface with a rigid obstacle: a row for each node, along the obstacle's normal, and
 * one more inside a side, where rows at its nodes would let the obstacle in (several, where that is as deep at several
 * places), or at a node that more than one flank of a groove holds (uz_obstacle_flanks).
 *
 * Nodes alone see nothing that is smaller than a side: a circle between two of them meets no resistance. Gaps in the
 * mean, as between two bodies, would see it, but on curved obstacles they are off by as much as the facets are. So rows
 * stay at nodes, and a side gets one at the place where the obstacle would stand deepest in it once its own nodes have
 * given way: with d the signed distance from the obstacle, x_a the nodes and N_a their shape functions, where
 *
 *     w(x) = d(x) - s + sum_a N_a(x) max(0, s - d(x_a))
 *
 * is least, if that is below -SLACK times the side's size. Nodes in the obstacle are pushed out to its surface, the
 * others stay, as do those whose way out is along the side; s is 0 where the side is in it by SINK times its size
 * already, else what it has yet to approach for that, as loads that bring it there are not known here. A side that
 * follows the obstacle, a plane or one whose radius is more than 12 sides, gets none: w is -L / 8R of its length L
 * there. The place is one of the material and stays.
 *
 * Amid a ridge the nearest way out is through a flank, whose normal says nothing of the crest that stands in the side:
 * where a side is not clear of an obstacle with edges, or past the middle of a round one, d is that of the side set
 * back along its normal until it is clear of the obstacle, less the way. Rows of nodes amid ridges are found alike
 * (uz_obstacle_row_gap). Outside of an obstacle w has no kinks but those of grooves, where it is not least.
 *
 * Straight sides of a hole stand for a curve that lies behind them, and a pin that fits would cut into each. There d is
 * that of the curve: x is set back by sum_a N_a(x) (x - x_a) . n_a / 2 with the means n_a of the normals around nodes,
 * which is the parabola of their tangents. */
#include "assembly/discretization.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/root.h"
#include "core/vector3.h"
#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In sizes of a side: what rows at nodes may leave, and how far a side is taken to enter the obstacle at least. */
#define SLACK 0.01
#define SINK  0.02
/* Cosine of the angle between the way back and that out of the obstacle which is next there. */
#define LEAST_BACK 0.5
/* In lengths of an edge: how far from the obstacle its middle may be held by the gaps of its ends. */
#define EARLY 0.02
/* Of what the obstacle bows towards a middle: how far away it is then held while its edge is straight. */
#define BOW_PRESSES (2 * UZ_MIDDLE_SHARE / (1 - 2 * UZ_MIDDLE_SHARE))
/* The side is set back until it is so far from the obstacle. */
#define CLEAR 0.1
/* To rows the obstacle's edges are as if rounded with this part of the distance between nodes: of a node that settles
 * on an edge the direction from it would be rounding. */
#define EDGE 0.5
/* An edge that is no farther aside of a node than this part of that distance is before it, as one is before a place
 * inside a side that is no farther aside than EDGE. */
#define BEFORE 0.125

/* A row inside has a normal that is against the side's, and nodes that can give way along it, by more than this. */
#define LEAST_SHARE 0.1

/* Cosine of the angle between a side and what holds it back, of a node beside an edge, from which on the edge holds it.
 */
#define LEAST_BEFORE 0.99

/* Cosine of the angle between a side and the mean around a node from which on the node is a corner. */
#define LEAST_COSINE 0.94

/* Of places that are as deep as each other, as on an edge along the side, the one next to the side's middle is taken:
 * at a distance of D from there in a side of length L one counts as less deep by PULL D^2 / L. So the place moves on
 * with the obstacle, and does not leap from one end of the side to the other as the obstacle tilts. */
#define PULL 1e-4
/* In lengths of a side: depths that are the same but for rounding. */
#define SAME_DEPTH 1e-9
/* In coordinates of a side: places that are the same, and how well they are known. */
#define SAME_PLACE   1e-4
#define PLACE_WITHIN 1e-13

/* Of the rows inside a side: their part of the side's area. The nodes have the rest. */
#define INNER_AREA 0.5

/* Sides are halved so many times in search of the least w: in the plane, in space. So many places of a side may be as
 * deep as each other, as those of two teeth: each gets a row. */
enum { HALVINGS = 5, HALVINGS_IN_SPACE = 3, MOST_PLACES = 4 };

/* Rows of a node beside its own, of other flanks of the groove that it is in. */
enum { MOST_FLANKS = 3 };

/* ---- the deepest place of a side */

typedef struct {
    const uz_obstacle *obstacle;
    uz_side side;
    int64_t node[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    double length, size;              /* the longest distance between its nodes; the same, halved on quadratic sides */
    double normal[3];                 /* of the side, unit, out of the body */
    double middle[3];                 /* the mean of its corners */
    double around[4][3];              /* of straight sides: mean normals around the corners */
    bool curved;                      /* do they differ from the side's? */
    double back;                      /* by which the side is set back along its normal */
    bool near;                        /* is some of it in the obstacle, or not clear of it? */
    double pushed[UZ_FACE_NODES];     /* of the nodes: out of the obstacle */
    double steep, enough;             /* bound on the slope of w; what is above `enough` is not looked for */
    double least, at[MOST_PLACES][2]; /* found: where, in the side's own coordinates */
    int places;
} deepest;

static bool is_triangle(const uz_side *side)
{
    return side->dim == 3 && side->nodes % 3 == 0;
}

/* The place with these shape functions, of a hole on the curve behind its straight sides, set back; along (NULL: not
 * wanted): how it moves on with the coordinates of the side, if the shape functions do by `slope`. */
static void place_of(double x[3], double along[2][3], const deepest *of, const double *N, double slope[][3])
{
    const int dim = of->side.dim;
    double back = 0, grows[2] = {0};
    memset(x, 0, 3 * sizeof *x);
    for (int i = 0; i < 2 && along; i++)
        memset(along[i], 0, sizeof along[i]);
    for (int a = 0; a < of->side.nodes; a++)
        for (int c = 0; c < dim; c++) {
            x[c] += N[a] * of->xyz[dim * a + c];
            for (int i = 0; i < dim - 1 && along; i++)
                along[i][c] += slope[a][i] * of->xyz[dim * a + c];
        }
    for (int a = 0; a < of->side.nodes && of->curved; a++)
        for (int c = 0; c < dim; c++) {
            const double off = x[c] - of->xyz[dim * a + c];
            back += 0.5 * N[a] * off * of->around[a][c];
            for (int i = 0; i < dim - 1 && along; i++)
                grows[i] += 0.5 * (slope[a][i] * off + N[a] * along[i][c]) * of->around[a][c];
        }
    for (int c = 0; c < dim; c++) {
        x[c] -= (fmax(0, back) + of->back) * of->normal[c];
        for (int i = 0; i < dim - 1 && along && back > 1e-12 * of->length; i++) /* on edges rounding is all of it */
            along[i][c] -= grows[i] * of->normal[c];
    }
}

/* w there, but for s, and less what pulls it to the side's middle; slope (NULL: not wanted): its derivatives. NAN where
 * the obstacle has no normal, as the centre of a circle. */
static double depth_at(double slope[2], const deepest *of, const double local[2])
{
    const int dim = of->side.dim;
    double N[UZ_FACE_NODES], grows[UZ_FACE_NODES][3], x[3], along[2][3], value;
    uz_gap gap;
    uz_side_gradients(N, grows, &of->side, local);
    place_of(x, slope ? along : NULL, of, N, grows);
    if (uz_obstacle_gap(&gap, of->obstacle, x, NULL) != UZ_OK)
        return (double)NAN;
    value = gap.gap - of->back;
    for (int a = 0; a < of->side.nodes; a++)
        value += N[a] * of->pushed[a];
    for (int i = 0; i < dim - 1 && slope; i++) {
        slope[i] = 0;
        for (int a = 0; a < of->side.nodes; a++)
            slope[i] += grows[a][i] * of->pushed[a];
    }
    for (int c = 0; c < dim; c++) {
        const double off = x[c] + of->back * of->normal[c] - of->middle[c];
        value += PULL / of->length * off * off;
        for (int i = 0; i < dim - 1 && slope; i++)
            slope[i] += (gap.normal[c] + 2 * PULL / of->length * off) * along[i][c];
    }
    return value;
}

/* Branch and bound: a signed distance grows by no more than one is away. Sides are divided alike from all of their
 * corners: edges and quadrilaterals in halves, triangles by their middles (half < 0: upside down). */
static void search(deepest *of, double a, double b, double half, int halvings)
{
    const double at[2] = {a, b}, value = depth_at(NULL, of, at), same = SAME_DEPTH * of->length;
    const int dim = of->side.dim;
    const bool deeper = value < of->least - same;
    of->places = deeper ? 0 : of->places;
    if (deeper || (value <= of->least + same && of->places > 0 && of->places < MOST_PLACES)) {
        memcpy(of->at[of->places++], at, sizeof at);
        of->least = deeper ? value : of->least;
    }
    if (halvings == 0 || value - of->steep * fabs(half) * of->length > fmin(of->least, of->enough) + same)
        return;
    for (int k = 0; k < (is_triangle(&of->side) ? 3 : 2 * (dim - 1)); k++)
        if (is_triangle(&of->side))
            search(of, a + half * ((k == 1) / 2. - 1. / 6), b + half * ((k == 2) / 2. - 1. / 6), 0.5 * half,
                   halvings - 1);
        else
            search(of, a + (k % 2 ? 0.5 : -0.5) * half, dim == 3 ? b + (k / 2 ? 0.5 : -0.5) * half : b, 0.5 * half,
                   halvings - 1);
    if (is_triangle(&of->side))
        search(of, a, b, -0.5 * half, halvings - 1);
}

static void search_all(deepest *of)
{
    of->places = 0;
    if (is_triangle(&of->side))
        search(of, 1. / 3, 1. / 3, 1, HALVINGS_IN_SPACE);
    else
        search(of, 0, 0, 1, of->side.dim == 2 ? HALVINGS : HALVINGS_IN_SPACE);
}

typedef struct {
    const deepest *of;
    double low[2], high[2]; /* where is looked */
    double first;           /* the first coordinate, where the second is sought */
} place_search;

static double slope_along_second(const void *ctx, double second)
{
    const place_search *at = ctx;
    double slope[2] = {0};
    depth_at(slope, at->of, (double[2]){at->first, second});
    return slope[1];
}

static double best_second(const place_search *at, double first)
{
    const place_search line = {at->of, {at->low[0], at->low[1]}, {at->high[0], at->high[1]}, first};
    const double high = is_triangle(&at->of->side) ? fmax(0, fmin(at->high[1], 1 - first)) : at->high[1];
    return at->of->side.dim == 2
               ? 0
               : uz_root_between(slope_along_second, &line, fmin(at->low[1], high), high, PLACE_WITHIN);
}

/* Of the least w on the lines of a constant first coordinate: there the second is where w is least, or held; where the
 * long edge of a triangle holds it, it gives way as the first grows. */
static double slope_along_first(const void *ctx, double first)
{
    const place_search *at = ctx;
    double slope[2] = {0};
    const double second = best_second(at, first);
    depth_at(slope, at->of, (double[2]){first, second});
    return slope[0] - (is_triangle(&at->of->side) && second >= 1 - first ? fmin(0, slope[1]) : 0);
}

/* From the places found to where w is least about each, to rounding; what is not as deep as the others goes, and what
 * comes to the same place. */
static void refine(deepest *of)
{
    const bool triangle = is_triangle(&of->side);
    const double ends[2] = {triangle ? 0 : -1, 1};
    const double reach = ldexp(1, 1 - (of->side.dim == 2 ? HALVINGS : HALVINGS_IN_SPACE));
    double value[MOST_PLACES];
    int kept = 0;
    for (int k = 0; k < of->places; k++) {
        const double began = depth_at(NULL, of, of->at[k]);
        double at[2] = {of->at[k][0], of->at[k][1]};
        bool held = true; /* by the border of where is looked, not of the side */
        for (int steps = 0; steps < 20 && held; steps++) {
            place_search within = {.of = of};
            for (int i = 0; i < 2; i++) {
                within.low[i] = fmax(ends[0], at[i] - reach);
                within.high[i] = fmin(ends[1], at[i] + reach);
            }
            at[0] = uz_root_between(slope_along_first, &within, within.low[0], within.high[0], PLACE_WITHIN);
            at[1] = best_second(&within, at[0]);
            held = false;
            for (int i = 0; i < of->side.dim - 1; i++)
                held =
                    held || (at[i] <= within.low[i] && at[i] > ends[0]) || (at[i] >= within.high[i] && at[i] < ends[1]);
        }
        value[k] = depth_at(NULL, of, at);
        if (value[k] <= began)
            memcpy(of->at[k], at, sizeof at);
        else
            value[k] = began;
        of->least = fmin(of->least, value[k]);
    }
    for (int k = 0; k < of->places; k++) {
        bool other = value[k] <= of->least + SAME_DEPTH * of->length;
        for (int j = 0; j < kept; j++)
            other = other && hypot(of->at[k][0] - of->at[j][0], of->at[k][1] - of->at[j][1]) > SAME_PLACE;
        if (other)
            memmove(of->at[kept++], of->at[k], sizeof of->at[k]);
    }
    of->places = kept;
}

/* Does the way out of the obstacle lead a node into the body? On the flank of a block it leads along the side: its row
 * leaves the block where it stands. Beside an edge the node may slip off. */
static bool leads_in(const deepest *of, int a)
{
    double N[UZ_FACE_NODES], x[3], at[3], along = 0;
    uz_gap gap;
    uz_side_shape(N, &of->side, uz_side_local_nodes(&of->side)[a]);
    place_of(x, NULL, of, N, NULL);
    if (uz_obstacle_row_gap(&gap, at, of->obstacle, x, of->normal, EDGE * of->size, BEFORE * of->size, NULL) != UZ_OK)
        return true;
    for (int c = 0; c < of->side.dim; c++)
        along -= gap.normal[c] * of->normal[c];
    const bool edge = uz_obstacle_has_edges(of->obstacle) &&
                      gap.curvature * sqrt(uz_distance2(at, gap.foot, of->side.dim)) >= 0.5; /* that juts out */
    return along > (edge ? LEAST_BEFORE : LEAST_SHARE);
}

/* The places of the least w, roughly, where the nodes' gaps are `gap`. False: nothing is below the slack. */
static bool find_below(deepest *of, const double *gap)
{
    double lowest = INFINITY, highest = -INFINITY;
    for (int a = 0; a < of->side.nodes; a++) {
        lowest = fmin(lowest, gap[a]);
        highest = fmax(highest, gap[a]);
    }
    memset(of->pushed, 0, sizeof of->pushed);
    of->least = lowest;
    of->steep = 1 + PULL;
    of->enough = INFINITY;
    search_all(of);
    of->near = of->least < CLEAR * of->size;
    const double s = fmax(0, of->least + SINK * of->size);
    bool again = of->places == 0;
    for (int a = 0; a < of->side.nodes; a++) {
        again = again || s > gap[a];
        of->pushed[a] = s > gap[a] && leads_in(of, a) ? s - gap[a] : 0;
    }
    if (again) {
        of->least = of->enough = s - SLACK * of->size;
        of->steep = 1 + PULL + fmin(1, (highest - lowest) / of->size);
        search_all(of);
    }
    return of->places > 0 && of->least < s - SLACK * of->size;
}

/* Sets the side back until it is clear of the obstacle; gap: of its nodes there. False: it cannot be, or what is next
 * to it there is aside of it, as the wall of a hole: the way back along that is no depth. */
static bool set_back(deepest *of, double *gap)
{
    enum { STEPS = 60 };
    memset(of->pushed, 0, sizeof of->pushed);
    of->steep = 1 + PULL;
    of->enough = INFINITY;
    for (int k = 0; k < STEPS && of->back <= 2 * of->length; k++) {
        of->least = INFINITY;
        search_all(of);
        for (int a = 0; a < of->side.nodes; a++) {
            double N[UZ_FACE_NODES], x[3];
            uz_gap there;
            uz_side_shape(N, &of->side, uz_side_local_nodes(&of->side)[a]);
            place_of(x, NULL, of, N, NULL);
            if (uz_obstacle_gap(&there, of->obstacle, x, NULL) != UZ_OK)
                return false;
            gap[a] = there.gap - of->back;
            of->least = fmin(of->least, gap[a]);
        }
        const double lacking = CLEAR * of->size - (of->least + of->back);
        if (lacking <= 0.01 * CLEAR * of->size) {
            double N[UZ_FACE_NODES], x[3], along = 0;
            uz_gap there;
            uz_side_shape(N, &of->side, of->at[0]);
            place_of(x, NULL, of, N, NULL);
            if (uz_obstacle_gap(&there, of->obstacle, x, NULL) != UZ_OK)
                return false;
            for (int c = 0; c < of->side.dim; c++)
                along -= there.normal[c] * of->normal[c];
            return along >= LEAST_BACK;
        }
        of->back += lacking;
    }
    return false;
}

/* Are there places where the rows of the nodes, whose gaps are `gap`, leave more than the slack? */
static bool find_deepest(deepest *of, double *gap)
{
    double lowest = INFINITY;
    for (int a = 0; a < of->side.nodes; a++)
        lowest = fmin(lowest, gap[a]);
    /* A distance d bends the gap along a side of length l by l^2 / 8d in the plane. */
    if (lowest > of->length && of->length * of->length < 4 * (lowest - of->length) * SLACK * of->size)
        return false;
    if (!find_below(of, gap))
        return false;
    const deepest plain = *of;
    bool amid = of->near && uz_obstacle_has_edges(of->obstacle);
    if (!amid)
        refine(of);
    for (int k = 0; k < of->places && !amid; k++) { /* does the obstacle's normal lead into the body? */
        double N[UZ_FACE_NODES], x[3], along = 0;
        uz_gap there;
        uz_side_shape(N, &of->side, of->at[k]);
        place_of(x, NULL, of, N, NULL);
        amid = uz_obstacle_gap(&there, of->obstacle, x, NULL) != UZ_OK;
        for (int c = 0; c < of->side.dim && !amid; c++)
            along -= there.normal[c] * of->normal[c];
        amid = amid || along <= LEAST_SHARE;
    }
    if (amid && set_back(of, gap) && find_below(of, gap)) {
        /* From where w is least to the crest that is there, if it is within the side: what the nodes' rows are taken to
         * push them out by tilts w, and a row beside the crest would slip off it. */
        refine(of);
        deepest alone = *of;
        const bool triangle = is_triangle(&of->side);
        bool within = true;
        memset(alone.pushed, 0, sizeof alone.pushed);
        alone.least = INFINITY;
        refine(&alone);
        for (int k = 0; k < alone.places; k++) {
            double N[UZ_FACE_NODES], x[3];
            uz_gap gap_of_crest;
            uz_side_shape(N, &of->side, alone.at[k]);
            place_of(x, NULL, of, N, NULL);
            within = within && uz_obstacle_gap(&gap_of_crest, of->obstacle, x, NULL) == UZ_OK &&
                     gap_of_crest.curvature * gap_of_crest.gap >= 0.5;
            for (int i = 0; i < of->side.dim - 1; i++)
                within = within && alone.at[k][i] < 1 - SAME_PLACE &&
                         alone.at[k][i] > (triangle ? 0 : -1) + SAME_PLACE &&
                         !(triangle && alone.at[k][0] + alone.at[k][1] > 1 - SAME_PLACE);
        }
        if (within && alone.places == of->places)
            memcpy(of->at, alone.at, sizeof of->at);
    } else if (amid) /* among edges w has kinks, where there is no refining it */
        *of = plain;
    return true;
}

/* ---- sites */

/* The unit normal of a side in its middle. */
static void normal_of(double normal[3], const uz_side *side)
{
    const bool triangle = is_triangle(side);
    const double middle[2] = {triangle ? 1.0 / 3 : 0, triangle ? 1.0 / 3 : 0};
    double size = 0;
    normal[2] = 0;
    uz_side_area_vector(normal, side, middle);
    for (int c = 0; c < side->dim; c++)
        size = hypot(size, normal[c]);
    for (int c = 0; c < side->dim && size > 0; c++)
        normal[c] /= size;
}

/* normals (n_nodes x dim): sums of the sides' normals. At an end of the group the others are mirrored. */
static void set_curve(deepest *of, const double *normals, int corners)
{
    const int dim = of->side.dim;
    bool own[4];
    normal_of(of->normal, &of->side);
    of->curved = false;
    for (int a = 0; a < corners && of->side.nodes == corners; a++) {
        const double *sum = normals + dim * of->node[a];
        double size = 0, along = 0;
        for (int c = 0; c < dim; c++) {
            size = hypot(size, sum[c]);
            along += sum[c] * of->normal[c];
        }
        own[a] = !(along < (1 - 1e-9) * size) || along < LEAST_COSINE * size;
        of->curved = of->curved || !own[a];
        for (int c = 0; c < dim; c++)
            of->around[a][c] = own[a] ? of->normal[c] : sum[c] / size;
    }
    for (int a = 0; a < corners && of->curved; a++) {
        double others[3] = {0}, size = 0, along = 0;
        for (int b = 0; b < corners && own[a]; b++)
            for (int c = 0; c < dim && !own[b]; c++)
                others[c] += of->around[b][c];
        for (int c = 0; c < dim; c++) {
            size = hypot(size, others[c]);
            along += others[c] * of->normal[c];
        }
        for (int c = 0; c < dim && size > 0; c++)
            of->around[a][c] = (2 * along * of->normal[c] - others[c]) / size;
    }
}

/* The body's own normal where the corners of a side have these shares: of the means around them, as rows of nodes have;
 * beside a corner of the body the side's. In the middle of a side that a crest presses on, that of the side would tilt
 * with what its two nodes give way by, and push aside what is pressed straight on. sums: n_nodes x dim. */
static void outward_at(double outward[3], const deepest *of, const uz_inner_place *place, const double *sums)
{
    const int dim = of->side.dim;
    double mean[3] = {0};
    for (int a = 0; a < place->corners; a++) {
        const double *sum = sums + dim * place->node[a];
        double size = 0, along = 0;
        for (int c = 0; c < dim; c++) {
            size = hypot(size, sum[c]);
            along += sum[c] * of->normal[c];
        }
        const bool own = !(along >= LEAST_COSINE * size) || !(size > 0);
        for (int c = 0; c < dim; c++)
            mean[c] += place->linear[a] * (own ? of->normal[c] : sum[c] / size);
    }
    outward[2] = 0;
    if (!uz_unit_normal(outward, mean, dim))
        memcpy(outward, of->normal, sizeof of->normal);
}

/* Fills a place that was found. Has it a row? Not where its nodes cannot give way, nor where the obstacle's normal
 * leads out of the body: its middle is past the side then, and no row tells how to leave it. */
static bool describe(uz_inner_place *out, const deepest *of, const double local[2], const double *normals,
                     const uz_body_model *model, uz_face face)
{
    const int dim = of->side.dim, corners = dim == 2 ? 2 : of->side.nodes % 4 == 0 ? 4 : 3;
    uz_side straight = of->side;
    double along = 0, most = 0, outward[3];
    uz_gap gap;
    straight.nodes = corners;
    *out = (uz_inner_place){.face = face, .nodes = of->side.nodes, .corners = corners, .size = of->size};
    memcpy(out->node, of->node, sizeof out->node);
    uz_side_shape(out->share, &of->side, local);
    uz_side_shape(out->linear, &straight, local);
    place_of(out->x, NULL, of, out->share, NULL);
    outward_at(outward, of, out, normals);
    if (uz_obstacle_row_gap(&gap, NULL, of->obstacle, out->x, outward, EDGE * of->size + of->back, EDGE * of->size,
                            NULL) != UZ_OK)
        return false;
    out->back = of->back;
    for (int c = 0; c < dim; c++) {
        double on = 0;
        for (int a = 0; a < out->nodes; a++)
            on += out->share[a] * of->xyz[dim * a + c];
        out->curve += (on - out->x[c]) * of->normal[c];
    }
    out->curve -= out->back;
    out->gap = gap.gap - of->back;
    uz_unit_normal(out->normal, gap.normal, dim);
    for (int c = 0; c < dim; c++)
        along -= of->normal[c] * out->normal[c];
    for (int a = 0; a < out->nodes; a++) {
        double share[3];
        uz_free_shares(share, model, out->node[a], out->normal);
        for (int c = 0; c < dim; c++)
            most = fmax(most, fabs(out->share[a] * share[c]));
    }
    return along > LEAST_SHARE && most > LEAST_SHARE;
}

/* Room for `count` gaps and normals. */
static uz_status reserve_places(uz_contact_sites *sites, int64_t count, int dim, uz_error *err)
{
    double *gap = uz_realloc(sites->gap, count, sizeof *gap);
    sites->gap = gap ? gap : sites->gap;
    double *normal = gap ? uz_realloc(sites->normal, count * dim, sizeof *normal) : NULL;
    sites->normal = normal ? normal : sites->normal;
    return normal ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact at %lld places", (long long)count);
}

/* Room for `count` places inside sides beside `others`. */
static uz_status reserve_inner(uz_contact_sites *sites, int64_t others, int64_t count, int dim, uz_error *err)
{
    uz_inner_place *inner = uz_realloc(sites->inner, count, sizeof *inner);
    sites->inner = inner ? inner : sites->inner;
    return inner ? reserve_places(sites, others + count, dim, err)
                 : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact inside %lld sides", (long long)count);
}

/* The places that were found before anything moved, where they have come to. */
static uz_status move_inner(uz_contact_sites *sites, const uz_contact_input *in, const uz_obstacle *obstacle,
                            const double *normals, uz_error *err)
{
    const uz_contact_sites *before = &in->rest->sites[in->index];
    const int dim = in->model->mesh.dim;
    const int64_t nodes = sites->n;
    uz_status status = before->n_inner > 0 ? reserve_inner(sites, nodes, before->n_inner, dim, err) : UZ_OK;
    for (int64_t i = 0; i < before->n_inner && status == UZ_OK; i++) {
        uz_inner_place *place = &sites->inner[i];
        deepest of = {.obstacle = obstacle, .back = before->inner[i].back + before->inner[i].curve};
        uz_gap gap;
        double outward[3];
        *place = before->inner[i];
        uz_body_side(&of.side, of.xyz, of.node, in->model, place->face);
        normal_of(of.normal, &of.side);
        place_of(place->x, NULL, &of, place->share, NULL);
        outward_at(outward, &of, place, normals);
        status = uz_obstacle_row_gap(&gap, NULL, obstacle, place->x, outward, EDGE * place->size + place->back,
                                     EDGE * place->size, err);
        if (status != UZ_OK)
            break;
        place->gap = gap.gap - place->back;
        uz_unit_normal(place->normal, gap.normal, dim);
        const bool row = isfinite(before->gap[before->n - before->n_inner + i]);
        sites->gap[nodes + i] = row ? place->gap : INFINITY;
        memcpy(sites->normal + dim * (nodes + i), place->normal, (size_t)dim * sizeof *place->normal);
        sites->n++;
        sites->n_inner++;
    }
    return status;
}

/* Appends the places inside sides to those of the nodes. gaps (n_nodes): of the nodes; normals (n_nodes x dim): sums of
 * the sides' normals. */
static uz_status find_inner(uz_contact_sites *sites, const uz_contact_input *in, const uz_obstacle *obstacle,
                            const double *gaps, const double *normals, uz_error *err)
{
    const int dim = in->model->mesh.dim;
    const int64_t nodes = sites->n;
    int64_t room = 0;
    if (in->rest)
        return move_inner(sites, in, obstacle, normals, err);
    for (int64_t f = 0; f < in->on->n_faces; f++) {
        deepest of = {.obstacle = obstacle};
        double gap[UZ_FACE_NODES];
        uz_body_side(&of.side, of.xyz, of.node, in->model, in->on->face[f]);
        const int count = of.side.nodes, corners = dim == 2 ? 2 : count % 4 == 0 ? 4 : 3;
        for (int a = 0; a < count; a++) {
            gap[a] = gaps[of.node[a]];
            for (int b = 0; b < a; b++) {
                double distance = 0;
                for (int c = 0; c < dim; c++)
                    distance = hypot(distance, of.xyz[dim * a + c] - of.xyz[dim * b + c]);
                of.length = fmax(of.length, distance);
            }
        }
        of.size = of.length / (count > corners ? 2 : 1);
        for (int a = 0; a < corners; a++)
            for (int c = 0; c < dim; c++)
                of.middle[c] += of.xyz[dim * a + c] / corners;
        set_curve(&of, normals, corners);
        if (!find_deepest(&of, gap))
            continue;
        if (sites->n - nodes + of.places > room) {
            room = 2 * room + 16;
            const uz_status status = reserve_inner(sites, nodes, room, dim, err);
            if (status != UZ_OK)
                return status;
        }
        for (int k = 0; k < of.places; k++) {
            uz_inner_place *place = &sites->inner[sites->n_inner++];
            const bool row = describe(place, &of, of.at[k], normals, in->model, in->on->face[f]) &&
                             in->contact->between != UZ_CONTACT_NODES;
            place->part = 1. / of.places;
            sites->gap[sites->n] = row ? place->gap : INFINITY;
            memcpy(sites->normal + dim * sites->n++, place->normal, (size_t)dim * sizeof *place->normal);
        }
    }
    return UZ_OK;
}

/* Which middles of eight-node faces the obstacle bows towards (gaps: by node). It does so more where it is touched than
 * at a distance d from there: of a circle of radius R it is l^2 / 8 (R + d) along an edge of length l. What was so
 * before anything moved is kept, as rows that came and went with the place would leave Newton's method without an end.
 */
static uz_status find_bows(uz_contact_sites *sites, const uz_contact_input *in, const double *gaps, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    const int64_t nodes = uz_places_of_nodes(in);
    const unsigned char *before = in->rest ? in->rest->sites[in->index].bows : NULL;
    unsigned char *by_node = uz_alloc_zero(mesh->n_nodes, 1);
    sites->bows = uz_alloc_zero(nodes, 1);
    if (!by_node || !sites->bows) {
        free(by_node);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the gaps of %lld nodes", (long long)mesh->n_nodes);
    }
    for (int64_t f = 0; f < in->on->n_faces && !before; f++) {
        int64_t node[UZ_FACE_NODES];
        if (uz_mesh_face(node, mesh, in->on->face[f]) != 8)
            continue;
        for (int j = 0; j < 4; j++) {
            const int64_t a = node[j], b = node[(j + 1) % 4], middle = node[4 + j];
            const double length = sqrt(uz_distance2(mesh->xyz + 3 * a, mesh->xyz + 3 * b, 3));
            const double bow = 0.5 * (gaps[a] + gaps[b]) - gaps[middle];
            const double nearer = 1 - 8 * bow * fmax(0, gaps[middle]) / (length * length);
            by_node[middle] = BOW_PRESSES * bow > EARLY * length * fmax(0, nearer);
        }
    }
    for (int64_t i = 0; i < nodes; i++)
        sites->bows[i] = before ? before[i] : by_node[uz_group_node_at(in->on, i)];
    free(by_node);
    return UZ_OK;
}

/* By node: sums of the normals of its sides (x dim), and the shortest distance to another node of them. */
static void look_around(double *normals, double *near, const uz_contact_input *in)
{
    const int dim = in->model->mesh.dim;
    for (int64_t f = 0; f < in->on->n_faces; f++) {
        deepest of;
        uz_body_side(&of.side, of.xyz, of.node, in->model, in->on->face[f]);
        normal_of(of.normal, &of.side);
        for (int a = 0; a < of.side.nodes; a++) {
            double *own = near + of.node[a];
            for (int c = 0; c < dim; c++)
                normals[dim * of.node[a] + c] += of.normal[c];
            for (int b = 0; b < of.side.nodes; b++) {
                double distance = 0;
                for (int c = 0; c < dim; c++)
                    distance = hypot(distance, of.xyz[dim * a + c] - of.xyz[dim * b + c]);
                *own = a != b && !(*own > 0 && *own < distance) ? distance : *own;
            }
        }
    }
}

/* The row of a node, and where it was taken. */
typedef struct {
    uz_gap gap;
    double at[3];
} node_row;

/* Appends to the places of the nodes, whose rows are `first`, those that other flanks of grooves give them. clear (by
 * node): how far a groove may be away. */
static uz_status find_flanks(uz_contact_sites *sites, const uz_contact_input *in, const uz_obstacle *obstacle,
                             const node_row *first, const double *clear, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    const int dim = mesh->dim;
    const int64_t nodes = sites->n;
    if (!uz_obstacle_has_edges(obstacle))
        return UZ_OK;
    uz_gap *flank = uz_alloc(nodes, MOST_FLANKS * sizeof *flank);
    int *count = uz_alloc_zero(nodes, sizeof *count);
    int64_t *place = uz_alloc(mesh->n_nodes, sizeof *place), all = 0;
    uz_status status = flank && count && place ? UZ_OK
                                               : uz_fail(err, UZ_ERR_MEMORY, "",
                                                         "no memory for the grooves at %lld nodes", (long long)nodes);
    for (int64_t i = 0; i < nodes && status == UZ_OK; i++)
        place[uz_group_node_at(in->on, i)] = i;
    for (int64_t f = 0; f < in->on->n_faces && status == UZ_OK; f++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, in->model, in->on->face[f]);
        for (int a = 0; a < side.nodes; a++)
            for (int b = 0; b < side.nodes && first[place[node[a]]].gap.gap < clear[node[a]]; b++) {
                const int64_t i = place[node[a]];
                double way[3] = {0}, length = 0;
                for (int c = 0; c < dim; c++)
                    length = hypot(length, xyz[dim * b + c] - xyz[dim * a + c]);
                for (int c = 0; c < dim && length > 0; c++)
                    way[c] = clear[node[a]] / length * (xyz[dim * b + c] - xyz[dim * a + c]);
                all -= count[i];
                if (a != b)
                    count[i] = uz_obstacle_flanks(flank + MOST_FLANKS * i, count[i], MOST_FLANKS, obstacle,
                                                  xyz + dim * a, first[i].at, &first[i].gap, way);
                all += count[i];
            }
    }
    if (status == UZ_OK && all > 0) {
        sites->flank = uz_alloc(all, sizeof *sites->flank);
        status = sites->flank ? reserve_places(sites, nodes + all, dim, err)
                              : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld flanks", (long long)all);
    }
    for (int64_t i = 0; i < nodes && status == UZ_OK; i++)
        for (int k = 0; k < count[i]; k++) {
            double *normal = sites->normal + dim * sites->n;
            sites->flank[sites->n_flanks++] = uz_group_node_at(in->on, i);
            memset(normal, 0, (size_t)dim * sizeof *normal);
            sites->gap[sites->n] = flank[MOST_FLANKS * i + k].gap;
            uz_put_normal(sites, sites->n++, flank[MOST_FLANKS * i + k].normal, dim);
        }
    uz_free_all(flank, count, place);
    return status;
}

/* A plane has no sites: where it is belongs to the load. */
static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    uz_obstacle *obstacle = NULL;
    double *gaps = NULL, *normals = NULL, *near = NULL; /* by node */
    node_row *first = NULL;                             /* by node of the group */
    if (in->contact->kind == UZ_OBSTACLE_PLANE)
        return UZ_OK;
    uz_status status = uz_sites_of_nodes(sites, in, err);
    if (status == UZ_OK)
        status = uz_obstacle_new(&obstacle, in->contact, in->index, in->model->kind, err);
    if (status == UZ_OK) {
        gaps = uz_alloc(mesh->n_nodes, sizeof *gaps);
        normals = uz_alloc_zero(mesh->n_nodes * mesh->dim, sizeof *normals);
        near = uz_alloc_zero(mesh->n_nodes, sizeof *near);
        first = uz_alloc(sites->n, sizeof *first);
    }
    if (status == UZ_OK && !(gaps && normals && near && first))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the gaps of %lld nodes", (long long)mesh->n_nodes);
    if (status == UZ_OK)
        look_around(normals, near, in);
    for (int64_t i = 0; i < sites->n && status == UZ_OK; i++) {
        const int64_t node = uz_group_node_at(in->on, i);
        double outward[3] = {0};
        uz_unit_normal(outward, normals + node * mesh->dim, mesh->dim);
        near[node] *= EDGE;
        status = uz_obstacle_row_gap(&first[i].gap, first[i].at, obstacle, mesh->xyz + node * mesh->dim, outward,
                                     near[node], BEFORE / EDGE * near[node], err);
        if (status != UZ_OK)
            break;
        sites->gap[i] = gaps[node] = first[i].gap.gap;
        uz_put_normal(sites, i, first[i].gap.normal, mesh->dim);
    }
    if (status == UZ_OK && mesh->dim == 3)
        status = find_bows(sites, in, gaps, err);
    if (status == UZ_OK)
        status = find_flanks(sites, in, obstacle, first, near, err);
    if (status == UZ_OK)
        status = find_inner(sites, in, obstacle, gaps, normals, err);
    uz_free_all(gaps, normals, near, first);
    uz_obstacle_free(obstacle);
    return status;
}

/* ---- the discretization */

static int64_t places(const uz_contact_input *in)
{
    const int64_t n = in->model->sites[in->index].n;
    return n > 0 ? n : uz_places_of_nodes(in);
}

static bool row(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place)
{
    static const double whole = 1;
    const uz_mesh *mesh = &in->model->mesh;
    if (sites->n > 0 && place >= sites->n - sites->n_inner) {
        const uz_inner_place *inner = &sites->inner[place - (sites->n - sites->n_inner)];
        int most = 0;
        for (int a = 1; a < inner->nodes; a++)
            most = inner->share[a] > inner->share[most] ? a : most;
        *row = (uz_contact_row){.node = inner->node[most],
                                .gap = sites->gap[place],
                                .slaves = inner->nodes,
                                .slave = inner->node,
                                .slave_share = inner->share};
        memcpy(row->normal, inner->normal, sizeof row->normal);
        return isfinite(row->gap);
    }
    const int64_t flank = place - (sites->n - sites->n_inner - sites->n_flanks);
    const int64_t node = sites->n_flanks > 0 && flank >= 0 ? sites->flank[flank] : uz_group_node_at(in->on, place);
    *row = (uz_contact_row){.node = node, .slaves = 1, .slave_share = &whole};
    row->slave = &row->node;
    if (sites->n > 0) {
        row->gap = sites->gap[place];
        memcpy(row->normal, sites->normal + place * mesh->dim, (size_t)mesh->dim * sizeof *row->normal);
        return isfinite(row->gap);
    }
    for (int c = 0; c < mesh->dim; c++) {
        row->from[c] = in->contact->point[c];
        row->offset[c] = mesh->xyz[row->node * mesh->dim + c] - row->from[c];
    }
    return uz_unit_normal(row->normal, in->contact->normal, mesh->dim);
}

/* What a row inside a side has, its nodes have no more; the flanks that hold a node have equal parts of it. */
static bool areas(double *area, const uz_contact_input *in)
{
    const uz_contact_sites *sites = &in->model->sites[in->index];
    const int64_t nodes = uz_places_of_nodes(in), others = nodes + sites->n_flanks;
    const bool known = uz_areas_of_nodes(area, in);
    for (int64_t i = 0; i < sites->n_inner; i++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES], w[UZ_FACE_NODES];
        const bool row = isfinite(sites->gap[others + i]);
        uz_body_side(&side, xyz, node, in->model, sites->inner[i].face);
        uz_side_positive_weights(w, &side);
        const double part = INNER_AREA * sites->inner[i].part;
        area[others + i] = row ? part * uz_side_area(&side) : 0;
        for (int a = 0; a < side.nodes && row; a++)
            in->room[node[a]] += part * w[a];
    }
    if (sites->n_inner > 0)
        uz_leave_hanging(in->room, &in->model->mesh);
    for (int64_t i = 0; i < nodes && sites->n_inner > 0; i++) {
        const int64_t node = uz_group_node_at(in->on, i);
        area[i] = fmax(0, area[i] - in->room[node]);
        in->room[node] = 0;
    }
    for (int64_t i = 0; i < sites->n_flanks; i++)
        in->room[sites->flank[i]]++;
    for (int64_t i = 0; i < nodes && sites->n_flanks > 0; i++) {
        double *whole = &in->room[uz_group_node_at(in->on, i)];
        area[i] /= 1 + *whole;
        *whole = *whole > 0 ? area[i] : 0;
    }
    for (int64_t i = 0; i < sites->n_flanks; i++)
        area[nodes + i] = in->room[sites->flank[i]];
    for (int64_t i = 0; i < sites->n_flanks; i++)
        in->room[sites->flank[i]] = 0;
    return known;
}

const uz_contact_discretization uz_node_to_obstacle = {
    .name = "node to obstacle", .places = places, .find = find, .row = row, .areas = areas};
