#include "show/progress.h"
#include "local/files.h"
#include "service/http.h"
#include "show/report.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define LINE_EVERY_S 3.0 /* where lines are not written over */
#define BAR_CELLS    24
#define BAR_LEAST    8
#define ROOM         256

/* What the service's per cents mean (schemas/job.json): rows begin at 10 and end at 95. */
#define FIRST_ROW 10.0
#define LAST_ROW  95.0

int client_columns(FILE *stream, int otherwise)
{
    struct winsize size;
    if (ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
        return size.ws_col;
    const char *text = getenv("COLUMNS");
    long columns = text ? strtol(text, NULL, 10) : 0;
    return columns > 0 && columns < 10000 ? (int)columns : otherwise;
}

client_progress client_progress_new(FILE *to, bool wanted, bool quiet)
{
    bool terminal = isatty(fileno(to)) == 1;
    return (client_progress){.to = to,
                             .shown = wanted || (terminal && !quiet),
                             .live = terminal,
                             .start = client_clock(),
                             .said = -INFINITY,
                             .percent = NAN,
                             .iteration = NAN,
                             .bound = NAN,
                             .relative = NAN,
                             .first = NAN,
                             .grid = NAN,
                             .grid_error = NAN,
                             .grid_ends = NAN};
}

/* -------------------------------------------------------------------- ETA */

double client_progress_left(const client_progress *p, double now)
{
    double share = (p->percent - FIRST_ROW) / (LAST_ROW - FIRST_ROW), rate = 0;
    if (isfinite(p->grid)) /* iterations on this grid tell nothing of those that follow */
        return p->grid_ends - now;
    if (!(p->percent >= 2) || now - p->start < 1)
        return NAN;
    /* How fast log(error) falls over the samples that are kept, per second; 0: it does not. */
    const int kept = p->samples < CLIENT_PROGRESS_SAMPLES ? p->samples : CLIENT_PROGRESS_SAMPLES;
    if (kept >= 3) {
        const int last = (p->samples - 1) % CLIENT_PROGRESS_SAMPLES;
        const int first = p->samples > kept ? p->samples % CLIENT_PROGRESS_SAMPLES : 0;
        const double seconds = p->at[last] - p->at[first], drop = p->value[first] - p->value[last];
        rate = seconds > 0.2 && drop > 0 ? drop / seconds : 0;
    }
    /* The service's share of the way is one of log(error): what is fallen so far tells the rest. */
    double fallen = log(p->first / p->relative);
    if (share > 0 && share <= 1 && rate > 0 && fallen > 0)
        return fallen * (1 - share) / share / rate;
    return (now - p->start) * (100 - p->percent) / p->percent;
}

/* ------------------------------------------------------------------- line */

typedef struct {
    char text[48];
    int rank; /* the smaller, the longer it stays when there is little room; 0: not there */
} part;

__attribute__((format(printf, 3, 4))) static void put(part *to, int rank, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(to->text, sizeof to->text, format, args);
    va_end(args);
    to->rank = to->text[0] ? rank : 0;
}

enum { PARTS = 8 };

/* As many parts as fit into `room` characters, and the first even if it does not. */
static int compose(char out[ROOM], const client_progress *p, int room)
{
    part parts[PARTS];
    double now = client_clock();
    memset(parts, 0, PARTS * sizeof *parts);
    put(&parts[0], 1, "%.10s %3.0f %%", p->status, isfinite(p->percent) ? p->percent : 0);
    put(&parts[1], 6, "%.1f s", now - p->start);
    const bool running = strcmp(p->status, "running") == 0;
    const char *phase = strcmp(p->status, "accepted") == 0 ? "waiting for its turn"
                        : !running                         ? ""
                        : p->percent >= LAST_ROW           ? "finishing"
                        : isfinite(p->iteration)           ? "iterating"
                        : p->percent >= 5                  ? "factorizing"
                                                           : "starting";
    put(&parts[2], 5, "%s", phase);
    if (isfinite(p->iteration))
        put(&parts[3], 4, "iteration %.0f", p->iteration);
    if (isfinite(p->grid_error))
        put(&parts[7], 2, "grid %.0f, %.2g %% of %.2g %%", p->grid, 100 * p->grid_error, 100 * p->grid_asked);
    else if (isfinite(p->grid))
        put(&parts[7], 2, "grid %.0f", p->grid);
    if (isfinite(p->relative) && !isfinite(p->grid))
        put(&parts[4], 2, "error ~%.1e", p->relative);
    if (isfinite(p->bound))
        put(&parts[5], 7, "bound %.2e", p->bound);
    const double left = running ? client_progress_left(p, now) : NAN;
    if (isfinite(left) && left >= 0) {
        if (left < 90)
            put(&parts[6], 3, "ETA %.0f s", ceil(left));
        else if (left < 5400)
            put(&parts[6], 3, "ETA %.0f min", left / 60);
        else
            put(&parts[6], 3, "ETA %.1f h", left / 3600);
    }
    /* The parts of rank 1..most with two blanks between them. */
    int most = PARTS + 1, len = room + 1;
    while (len > room && most > 1) {
        most--;
        len = 0;
        out[0] = '\0';
        for (int i = 0; i < PARTS; i++)
            if (parts[i].rank > 0 && parts[i].rank <= most)
                len += snprintf(out + len, (size_t)(ROOM - len), "%s%s", len ? "  " : "", parts[i].text);
    }
    if (len > room && room >= 0 && room < ROOM)
        out[room] = '\0';
    return len < room ? len : room;
}

void client_progress_redraw(client_progress *p)
{
    char text[ROOM];
    if (!p->shown || !p->live || !p->status[0])
        return;
    /* The last column stays free: some terminals go on to the next line when it is written. */
    int room = client_columns(p->to, 80) - 1, len = compose(text, p, room), cells = room - len - 3;
    fputs("\r\033[K", p->to);
    if (cells >= BAR_LEAST) {
        const int width = cells < BAR_CELLS ? cells : BAR_CELLS;
        const int full = (int)lround(fmin(fmax(p->percent, 0), 100) / 100 * width);
        fputc('[', p->to);
        for (int i = 0; i < width; i++)
            fputc(i < full ? '#' : '.', p->to);
        fputs("] ", p->to);
    }
    client_print_safe(p->to, text);
    fflush(p->to);
}

static void say(client_progress *p)
{
    char text[ROOM];
    double now = client_clock();
    if (!p->shown)
        return;
    if (p->live) {
        client_progress_redraw(p);
        return;
    }
    bool changed = strcmp(p->status, p->last_status) != 0;
    if (!changed && now - p->said < LINE_EVERY_S)
        return;
    compose(text, p, ROOM - 1);
    client_print_safe(p->to, text);
    fputc('\n', p->to);
    fflush(p->to);
    p->said = now;
    memcpy(p->last_status, p->status, sizeof p->last_status);
}

/* Of a job or of an event. */
static void take_grid(client_progress *p, const json_t *from)
{
    if (!json_is_object(client_json_at(from, "grid")))
        return;
    p->grid = client_json_number(from, "grid.number");
    p->grid_error = client_json_number(from, "grid.error");
    p->grid_asked = client_json_number(from, "grid.asked");
    p->grid_ends = client_clock() + client_json_number(from, "grid.seconds_left");
}

void client_progress_show(client_progress *p, const json_t *job)
{
    double percent = client_json_number(job, "progress");
    take_grid(p, job);
    snprintf(p->status, sizeof p->status, "%s", client_json_text(job, "status"));
    if (isfinite(percent))
        p->percent = percent;
    say(p);
}

void client_progress_row(client_progress *p, const json_t *event)
{
    double percent = client_json_number(event, "progress"), iteration = client_json_number(event, "iteration");
    /* ||u||_K is near sqrt(2 |psi|): equal where every gap that closes was 0. */
    double scale = sqrt(2 * fabs(client_json_number(event, "dual_objective")));
    double bound = client_json_number(event, "error_bound");
    take_grid(p, event);
    if (!p->status[0])
        snprintf(p->status, sizeof p->status, "running");
    if (isfinite(percent))
        p->percent = percent;
    if (isfinite(iteration))
        p->iteration = iteration;
    if (isfinite(bound)) {
        p->bound = bound;
        p->relative = scale > 0 ? bound / scale : NAN;
    }
    /* A sample of how the error falls, for the time that is left. */
    if (isfinite(bound) && p->relative > 0 && isfinite(p->relative)) {
        if (!isfinite(p->first))
            p->first = p->relative;
        const int at = p->samples++ % CLIENT_PROGRESS_SAMPLES;
        p->at[at] = client_clock();
        p->value[at] = log(p->relative);
    }
    say(p);
}

void client_progress_end(client_progress *p)
{
    if (p->shown && p->live)
        fputs("\r\033[K", p->to);
    fflush(p->to);
}
