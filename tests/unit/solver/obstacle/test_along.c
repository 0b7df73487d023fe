/* What of an obstacle is before a way: gap and normal of its pieces are those of each point of the way. */
#include "core/random.h"
#include "harness.h"
#include "obstacle/along.h"
#include "sanitized.h"

enum { MOST_POINTS = 400 };

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * uz_uniform(seed);
}

static uz_obstacle *made(const uz_contact *contact)
{
    uz_obstacle *obstacle;
    uz_error err = {0};
    const uz_status status = uz_obstacle_new(&obstacle, contact, 0, UZ_PLANE_STRAIN, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return obstacle;
}

static uz_obstacle_pieces pieces_of(const uz_obstacle *obstacle, const double a[2], const double b[2])
{
    uz_obstacle_pieces pieces = {.n = 0};
    uz_error err = {0};
    CHECK(uz_obstacle_along(&pieces, obstacle, a, b, &err) == UZ_OK);
    return pieces;
}

/* The gap of a piece at a part of the way, and the normal out of the obstacle. */
static double gap_at(double normal[2], const uz_obstacle_piece *p, const double x[2], double q)
{
    const double off[2] = {x[0] - p->centre[0], x[1] - p->centre[1]}, distance = hypot(off[0], off[1]);
    const double sign = p->inside ? -1 : 1;
    for (int c = 0; c < 2; c++)
        normal[c] = p->round ? sign * off[c] / distance : -p->normal[c];
    return p->round ? sign * (distance - p->radius) : p->gap[0] + q * (p->gap[1] - p->gap[0]);
}

/* Against uz_obstacle_gap at points amid each piece, close to its ends, too; gaps everywhere. */
static void compare(const uz_obstacle *obstacle, const double a[2], const double b[2], double size)
{
    uz_obstacle_pieces pieces = pieces_of(obstacle, a, b);
    double from = 0;
    CHECK_MSG(pieces.n > 0 && !pieces.why && pieces.at[pieces.n - 1].end == 1, "%s", pieces.why ? pieces.why : "none");
    for (int64_t i = 0; i < pieces.n; i++) {
        const uz_obstacle_piece *p = &pieces.at[i];
        CHECK_MSG(p->end > from, "%g %g", p->end, from);
        const double wide = (p->end - from) * hypot(b[0] - a[0], b[1] - a[1]);
        double nearest = INFINITY;
        for (int k = 0; k <= 10; k++) {
            static const double PART[] = {0, 1e-6, 1e-3, 0.1, 0.3, 0.5, 0.7, 0.9, 0.999, 0.999999, 1};
            const double q = from + PART[k] * (p->end - from);
            const double x[2] = {a[0] + q * (b[0] - a[0]), a[1] + q * (b[1] - a[1])};
            double normal[2];
            uz_gap gap;
            uz_error err = {0};
            CHECK(uz_obstacle_gap(&gap, obstacle, x, &err) == UZ_OK);
            CHECK_MSG(fabs(gap_at(normal, p, x, q) - gap.gap) < 1e-12 * size, "%d of %d at %g: %.15g, it is %.15g",
                      (int)i, (int)pieces.n, q, gap_at(normal, p, x, q), gap.gap);
            nearest = fmin(nearest, hypot(x[0] - p->centre[0], x[1] - p->centre[1]));
            if (k > 0 && k < 10 && wide > 1e-4 * size && fabs(gap.gap) > 1e-9 * size)
                CHECK_MSG(hypot(normal[0] - gap.normal[0], normal[1] - gap.normal[1]) < 1e-6, "%d at %g: %g %g, %g %g",
                          (int)i, q, normal[0], normal[1], gap.normal[0], gap.normal[1]);
        }
        CHECK(!p->round || wide <= nearest * (1 + 1e-9));
        from = p->end;
    }
    free(pieces.at);
}

TEST(one_piece_before_straight_and_round_obstacles)
{
    const double a[2] = {-3, 4}, b[2] = {5, 3};
    double x[] = {-2e3, 4e3}, y[] = {1, 2}, gap[3];
    uz_contact plane = {.kind = UZ_OBSTACLE_PLANE, .point = {1, 1.0005}, .normal = {-1, 6e3}};
    const uz_contact line = {.kind = UZ_OBSTACLE_POLYLINE, .n_x = 2, .x = x, .y = y};
    const uz_contact table = {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 2, .x = x, .z = y};
    const uz_contact disc = {.kind = UZ_OBSTACLE_ROUND, .point = {1, -40}, .radius = 30};
    plane.point[1] = 1 + 2001. / 6e3;
    const uz_contact *of[] = {&plane, &line, &table, &disc};
    for (int k = 0; k < 4; k++) {
        uz_obstacle *obstacle = made(of[k]);
        uz_obstacle_pieces pieces = pieces_of(obstacle, a, b);
        CHECK_INT(pieces.n, 1);
        CHECK_INT(pieces.at->round, k == 3);
        if (k < 3) {
            gap[k] = pieces.at->gap[0];
            CHECK_REL(gap[k], gap[0], 1e-13);
        }
        free(pieces.at);
        compare(obstacle, a, b, 1e3);
        uz_obstacle_free(obstacle);
    }
}

TEST(pieces_are_those_of_every_point)
{
    uint64_t seed = 11;
    for (int trial = 0; trial < some_of(600); trial++) {
        double x[MOST_POINTS], y[MOST_POINTS], low[2], high[2];
        const int kind = trial % 4, n = 2 + (int)between(&seed, 0, trial % 3 == 0 ? 300 : 9);
        const double unit = pow(10, between(&seed, -6, 6)), bend = between(&seed, 0.01, 2);
        double at = -2;
        for (int i = 0; i < n; i++) { /* a zigzag, an arc, or a hill, from left to right */
            at += 4. / n * between(&seed, 0.2, 1.5);
            x[i] = unit * at;
            y[i] = unit * (kind == 0 ? between(&seed, -bend, bend) : kind == 1 ? -bend * at * at : bend * at * at);
        }
        if (kind == 3) /* a polygon, or a hole */
            for (int i = 0; i < n + 2; i++) {
                const double angle = (trial % 8 < 4 ? -1 : 1) * 6.283185307179586 * i / (n + 1);
                x[i] = i == n + 1 ? x[0] : unit * cos(angle);
                y[i] = i == n + 1 ? y[0] : unit * sin(angle);
            }
        const uz_contact contact =
            kind == 3 || trial % 5
                ? (uz_contact){.kind = UZ_OBSTACLE_POLYLINE, .n_x = kind == 3 ? n + 2 : n, .x = x, .y = y}
                : (uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = n, .x = x, .z = y};
        uz_obstacle *obstacle;
        uz_error err = {0};
        if (uz_obstacle_new(&obstacle, &contact, 0, UZ_PLANE_STRAIN, &err) != UZ_OK)
            continue; /* crosses itself beyond its ends */
        for (int way = 0; way < 6; way++) {
            const double length = unit * pow(10, between(&seed, -3, 0.5)), angle = between(&seed, 0, 6.283185307);
            low[0] = unit * between(&seed, -2, 2);
            low[1] = unit * between(&seed, -2, 3);
            if (way == 0 && kind == 3) /* from a place as far from all sides */
                low[0] = low[1] = 1e-3 * unit;
            if (way == 1) { /* from a corner */
                low[0] = x[n / 2];
                low[1] = y[n / 2];
            }
            high[0] = low[0] + length * cos(angle);
            high[1] = low[1] + length * sin(angle);
            if (way == 2) { /* across one */
                low[0] = 2 * x[n / 2] - high[0];
                low[1] = 2 * y[n / 2] - high[1];
            }
            compare(obstacle, low, high, unit * 10);
        }
        uz_obstacle_free(obstacle);
    }
}

/* In the middle of a slit, and from the centre of a polygon. */
TEST(what_is_as_far_from_two_parts_is_told)
{
    double x[] = {4, 0, 0, 4}, y[] = {0, 0, 1, 1};
    const uz_contact slit = {.kind = UZ_OBSTACLE_POLYLINE, .n_x = 4, .x = y, .y = x};
    uz_obstacle *obstacle = made(&slit);
    const double from[2] = {0.5, 1}, to[2] = {0.5, 3}, beside[2] = {0.4, 3};
    uz_obstacle_pieces pieces = pieces_of(obstacle, from, to);
    CHECK(pieces.why && strstr(pieces.why, "two parts"));
    free(pieces.at);
    pieces = pieces_of(obstacle, from, beside);
    CHECK(!pieces.why);
    free(pieces.at);
    uz_obstacle_free(obstacle);
}
