#include "progress.h"
#include "files.h"
#include "http.h"
#include "report.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#define BAR_CELLS 24

client_progress client_progress_new(FILE *to, bool wanted, bool quiet)
{
    bool terminal = isatty(fileno(to)) == 1;
    return (client_progress){
        .to = to, .shown = wanted || (terminal && !quiet), .live = terminal, .start = client_clock()};
}

static void print_bar(FILE *to, double percent)
{
    int full = (int)lround(fmin(fmax(percent, 0), 100) / 100 * BAR_CELLS);
    fputc('[', to);
    for (int i = 0; i < BAR_CELLS; i++)
        fputc(i < full ? '#' : '.', to);
    fputs("] ", to);
}

void client_progress_show(client_progress *progress, const json_t *job)
{
    if (!progress->shown)
        return;
    double percent = client_json_number(job, "progress");
    char now[sizeof progress->last];
    snprintf(now, sizeof now, "%.10s %3.0f %%", client_json_text(job, "status"), isfinite(percent) ? percent : 0);
    if (!progress->live && strcmp(now, progress->last) == 0)
        return;
    memcpy(progress->last, now, sizeof now);
    if (progress->live) {
        fputs("\r\033[K", progress->to);
        print_bar(progress->to, percent);
    }
    client_print_safe(progress->to, now);
    fprintf(progress->to, "  %.1f s%s", client_clock() - progress->start, progress->live ? "" : "\n");
    fflush(progress->to);
}

void client_progress_end(client_progress *progress)
{
    if (progress->shown && progress->live)
        fputs("\r\033[K", progress->to);
    fflush(progress->to);
}
