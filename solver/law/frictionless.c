/* frictionless.c: contact without friction, the sign rule of sign.h for whole vectors. One row per contact. */
#include "law/law.h"
#include "law/sign.h"

#include <math.h>

static void project(const uz_law *law, double *r, int64_t n)
{
    (void)law;
    for (int64_t i = 0; i < n; i++)
        r[i] = uz_reaction_cut(r[i]);
}

static bool admissible(const uz_law *law, const double *r, int64_t n)
{
    (void)law;
    for (int64_t i = 0; i < n; i++)
        if (uz_reaction_pulls(r[i]))
            return false;
    return true;
}

static double residual(const uz_law *law, const double *r, const double *g, const double *step, const double *scale,
                       int64_t n)
{
    double square = 0.0;
    (void)law;
    for (int64_t i = 0; i < n; i++) {
        const double change = r[i] - uz_reaction_cut(r[i] + step[i] * g[i]),
                     scaled = scale ? scale[i] * change : change;
        square += scaled * scaled;
    }
    return sqrt(square);
}

/* The largest g's over s <= 0 is 0 for g >= 0, and there is none for any other g. */
static double gap_bound(const uz_law *law, const double *r, const double *g, int64_t n)
{
    double sum = 0.0;
    (void)law;
    for (int64_t i = 0; i < n; i++) {
        if (uz_gap_penetrates(g[i]))
            return INFINITY;
        sum -= r[i] * g[i];
    }
    return sum;
}

static void penetration(const uz_law *law, double *out, const double *g, int64_t n)
{
    (void)law;
    for (int64_t i = 0; i < n; i++)
        out[i] = uz_gap_penetration(g[i]);
}

static int64_t active(const uz_law *law, bool *in, const double *r, int64_t n)
{
    int64_t count = 0;
    (void)law;
    for (int64_t i = 0; i < n; i++) {
        const bool presses = uz_reaction_presses(r[i]);
        count += presses;
        if (in)
            in[i] = presses;
    }
    return count;
}

static void predict(const uz_law *law, bool *in, const double *r, const double *g, const double *step, int64_t n)
{
    (void)law;
    for (int64_t i = 0; i < n; i++)
        in[i] = uz_reaction_presses(r[i] + step[i] * g[i]);
}

static int64_t refute(const uz_law *law, bool *wrong, const bool *guess, const double *r, const double *g, int64_t n)
{
    int64_t count = 0;
    (void)law;
    for (int64_t i = 0; i < n; i++) {
        const bool refuted = guess[i] ? uz_reaction_pulls(r[i]) : uz_gap_penetrates(g[i]);
        count += refuted;
        if (wrong)
            wrong[i] = refuted;
    }
    return count;
}

static void reach(const uz_law *law, double *out, const double *r, const double *d, int64_t n)
{
    (void)law;
    for (int64_t i = 0; i < n; i++)
        out[i] = d[i] > 0.0 ? (uz_reaction_presses(r[i]) ? -r[i] : 0.0) / d[i] : INFINITY;
}

static const uz_law_kind kind = {
    .name = "frictionless",
    .rows = 1,
    .one_sided = true,
    .project = project,
    .admissible = admissible,
    .residual = residual,
    .gap_bound = gap_bound,
    .penetration = penetration,
    .active = active,
    .predict = predict,
    .refute = refute,
    .reach = reach,
};

const uz_law uz_law_frictionless = {.kind = &kind};
