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
                             .first = NAN};
}

/* -------------------------------------------------------------------- ETA */

static void note_sample(client_progress *p)
{
    if (!(p->relative > 0) || !isfinite(p->relative))
        return;
    if (!isfinite(p->first))
        p->first = p->relative;
    int at = p->samples++ % CLIENT_PROGRESS_SAMPLES;
    p->at[at] = client_clock();
    p->value[at] = log(p->relative);
}

/* How fast log(error) falls over the samples that are kept, per second; 0: it does not. */
static double slope(const client_progress *p)
{
    int kept = p->samples < CLIENT_PROGRESS_SAMPLES ? p->samples : CLIENT_PROGRESS_SAMPLES;
    if (kept < 3)
        return 0;
    int last = (p->samples - 1) % CLIENT_PROGRESS_SAMPLES;
    int first = p->samples > kept ? p->samples % CLIENT_PROGRESS_SAMPLES : 0;
    double seconds = p->at[last] - p->at[first], fallen = p->value[first] - p->value[last];
    return seconds > 0.2 && fallen > 0 ? fallen / seconds : 0;
}

double client_progress_left(const client_progress *p, double now)
{
    double share = (p->percent - FIRST_ROW) / (LAST_ROW - FIRST_ROW), rate = slope(p);
    if (!(p->percent >= 2) || now - p->start < 1)
        return NAN;
    /* The service's share of the way is one of log(error): what is fallen so far tells the rest. */
    double fallen = log(p->first / p->relative);
    if (share > 0 && share <= 1 && rate > 0 && fallen > 0)
        return fallen * (1 - share) / share / rate;
    return (now - p->start) * (100 - p->percent) / p->percent;
}

/* ------------------------------------------------------------------- line */

static const char *phase_of(const client_progress *p)
{
    if (strcmp(p->status, "accepted") == 0)
        return "waiting for its turn";
    if (strcmp(p->status, "running") != 0)
        return "";
    if (p->percent >= LAST_ROW)
        return "finishing";
    if (isfinite(p->iteration))
        return "iterating";
    return p->percent >= 5 ? "factorizing" : "starting";
}

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

static void put_left(part *to, int rank, double seconds)
{
    if (!isfinite(seconds) || seconds < 0)
        return;
    if (seconds < 90)
        put(to, rank, "ETA %.0f s", ceil(seconds));
    else if (seconds < 5400)
        put(to, rank, "ETA %.0f min", seconds / 60);
    else
        put(to, rank, "ETA %.1f h", seconds / 3600);
}

enum { PARTS = 7 };

/* The parts of rank 1..most with two blanks between them. Returns the length. */
static int join(char out[ROOM], const part parts[PARTS], int most)
{
    int len = 0;
    out[0] = '\0';
    for (int i = 0; i < PARTS; i++)
        if (parts[i].rank > 0 && parts[i].rank <= most)
            len += snprintf(out + len, (size_t)(ROOM - len), "%s%s", len ? "  " : "", parts[i].text);
    return len;
}

/* As many parts as fit into `room` characters, and the first even if it does not. */
static int compose(char out[ROOM], const client_progress *p, int room)
{
    part parts[PARTS];
    double now = client_clock();
    memset(parts, 0, PARTS * sizeof *parts);
    put(&parts[0], 1, "%.10s %3.0f %%", p->status, isfinite(p->percent) ? p->percent : 0);
    put(&parts[1], 6, "%.1f s", now - p->start);
    put(&parts[2], 5, "%s", phase_of(p));
    if (isfinite(p->iteration))
        put(&parts[3], 4, "iteration %.0f", p->iteration);
    if (isfinite(p->relative))
        put(&parts[4], 2, "error ~%.1e", p->relative);
    if (isfinite(p->bound))
        put(&parts[5], 7, "bound %.2e", p->bound);
    if (strcmp(p->status, "running") == 0)
        put_left(&parts[6], 3, client_progress_left(p, now));
    int most = PARTS, len;
    while ((len = join(out, parts, most)) > room && most > 1)
        most--;
    if (len > room && room >= 0 && room < ROOM)
        out[room] = '\0';
    return len < room ? len : room;
}

static void print_bar(FILE *to, double percent, int cells)
{
    int full = (int)lround(fmin(fmax(percent, 0), 100) / 100 * cells);
    fputc('[', to);
    for (int i = 0; i < cells; i++)
        fputc(i < full ? '#' : '.', to);
    fputs("] ", to);
}

void client_progress_redraw(client_progress *p)
{
    char text[ROOM];
    if (!p->shown || !p->live || !p->status[0])
        return;
    /* The last column stays free: some terminals go on to the next line when it is written. */
    int room = client_columns(p->to, 80) - 1, len = compose(text, p, room), cells = room - len - 3;
    fputs("\r\033[K", p->to);
    if (cells >= BAR_LEAST)
        print_bar(p->to, p->percent, cells < BAR_CELLS ? cells : BAR_CELLS);
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

void client_progress_show(client_progress *p, const json_t *job)
{
    double percent = client_json_number(job, "progress");
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
    if (!p->status[0])
        snprintf(p->status, sizeof p->status, "running");
    if (isfinite(percent))
        p->percent = percent;
    if (isfinite(iteration))
        p->iteration = iteration;
    if (isfinite(bound)) {
        p->bound = bound;
        p->relative = scale > 0 ? bound / scale : NAN;
        note_sample(p);
    }
    say(p);
}

void client_progress_end(client_progress *p)
{
    if (p->shown && p->live)
        fputs("\r\033[K", p->to);
    fflush(p->to);
}
