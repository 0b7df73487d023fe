/* judge.c: what became of a request's assertions, from the summary as it is told and stored.
 *
 * What is asserted is meant of the exact answer, and a summary is of one that is certified to be near it. Where the
 * certificate bounds how far a number is from that of the exact answer, the whole range must meet the limits to pass,
 * and miss them to fail; a quantity's interval is such a range, of the body itself, and so, by estimate, is what
 * several grids tell of the largest pressure and of the area. The other numbers are taken as they are, and `error` says
 * that no bound is known. An answer that is not what was asked for passes nothing. */
#include "work/judge.h"
#include "codec/quantity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- limits */

typedef struct {
    double lo, hi;
} range;

/* Where the exact number is, and how far from the value at most; all NaN: no bound is known. */
typedef struct {
    range in;
    double error;
    bool estimated; /* not proved */
} bound;

static const bound UNKNOWN = {{NAN, NAN}, NAN, false};

/* ---- how far a number may be from that of the exact answer */

static double number_at(const json_value *summary, const char *name)
{
    double value = NAN;
    return quantity_read(&value, summary, name) ? value : (double)NAN;
}

/* Of the quantity of this name. */
static bool is_proved(const json_value *summary, const char *name)
{
    const json_value *list = json_get(summary, "quantities");
    for (size_t i = 0; i < json_size(list); i++) {
        json_value room;
        const json_value *one = json_item(list, i, &room);
        if (json_text_is(json_get(one, "name"), name))
            return json_text_is(json_get(one, "kind"), "guaranteed");
    }
    return false;
}

/* What is said by its low and high end; how far the value is from the farther one. */
static bound interval_at(const json_value *summary, const char *name, double value, bool estimated)
{
    char end[160];
    snprintf(end, sizeof end, "%s.low", name);
    const double low = number_at(summary, end);
    snprintf(end, sizeof end, "%s.high", name);
    double high = number_at(summary, end);
    if (isnan(high) && !isnan(low)) /* no limit is seen */
        high = INFINITY;
    return isnan(low) ? UNKNOWN : (bound){{low, high}, fmax(high - value, value - low), estimated};
}

/* The minimum of the energy is between the dual and the primal value. The strain energy W is half the square of a
 * seminorm of the strain without its thermal part, and by the triangle inequality sqrt(2 W) differs from the exact one
 * by at most the energy norm of the displacement's error. */
static bound exact_bound(const json_value *summary, const char *quantity, double value)
{
    /* Numbers of the answer, which a finer one would have otherwise; the others are what they are. */
    static const char *const FACTS[] = {"contact.candidates", "contact.kept", "contact.added", "contact.rounds"};
    static const char *const ESTIMATES[] = {"contact.", "energy.", "resultants.", "stress.", "warnings"};
    static const char *const TRENDS[][2] = {{"contact.max_pressure", "contact.estimates.max_pressure"},
                                            {"contact.area", "contact.estimates.area"},
                                            {"contact.estimates.max_pressure.value", "contact.estimates.max_pressure"},
                                            {"contact.estimates.area.value", "contact.estimates.area"},
                                            {"stress.von_mises", "stress.estimates.von_mises"},
                                            {"stress.safety", "stress.estimates.safety"},
                                            {"stress.estimates.von_mises.value", "stress.estimates.von_mises"},
                                            {"stress.estimates.safety.value", "stress.estimates.safety"}};
    const double gap = number_at(summary, "certificate.gap"), e = number_at(summary, "certificate.absolute_error");
    bool estimate = false;
    for (size_t i = 0; i < sizeof ESTIMATES / sizeof ESTIMATES[0]; i++)
        estimate = estimate || strncmp(quantity, ESTIMATES[i], strlen(ESTIMATES[i])) == 0;
    for (size_t i = 0; i < sizeof FACTS / sizeof FACTS[0]; i++)
        estimate = estimate && strcmp(quantity, FACTS[i]) != 0;
    if (strncmp(quantity, "quantities.", 11) == 0) /* the interval is of the body itself */
        return interval_at(summary, quantity, value, !is_proved(summary, quantity + 11));
    for (size_t i = 0; i < sizeof TRENDS / sizeof TRENDS[0]; i++)
        if (strcmp(quantity, TRENDS[i][0]) == 0) /* so is what the grids tell, where there are several */
            return interval_at(summary, TRENDS[i][1], value, true);
    if (!estimate)
        return (bound){{value, value}, 0.0, false};
    if (!isnan(number_at(summary, "contact.geometry.left")))
        return UNKNOWN; /* the certificate is of the last pass, and what others would change is estimated */
    if (strcmp(quantity, "energy.primal") == 0 && !isnan(gap))
        return (bound){{value - gap, value}, gap, false};
    if (strcmp(quantity, "energy.dual") == 0 && !isnan(gap))
        return (bound){{value, value + gap}, gap, false};
    if (strcmp(quantity, "energy.strain") == 0 && value >= 0.0 && !isnan(e)) {
        const double norm = sqrt(2.0 * value), least = fmax(norm - e, 0.0);
        return (bound){{0.5 * least * least, 0.5 * (norm + e) * (norm + e)}, e * (norm + 0.5 * e), false};
    }
    return UNKNOWN;
}

/* ---- the verdict */

enum { DIGITS = 32 };

/* The digits that read back, whatever the locale. */
static const char *shown(char out[DIGITS], double x)
{
    if (isfinite(x))
        out[uz_format_double(out, x)] = '\0';
    else
        snprintf(out, DIGITS, "unbounded");
    return out;
}

/* A finding without a reason passes. */
static codec_finding judge_one(const codec_assertion *a, const json_value *summary)
{
    codec_finding out = {.verdict = CODEC_FAIL, .value = NAN, .error = NAN, .margin = -INFINITY};
    char first[DIGITS], second[DIGITS], third[DIGITS];
    if (!quantity_read(&out.value, summary, a->quantity)) {
        if (strncmp(a->quantity, "cases.", 6) != 0 || isnan(number_at(summary, "cases.count"))) {
            snprintf(out.reason, sizeof out.reason, "the summary of this job has no such number");
            return out;
        }
        out.value = 0.0; /* outcomes that no case had are not in a summary */
    }
    const char *outcome = codec_summary_text(summary, "outcome");
    const bool met = strcmp(outcome, "converged") == 0 || strcmp(outcome, "verified") == 0;
    const double tolerance = fmax(a->absolute, a->relative * fabs(a->near)); /* fmax leaves out what is not given */
    const range limits = !isnan(a->near)
                             ? (range){a->near - tolerance, a->near + tolerance}
                             : (range){isnan(a->least) ? -INFINITY : a->least, isnan(a->most) ? INFINITY : a->most};
    const bound known = exact_bound(summary, a->quantity, out.value);
    const bool bounded = !isnan(known.error) && !isnan(out.value);
    const range exact = bounded ? known.in : (range){out.value, out.value};
    out.error = bounded ? known.error : (double)NAN;
    out.margin = isnan(out.value) ? -INFINITY : fmin(out.value - limits.lo, limits.hi - out.value);
    const bool misses = exact.hi < limits.lo || exact.lo > limits.hi;
    if (misses && (met || bounded)) {
        const bool below = out.value < limits.lo;
        if (!isnan(a->near))
            snprintf(out.reason, sizeof out.reason, "%s is not within %s of %s", shown(first, out.value),
                     shown(second, tolerance), shown(third, a->near));
        else
            snprintf(out.reason, sizeof out.reason, "%s is %s %s", shown(first, out.value), below ? "below" : "above",
                     shown(second, below ? limits.lo : limits.hi));
    } else if (!met || isnan(out.value)) {
        out.verdict = CODEC_UNCERTAIN;
        snprintf(out.reason, sizeof out.reason, "%s%.40s", met ? "the value is not known" : "the job ended with ",
                 met ? "" : outcome);
    } else if (exact.lo < limits.lo || exact.hi > limits.hi) {
        out.verdict = CODEC_UNCERTAIN;
        snprintf(out.reason, sizeof out.reason,
                 "%sthe exact value is between %s and %s, so that it may or may not meet the limit",
                 known.estimated ? "by estimate " : "", shown(first, exact.lo), shown(second, exact.hi));
    } else {
        out.verdict = CODEC_PASS;
    }
    return out;
}

/* ---- of many cases */

bool judge(char **summary, const codec_request *request, const char *name, bool whole, codec_finding *all)
{
    const int64_t n = request->n_assertions;
    int64_t told = 0;
    bool good = false;
    if (n == 0)
        return true;
    codec_judged *list = calloc((size_t)n, sizeof *list);
    json_tree tree;
    const bool read = codec_summary_read(&tree, *summary);
    for (int64_t i = 0; list && read && i < n; i++) {
        const codec_assertion *a = &request->assertions[i];
        /* How many cases ended how, and how long all took, is known of the whole job alone. */
        const bool of_whole =
            !a->case_name[0] && (strncmp(a->quantity, "cases.", 6) == 0 || strncmp(a->quantity, "timings_s.", 10) == 0);
        const bool gathered = whole && !of_whole;
        const bool of_another = name && (a->case_name[0] ? strcmp(a->case_name, name) != 0 : of_whole);
        if (!whole && of_another)
            continue;
        codec_judged *one = &list[told++];
        *one = (codec_judged){a, gathered ? all[i] : judge_one(a, tree.root), gathered};
        if (!name)
            continue;
        /* The worst of several cases; of equally good ones that which is nearest to its limit. */
        const codec_finding *found = &one->found, *sum = &all[i];
        const bool first = sum->counts[0] + sum->counts[1] + sum->counts[2] == 0;
        const bool worse = found->verdict > sum->verdict;
        all[i].counts[found->verdict]++;
        if (first || worse || (found->verdict == sum->verdict && found->margin < sum->margin)) {
            codec_finding taken = *found;
            memcpy(taken.counts, sum->counts, sizeof taken.counts);
            snprintf(taken.case_name, sizeof taken.case_name, "%s", name);
            all[i] = taken;
        }
    }
    if (list && read)
        good = codec_add_findings(summary, list, told);
    json_clear(&tree);
    free(list);
    return good;
}
