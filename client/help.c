/* help.c: the table of commands as pages for a terminal. */
#include "commands.h"

#include <string.h>

#define WIDTH  96 /* characters of a line */
#define INDENT 23 /* where explanations of options begin */

/* Writes a paragraph (up to '\n' or the end) with lines broken at blanks, those after the first indented. `at` is the
 * column that the first line begins in. Returns what follows the paragraph. */
static const char *print_wrapped(FILE *to, const char *text, int at, int indent)
{
    while (*text && *text != '\n') {
        int word = (int)strcspn(text, " \n");
        if (at > indent && at + 1 + word > WIDTH) {
            fprintf(to, "\n%*s", indent, "");
            at = indent;
        } else if (at > indent) {
            fputc(' ', to);
            at++;
        }
        fwrite(text, 1, (size_t)word, to);
        at += word;
        text += word;
        text += strspn(text, " ");
    }
    fputc('\n', to);
    return *text ? text + 1 : text;
}

static void print_option(FILE *to, const client_option *o)
{
    int used = fprintf(to, "  %c%c%s %s%s%s", o->letter ? '-' : ' ', o->letter ? o->letter : ' ', o->letter ? "," : " ",
                       o->name, o->value ? " " : "", o->value ? o->value : "");
    if (used + 2 > INDENT)
        fprintf(to, "\n%*s", INDENT, "");
    else
        fprintf(to, "%*s", INDENT - used, "");
    print_wrapped(to, o->about, INDENT, INDENT);
}

/* The row that counts for this command. */
static bool is_own(const client_option *o, client_command command)
{
    if (!(o->commands & CLIENT_IN(command)))
        return false;
    for (size_t i = 0; client_option_at(i) != o; i++) {
        const client_option *before = client_option_at(i);
        if (strcmp(before->name, o->name) == 0 && before->commands & CLIENT_IN(command))
            return false;
    }
    return true;
}

static void print_general(FILE *to)
{
    const client_option *o;
    fputs("\nGeneral options:\n", to);
    for (size_t i = 0; (o = client_option_at(i)); i++)
        if (client_option_is_general(o))
            print_option(to, o);
}

static void print_overview(FILE *to)
{
    const client_exit_line *line;
    fputs("usage: uzawa [--server URL] [--timeout S] COMMAND ...\n"
          "Solves frictionless contact problems by a contact solver service.\n\nCommands:\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        fprintf(to, "  %-9s %s\n", client_page_of((client_command)i)->name, client_page_of((client_command)i)->about);
    print_general(to);
    fputs("\nExit status:\n", to);
    for (size_t i = 0; (line = client_exit_line_at(i)); i++) {
        fprintf(to, " %3d  ", line->code);
        print_wrapped(to, line->about, 6, 6);
    }
}

void client_help_print(FILE *to, client_command command)
{
    const client_option *o;
    bool any = false;
    if (command >= CLIENT_COMMANDS) {
        print_overview(to);
        return;
    }
    const client_page *p = client_page_of(command);
    fprintf(to, "usage: uzawa %s\n%c%s.\n", p->usage, p->about[0] - 'a' + 'A', p->about + 1);
    for (const char *rest = p->details; *rest;) {
        fputc('\n', to);
        rest = print_wrapped(to, rest, 0, 0);
    }
    for (size_t i = 0; (o = client_option_at(i)); i++) {
        if (client_option_is_general(o) || !is_own(o, command))
            continue;
        fputs(any ? "" : "\n", to);
        any = true;
        print_option(to, o);
    }
    if (p->exits) {
        fputs("\nExit status:", to);
        print_wrapped(to, p->exits, 12, 0);
    }
    if (command != CLIENT_VERSION && command != CLIENT_HELP)
        print_general(to);
}
