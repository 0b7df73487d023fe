#include "arguments.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

typedef enum { FLAG, TEXT, SECONDS, COUNT, TAG } option_kind;

#define IN(command)  (1u << (command))
#define ALL_COMMANDS (IN(CLIENT_COMMANDS) - 1u)
#define ASKING       (ALL_COMMANDS & ~IN(CLIENT_VERSION) & ~IN(CLIENT_HELP)) /* commands that talk to the server */

#define MAKING    (IN(CLIENT_SUBMIT) | IN(CLIENT_REFINE) | IN(CLIENT_VERIFY)) /* commands that make a job */
#define STAYING   (MAKING | IN(CLIENT_WAIT))
#define OF_A_CASE (IN(CLIENT_RESULT) | IN(CLIENT_PICTURE) | IN(CLIENT_HISTORY))

typedef struct {
    const char *name;
    char letter; /* 0: no short form */
    option_kind kind;
    size_t offset;     /* of the field in client_options */
    unsigned commands; /* where it may be used */
    long least, most;  /* COUNT only */
} option_rule;

#define FIELD(name) offsetof(client_options, name)
static const option_rule RULES[] = {
    {"--server", 's', TEXT, FIELD(server), ALL_COMMANDS, 0, 0},
    {"--timeout", 't', SECONDS, FIELD(timeout_s), ALL_COMMANDS, 0, 0},
    {"--retry", 0, SECONDS, FIELD(retry_s), ALL_COMMANDS, 0, 0},
    {"--help", 'h', FLAG, FIELD(help), ALL_COMMANDS, 0, 0},
    {"--version", 'V', FLAG, FIELD(version), ALL_COMMANDS, 0, 0},
    {"--json", 'j', FLAG, FIELD(json), ASKING, 0, 0},
    {"--wait", 'w', FLAG, FIELD(wait), IN(CLIENT_SUBMIT) | IN(CLIENT_REFINE), 0, 0},
    {"--tag", 0, TAG, FIELD(tags), IN(CLIENT_SUBMIT) | IN(CLIENT_LIST), 0, 0},
    {"--key", 'k', TEXT, FIELD(key), MAKING, 0, 0},
    {"--quiet", 'q', FLAG, FIELD(quiet), MAKING | IN(CLIENT_WAIT) | IN(CLIENT_CANCEL), 0, 0},
    {"--progress", 0, FLAG, FIELD(progress), MAKING | IN(CLIENT_WAIT), 0, 0},
    {"--junit", 0, TEXT, FIELD(junit), STAYING, 0, 0},
    {"--baseline", 0, TEXT, FIELD(baseline), STAYING, 0, 0},
    {"--tolerance", 0, SECONDS, FIELD(tolerance), STAYING, 0, 0},
    {"--accuracy", 'a', TEXT, FIELD(accuracy), IN(CLIENT_REFINE), 0, 0},
    {"--max-iterations", 0, COUNT, FIELD(max_iterations), IN(CLIENT_REFINE), 0, 1000000000},
    {"--time-limit", 0, SECONDS, FIELD(time_limit_s), IN(CLIENT_REFINE), 0, 0},
    {"--case", 'c', TEXT, FIELD(case_name), OF_A_CASE, 0, 0},
    {"--fields", 0, TEXT, FIELD(fields), IN(CLIENT_RESULT), 0, 0},
    {"--format", 'f', TEXT, FIELD(format), IN(CLIENT_RESULT), 0, 0},
    {"--output", 'o', TEXT, FIELD(output), OF_A_CASE, 0, 0},
    {"--colour", 0, TEXT, FIELD(colour), IN(CLIENT_PICTURE), 0, 0},
    {"--factor", 0, TEXT, FIELD(factor), IN(CLIENT_PICTURE), 0, 0},
    {"--csv", 0, FLAG, FIELD(csv), IN(CLIENT_HISTORY), 0, 0},
    {"--plot", 0, FLAG, FIELD(plot), IN(CLIENT_HISTORY), 0, 0},
    {"--ascii", 0, FLAG, FIELD(ascii), IN(CLIENT_HISTORY), 0, 0},
    {"--width", 0, COUNT, FIELD(width), IN(CLIENT_HISTORY) | IN(CLIENT_PICTURE), 0, LONG_MAX}, /* check_width */
    {"--height", 0, COUNT, FIELD(height), IN(CLIENT_HISTORY), 8, 200},
    {"--status", 0, TEXT, FIELD(status), IN(CLIENT_LIST), 0, 0},
    {"--limit", 'n', COUNT, FIELD(limit), IN(CLIENT_LIST), 1, 1000000},
};
#define RULE_COUNT (sizeof RULES / sizeof *RULES)

/* A walk over argv, and what was seen of it. */
typedef struct {
    client_options *options;
    char *const *argv;
    int argc, next;
    bool have_command;
    unsigned used; /* bit i: RULES[i] was given */
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

/* The rule of "--name", "--name=value", "-n"; *value is what follows '=' or NULL. */
static const option_rule *find_rule(const char *word, const char **value)
{
    *value = NULL;
    size_t len = strcspn(word, "=");
    for (size_t i = 0; i < RULE_COUNT; i++) {
        const option_rule *rule = &RULES[i];
        bool is_short = word[1] != '-' && word[1] != '\0' && word[1] == rule->letter && word[2] == '\0';
        bool is_long = strlen(rule->name) == len && strncmp(word, rule->name, len) == 0;
        if (is_long && word[len] == '=')
            *value = word + len + 1;
        if (is_short || is_long)
            return rule;
    }
    return NULL;
}

static bool set_seconds(parser *p, const option_rule *rule, const char *value)
{
    char *end;
    double seconds = strtod(value, &end);
    if (end == value || *end || !isfinite(seconds) || seconds < 0)
        return fail(p, "%s wants a number of seconds, 0 or more, not \"%s\"", rule->name, value);
    *(double *)(void *)((char *)p->options + rule->offset) = seconds;
    return true;
}

static bool set_count(parser *p, const option_rule *rule, const char *value)
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

static bool set_tag(parser *p, const char *value)
{
    if (!*value)
        return fail(p, "--tag wants a word");
    if (p->options->n_tags == CLIENT_MAX_TAGS)
        return fail(p, "a job has at most %d tags", CLIENT_MAX_TAGS);
    p->options->tags[p->options->n_tags++] = value;
    return true;
}

static bool set_value(parser *p, const option_rule *rule, const char *value)
{
    switch (rule->kind) {
    case SECONDS:
        return set_seconds(p, rule, value);
    case COUNT:
        return set_count(p, rule, value);
    case TAG:
        return set_tag(p, value);
    case TEXT:
    case FLAG:
        break;
    }
    if (!*value)
        return fail(p, "%s wants a value that is not empty", rule->name);
    *(const char **)(void *)((char *)p->options + rule->offset) = value;
    return true;
}

static bool take_option(parser *p, const char *word)
{
    const char *value;
    const option_rule *rule = find_rule(word, &value);
    if (!rule)
        return fail(p, "unknown option %s", word);
    p->used |= 1u << (rule - RULES);
    if (rule->kind == FLAG) {
        *(bool *)(void *)((char *)p->options + rule->offset) = true;
        return value ? fail(p, "%s takes no value", rule->name) : true;
    }
    if (!value) {
        if (p->next == p->argc)
            return fail(p, "%s wants a value", rule->name);
        value = p->argv[p->next++];
    }
    return set_value(p, rule, value);
}

static bool take_operand(parser *p, const char *word)
{
    if (!p->have_command) {
        p->have_command = client_command_find(&p->options->command, word);
        return p->have_command ? true : fail(p, "unknown command \"%s\"", word);
    }
    if (p->options->operand)
        return fail(p, "%s: one operand too many: \"%s\"", client_command_name(p->options->command), word);
    p->options->operand = word;
    return true;
}

static bool take_words(parser *p)
{
    bool options_end = false;
    while (p->next < p->argc) {
        const char *word = p->argv[p->next++];
        if (!options_end && strcmp(word, "--") == 0)
            options_end = true;
        else if (!options_end && word[0] == '-' && word[1] ? !take_option(p, word) : !take_operand(p, word))
            return false;
    }
    return true;
}

/* What each command needs to be complete. */
static bool check_operand(parser *p)
{
    static const char *const WANTED[CLIENT_COMMANDS] = {
        [CLIENT_SUBMIT] = "FILE",  [CLIENT_STATUS] = "ID",   [CLIENT_WAIT] = "ID",    [CLIENT_REFINE] = "ID",
        [CLIENT_VERIFY] = "FILE",  [CLIENT_RESULT] = "ID",   [CLIENT_HISTORY] = "ID", [CLIENT_CANCEL] = "ID",
        [CLIENT_HELP] = "COMMAND", [CLIENT_UPLOAD] = "FILE", [CLIENT_PICTURE] = "ID",
    };
    const client_options *o = p->options;
    const char *name = client_command_name(o->command);
    if (o->operand && !WANTED[o->command])
        return fail(p, "%s takes no operand, but got \"%s\"", name, o->operand);
    if (o->operand && !*o->operand)
        return fail(p, "%s: %s is empty", name, WANTED[o->command]);
    if (!o->operand && WANTED[o->command] && o->command != CLIENT_HELP)
        return fail(p, "%s wants a %s", name, WANTED[o->command]);
    return true;
}

/* Characters of a drawing, pixels of a picture. */
static bool check_width(parser *p)
{
    const client_options *o = p->options;
    const bool picture = o->command == CLIENT_PICTURE;
    const long least = picture ? 200 : 56, most = picture ? 4000 : 400;
    if (o->width < 0 || (o->width >= least && o->width <= most))
        return true;
    return fail(p, "--width wants a whole number from %ld to %ld, not \"%ld\"", least, most, o->width);
}

static bool check_combination(parser *p)
{
    const client_options *o = p->options;
    for (size_t i = 0; i < RULE_COUNT; i++)
        if ((p->used >> i & 1u) && !(RULES[i].commands & IN(o->command)))
            return fail(p, "%s does not take %s", client_command_name(o->command), RULES[i].name);
    if ((o->junit || o->baseline) && !o->wait && (o->command == CLIENT_SUBMIT || o->command == CLIENT_REFINE))
        return fail(p, "%s wants --wait", o->junit ? "--junit" : "--baseline");
    if (o->tolerance >= 0 && !o->baseline)
        return fail(p, "--tolerance wants --baseline");
    if (o->csv + o->plot + o->json > 1)
        return fail(p, "--csv, --plot and --json are alternatives: choose one");
    if (o->format && strcmp(o->format, "json") != 0 && strcmp(o->format, "vtu") != 0)
        return fail(p, "--format is json or vtu, not \"%s\"", o->format);
    if (o->command == CLIENT_REFINE && !o->accuracy)
        return fail(p, "refine wants --accuracy: a relative error such as 1e-8, or quick, balanced, precise, exact");
    if (o->command == CLIENT_LIST && o->n_tags > 1)
        return fail(p, "list filters by one --tag");
    return check_width(p);
}

bool client_arguments_parse(client_options *out, int argc, char *const *argv, const char *env_server, char *message,
                            size_t size)
{
    *out = (client_options){.command = CLIENT_HELP,
                            .server = env_server && *env_server ? env_server : "http://127.0.0.1:8080",
                            .timeout_s = INFINITY,
                            .retry_s = -1,
                            .tolerance = -1,
                            .time_limit_s = NAN,
                            .max_iterations = -1,
                            .limit = 20,
                            .width = -1,
                            .height = 20};
    parser p = {.options = out, .argv = argv, .argc = argc, .next = 1, .message = message, .size = size};
    if (!take_words(&p))
        return false;
    if (out->help || out->version)
        return true;
    if (!p.have_command)
        return fail(&p, "no command given");
    return check_operand(&p) && check_combination(&p);
}
