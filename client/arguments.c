#include "arguments.h"
#include "text/edit_distance.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* A walk over argv, and what was seen of it. */
typedef struct {
    client_options *options;
    char *const *argv;
    int argc, next;
    bool have_command, apply; /* apply: the second walk, where the command is known */
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

/* The row of "--name", "--name=value", "-n" for the command, or any row of that name, or NULL; *value is what follows
 * '=' or NULL. */
static const client_option *find_rule(const char *word, client_command command, const char **value)
{
    *value = NULL;
    const client_option *rule, *other = NULL;
    size_t len = strcspn(word, "=");
    for (size_t i = 0; (rule = client_option_at(i)); i++) {
        bool is_short = word[1] != '-' && word[1] != '\0' && word[1] == rule->letter && word[2] == '\0';
        bool is_long = strlen(rule->name) == len && strncmp(word, rule->name, len) == 0;
        if (is_long && word[len] == '=')
            *value = word + len + 1;
        if ((is_short || is_long) && rule->commands & CLIENT_IN(command))
            return rule;
        if (is_short || is_long)
            other = rule;
    }
    return other;
}

static bool set_seconds(parser *p, const client_option *rule, const char *value)
{
    char *end;
    double seconds = strtod(value, &end);
    if (end == value || *end || !isfinite(seconds) || seconds < 0)
        return fail(p, "%s wants a number%s, 0 or more, not \"%s\"", rule->name,
                    *rule->value == 'S' ? " of seconds" : "", value);
    *(double *)(void *)((char *)p->options + rule->offset) = seconds;
    return true;
}

static bool set_count(parser *p, const client_option *rule, const char *value)
{
    char *end;
    errno = 0;
    long count = strtol(value, &end, 10);
    if (end == value || *end || errno || count < rule->least || count > rule->most)
        return fail(p, "%s wants a whole number from %ld to %ld, not \"%s\"", rule->name, rule->least, rule->most,
                    value);
    *(long *)(void *)((char *)p->options + rule->offset) = count;
    return true;
}

static bool set_word(parser *p, const client_option *rule, const char *value)
{
    client_words *words = (client_words *)(void *)((char *)p->options + rule->offset);
    if (!*value)
        return fail(p, "%s wants a %s", rule->name, rule->value);
    if (words->count == rule->most)
        return fail(p, "%s may be given at most %ld times", rule->name, rule->most);
    words->item[words->count++] = value;
    return true;
}

/* Is `word` one of the words between blanks? */
static bool is_choice(const char *choices, const char *word)
{
    size_t len = strlen(word);
    for (const char *at = choices; *at; at += strspn(at, " ")) {
        size_t n = strcspn(at, " ");
        if (n == len && memcmp(at, word, n) == 0)
            return true;
        at += n;
    }
    return false;
}

static bool set_value(parser *p, const client_option *rule, const char *value)
{
    switch (rule->kind) {
    case CLIENT_SECONDS:
        return set_seconds(p, rule, value);
    case CLIENT_COUNT:
        return set_count(p, rule, value);
    case CLIENT_LIST_OF:
        return set_word(p, rule, value);
    case CLIENT_CHOICE:
        if (!is_choice(rule->choices, value))
            return fail(p, "%s is one of: %s; not \"%s\"", rule->name, rule->choices, value);
        break;
    case CLIENT_TEXT:
    case CLIENT_FLAG:
        break;
    }
    if (!*value)
        return fail(p, "%s wants a value that is not empty", rule->name);
    *(const char **)(void *)((char *)p->options + rule->offset) = value;
    return true;
}

static bool set_flag(parser *p, const client_option *rule, const char *value)
{
    *(bool *)(void *)((char *)p->options + rule->offset) = true;
    return value ? fail(p, "%s takes no value", rule->name) : true;
}

/* Of the options of the command that was named, or of all before there is one. */
static bool fail_unknown_option(parser *p, const char *word)
{
    const client_option *rule;
    const char *names[128];
    size_t count = 0;
    for (size_t i = 0; (rule = client_option_at(i)) && count < sizeof names / sizeof *names; i++)
        if (!p->have_command || rule->commands & CLIENT_IN(p->options->command))
            names[count++] = rule->name;
    const int near = uz_closest(word, strcspn(word, "="), names, count);
    return near >= 0 ? fail(p, "unknown option %s; did you mean %s?", word, names[near])
                     : fail(p, "unknown option %s", word);
}

static bool fail_unknown_command(parser *p, const char *word)
{
    const char *names[CLIENT_COMMANDS];
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        names[i] = client_command_name((client_command)i);
    const int near = uz_closest(word, strlen(word), names, CLIENT_COMMANDS);
    return near >= 0 ? fail(p, "unknown command \"%s\"; did you mean \"%s\"?", word, names[near])
                     : fail(p, "unknown command \"%s\"", word);
}

static bool take_option(parser *p, const char *word)
{
    const char *value;
    const client_option *rule = find_rule(word, p->options->command, &value);
    if (!rule)
        return fail_unknown_option(p, word);
    if (rule->kind != CLIENT_FLAG && !value) {
        if (p->next == p->argc)
            return fail(p, "%s wants a value", rule->name);
        value = p->argv[p->next++];
    }
    if (!p->apply)
        return true;
    if (!(rule->commands & CLIENT_IN(p->options->command)))
        return fail(p, "%s does not take %s", client_command_name(p->options->command), rule->name);
    return rule->kind == CLIENT_FLAG ? set_flag(p, rule, value) : set_value(p, rule, value);
}

static bool take_operand(parser *p, const char *word)
{
    if (!p->have_command) {
        p->have_command = client_command_find(&p->options->command, word);
        return p->have_command || fail_unknown_command(p, word);
    }
    if (!p->apply)
        return true;
    if (p->options->operand)
        return fail(p, "%s: one operand too many: \"%s\"", client_command_name(p->options->command), word);
    p->options->operand = word;
    return true;
}

/* One walk finds the command, the next one takes the options as that command understands them. */
static bool take_words(parser *p)
{
    bool options_end = false, command_seen = false;
    p->next = 1;
    while (p->next < p->argc) {
        const char *word = p->argv[p->next++];
        bool option = !options_end && word[0] == '-' && word[1];
        if (option && strcmp(word, "--") == 0) {
            options_end = true;
        } else if (!option && p->apply && !command_seen) {
            command_seen = true; /* the command itself */
        } else if (option ? !take_option(p, word) : !take_operand(p, word)) {
            return false;
        }
    }
    return true;
}

static bool has_matrices(const client_options *o)
{
    return o->K || o->N || o->h || o->p;
}

/* What each command needs to be complete. */
static bool check_operand(parser *p)
{
    const client_options *o = p->options;
    const client_page *page = client_page_of(o->command);
    if (o->operand && !page->operand)
        return fail(p, "%s takes no operand, but got \"%s\"", page->name, o->operand);
    if (o->operand && !*o->operand)
        return fail(p, "%s: %s is empty", page->name, page->operand);
    if (!o->operand && page->operands & CLIENT_OPERAND_NEEDED)
        return fail(p, "%s wants %s %s", page->name, *page->operand == 'I' ? "an" : "a", page->operand);
    if (!o->operand && o->command == CLIENT_SUBMIT && !has_matrices(o))
        return o->mesh ? fail(p, "--mesh wants a FILE with the scene whose mesh it replaces")
                       : fail(p, "submit wants a FILE, or --K and --p");
    if (!o->operand && o->command == CLIENT_SUBMIT && (!o->K || !o->p || !o->N != !o->h))
        return fail(p, "without a FILE submit wants --K and --p, and --N and --h both or neither");
    return true;
}

/* At most one of the files is standard input. */
static bool check_standard_input(parser *p)
{
    const client_options *o = p->options;
    const char *files[] = {o->operand, o->K, o->N, o->h, o->p, o->mesh};
    int count = 0;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        count += files[i] && strcmp(files[i], "-") == 0;
    return count < 2 || fail(p, "only one file can be \"-\", standard input");
}

static bool check_submit(parser *p)
{
    const client_options *o = p->options;
    if (o->mesh && has_matrices(o))
        return fail(p, "--mesh is of a scene, --K, --N, --h and --p of a problem in matrices: choose one");
    return check_standard_input(p);
}

/* Options that change nothing without another. */
static bool check_idle(parser *p)
{
    const client_options *o = p->options;
    const bool stays = o->wait || o->command == CLIENT_WAIT || o->command == CLIENT_VERIFY;
    if (o->progress && !stays)
        return fail(p, "--progress wants --wait");
    if ((o->junit || o->baseline) && !stays)
        return fail(p, "%s wants --wait", o->junit ? "--junit" : "--baseline");
    if (o->tolerance >= 0 && !o->baseline)
        return fail(p, "--tolerance wants --baseline");
    if (o->progress && o->quiet)
        return fail(p, "--progress and --quiet contradict each other");
    if (o->quiet && o->json)
        return fail(p, "--quiet and --json contradict each other");
    if (o->command == CLIENT_HISTORY && !o->plot && (o->width >= 0 || o->height >= 0 || o->ascii))
        return fail(p, "--width, --height and --ascii want --plot");
    return true;
}

static bool check_plot(parser *p)
{
    const client_options *o = p->options;
    const bool convergence = !o->deformed && !o->trade;
    if (o->deformed && o->trade)
        return fail(p, "--deformed and --trade are alternatives: choose one");
    if (!o->deformed && (o->colour || o->factor))
        return fail(p, "--colour and --factor want --deformed");
    if (convergence && o->width >= 0)
        return fail(p, "--width wants --deformed or --trade");
    if (o->deformed && o->width >= 0 && o->width < 200)
        return fail(p, "--width wants a whole number from 200 to 4000 with --deformed, not \"%ld\"", o->width);
    if (o->trade && o->width > 400)
        return fail(p, "--width wants a whole number from 40 to 400 with --trade, not \"%ld\"", o->width);
    if (!convergence && (o->axis || o->with.count))
        return fail(p, "--x and --with are of the convergence");
    if (o->ascii && !o->trade)
        return fail(p, "--ascii wants --trade");
    if (o->output && o->trade)
        return fail(p, "--trade is printed and takes no --output");
    return true;
}

static bool check_combination(parser *p)
{
    const client_options *o = p->options;
    const bool drawing = o->command == CLIENT_PICTURE || (o->command == CLIENT_PLOT && !o->trade);
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
    if (o->command == CLIENT_LIST && o->tags.count > 1)
        return fail(p, "list filters by one --tag");
    return check_idle(p) && check_submit(p) && (o->command != CLIENT_PLOT || check_plot(p));
}

bool client_arguments_parse(client_options *out, int argc, char *const *argv, const char *env_server, char *message,
                            size_t size)
{
    *out = (client_options){.command = CLIENT_HELP,
                            .server = env_server && *env_server ? env_server : "http://127.0.0.1:8080",
                            .timeout_s = INFINITY,
                            .retry_s = -1,
                            .time_limit_s = NAN,
                            .tolerance = -1,
                            .max_iterations = -1,
                            .limit = 20,
                            .width = -1,
                            .height = -1};
    parser p = {.options = out, .argv = argv, .argc = argc, .message = message, .size = size};
    if (!take_words(&p))
        return false;
    p.apply = true;
    if (!take_words(&p))
        return false;
    if (out->help || out->version)
        return true;
    if (!p.have_command)
        return fail(&p, "no command given");
    return check_operand(&p) && check_combination(&p);
}
