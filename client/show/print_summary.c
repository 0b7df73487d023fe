/* What a job came to, for a person: a block of lines under a label for each part of its summary. */
#include "show/checks.h"
#include "local/files.h"
#include "show/report.h"

#include <math.h>
#include <string.h>

/* ---- words */

/* A number for a person; "unknown" where the job has none, since nan looks like an answer. digits 0: a bound, which
 * must not be shown smaller than it is. Buffer of 32. */
static const char *number_in_words(char text[32], const json_t *object, const char *path, int digits)
{
    double value = client_json_number(object, path);
    if (!isfinite(value))
        snprintf(text, 32, "unknown");
    else if (digits == 0)
        client_format_bound(text, value);
    else
        snprintf(text, 32, "%.*g", digits, value);
    return text;
}

/* With two digits: up to six places behind the point, then with a power of ten. */
static const char *two_digits(char buffer[32], double value)
{
    const int places = value > 0 ? (int)fmax(0, 1 - floor(log10(value))) : 0;
    snprintf(buffer, 32, places > 6 ? "%.*g" : "%.*f", places > 6 ? 2 : places, value);
    return buffer;
}

/* " MPa": what the scene calls the unit of this ("length", "force" or "stress"), or nothing. power: "^2" of an area. */
static void print_unit(FILE *to, const json_t *summary, const char *of, const char *power)
{
    const char *unit = client_json_text(client_json_at(summary, "problem.units"), of);
    if (!*unit)
        return;
    fputc(' ', to);
    client_print_safe(to, unit);
    fputs(power, to);
}

static void label(FILE *to, const char *text)
{
    fprintf(to, "%-12s", text);
}

/* A point or a force in brackets behind the words; nothing where there is none. */
static void print_vector(FILE *to, const char *before, const json_t *vector)
{
    size_t n = json_array_size(vector);
    for (size_t i = 0; i < n; i++) {
        const json_t *number = json_array_get(vector, i);
        fputs(i ? ", " : before, to);
        fputs(i ? "" : "(", to);
        if (json_is_number(number))
            fprintf(to, "%.6g", json_number_value(number));
        else
            fputs("unknown", to);
    }
    fputs(n ? ")" : "", to);
}

/* "12 x 4" */
static void print_cells(FILE *to, const json_t *cells)
{
    for (size_t i = 0; i < json_array_size(cells); i++)
        fprintf(to, "%s%.0f", i ? " x " : "", json_number_value(json_array_get(cells, i)));
}

/* ---- the parts, in the order in which they are printed */

/* Of several cases. */
static void name_worst(FILE *to, const char *before, const json_t *summary)
{
    const char *worst = client_json_text(summary, "cases.worst");
    if (!*worst)
        return;
    fputs(before, to);
    client_print_safe(to, worst);
}

/* How it ended, and of what: the worst case where there are several. */
static void print_outcome(FILE *to, const json_t *summary)
{
    static const char *const WORDS[][2] = {
        {"converged", "the certificate meets what was asked for"},
        {"iteration_limit", "the iterations ran out first; this is the best answer so far"},
        {"time_limit", "the time ran out first; this is the best answer so far"},
        {"precision_limit", "double precision holds no more digits here"},
        {"paper_rule", "the paper's stopping rule ended it before the certificate met what was asked for"},
        {"infeasible", "no displacement satisfies all contact conditions"},
        {"out_of_reach", "a displacement that satisfies all contact conditions, if there is one, is far away"},
        {"moving_geometry",
         "the surfaces move so far that the contact's geometry did not settle; this is the last answer"},
        {"unstable", "no stable equilibrium was found under all of the load; this is the answer under a part of it"},
        {"inverted", "elements turn inside out under all of the load; this is the answer under a part of it"},
        {"loose", "nothing says where the body lies; this is one place of many"},
        {"unheld", "the load does not press the body on what would hold it; there is no answer"},
        {"dismissed", "it was dismissed; this is the best answer so far"},
        {"verified", "the certificate of the given answer meets what was asked for"},
        {"mesh_limit", "a grid that meets what was asked for is larger than allowed"},
        {"not_verified", "the certificate of the given answer does not meet what was asked for"},
    };
    const char *outcome = client_json_text(summary, "outcome"), *words = "";
    const char *message = client_json_text(summary, "message");
    const double d = client_json_number(summary, "problem.d"), m = client_json_number(summary, "problem.m");
    char count[32], percent[32], of_mesh[32];
    for (size_t i = 0; i < sizeof WORDS / sizeof *WORDS; i++)
        words = strcmp(WORDS[i][0], outcome) == 0 ? WORDS[i][1] : words;
    label(to, "outcome");
    client_print_safe(to, outcome);
    name_worst(to, ", case ", summary);
    fprintf(to, "%s%s\n", *words ? ": " : "", words);
    if (*message) {
        label(to, "");
        client_print_safe(to, message);
        fputc('\n', to);
    }
    const json_t *error = json_object_get(summary, "error");
    const bool bounded = json_is_number(json_object_get(error, "dual_unknowns"));
    if (bounded || strcmp(client_json_text(error, "kind"), "estimated") == 0) {
        const double mesh = client_json_number(error, "mesh"), total = client_json_number(error, "total");
        label(to, "whole error");
        if (bounded && isfinite(total))
            fprintf(to, "at most %s %% in the energy norm, mesh and equations together, guaranteed\n",
                    client_format_bound(percent, 100 * total));
        else if (bounded)
            fprintf(to, "at most %s in the energy norm, which may be all of it: guaranteed\n",
                    client_format_bound(percent, client_json_number(error, "bound")));
        else if (isfinite(total))
            fprintf(to, "about %s %% in the energy norm: %s %% of it the mesh's, by estimate\n",
                    two_digits(percent, 100 * total), two_digits(of_mesh, 100 * mesh));
        else
            fprintf(to, "not known: what the %s could not be told\n",
                    isfinite(mesh) ? "equations leave" : "mesh loses");
        if (*client_json_text(error, "why")) {
            label(to, "");
            fputs("no guarantee: ", to);
            client_print_safe(to, client_json_text(error, "why"));
            fputc('\n', to);
        }
    }
    const json_t *quantity;
    size_t i;
    json_array_foreach(json_object_get(summary, "quantities"), i, quantity)
    {
        char text[CLIENT_QUANTITY];
        label(to, i == 0 ? "quantities" : "");
        client_print_safe(to, client_format_quantity(text, quantity));
        fputc('\n', to);
    }
    if (json_is_object(json_object_get(summary, "cases"))) {
        label(to, "cases");
        fputs(number_in_words(count, summary, "cases.count", 9), to);
        name_worst(to, "; what follows is of the worst: ", summary);
        fputc('\n', to);
    }
    if (isfinite(d) && isfinite(m)) {
        label(to, "problem");
        client_print_safe(to, client_json_text(summary, "problem.kind"));
        fprintf(to, ", %.0f unknowns, %.0f contact conditions\n", d, m);
    }
}

/* Was the mesh chosen for the first of the quantities? Its error is that of the grids then. */
static bool is_of_quantity(const json_t *summary)
{
    return json_array_size(json_object_get(summary, "quantities")) > 0 &&
           !isfinite(client_json_number(summary, "total_error")) && client_json_at(summary, "mesh.ladder");
}

/* A mesh that was chosen: the grid of the answer, and all that were tried. */
static void print_ladder(FILE *to, const json_t *summary)
{
    const json_t *ladder = client_json_at(summary, "mesh.ladder"), *level;
    char d[32], whole[32], mesh[32], certified[32], iterations[32], seconds[32];
    size_t i;
    if (!json_is_array(ladder))
        return;
    label(to, "mesh");
    const bool refined = json_is_true(client_json_at(summary, "mesh.refined"));
    if (refined)
        fputs(number_in_words(d, summary, "mesh.elements", 9), to);
    else
        print_cells(to, client_json_at(summary, "mesh.cells"));
    fprintf(to, " %s after %zu grid%s:\n", refined ? "elements, refined" : "cells, chosen", json_array_size(ladder),
            json_array_size(ladder) > 1 ? "s" : "");
    fprintf(to, "%12s%9s  %11s  %10s  %10s  %10s  %s\n", "", "unknowns",
            is_of_quantity(summary) ? "quantity" : "whole error", "mesh error", "certified", "iterations", "time");
    json_array_foreach((json_t *)ladder, i, level)
    {
        fprintf(to, "%12s%9s  %11s  %10s  %10s  %10s  %s  ", "", number_in_words(d, level, "d", 9),
                number_in_words(whole, level, "error", 3), number_in_words(mesh, level, "discretization_error", 3),
                number_in_words(certified, level, "certified_error", 2),
                number_in_words(iterations, level, "iterations", 9),
                client_format_seconds(seconds, sizeof seconds, client_json_number(level, "seconds")));
        if (refined)
            fprintf(to, "%s elements", number_in_words(d, level, "elements", 9));
        else
            print_cells(to, json_object_get(level, "cells"));
        fputc('\n', to);
    }
}

/* The method, what it began with unless that was nothing special, and what holds a body that its supports leave free.
 */
static void print_method(FILE *to, const json_t *summary)
{
    static const char *const COUNTS[][2] = {{"iteration", "iterations"}, {"restart", "restarts"}};
    const char *from = client_json_text(summary, "started_from");
    const double modes = client_json_number(summary, "semicoercive.free_modes");
    char held[32];
    if (isfinite(modes)) {
        label(to, "supports");
        fprintf(to, "only the obstacle holds it: %.0f free motion%s, stopped by %s rows proved to be in contact\n",
                modes, modes > 1 ? "s" : "", number_in_words(held, summary, "semicoercive.held", 9));
    }
    label(to, "method");
    client_print_safe(to, client_json_text(summary, "method"));
    fputs(", ", to);
    client_print_safe(to, client_json_text(summary, "operator"));
    fputs(" operator", to);
    for (size_t i = 0; i < sizeof COUNTS / sizeof *COUNTS; i++) {
        const double count = client_json_number(summary, COUNTS[i][1]);
        if (isfinite(count))
            fprintf(to, ", %.0f %s", count, COUNTS[i][fabs(count - 1) >= 0.5]);
    }
    if (strcmp(from, "continued") == 0)
        fputs(", continued from another job", to);
    else if (strcmp(from, "warm") == 0)
        fputs(", from known reactions", to);
    fputc('\n', to);
}

/* Where the largest pressure, the area and the largest stress are without a mesh, by what grids tell: a line for each,
 * or what is in the way.
 */
static void print_trends(FILE *to, const json_t *estimates)
{
    static const char *const NAMES[][2] = {
        {"max_pressure", "largest pressure"}, {"area", "area"}, {"von_mises", "largest stress"}, {"safety", "safety"}};
    bool first = true;
    for (size_t k = 0; k < sizeof NAMES / sizeof NAMES[0] && json_is_object(estimates); k++) {
        const json_t *one = client_json_at(estimates, NAMES[k][0]);
        const double low = client_json_number(one, "low"), high = client_json_number(one, "high"),
                     value = client_json_number(one, "value"), order = client_json_number(one, "order");
        char within[32];
        if (!json_is_object(one))
            continue;
        label(to, first ? "estimates" : "");
        first = false;
        fprintf(to, "%s ", NAMES[k][1]);
        if (isfinite(high))
            fprintf(to, "%.5g within %s, by estimate: ", value,
                    client_format_bound(within, fmax(high - value, value - low)));
        else
            fputs(isfinite(low) ? "without a limit: " : "none: ", to);
        if (isfinite(order))
            fprintf(to, "order %.2g observed on %.0f grids", order, client_json_number(one, "grids"));
        else
            client_print_safe(to, client_json_text(one, "why"));
        fputc('\n', to);
    }
}

static void print_contact(FILE *to, const json_t *summary)
{
    const double candidates = client_json_number(summary, "contact.candidates");
    const double kept = client_json_number(summary, "contact.kept"),
                 added = client_json_number(summary, "contact.added");
    char text[32], more[32];
    label(to, "contact");
    fprintf(to, "%s of %s candidates touch", number_in_words(text, summary, "contact.active", 9),
            number_in_words(more, summary, "contact.candidates", 9));
    if (json_is_number(client_json_at(summary, "contact.area"))) {
        fprintf(to, ", on an area of %s", number_in_words(text, summary, "contact.area", 6));
        print_unit(to, summary, "length", "^2");
    }
    if (kept < candidates)
        fprintf(to, "; solved with %.0f, the others are proved not to matter", kept);
    if (added > 0) /* candidates that had to be taken back */
        fprintf(to, "; %.0f added in %.0f rounds", added, client_json_number(summary, "contact.rounds"));
    fputc('\n', to);
    /* The commonest mistake in a scene is converged, certified and without a warning: the obstacle on the other side.
     */
    if (strcmp(client_json_text(client_json_at(summary, "problem"), "kind"), "scene") == 0 &&
        client_json_number(summary, "contact.active") == 0 && candidates > 0) {
        label(to, "");
        fputs("nothing touches; if it should: an obstacle's normal points to the body, a polyline has it on its left\n",
              to);
    }
    label(to, "reactions");
    fprintf(to, "sum %s", number_in_words(text, summary, "contact.reaction_sum", 10));
    print_unit(to, summary, "force", "");
    print_vector(to, ", force ", client_json_at(summary, "contact.force"));
    print_unit(to, summary, "force", "");
    if (json_is_number(client_json_at(summary, "contact.max_pressure"))) {
        fprintf(to, ", largest pressure %s", number_in_words(text, summary, "contact.max_pressure", 6));
        print_unit(to, summary, "stress", "");
        print_vector(to, " at ", client_json_at(summary, "contact.max_pressure_at.x"));
    }
    fputc('\n', to);
    print_trends(to, client_json_at(summary, "contact.estimates"));
    label(to, "penetration");
    fputs(number_in_words(text, summary, "contact.max_penetration", 3), to);
    print_unit(to, summary, "length", "");
    fputs(" at most\n", to);
    /* What facets are taken for: "shaft: cylinder of radius 20, 0.027 off the facets, which turn by 6 degrees". */
    const json_t *list = client_json_at(summary, "contact.surfaces");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *one = json_array_get(list, i);
        label(to, i == 0 ? "surfaces" : "");
        client_print_safe(to, client_json_text(one, "group"));
        fprintf(to, ": %s", client_json_text(one, "shape"));
        if (json_is_number(json_object_get(one, "radius")))
            fprintf(to, " of radius %s", number_in_words(text, one, "radius", 6));
        if (client_json_number(one, "largest_offset") > 0)
            fprintf(to, ", %s off the facets", number_in_words(text, one, "largest_offset", 2));
        fprintf(to, ", turning by %s degrees\n", number_in_words(text, one, "largest_turn", 2));
    }
}

/* The largest stress, and what is left to the yield stress. */
static void print_stress(FILE *to, const json_t *summary)
{
    const json_t *stress = client_json_at(summary, "stress");
    char text[32];
    if (!json_is_object(stress))
        return;
    label(to, "stress");
    fprintf(to, "von Mises %s", number_in_words(text, stress, "von_mises", 6));
    print_unit(to, summary, "stress", "");
    fputs(" at most,", to);
    print_vector(to, " at ", client_json_at(stress, "at.x"));
    if (json_is_number(json_object_get(stress, "safety"))) {
        fprintf(to, "; safety factor %s", number_in_words(text, stress, "safety", 4));
        print_vector(to, " at ", client_json_at(stress, "weakest_at.x"));
    }
    fputc('\n', to);
    print_trends(to, json_object_get(stress, "estimates"));
}

/* " N mm": of a moment. */
static void print_moment_unit(FILE *to, const json_t *summary)
{
    print_unit(to, summary, "force", "");
    print_unit(to, summary, "length", "");
}

/* How a rigid group was moved, and the moment that the support takes at its point. */
static void print_rigid(FILE *to, const json_t *summary, const json_t *rigid)
{
    const bool plane = json_array_size(json_object_get(rigid, "displacement")) == 2;
    fprintf(to, "\n%14srigid: its point", "");
    print_vector(to, " ", json_object_get(rigid, "point"));
    print_vector(to, " moves by ", json_object_get(rigid, "displacement"));
    print_unit(to, summary, "length", "");
    print_vector(to, plane ? " and turns by " : " and turns about the axes by ", json_object_get(rigid, "rotation"));
    fputs(" degrees", to);
    print_vector(to, "; moment ", json_object_get(rigid, "moment"));
    print_moment_unit(to, summary);
}

/* What acts on the body, moments but of rigid groups left out: "contact bottom (0, 10.5)". */
static void print_resultants(FILE *to, const json_t *summary)
{
    static const char *const LISTS[][2] = {{"contacts", "contact "}, {"supports", "support "}, {"loads", "loads"}};
    const json_t *acts = client_json_at(summary, "resultants");
    bool first = true;
    char text[32];
    if (!json_is_object(acts))
        return;
    for (int k = 0; k < 3; k++) {
        const json_t *list = json_object_get(acts, LISTS[k][0]); /* the loads are one object */
        for (size_t i = 0, n = k < 2 ? json_array_size(list) : 1; i < n; i++) {
            const json_t *one = k < 2 ? json_array_get(list, i) : list;
            label(to, first ? "forces" : "");
            fputs(LISTS[k][1], to);
            client_print_safe(to, client_json_text(one, "on"));
            print_vector(to, " ", client_json_at(one, "force"));
            print_unit(to, summary, "force", "");
            if (k == 0 && isfinite(client_json_number(one, "mean_pressure"))) {
                fprintf(to, "\n%14spressure %s", "", number_in_words(text, one, "mean_pressure", 5));
                print_unit(to, summary, "stress", "");
                fprintf(to, " on average, %s", number_in_words(text, one, "max_pressure", 5));
                print_unit(to, summary, "stress", "");
                fprintf(to, " at most, on %s", number_in_words(text, one, "area", 5));
                print_unit(to, summary, "length", "^2");
                fputs(" around", to);
                print_vector(to, " ", client_json_at(one, "center"));
            }
            if (json_is_object(json_object_get(one, "rigid")))
                print_rigid(to, summary, json_object_get(one, "rigid"));
            fputc('\n', to);
            first = false;
        }
    }
    label(to, "");
    fprintf(to, "imbalance %s of their sizes\n", number_in_words(text, acts, "imbalance", 2));
}

static const char *in_words(bool met)
{
    return met ? "met" : "not met";
}

/* Of finite kinematics, where nothing bounds the error. */
static void print_finite(FILE *to, const json_t *finite, double asked, const char *met)
{
    char least[32], residual[32];
    fprintf(to, "%sstable equilibrium under %.6g of the load: a further Newton step would change it\n",
            json_is_true(json_object_get(finite, "definite")) ? "" : "no ", client_json_number(finite, "load"));
    label(to, "");
    fprintf(to, "by %s, relative, in the energy norm (asked for %.3g: %s). Nothing bounds its error\n",
            number_in_words(residual, finite, "residual", 2), asked, met);
    label(to, "");
    fprintf(to, "%.0f contact problems in %.0f steps, the least determinant of F is %s\n",
            client_json_number(finite, "qps"), client_json_number(finite, "steps"),
            number_in_words(least, finite, "least_det", 3));
}

/* Of the kinematics auto. */
static void print_small(FILE *to, const json_t *summary)
{
    const json_t *small = json_object_get(summary, "small_deformation");
    const double error = client_json_number(small, "error");
    if (!json_is_object(small))
        return;
    label(to, "kinematics");
    if (!isfinite(error))
        fprintf(to, "large deformation has no stable equilibrium beyond %.6g of the load\n",
                client_json_number(small, "load"));
    else
        fprintf(to, "small deformation %s by %.3g %% in %s\n",
                json_is_object(json_object_get(summary, "finite")) ? "would have erred" : "errs", 100 * error,
                client_json_text(small, "in"));
}

/* The bound, whether it is what was asked for, and what it is made of. */
static void print_certificate(FILE *to, const json_t *summary)
{
    const json_t *certificate = client_json_at(summary, "certificate");
    const double relative = client_json_number(certificate, "relative_error");
    const bool bounded = json_is_number(client_json_at(summary, "error.dual_unknowns"));
    const bool guaranteed = !bounded && strcmp(client_json_text(summary, "error.kind"), "guaranteed") == 0;
    const double asked = client_json_number(summary, "requested_error"),
                 total = client_json_number(summary, "total_error");
    const char *outcome = client_json_text(summary, "outcome");
    const bool ended = strcmp(outcome, "converged") == 0 || strcmp(outcome, "verified") == 0;
    char absolute[32], gap[32], residual[32];
    if (!json_is_object(certificate))
        return;
    label(to, "certificate");
    if (json_is_object(json_object_get(summary, "finite"))) {
        print_finite(to, json_object_get(summary, "finite"), asked, in_words(ended));
        return;
    }
    /* What the bound says to somebody who never heard of an energy norm: how many digits it leaves. */
    const double left = client_json_number(summary, "contact.geometry.left");
    const double off = left > relative ? left : relative, digits = floor(-log10(off));
    if (!isfinite(relative))
        fputs("nothing could be certified", to);
    else
        fprintf(to, "the exact %s is within %s of this one, relative, in the energy norm",
                guaranteed ? "displacement" : "solution of these equations", client_format_bound(absolute, relative));
    const bool certified = !guaranteed && isfinite(relative);
    if (certified && !isfinite(total))
        fprintf(to, "\n%11s", ""); /* what was asked for has a line of its own */
    else if (!certified && relative > 0 && relative < 1 && digits >= 1)
        fprintf(to, ":\n%12s%.0f digit%s %s certain", "", fmin(digits, 15), digits > 1 ? "s" : "",
                digits > 1 ? "are" : "is");
    /* what was asked for is met or not by the number beside it, whatever else the answer is short of */
    if (!isfinite(asked))
        fputs("\n", to);
    else if (is_of_quantity(summary)) {
        fprintf(to, " (asked for %.3g of ", asked);
        client_print_safe(to, client_json_text(json_array_get(json_object_get(summary, "quantities"), 0), "name"));
        fprintf(to, ": %s)\n", in_words(ended));
    } else if (isfinite(total))
        fprintf(to, "\n%12stotal error %s %.2g (asked for %.3g: %s)\n", "", bounded ? "at most" : "about", total, asked,
                in_words(total <= asked));
    else if (asked > 0)
        fprintf(to, " (asked for %.3g: %s)\n", asked, in_words(off <= asked));
    else
        fprintf(to, " (asked for rounding level: %s)\n", in_words(ended));
    label(to, "");
    fprintf(to, "absolute %s, duality gap %s, relative KKT residual %s\n",
            number_in_words(absolute, certificate, "absolute_error", 0), number_in_words(gap, certificate, "gap", 0),
            number_in_words(residual, certificate, "relative_residual.total", 3));
    if (isfinite(left)) {
        label(to, "");
        fprintf(to, "contact where the answer moves it, in %.0f passes; others would change it by about %.2g\n",
                client_json_number(summary, "contact.geometry.passes"), left);
    }
}

/* What the answer took: the factor, or the coarse levels that stand in its place; why this form of the operator, by
 * what each was expected to take; the stages that took at least a hundredth of the whole, in the order in which they
 * ran. */
static void print_effort(FILE *to, const json_t *summary)
{
    static const char *const STAGES[] = {"queue",  "parse",    "assemble", "order",
                                         "factor", "condense", "iterate",  "certify"};
    const json_t *cost = client_json_at(summary, "cost"), *considered = client_json_at(cost, "considered"), *form;
    const json_t *timings = client_json_at(summary, "timings_s");
    const double predicted = client_json_number(cost, "predicted.seconds"),
                 actual = client_json_number(cost, "actual.seconds"), total = client_json_number(timings, "total");
    const json_t *factor = client_json_at(summary, "factor");
    const double bytes = client_json_number(factor, "bytes");
    const char *before = ": ", *from = json_is_true(json_object_get(factor, "cached")) ? "from the cache" : "new";
    char text[32], more[32];
    size_t i;
    if (json_is_object(factor))
        label(to, "factor");
    const char *by = client_json_text(summary, "operator");
    if (json_is_object(factor) && (strcmp(by, "matrix_free") == 0 || strcmp(by, "distributed") == 0)) {
        fprintf(to, "none: coarse levels of %.3g MB, %s\n", isfinite(bytes) ? bytes / 1e6 : 0.0, from);
    } else if (json_is_object(factor)) {
        fprintf(to, "%s, ", from);
        client_print_safe(to, client_json_text(factor, "ordering"));
        fprintf(to, " ordering, %s entries", number_in_words(text, factor, "nnz", 15));
        if (isfinite(bytes))
            fprintf(to, ", %.3g MB", bytes / 1e6);
        fprintf(to, ", rcond %s\n", number_in_words(text, factor, "rcond", 2));
    }
    if (isfinite(predicted) && isfinite(actual)) {
        label(to, "cost");
        fprintf(to, "%s predicted, %s in fact", client_format_seconds(text, sizeof text, predicted),
                client_format_seconds(more, sizeof more, actual));
        json_array_foreach(considered, i, form)
        {
            double seconds = client_json_number(form, "seconds");
            fputs(i ? ", " : "; considered: ", to);
            client_print_safe(to, client_json_text(form, "operator"));
            fprintf(to, " %s", isfinite(seconds) ? client_format_seconds(text, sizeof text, seconds) : "unknown");
            if (json_is_false(json_object_get(form, "fits")))
                fputs(" (too much memory)", to);
        }
        fputc('\n', to);
    }
    if (!isfinite(total))
        return;
    label(to, "time");
    fprintf(to, "%s", client_format_seconds(text, sizeof text, total));
    for (i = 0; i < sizeof STAGES / sizeof *STAGES; i++) {
        double seconds = client_json_number(timings, STAGES[i]);
        if (!(seconds >= 0.01 * total) || !(seconds > 0))
            continue;
        fprintf(to, "%s%s %s", before, STAGES[i], client_format_seconds(text, sizeof text, seconds));
        before = ", ";
    }
    fputc('\n', to);
}

/* ---- the whole */

void client_print_summary(FILE *to, const json_t *job)
{
    const json_t *summary = json_object_get(job, "summary"), *warning;
    char primal[32], dual[32];
    size_t i;
    client_print_job(to, job);
    if (!json_is_object(summary))
        return;
    print_outcome(to, summary);
    print_ladder(to, summary);
    print_method(to, summary);
    if (json_is_object(json_object_get(summary, "contact")))
        print_contact(to, summary);
    print_stress(to, summary);
    print_resultants(to, summary);
    json_array_foreach(json_object_get(summary, "warnings"), i, warning)
    {
        label(to, "warning");
        client_print_safe(to, client_json_text(warning, "code"));
        fputs(": ", to);
        client_print_safe(to, client_json_text(warning, "message"));
        fputc('\n', to);
    }
    if (json_is_object(client_json_at(summary, "energy"))) {
        label(to, "energy");
        fprintf(to, "%s primal, %s dual\n", number_in_words(primal, summary, "energy.primal", 11),
                number_in_words(dual, summary, "energy.dual", 11));
        if (isfinite(client_json_number(summary, "energy.potential")))
            fprintf(to, "%12sthe body's potential energy is %s\n", "",
                    number_in_words(primal, summary, "energy.potential", 6));
    }
    print_certificate(to, summary);
    print_small(to, summary);
    print_effort(to, summary);
    client_checks checks = {.item = NULL};
    client_checks_assertions(&checks, summary, "");
    client_checks_print(to, &checks, 0, "assertions");
    if (checks.failed)
        fputs("assertions  no memory to show all of them\n", to);
    client_checks_clear(&checks);
}

/* ---- load cases */

enum { NAME_WIDTH = 24 };

void client_print_cases(FILE *to, const json_t *result)
{
    const json_t *cases = json_object_get(result, "cases");
    char touch[32], iterations[32], error[32];
    size_t i;
    json_t *item;
    fprintf(to, "\n%-*s  %-15s  %10s  %8s  %s\n", NAME_WIDTH, "case", "outcome", "iterations", "contacts",
            "whole error");
    json_array_foreach(cases, i, item)
    {
        const json_t *summary = json_object_get(item, "summary");
        client_print_cell(to, client_json_text(item, "name"), NAME_WIDTH);
        client_print_cell(to, client_json_text(summary, "outcome"), 15);
        fprintf(to, "%10s  %8s  %s\n", number_in_words(iterations, summary, "iterations", 9),
                number_in_words(touch, summary, "contact.active", 9), client_format_error(error, summary));
    }
}
