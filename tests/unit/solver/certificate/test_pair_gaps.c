/* Gaps of two deformed surfaces: of a block on a plate that are apart, lie on each other, or overlap by what is known,
 * in the plane and in space, whatever the elements; beside an end there is nothing to face. */
#include "certificate/pair_gaps.h"
#include "two_boxes.h"

static uz_scene plate_and_block(const char *element, bool solid)
{
    const box_part a = {{0, 0, 0}, {3, 1, 2}, {5, 1, 3}, element}, b = {{1, 1, 0.5}, {0.8, 1, 0.7}, {2, 1, 2}, element};
    uz_scene s = two(solid ? UZ_SOLID : UZ_PLANE_STRAIN, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
    body_hold(&s, "abottom", 0, 0, solid ? 0 : NAN);
    body_hold(&s, "btop", 0, 0, solid ? 0 : NAN);
    touch(&s, "bbottom", "atop");
    return s;
}

/* The plate's top becomes y = 1 - bow (x - 1)^2, the block is lifted. */
static void move(double *u, const uz_body_model *model, double lifted, double bow)
{
    const int dim = model->mesh.dim;
    bool second = false;
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        const double *x = model->mesh.xyz + dim * a;
        second = second || (fabs(x[0] - 1) < 1e-9 && fabs(x[1] - 1) < 1e-9 && (dim == 2 || fabs(x[2] - 0.5) < 1e-9));
        u[dim * a + 1] = second ? lifted : -bow * (x[0] - 1) * (x[0] - 1);
    }
}

TEST(gaps_are_those_of_the_surfaces)
{
    static const char *const ELEMENTS[] = {"quad4", "tri6", "hex8", "tet4", "hex20", "tet10"};
    static const double LIFTED[] = {0.2, 0, -0.03};
    for (int k = 0; k < 6; k++) {
        uz_scene s = plate_and_block(ELEMENTS[k], k >= 2);
        uz_body_model model = body_model(&s);
        double *u = body_room(model.mesh.dim * model.mesh.n_nodes, sizeof *u);
        uz_error err = {0};
        for (int i = 0; i < 3; i++) {
            double least = INFINITY, part = INFINITY;
            move(u, &model, LIFTED[i], 0);
            CHECK_INT(uz_pair_gaps(&least, &part, &model, &s, 0, u, 8, &err), UZ_OK);
            CHECK_MSG(fabs(least - LIFTED[i]) < 1e-12, "%s: %.12g, not %.12g", ELEMENTS[k], least, LIFTED[i]);
            CHECK(LIFTED[i] >= 0 || (part < 0 && part > LIFTED[i] / 0.4 - 1e-12));
        }
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
        free(u);
    }
}

/* A parabola below a flat block: the distance from the block's edge, by Newton's method. */
TEST(faces_that_bend_are_followed)
{
    static const char *const ELEMENTS[] = {"quad8", "hex20", "tet10"};
    for (int k = 0; k < 3; k++) {
        uz_scene s = plate_and_block(ELEMENTS[k], k > 0);
        uz_body_model model = body_model(&s);
        double *u = body_room(model.mesh.dim * model.mesh.n_nodes, sizeof *u), least = INFINITY, part = INFINITY;
        uz_error err = {0};
        const double bow = 0.1, lifted = 0.05;
        move(u, &model, lifted, bow);
        CHECK_INT(uz_pair_gaps(&least, &part, &model, &s, 0, u, 8, &err), UZ_OK);
        /* above x = 1, where it is flat; chords are off it by a fiftieth of the sagitta at most */
        CHECK_MSG(fabs(least - lifted) < 0.02 * bow * 0.3 * 0.3, "%s: %.9g", ELEMENTS[k], least);
        least = part = INFINITY;
        move(u, &model, 0, -bow); /* bends up into the block: deepest at its far end, x = 1.8 */
        CHECK_INT(uz_pair_gaps(&least, &part, &model, &s, 0, u, 8, &err), UZ_OK);
        double x = 1.8;
        for (int i = 0; i < 50; i++) {
            const double t = x - 1, slope = 2 * bow * t;
            x -= (x - 1.8 + bow * t * t * slope) / (1 + slope * slope + 2 * bow * bow * t * t);
        }
        const double depth = hypot(x - 1.8, bow * (x - 1) * (x - 1));
        CHECK_MSG(least < -0.99 * depth && least > -1.03 * bow * 0.8 * 0.8, "%s: %.9g, not %.9g", ELEMENTS[k], least,
                  -depth);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
        free(u);
    }
}

/* A block that has slid off the plate faces nothing, however deep below its top it is. */
TEST(what_is_beyond_the_border_has_no_gap)
{
    static const char *const ELEMENTS[] = {"quad4", "hex8", "tet10"};
    for (int k = 0; k < 3; k++) {
        uz_scene s = plate_and_block(ELEMENTS[k], k > 0);
        uz_body_model model = body_model(&s);
        const int dim = model.mesh.dim;
        double *u = body_room(dim * model.mesh.n_nodes, sizeof *u), least = INFINITY, part = INFINITY;
        uz_error err = {0};
        move(u, &model, -0.3, 0);
        for (int64_t a = 0; a < model.mesh.n_nodes; a++)
            u[dim * a] = u[dim * a + 1] < 0 ? 2.5 : 0;
        CHECK_INT(uz_pair_gaps(&least, &part, &model, &s, 0, u, 8, &err), UZ_OK);
        CHECK_MSG(isinf(least) && isinf(part), "%s: %.9g", ELEMENTS[k], least);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
        free(u);
    }
}
