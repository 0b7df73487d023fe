#include "arguments/arguments.h"
#include "text/edit_distance.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

const char CLIENT_DEFAULT_SERVER[] = "http://127.0.0.1:8080";

typedef struct {
    client_options *options;
    bool have_command;
    char *message;
    size_t size;
} parser;

__attribute__((format(printf, 2, 3))) static bool fail(parser *p, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(p->message, p->size, format, args);
    va_end(args);
    return false;
}

/* One walk finds the command, the next one (apply) takes the options as that command understands them. */
static bool take_words(parser *p, int argc, char *const *argv, bool apply)
{
    uz_option_walk walk = {.table = CLIENT_OPTIONS, .argc = argc, .argv = argv};
    bool command_seen = false;
    char wants[200];
    for (;;) {
        walk.places = CLIENT_IN(p->options->command);
        switch (uz_option_next(&walk)) {
        case UZ_WALK_END:
            return true;
        case UZ_WALK_UNKNOWN: {
            /* Of the options of the command that was named, or of all before there is one. */
            const char *name = walk.word + strspn(walk.word, "-");
            const unsigned places = p->have_command ? walk.places : CLIENT_EVERYWHERE;
            const char *near = uz_option_closest(walk.table, places, name, strcspn(name, "="));
            return fail(p, near ? "unknown option %s; did you mean --%s?" : "unknown option %s", walk.word, near);
        }
        case UZ_WALK_LACKS:
            return fail(p, "--%s wants a value", walk.row->name);
        case UZ_WALK_OPTION:
            if (!apply)
                break;
            if (!(walk.row->places & walk.places))
                return fail(p, "%s does not take --%s", CLIENT_PAGES[p->options->command].name, walk.row->name);
            if (uz_option_set(p->options, walk.row, walk.value))
                break;
            if (walk.row->kind == UZ_OPTION_FLAG)
                return fail(p, "--%s takes no value", walk.row->name);
            uz_option_wants(wants, sizeof wants, walk.row);
            return fail(p, "--%s wants %s, not \"%s\"", walk.row->name, wants, walk.value);
        case UZ_WALK_OPERAND:
            if (!p->have_command) {
                p->have_command = client_command_find(&p->options->command, walk.word);
                if (!p->have_command) {
                    const char *names[CLIENT_COMMANDS];
                    for (int i = 0; i < CLIENT_COMMANDS; i++)
                        names[i] = CLIENT_PAGES[i].name;
                    const int near = uz_closest(walk.word, strlen(walk.word), names, CLIENT_COMMANDS);
                    return near >= 0 ? fail(p, "unknown command \"%s\"; did you mean \"%s\"?", walk.word, names[near])
                                     : fail(p, "unknown command \"%s\"", walk.word);
                }
            } else if (apply && command_seen) {
                if (p->options->operand)
                    return fail(p, "%s: one operand too many: \"%s\"", CLIENT_PAGES[p->options->command].name,
                                walk.word);
                p->options->operand = walk.word;
            }
            command_seen = true;
            break;
        }
    }
}

static bool check_plot(parser *p)
{
    const client_options *o = p->options;
    const bool printed = o->trade || o->along_path, convergence = !o->deformed && !printed && !o->whole_error;
    const char *name = o->trade ? "--trade" : "--path";
    if (o->deformed + o->trade + o->along_path + o->whole_error > 1)
        return fail(p, "--deformed, --error, --path and --trade are alternatives: choose one");
    if (!o->deformed && (o->colour || o->factor))
        return fail(p, "--colour and --factor want --deformed");
    if (convergence && o->width >= 0)
        return fail(p, "--width wants --deformed, --error, --path or --trade");
    if (o->whole_error && o->width >= 0 && o->width < 300)
        return fail(p, "--width wants an integer from 300 to 4000 with --error, not \"%d\"", o->width);
    if (o->deformed && o->width >= 0 && o->width < 200)
        return fail(p, "--width wants an integer from 200 to 4000 with --deformed, not \"%d\"", o->width);
    if (printed && o->width > 400)
        return fail(p, "--width wants an integer from 40 to 400 with %s, not \"%d\"", name, o->width);
    if (!convergence && (o->axis || o->with.count))
        return fail(p, "--x and --with are of the convergence");
    if (o->ascii && !printed)
        return fail(p, "--ascii wants --path or --trade");
    if (o->output && printed)
        return fail(p, "%s is printed and takes no --output", name);
    if (o->along_path && o->case_name)
        return fail(p, "--path is of all load cases: leave --case out");
    return true;
}

/* What the command needs to be complete, and what goes together. */
static bool check_all(parser *p)
{
    const client_options *o = p->options;
    const bool matrices = o->K || o->N || o->h || o->p;
    const bool drawing = o->command == CLIENT_PICTURE || (o->command == CLIENT_PLOT && !o->trade && !o->along_path);
    const client_page *page = &CLIENT_PAGES[o->command];
    if (o->operand && !page->operand)
        return fail(p, "%s takes no operand, but got \"%s\"", page->name, o->operand);
    if (o->operand && !*o->operand)
        return fail(p, "%s: %s is empty", page->name, page->operand);
    if (!o->operand && page->operands & CLIENT_OPERAND_NEEDED)
        return fail(p, "%s wants %s %s", page->name, *page->operand == 'I' ? "an" : "a", page->operand);
    if (!o->operand && o->command == CLIENT_SUBMIT && !matrices)
        return o->surface ? fail(p, "--surface wants a FILE with the scene whose obstacle it is")
               : o->mesh  ? fail(p, "--mesh wants a FILE with the scene whose mesh it replaces")
                          : fail(p, "submit wants a FILE, or --K and --p");
    if (!o->operand && o->command == CLIENT_SUBMIT && (!o->K || !o->p || !o->N != !o->h))
        return fail(p, "without a FILE submit wants --K and --p, and --N and --h both or neither");
    if (o->csv + o->plot + o->json > 1)
        return fail(p, "--csv, --plot and --json are alternatives: choose one");
    if (o->json && o->format && strcmp(o->format, "json") != 0)
        return fail(p, "--json and --format %s contradict each other", o->format);
    if (o->json && drawing && (!o->output || strcmp(o->output, "-") == 0))
        return fail(p, "--json wants --output FILE, since the picture goes to standard output otherwise");
    if (o->command == CLIENT_HELP && o->format && strcmp(o->format, "text") != 0 && o->operand)
        return fail(p, "help --format %s is of all commands together", o->format);
    if (o->command == CLIENT_REFINE && !o->accuracy)
        return fail(p, "refine wants --accuracy: a relative error such as 1e-8, or quick, balanced, precise, exact");
    if (o->command == CLIENT_PATH && (!o->from || !o->to))
        return fail(p, "path wants --from and --to, points such as 0,20 or, of a solid, 0,20,5");
    if (o->command == CLIENT_LIST && o->tags.count > 1)
        return fail(p, "list filters by one --tag");
    /* Options that change nothing without another. */
    if (o->progress && !o->wait)
        return fail(p, "--progress wants --wait");
    if ((o->junit || o->baseline) && !o->wait)
        return fail(p, "%s wants --wait", o->junit ? "--junit" : "--baseline");
    if (o->tolerance >= 0 && !o->baseline)
        return fail(p, "--tolerance wants --baseline");
    if (o->progress && o->quiet)
        return fail(p, "--progress and --quiet contradict each other");
    if (o->quiet && o->json)
        return fail(p, "--quiet and --json contradict each other");
    if (o->command == CLIENT_HISTORY && !o->plot && (o->width >= 0 || o->height >= 0 || o->ascii))
        return fail(p, "--width, --height and --ascii want --plot");
    if (o->surface && matrices)
        return fail(p, "--surface is of a scene, --K, --N, --h and --p of a problem in matrices: choose one");
    if (o->mesh && matrices)
        return fail(p, "--mesh is of a scene, --K, --N, --h and --p of a problem in matrices: choose one");
    /* At most one of the files is standard input. */
    const char *files[] = {o->operand, o->K, o->N, o->h, o->p, o->mesh, o->surface};
    int count = 0;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        count += files[i] && strcmp(files[i], "-") == 0;
    if (count > 1)
        return fail(p, "only one file can be \"-\", standard input");
    return o->command != CLIENT_PLOT || check_plot(p);
}

bool client_arguments_parse(client_options *out, int argc, char *const *argv, const char *env_server, char *message,
                            size_t size)
{
    *out = (client_options){.command = CLIENT_HELP,
                            .server = env_server && *env_server ? env_server : CLIENT_DEFAULT_SERVER,
                            .timeout_s = INFINITY,
                            .retry_s = -1,
                            .time_limit_s = NAN,
                            .tolerance = -1,
                            .max_iterations = -1,
                            .limit = 20,
                            .width = -1,
                            .height = -1,
                            .count = -1};
    parser p = {.options = out, .message = message, .size = size};
    for (int i = 1; i < argc; i++) /* known also where the line is not understood */
        out->json = out->json || strcmp(argv[i], "--json") == 0 || strcmp(argv[i], "-j") == 0;
    if (!take_words(&p, argc, argv, false) || !take_words(&p, argc, argv, true))
        return false;
    if (out->help || out->version)
        return true;
    if (!p.have_command)
        return fail(&p, "no command given");
    out->wait = out->wait || out->command == CLIENT_WAIT || out->command == CLIENT_VERIFY;
    return check_all(&p);
}
