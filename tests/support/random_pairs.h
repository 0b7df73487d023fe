/* random_pairs.h: generated scenes of two bodies that touch under large deformation. */
#ifndef TESTS_RANDOM_PAIRS_H
#define TESTS_RANDOM_PAIRS_H

#include "qp_fixture.h"
#include "two_boxes.h"

static inline uz_scene solid_pair(const box_part *a, const box_part *b, uz_elasticity law, body_map map, bool turned)
{
    uz_scene s = two(UZ_SOLID, law, a, b, map);
    touch(&s, turned ? "atop" : "bbottom", turned ? "bbottom" : "atop");
    return s;
}

static inline uz_scene random_pair(qp_random *rng, bool ring)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    const double length = 1.5 + 2 * random_unit(rng), width = 0.6 + random_unit(rng), from = ring ? 1 : 0;
    const double at = from + (length - 0.5 * width) * random_unit(rng);
    const int64_t cells = 2 + (int64_t)(3 * random_unit(rng)), others = 2 + (int64_t)(4 * random_unit(rng));
    const box_part a = {
        {from, 0}, {length, 1}, {(int64_t)((double)cells * length), cells}, ELEMENTS[(int)(4 * random_unit(rng))]};
    const box_part b = {
        {at, 1 + 0.1 * random_unit(rng)}, {width, 0.8}, {others, 2}, ELEMENTS[(int)(4 * random_unit(rng))]};
    uz_scene s =
        two(ring ? UZ_AXISYMMETRIC : UZ_PLANE_STRAIN, (uz_elasticity)(1 + (int)(3 * random_unit(rng))), &a, &b, NULL);
    const bool turned = random_unit(rng) < 0.5;
    s.materials[0].poisson = 0.4 * random_unit(rng);
    body_hold(&s, "abottom", 0, 0, NAN);
    body_hold(&s, "btop", 1.5 * random_signed(rng), -0.5 * random_unit(rng), NAN);
    if (random_unit(rng) < 0.3) /* on its flank, too, where it may meet the other one's corner */
        body_load(&s, UZ_LOAD_TRACTION, "bright", 0.05 * random_signed(rng), 0, 0);
    touch(&s, turned ? "atop" : "bbottom", turned ? "bbottom" : "atop");
    return s;
}

static inline uz_scene random_bricks(qp_random *rng)
{
    static const char *const ELEMENTS[] = {"hex8", "tet4", "hex20", "tet10"};
    const double length = 1.2 + random_unit(rng), width = 0.5 + 0.5 * random_unit(rng);
    const int64_t along = 2 + (int64_t)(3 * random_unit(rng)), others = 1 + (int64_t)(3 * random_unit(rng));
    const int kind = (int)(4 * random_unit(rng)), other = (int)(4 * random_unit(rng));
    const box_part a = {{0, 0, 0}, {length, 0.6, 1}, {kind < 2 ? along : 2, 1, 2}, ELEMENTS[kind]},
                   b = {{(length - width) * random_unit(rng), 0.6 + 0.05 * random_unit(rng), 0.3 * random_unit(rng)},
                        {width, 0.5, 0.4 + 0.5 * random_unit(rng)},
                        {other < 2 ? others : 1, 1, other < 2 ? others : 1},
                        ELEMENTS[other]};
    uz_scene s = solid_pair(&a, &b, (uz_elasticity)(1 + (int)(3 * random_unit(rng))), NULL, random_unit(rng) < 0.5);
    s.materials[0].poisson = 0.4 * random_unit(rng);
    body_hold(&s, "abottom", 0, 0, 0);
    body_hold(&s, "btop", 0.6 * random_signed(rng), -0.3 * random_unit(rng), 0.3 * random_signed(rng));
    if (random_unit(rng) < 0.3)
        body_load(&s, UZ_LOAD_TRACTION, "bright", 0.05 * random_signed(rng), 0, 0.05 * random_signed(rng));
    return s;
}

#endif
