/* extremes.c: prints the table, writes it as JSON, counts. usage: extremes OUTPUT.json [part of a family's name] */
#include "extremes.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

const char *name_of(char *room, size_t size, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(room, size, format, args);
    va_end(args);
    return room;
}

bool wants_family(const suite *all, const char *name)
{
    return !all->filter || strstr(name, all->filter);
}

static family *find_family(suite *all, const char *name)
{
    for (int k = 0; k < all->n_families; k++)
        if (strcmp(all->families[k].name, name) == 0)
            return &all->families[k];
    family *f = &all->families[all->n_families++];
    *f = (family){.least_ratio = INFINITY};
    snprintf(f->name, sizeof f->name, "%s", name);
    return f;
}

/* JSON has no NaN and no infinity. */
static void put_number(FILE *out, const char *key, double value)
{
    if (isfinite(value))
        fprintf(out, ", \"%s\": %.9g", key, value);
    else
        fprintf(out, ", \"%s\": null", key);
}

static void print_number(double value, int digits)
{
    char text[32] = "-";
    if (!isnan(value))
        snprintf(text, sizeof text, "%.*g", digits, value);
    printf(" %10s", text);
}

/* Not wrong, but doubles could hold the answer that was not given. */
static bool falls_short(const char *how, const char *outcome, const judgement *j)
{
    bool plain = strcmp(how, "default") == 0 || strcmp(how, "cached") == 0;
    return plain && strstr(outcome, "_limit") && j->floor < 1e-11;
}

static const char *say(const judgement *j, bool missed, bool is_short)
{
    if (j->verdict == JUDGED_WRONG)
        return "WRONG";
    if (missed)
        return "MISSED";
    return j->verdict == JUDGED_UNCERTAIN ? "uncertain" : is_short ? "short" : "ok";
}

static void count_row(family *f, const char *outcome, const judgement *j, bool failed, bool is_short)
{
    bool converged = strcmp(outcome, "converged") == 0, refused = strncmp(outcome, "error ", 6) == 0;
    f->rows++;
    f->failed += failed;
    f->converged += converged;
    f->refused += refused;
    f->other += !converged && !refused;
    f->is_short += is_short;
    if (converged && !isnan(j->error))
        f->worst_error = fmax(f->worst_error, j->error);
    if (!isnan(j->ratio))
        f->least_ratio = fmin(f->least_ratio, j->ratio);
}

void add_row(suite *all, const char *family_name, const char *name, const char *how, const char *outcome,
             const judgement *j, bool missed)
{
    bool failed = missed || j->verdict == JUDGED_WRONG, is_short = falls_short(how, outcome, j);
    const char *said = say(j, missed, is_short);
    printf("%-11s %-34s %-9s %-22s", family_name, name, how, outcome);
    print_number(j->certified, 3);
    print_number(j->error, 3);
    print_number(j->floor, 2);
    print_number(j->ratio, 4);
    printf("  %s%s%s\n", said, j->why[0] ? ": " : "", j->why);
    fprintf(all->json, "%s  {\"family\": \"%s\", \"name\": \"%s\", \"way\": \"%s\", \"outcome\": \"%s\"",
            all->rows ? ",\n" : "", family_name, name, how, outcome);
    put_number(all->json, "certified", j->certified);
    put_number(all->json, "true", j->error);
    put_number(all->json, "floor", j->floor);
    put_number(all->json, "ratio", j->ratio);
    fprintf(all->json, ", \"verdict\": \"%s\"}", said);
    all->rows++;
    all->passed += !failed;
    all->failed += failed;
    count_row(find_family(all, family_name), outcome, j, failed, is_short);
}

static void print_families(suite *all)
{
    printf("\n%-12s %6s %10s %8s %8s %8s %8s %14s %16s\n", "family", "rows", "converged", "other", "short", "refused",
           "failed", "largest error", "least bound/true");
    for (int k = 0; k < all->n_families; k++) {
        const family *f = &all->families[k];
        printf("%-12s %6d %10d %8d %8d %8d %8d %14.2g %16.6g\n", f->name, f->rows, f->converged, f->other, f->is_short,
               f->refused, f->failed, f->worst_error, f->least_ratio);
    }
}

static void write_totals(suite *all)
{
    fprintf(all->json, "\n], \"generated\": {\"problems\": %d, \"solves\": %d, \"converged\": %d, \"wrong\": %d",
            all->generated.problems, all->generated.solves, all->generated.converged, all->generated.wrong);
    fprintf(all->json, ", \"asked\": %d, \"answered\": %d", all->generated.asked, all->generated.answered);
    put_number(all->json, "ratio_median", all->generated.ratio_median);
    put_number(all->json, "ratio_least", all->generated.ratio_least);
    fprintf(all->json, "}, \"passed\": %d, \"failed\": %d}\n", all->passed, all->failed);
}

int main(int argc, char **argv)
{
    static void (*const families[])(suite *) = {run_scenes,
                                                run_bodies,
                                                run_scene_mixtures,
                                                run_stiffnesses,
                                                run_rows,
                                                run_ranges,
                                                run_exhaustive,
                                                run_invariance,
                                                run_guarantees,
                                                run_generated_problems,
                                                run_conditioned_problems,
                                                run_degenerate_problems,
                                                run_contradictions};
    suite all = {.filter = argc > 2 ? argv[2] : NULL};
    if (argc < 2 || !(all.json = fopen(argv[1], "w"))) {
        fprintf(stderr, "usage: extremes OUTPUT.json [part of a family's name]\n");
        return 2;
    }
    uz_process_init(2);
    uz_thread_init();
    setvbuf(stdout, NULL, _IOLBF, 0);
    printf("%-11s %-34s %-9s %-22s %10s %10s %10s %10s\n", "family", "problem", "way", "outcome", "certified", "true",
           "floor", "ratio");
    fprintf(all.json, "{\"rows\": [\n");
    for (size_t k = 0; k < sizeof families / sizeof families[0]; k++)
        families[k](&all);
    write_totals(&all);
    print_families(&all);
    printf("%d passed, %d failed\n", all.passed, all.failed);
    return fclose(all.json) != 0 || all.failed > 0 || all.passed == 0;
}
