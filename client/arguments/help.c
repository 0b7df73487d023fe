/* help.c: the table of commands as pages for a terminal. */
#include "arguments/commands.h"

#define WIDTH  96 /* characters of a line */
#define INDENT 23 /* where explanations of options begin */

/* A paragraph, and the line break after it. Returns what follows. */
static const char *print_paragraph(FILE *to, const char *text, int at, int indent)
{
    const char *rest = uz_write_wrapped(to, text, at, "", indent, WIDTH);
    fputc('\n', to);
    return rest;
}

static void print_options(FILE *to, client_command command, bool general)
{
    const uz_option_table all = CLIENT_OPTIONS;
    bool any = false;
    for (size_t i = 0; i < all.count; i++) {
        const uz_option *o = &all.rows[i];
        if (client_option_is_own(o, CLIENT_COMMANDS) != general || (!general && !client_option_is_own(o, command)))
            continue;
        fputs(any ? "" : general ? "\nGeneral options:\n" : "\n", to);
        any = true;
        uz_option_print(to, o, o->about, INDENT, WIDTH, true);
    }
}

void client_help_print(FILE *to, client_command command)
{
    if (command >= CLIENT_COMMANDS) {
        fputs("usage: uzawa [--server URL] [--timeout S] COMMAND ...\n"
              "Solves frictionless contact problems by a contact solver service.\n\nCommands:\n",
              to);
        for (int i = 0; i < CLIENT_COMMANDS; i++)
            fprintf(to, "  %-9s %s\n", CLIENT_PAGES[i].name, CLIENT_PAGES[i].about);
        fputs("\nAn ID may be cut to four digits and more that it begins or ends with; @last is the newest job.\n", to);
        print_options(to, CLIENT_COMMANDS, true);
        fputs("\nExit status:\n", to);
        for (const client_exit_line *line = CLIENT_EXITS; line->about; line++) {
            fprintf(to, " %3d  ", line->code);
            print_paragraph(to, line->about, 6, 6);
        }
        return;
    }
    const client_page *p = &CLIENT_PAGES[command];
    fprintf(to, "usage: uzawa %s\n%c%s.\n", p->usage, p->about[0] - 'a' + 'A', p->about + 1);
    for (const char *rest = p->details; *rest;) {
        fputc('\n', to);
        rest = print_paragraph(to, rest, 0, 0);
    }
    print_options(to, command, false);
    if (p->exits) {
        fputs("\nExit status:", to);
        print_paragraph(to, p->exits, 12, 0);
    }
    if (command != CLIENT_VERSION && command != CLIENT_HELP)
        print_options(to, CLIENT_COMMANDS, true);
}
