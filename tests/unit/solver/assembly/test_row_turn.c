/* How rows between bodies turn: forces and gaps along any motion, against differences of the whole. */
#include "assembly/row_turn.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"
#include "two_boxes.h"

/* Two blocks that lie on each other, bent and moved aside a little, so that no nodes face each other. */
static uz_scene bent(const char *element, uz_model model, bool turned)
{
    const double from = model == UZ_AXISYMMETRIC ? 1 : 0;
    const box_part a = {{from, 0}, {3, 1}, {5, 2}, element}, b = {{from + 0.7, 1}, {1.3, 0.5}, {3, 1}, element};
    uz_scene s = two(model, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
    body_hold(&s, "abottom", 0, 0, NAN);
    body_hold(&s, "btop", 0, 0, NAN);
    touch(&s, turned ? "atop" : "bbottom", turned ? "bbottom" : "atop");
    return s;
}

/* f = N' r and the gaps (m) of the body at a place; reactions by place. Gaps of middles of edges in space are those of
 * their rows (contact_rows.c). */
static void look(double *f, double *g, const uz_body_model *base, uz_scene *s, double *u, const double *r)
{
    uz_body_model at;
    uz_error err = {0};
    s->place = u;
    CHECK_MSG(uz_body_model_move(&at, base, s, &err) == UZ_OK, "%s", err.message);
    s->place = NULL;
    memset(f, 0, (size_t)base->d * sizeof *f);
    uz_csc_gaxpy_t(f, &at.N, 1, r);
    const double *gap = at.sites[0].gap;
    for (int64_t i = 0; i < at.m; i++) {
        const int64_t *ends = at.sites[0].ends + 2 * at.row_place[i];
        g[i] = gap[at.row_place[i]];
        if (ends[0] >= 0)
            g[i] = (g[i] - UZ_MIDDLE_SHARE * (gap[ends[0]] + gap[ends[1]])) / (1 - 2 * UZ_MIDDLE_SHARE);
    }
    uz_body_model_clear(&at);
}

/* At u (nodes), along `way` (nodes): by entries, to `within` (INFINITY: they do not say), by the difference of the rows
 * at one place more, and by differences of the whole. */
static void compare(uz_scene *s, const uz_body_model *base, double *u, const double *way, qp_random *rng,
                    const char *element, double within)
{
    enum { EACH, WHOLE, WAYS };
    const int64_t n = base->mesh.dim * base->mesh.n_nodes, d = base->d;
    uz_body_model at;
    double *f[2], *g[2], *v = body_room(d, sizeof *v), *turned[WAYS], *moved[WAYS], *r;
    const double h = 1e-6;
    bool known = false;
    uz_row_turn turn;
    uz_error err = {0};
    s->place = u;
    CHECK_MSG(uz_body_model_move(&at, base, s, &err) == UZ_OK, "%s", err.message);
    s->place = NULL;
    r = body_room(at.m, sizeof *r);
    for (int64_t i = 0; i < at.m; i++)
        r[i] = -random_unit(rng);
    CHECK_INT(uz_row_turn_find(&turn, base, &at, s, r, 0, NULL, &err), UZ_OK);
    CHECK(turn.known && turn.force.n > 0 && turn.gap.n > 0 && at.m > 2);
    uz_restrict_nodal(v, base, way);
    for (int k = 0; k < WAYS; k++) {
        turned[k] = body_room(d, sizeof **turned);
        moved[k] = body_room(at.m + d, sizeof **moved);
    }
    CHECK_INT(uz_row_turn_along(&known, turned[WHOLE], moved[WHOLE], base, &at, s, r, v, &err), UZ_OK);
    CHECK(known);
    for (int side = 0; side < 2; side++) {
        f[side] = body_room(d, sizeof **f);
        g[side] = body_room(at.m + d, sizeof **g);
        for (int64_t i = 0; i < n; i++)
            u[i] += (side ? 2 : -1) * h * way[i];
        look(f[side], g[side], base, s, u, r);
    }
    uz_add_entries(turned[EACH], &turn.force, v, false);
    uz_add_entries(moved[EACH], &turn.gap, v, false);
    for (int k = within < INFINITY ? EACH : WHOLE; k < WAYS; k++) {
        const double most = k == WHOLE ? 1e-4 : within; /* of second derivatives */
        uz_csc_gaxpy(moved[k], &at.N, -1, v);
        for (int64_t j = 0; j < d; j++)
            CHECK_MSG(fabs((f[1][j] - f[0][j]) / (2 * h) - turned[k][j]) < most, "%s: %.9g, not %.9g", element,
                      turned[k][j], (f[1][j] - f[0][j]) / (2 * h));
        for (int64_t i = 0; i < at.m; i++)
            CHECK_MSG(fabs((g[1][i] - g[0][i]) / (2 * h) - moved[k][i]) < most, "%s: gap %.9g, not %.9g", element,
                      moved[k][i], (g[1][i] - g[0][i]) / (2 * h));
    }
    uz_row_turn_clear(&turn);
    uz_body_model_clear(&at);
    double *const room[] = {v, f[0], f[1], g[0], g[1], turned[EACH], turned[WHOLE], moved[EACH], moved[WHOLE], r};
    for (size_t i = 0; i < sizeof room / sizeof room[0]; i++)
        free(room[i]);
}

TEST(forces_and_gaps_change_as_differences_say)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    for (int k = 0; k < 8; k++) {
        qp_random rng = {(uint64_t)k + 1};
        uz_scene s = bent(ELEMENTS[k % 4], k < 6 ? UZ_PLANE_STRAIN : UZ_AXISYMMETRIC, k % 2);
        uz_body_model base = body_model(&s);
        const int64_t n = 2 * base.mesh.n_nodes;
        double *u = body_room(n, sizeof *u), *way = body_room(n, sizeof *way);
        for (int64_t i = 0; i < n; i++) {
            u[i] = 0.02 * random_signed(&rng);
            way[i] = base.dof[i] < 0 ? 0 : random_signed(&rng);
        }
        compare(&s, &base, u, way, &rng, ELEMENTS[k % 4], 1e-6);
        uz_body_model_clear(&base);
        uz_scene_clear(&s);
        free(u);
        free(way);
    }
}

/* Any motion, by one difference: parts of faces change, too. */
TEST(solids_deform_as_one_difference_says)
{
    static const char *const ELEMENTS[] = {"hex8", "tet4", "hex20", "tet10"};
    for (int k = 0; k < 4; k++) {
        qp_random rng = {(uint64_t)k + 1};
        const box_part a = {{0, 0, 0}, {2, 1, 1}, {3, 1, 2}, ELEMENTS[k]},
                       b = {{0.7, 1, 0.15}, {0.8, 0.5, 0.6}, {2, 1, 2}, ELEMENTS[3 - k]};
        uz_scene s = two(UZ_SOLID, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
        body_hold(&s, "abottom", 0, 0, 0);
        body_hold(&s, "btop", 0, 0, 0);
        touch(&s, "bbottom", "atop");
        uz_body_model base = body_model(&s);
        const int64_t n = 3 * base.mesh.n_nodes;
        double *u = body_room(n, sizeof *u), *way = body_room(n, sizeof *way);
        for (int64_t i = 0; i < n; i++) {
            u[i] = base.dof[i] < 0 ? 0 : 0.02 * random_signed(&rng);
            way[i] = base.dof[i] < 0 ? 0 : random_signed(&rng);
        }
        compare(&s, &base, u, way, &rng, ELEMENTS[k], INFINITY);
        uz_body_model_clear(&base);
        uz_scene_clear(&s);
        free(u);
        free(way);
    }
}

/* A block on a flat top, whose nodes lie anywhere, or of faces with middles where straight edges have them, as
 * integrals cut along these: exact for any motion of what is below, and rigid ones of the block, whose faces keep their
 * parts. */
TEST(solids_turn_and_slide_as_differences_say)
{
    static const char *const ELEMENTS[] = {"hex8", "tet4", "hex20", "tet10"};
    for (int k = 0; k < 8; k++) {
        qp_random rng = {(uint64_t)k + 1};
        const box_part a = {{0, 0, 0}, {2, 1, 1}, {3, 1, 2}, ELEMENTS[k / 2]},
                       b = {{0.7, 1, 0.15}, {0.8, 0.5, 0.6}, {2, 1, 2}, ELEMENTS[(k / 2) ^ (k % 2)]};
        uz_scene s = two(UZ_SOLID, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
        body_hold(&s, "abottom", 0, 0, 0);
        body_hold(&s, "btop", 0, 0, 0);
        touch(&s, "bbottom", "atop");
        uz_body_model base = body_model(&s);
        const int64_t n = 3 * base.mesh.n_nodes;
        double *u = body_room(n, sizeof *u), *way = body_room(n, sizeof *way), turn[3], aside[3];
        bool second = false;
        for (int c = 0; c < 3; c++) {
            turn[c] = random_signed(&rng);
            aside[c] = random_signed(&rng);
        }
        for (int64_t i = 0; i < n; i++) {
            const double *x = base.mesh.xyz + i - i % 3;
            const int c = (int)(i % 3), e = (c + 1) % 3, f = (c + 2) % 3;
            second = second || (fabs(x[0] - 0.7) + fabs(x[1] - 1) + fabs(x[2] - 0.15) < 1e-9);
            const double off = k < 4 ? 0.02 * random_signed(&rng) : 0.03 * (turn[0] * x[0] + turn[1] * x[2]);
            u[i] = !second && (c != 1 || x[1] < 1) ? off : 0;
            way[i] = second ? aside[c] + turn[e] * x[f] - turn[f] * x[e] : random_signed(&rng);
        }
        compare(&s, &base, u, way, &rng, ELEMENTS[k / 2], k < 4 ? 1e-6 : 1e-3); /* cut where edges were straight */
        uz_body_model_clear(&base);
        uz_scene_clear(&s);
        free(u);
        free(way);
    }
}

/* The symmetric part joins the stiffness; the skew part does no work. */
TEST(a_stiffness_gets_the_symmetric_part)
{
    uz_scene s = bent("quad4", UZ_PLANE_STRAIN, false);
    uz_body_model base = body_model(&s), at;
    const int64_t n = 2 * base.mesh.n_nodes, d = base.d;
    double *u = body_room(n, sizeof *u), *v = body_room(d, sizeof *v), *Kv = body_room(d, sizeof *Kv),
           *Tv = body_room(d, sizeof *Tv), *skew = body_room(d, sizeof *skew), *r, sum[4] = {0};
    qp_random rng = {3};
    uz_row_turn turn;
    uz_csc wide;
    uz_error err = {0};
    for (int64_t i = 0; i < n; i++)
        u[i] = 0.02 * random_signed(&rng);
    s.place = u;
    CHECK_INT(uz_body_model_move(&at, &base, &s, &err), UZ_OK);
    s.place = NULL;
    r = body_room(at.m, sizeof *r);
    for (int64_t i = 0; i < at.m; i++)
        r[i] = -10 * random_unit(&rng);
    CHECK_INT(uz_row_turn_find(&turn, &base, &at, &s, r, 0, NULL, &err), UZ_OK);
    CHECK_INT(uz_widen_by_rows(&wide, &base.K, &at.N, r, 0, &turn, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        v[j] = random_signed(&rng);
    uz_csc_symv(Kv, &base.K, 1, v);
    for (int64_t j = 0; j < d; j++)
        sum[0] += v[j] * Kv[j];
    memset(Kv, 0, (size_t)d * sizeof *Kv);
    uz_csc_symv(Kv, &wide, 1, v);
    uz_add_entries(Tv, &turn.force, v, false);
    uz_add_entries(skew, &turn.force, v, true);
    for (int64_t j = 0; j < d; j++) {
        sum[1] += v[j] * Kv[j];
        sum[2] += v[j] * Tv[j];
        sum[3] += v[j] * skew[j];
    }
    CHECK_MSG(fabs(sum[1] - (sum[0] - sum[2])) < 1e-9 * sum[0] && fabs(sum[2]) > 1e-3, "%.12g, %.12g less %.12g",
              sum[1], sum[0], sum[2]);
    CHECK(fabs(sum[3]) < 1e-9);
    for (int64_t i = 0; i < at.m; i++) { /* there is room for stiffness along the rows */
        int64_t own[2] = {-1, -1};
        for (int64_t j = 0; j < d; j++)
            if (uz_csc_find(&at.N, i, j) >= 0) {
                own[0] = own[0] < 0 ? j : own[0];
                own[1] = j;
            }
        CHECK(own[0] >= 0 && uz_csc_find(&wide, own[1], own[0]) >= 0);
    }
    uz_csc_clear(&wide);
    uz_row_turn_clear(&turn);
    uz_body_model_clear(&at);
    uz_body_model_clear(&base);
    uz_scene_clear(&s);
    double *const room[] = {u, v, Kv, Tv, skew, r};
    for (size_t i = 0; i < sizeof room / sizeof room[0]; i++)
        free(room[i]);
}
