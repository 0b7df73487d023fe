/* completion.c: the table of commands as a completion for bash (its manual, "Programmable Completion"). */
#include "arguments/commands.h"

#include <string.h>

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
        if (o->choices)
            fprintf(to, ") words='%s' ;;\n", o->choices);
        else if (strcmp(o->value, "FILE") == 0)
            fputs(") files=1 ;;\n", to);
        else if (strcmp(o->value, "ID") == 0)
            fputs(") words=$(_uzawa_ids) ;;\n", to);
        else
            fputs(") words='' ;;\n", to);
    }
}

void client_completion_print(FILE *to)
{
    fputs("# Completion of uzawa for bash. Made from client/arguments/commands.c by make man.\n\n"
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
        fprintf(to, "    %s) ", p->name);
        if (strcmp(p->operand, "FILE") == 0)
            fputs("files=1 ;;\n", to);
        else if (strcmp(p->operand, "ID") == 0)
            fputs("words=$(_uzawa_ids) ;;\n", to);
        else
            fputs("words=$commands ;;\n", to);
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
