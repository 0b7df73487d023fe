/* main.c: measures what docs/numbers.md shows, as JSON; progress goes to stderr. tests/figures/numbers_page.py makes
 * figures and tables of it. usage: figures OUTPUT.json [history|sizes|precision [problem]] */
#include "figures/figures.h"
#include "harness.h"

#include <limits.h>
#include <malloc.h>
#include <string.h>

/* As in the benchmark: memory that is given back and asked for again costs the kernel as much as a factorization. */
static void keep_memory(void)
{
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

static bool wanted(const char *part, const char *asked)
{
    return !asked || strcmp(part, asked) == 0;
}

int main(int argc, char **argv)
{
    const char *part = argc > 2 ? argv[2] : NULL;
    json out = {.first = true};
    if (part && strcmp(part, "history") != 0 && strcmp(part, "sizes") != 0 && strcmp(part, "precision") != 0) {
        fprintf(stderr, "figures: there is no part '%s': history, sizes or precision\n", part);
        return 2;
    }
    if (argc < 2 || !(out.file = fopen(argv[1], "w"))) {
        fprintf(stderr, "usage: figures OUTPUT.json [history|sizes|precision [problem]]\n");
        return 2;
    }
    keep_memory();
    uz_process_init(2);
    uz_thread_init();
    fputc('{', out.file);
    if (wanted("history", part))
        figure_history(&out);
    if (wanted("sizes", part))
        figure_sizes(&out);
    if (wanted("precision", part))
        figure_precision(&out, argc > 3 ? argv[3] : NULL);
    fputs("\n}\n", out.file);
    return fclose(out.file) != 0 || test_has_failed();
}
