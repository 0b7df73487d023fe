/* completion.c: the table of commands as a completion for bash (its manual, "Programmable Completion"), for zsh (its
 * manual, "Completion System": _arguments, _describe) and for fish (its manual, "complete"). */
#include "arguments/commands.h"

#include <string.h>

/* What a value or an operand is, by what it is called. */
typedef enum { VALUE_FILE, VALUE_ID, VALUE_COMMAND, VALUE_OTHER } value_kind;

static value_kind kind_of(const char *value)
{
    return strcmp(value, "FILE") == 0      ? VALUE_FILE
           : strcmp(value, "ID") == 0      ? VALUE_ID
           : strcmp(value, "COMMAND") == 0 ? VALUE_COMMAND
                                           : VALUE_OTHER;
}

/* ---- bash */

/* " words=... ;;" of what may stand there. */
static void print_bash_value(FILE *to, const char *value, const char *choices)
{
    static const char *const WORDS[] = {[VALUE_FILE] = "files=1",
                                        [VALUE_ID] = "words=$(_uzawa_ids)",
                                        [VALUE_COMMAND] = "words=$commands",
                                        [VALUE_OTHER] = "words=''"};
    if (choices)
        fprintf(to, ") words='%s' ;;\n", choices);
    else
        fprintf(to, ") %s ;;\n", WORDS[kind_of(value)]);
}

/* Patterns of `case $command$previous`: what may follow an option. */
static void print_values(FILE *to, client_command command)
{
    const uz_option_table all = CLIENT_OPTIONS;
    for (size_t i = 0; i < all.count; i++) {
        const uz_option *o = &all.rows[i];
        if (!o->value || !client_option_is_own(o, command))
            continue;
        fprintf(to, "    %s--%s", CLIENT_PAGES[command].name, o->name);
        if (o->letter)
            fprintf(to, "|%s-%c", CLIENT_PAGES[command].name, o->letter);
        print_bash_value(to, o->value, o->choices);
    }
}

static void print_bash(FILE *to)
{
    fputs("# Completion of uzawa for bash. Made from client/arguments/commands.c.\n\n"
          "# The newest jobs, if the service answers at once.\n"
          "_uzawa_ids() {\n    \"${COMP_WORDS[0]}\" list --quiet --limit 20 --retry 0 --timeout 1 2>/dev/null\n}\n\n"
          "_uzawa() {\n"
          "    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
          "    local command='' options='' words='' files='' i commands='",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        fprintf(to, "%s%s", i ? " " : "", CLIENT_PAGES[i].name);
    fputs("'\n    COMPREPLY=()\n", to);
    /* The command is the first word that is one: bash takes a URL apart at its colons, and words at "=". */
    fputs("    if [[ $current == '=' ]]; then current=''; previous='='; fi\n"
          "    if [[ $previous == '=' ]]; then\n"
          "        previous=${COMP_WORDS[COMP_CWORD-1]}\n"
          "        [[ $previous != '=' ]] || previous=${COMP_WORDS[COMP_CWORD-2]}\n"
          "    fi\n"
          "    for ((i = 1; i < COMP_CWORD; i++)); do\n"
          "        if [[ \" $commands \" == *\" ${COMP_WORDS[i]} \"* ]]; then command=${COMP_WORDS[i]}; break; fi\n"
          "    done\n",
          to);
    fputs("    case $command in\n    '') options='--server --timeout --retry --help --version'; words=$commands ;;\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        /* "    submit) options='--K --N ...' ;;" */
        const uz_option_table all = CLIENT_OPTIONS;
        fprintf(to, "    %s) options='", CLIENT_PAGES[i].name);
        for (size_t k = 0; k < all.count; k++)
            if (client_option_is_own(&all.rows[k], (client_command)i))
                fprintf(to, "--%s ", all.rows[k].name);
        fputs("' ;;\n", to);
    }
    fputs("    esac\n    case $command$previous in\n    -s|--server|-t|--timeout|--retry) words='' ;;\n", to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        print_values(to, (client_command)i);
    fputs("    *)  if [[ $current == -* ]]; then words=$options; else case $command in\n", to);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        const client_page *p = &CLIENT_PAGES[i];
        if (!p->operand)
            continue;
        fprintf(to, "    %s", p->name);
        print_bash_value(to, p->operand, NULL);
    }
    fputs("        esac; fi ;;\n    esac\n"
          "    if [[ $files ]]; then\n"
          "        mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n"
          "        compopt -o filenames 2>/dev/null\n"
          "    else\n"
          "        mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
          "    fi\n"
          "    return 0\n"
          "}\ncomplete -F _uzawa uzawa\n",
          to);
}

/* ---- what zsh and fish share */

/* Within single quotes: those of the text become '\'', and bytes of `escaped` get a backslash before them. */
static void print_quoted(FILE *to, const char *text, const char *escaped)
{
    for (; *text; text++) {
        if (*text == '\'')
            fputs("'\\''", to);
        else
            fprintf(to, "%s%c", strchr(escaped, *text) ? "\\" : "", *text);
    }
}

/* The options of a command, or of none: those before there is one. */
static bool is_offered(const uz_option *option, int command)
{
    return client_option_is_own(option, command < CLIENT_COMMANDS ? (client_command)command : CLIENT_COMMANDS);
}

/* ---- zsh */

static void print_zsh_value(FILE *to, const char *value, const char *choices)
{
    static const char *const ACTIONS[] = {
        [VALUE_FILE] = "_files", [VALUE_ID] = "_uzawa_ids", [VALUE_COMMAND] = "_uzawa_commands", [VALUE_OTHER] = " "};
    fprintf(to, ":%s:", value);
    if (choices)
        fprintf(to, "(%s)", choices);
    else
        fputs(ACTIONS[kind_of(value)], to);
}

/* "'(-t --timeout)'{-t,--timeout}'[about]:S: ' \": each option may come once, but for lists. */
static void print_zsh_options(FILE *to, int command)
{
    const uz_option_table all = CLIENT_OPTIONS;
    for (size_t k = 0; k < all.count; k++) {
        const uz_option *o = &all.rows[k];
        if (!is_offered(o, command))
            continue;
        const bool many = o->kind == UZ_OPTION_WORDS;
        if (o->letter)
            fprintf(to, " \\\n            '%s(-%c --%s)'{-%c,--%s}'", many ? "*" : "", o->letter, o->name, o->letter,
                    o->name);
        else
            fprintf(to, " \\\n            '%s--%s", many ? "*" : "", o->name);
        fputc('[', to);
        print_quoted(to, o->about, "[]:\\");
        fputc(']', to);
        if (o->value)
            print_zsh_value(to, o->value, o->choices);
        fputc('\'', to);
    }
}

static void print_zsh(FILE *to)
{
    fputs("#compdef uzawa\n# Completion of uzawa for zsh. Made from client/arguments/commands.c.\n\n"
          "# The newest jobs, if the service answers at once.\n"
          "_uzawa_ids() {\n    local -a ids\n"
          "    ids=(${(f)\"$(uzawa list --quiet --limit 20 --retry 0 --timeout 1 2>/dev/null)\"})\n"
          "    compadd -V jobs -a ids\n}\n\n"
          "_uzawa_commands() {\n    local -a commands\n    commands=(\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        fprintf(to, "        '%s:", CLIENT_PAGES[i].name);
        print_quoted(to, CLIENT_PAGES[i].about, "");
        fputs("'\n", to);
    }
    fputs("    )\n    _describe -V command commands\n}\n\n"
          "_uzawa() {\n    local curcontext=$curcontext state line\n    typeset -A opt_args\n    _arguments -C",
          to);
    print_zsh_options(to, CLIENT_COMMANDS);
    fputs(" \\\n            '1:command:_uzawa_commands' '*::rest:->rest'\n"
          "    [[ $state == rest ]] || return\n    case $words[1] in\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        const char *operand = CLIENT_PAGES[i].operand;
        fprintf(to, "    %s)\n        _arguments", CLIENT_PAGES[i].name);
        print_zsh_options(to, i);
        if (operand) {
            fputs(" \\\n            '1", to);
            print_zsh_value(to, operand, NULL);
            fputc('\'', to);
        }
        fputs(" ;;\n", to);
    }
    fputs("    esac\n}\n\n_uzawa \"$@\"\n", to);
}

/* ---- fish */

/* What may follow: no file unless told so. */
static void print_fish_value(FILE *to, const char *value, const char *choices)
{
    const value_kind kind = kind_of(value);
    fputs(kind == VALUE_FILE ? " -F" : " -f", to);
    if (kind == VALUE_ID)
        fputs(" -a '(__uzawa_ids)'", to);
    else if (kind == VALUE_COMMAND)
        fputs(" -a '(__uzawa_commands)'", to);
    else if (choices)
        fprintf(to, " -a '%s'", choices);
}

static void print_fish_options(FILE *to, int command)
{
    const uz_option_table all = CLIENT_OPTIONS;
    for (size_t k = 0; k < all.count; k++) {
        const uz_option *o = &all.rows[k];
        if (!is_offered(o, command))
            continue;
        if (command < CLIENT_COMMANDS)
            fprintf(to, "complete -c uzawa -n '__uzawa_is %s' -l %s", CLIENT_PAGES[command].name, o->name);
        else
            fprintf(to, "complete -c uzawa -n '__uzawa_is \"\"' -l %s", o->name);
        if (o->letter)
            fprintf(to, " -s %c", o->letter);
        if (o->value) {
            fputs(" -r", to);
            print_fish_value(to, o->value, o->choices);
        }
        fputs(" -d '", to);
        print_quoted(to, o->about, "\\");
        fputs("'\n", to);
    }
}

static void print_fish(FILE *to)
{
    fputs("# Completion of uzawa for fish. Made from client/arguments/commands.c.\n\n"
          "# The newest jobs, if the service answers at once.\n"
          "function __uzawa_ids\n    uzawa list --quiet --limit 20 --retry 0 --timeout 1 2>/dev/null\nend\n\n"
          "function __uzawa_commands\n    printf '%s\\n'",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        fprintf(to, " %s", CLIENT_PAGES[i].name);
    fputs("\nend\n\n"
          "# Is this the command of the line? \"\": there is none yet.\n"
          "function __uzawa_is\n    for word in (commandline -opc)[2..-1]\n"
          "        if contains -- $word (__uzawa_commands)\n            test $word = \"$argv[1]\"\n            return\n"
          "        end\n    end\n    test -z \"$argv[1]\"\nend\n\ncomplete -c uzawa -f\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        fprintf(to, "complete -c uzawa -n '__uzawa_is \"\"' -a %s -d '", CLIENT_PAGES[i].name);
        print_quoted(to, CLIENT_PAGES[i].about, "\\");
        fputs("'\n", to);
    }
    print_fish_options(to, CLIENT_COMMANDS);
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        const char *operand = CLIENT_PAGES[i].operand;
        if (operand) {
            fprintf(to, "complete -c uzawa -n '__uzawa_is %s'", CLIENT_PAGES[i].name);
            print_fish_value(to, operand, NULL);
            fputc('\n', to);
        }
        print_fish_options(to, i);
    }
}

bool client_completion_print(FILE *to, const char *shell)
{
    static const struct {
        const char *shell;
        void (*print)(FILE *to);
    } SHELLS[] = {{"bash", print_bash}, {"zsh", print_zsh}, {"fish", print_fish}};
    for (size_t i = 0; i < sizeof SHELLS / sizeof SHELLS[0]; i++)
        if (strcmp(SHELLS[i].shell, shell) == 0) {
            SHELLS[i].print(to);
            return true;
        }
    return false;
}
