/* manual.c: the table of commands as a manual page (mdoc, mandoc(1)) and as JSON. */
#include "arguments/commands.h"

#include <ctype.h>
#include <jansson.h>
#include <string.h>

/* What the page shows to copy; a test runs every line of it. */
static const struct {
    const char *about, *lines;
} EXAMPLES[] = {
    {"Send a scene, wait, and see what came of it:", "uzawa submit body.json --wait"},
    {"Step by step:", "job=$(uzawa submit body.json --tag plate)\n"
                      "uzawa wait $job --timeout 60\n"
                      "uzawa status $job\n"
                      "uzawa history $job --plot\n"
                      "uzawa history $job --csv -o history.csv\n"
                      "uzawa result $job --format csv --fields displacements,von_mises -o nodes.csv\n"
                      "uzawa result $job --format csv --field reactions --field pressure\n"
                      "uzawa result $job --format vtu -o body.vtu\n"
                      "uzawa path $job --from 0,10 --to 60,10 --count 7\n"
                      "uzawa plot $job -o convergence.svg\n"
                      "uzawa plot $job --deformed -o body.svg\n"
                      "uzawa report $job -o report.html\n"
                      "uzawa request $job -o again.json\n"
                      "uzawa list --tag plate\n"
                      "uzawa delete $job"},
    {"Change values of a scene, and take its mesh from Gmsh:",
     "uzawa submit body.json --set materials.0.young=70e3 --set solver.accuracy=quick --wait\n"
     "uzawa submit part.json --mesh part.msh --wait"},
    {"A deck of Abaqus or CalculiX, at once and by way of a scene to look at:",
     "uzawa submit part.inp --wait\n"
     "uzawa import part.inp -o deck.json\n"
     "uzawa submit deck.json --set solver.accuracy=quick --wait"},
    {"Ten loads in one job, and the answer to one of them:",
     "job=$(uzawa submit body.json --vary loads.1.traction.0=0.1:1.0:10)\n"
     "uzawa wait $job\n"
     "uzawa result $job --case 0.1 --field reactions"},
    {"A job for each of three materials:",
     "uzawa submit body.json --vary materials.0.young=70e3,110e3,210e3 --tag metals --wait"},
    {"A problem in matrices:", "uzawa submit --K K.mtx --N N.mtx --h h.mtx --p p.mtx --wait\n"
                               "K=$(uzawa upload K.mtx)\n"
                               "uzawa submit matrices.json --set K='{\"upload\": \"'$K'\"}' --wait"},
    {"More digits, an answer from elsewhere, and from standard input:", "job=$(uzawa submit body.json --wait --quiet)\n"
                                                                        "uzawa refine $job --accuracy 1e-10 --wait\n"
                                                                        "uzawa verify answer.json\n"
                                                                        "uzawa submit - --wait <body.json"},
    {"In a pipeline: a JUnit report, exit status 3 where an assertion of the scene is missed or where something has "
     "changed since another job:",
     "uzawa submit body.json --wait --junit report.xml\n"
     "baseline=$(uzawa submit body.json --wait --quiet)\n"
     "uzawa submit body.json --set materials.0.poisson=0.30001 --wait --baseline $baseline --tolerance 1e-3"},
    {"In scripts:", "uzawa submit body.json --wait --json | jq .summary.contact.active\n"
                    "uzawa list --quiet --limit 5\n"
                    "uzawa factors --json | jq .bytes\n"
                    "uzawa nodes --json | jq .nodes[].name"},
    {"As tools of a language model, whose program says one line after another:",
     "printf '%s\\n' '{\"jsonrpc\": \"2.0\", \"id\": 1, \"method\": \"tools/list\"}' | uzawa mcp | jq -r "
     ".result.tools[].name"},
    {"When something is wrong:", "uzawa doctor"},
};

/* ------------------------------------------------------------ manual page */

#define ROFF_LINE 76 /* mandoc wants lines of at most 80 characters */

/* Text with roff's own characters escaped. Lines are broken at blanks if `fill`, and at the end of sentences, as mandoc
 * wants it. */
static void print_roff(FILE *to, const char *text, bool fill)
{
    int at = 0;
    for (; *text; text++) {
        const char *escape = *text == '\\' ? "\\e" : *text == '-' ? "\\-" : NULL;
        if (at == 0 && (*text == '.' || *text == '\''))
            fputs("\\&", to);
        bool sentence = *text == ' ' && text[-1] == '.' && isupper((unsigned char)text[1]);
        bool full = *text == ' ' && at + 1 + (int)strcspn(text + 1, " ") > ROFF_LINE;
        if (*text == '\n' || (fill && (sentence || full))) {
            fputc('\n', to);
            at = 0;
            continue;
        }
        at += escape ? fprintf(to, "%s", escape) : fprintf(to, "%c", *text);
    }
}

/* A paragraph's words as one or more text lines. Returns what follows it. */
static const char *print_paragraph(FILE *to, const char *text)
{
    char line[2048];
    size_t len = strcspn(text, "\n");
    snprintf(line, sizeof line, "%.*s", (int)len, text);
    print_roff(to, line, true);
    fputc('\n', to);
    return text[len] ? text + len + 1 : text + len;
}

static void print_options(FILE *to, client_command command, bool general)
{
    const uz_option_table all = CLIENT_OPTIONS;
    bool open = false;
    for (size_t i = 0; i < all.count; i++) {
        const uz_option *o = &all.rows[i];
        if (client_option_is_own(o, CLIENT_COMMANDS) != general || (!general && !client_option_is_own(o, command)))
            continue;
        fputs(open ? "" : ".Bl -tag -width Ds\n", to);
        open = true;
        fputs(".It ", to);
        if (o->letter)
            fprintf(to, "Fl %c , ", o->letter);
        fprintf(to, "Fl \\-%s", o->name);
        if (o->value)
            fprintf(to, " Ar %s", o->value);
        fputc('\n', to);
        print_paragraph(to, o->about);
    }
    fputs(open ? ".El\n" : "", to);
}

/* "submit [FILE] [options]" with macros; about is said first. */
static void print_command(FILE *to, client_command command)
{
    const client_page *p = &CLIENT_PAGES[command];
    const char *open = p->operands & CLIENT_OPERAND_NEEDED ? "" : "Op ";
    fprintf(to, ".Ss %s\n.Nm uzawa Cm %s\n", p->name, p->name);
    if (p->operand)
        fprintf(to, ".%sAr %s\n", open, p->operand);
    fputs(".Op Ar options\n.Pp\n", to);
    char about[200];
    snprintf(about, sizeof about, "%c%s.", toupper((unsigned char)p->about[0]), p->about + 1);
    print_paragraph(to, about);
    for (const char *rest = p->details; *rest;) {
        fputs(".Pp\n", to);
        rest = print_paragraph(to, rest);
    }
    print_options(to, command, false);
    if (!p->exits)
        return;
    fputs(".Pp\nExit status:\n", to);
    print_paragraph(to, p->exits);
}

void client_manual_print(FILE *to)
{
    fputs(".\\\" Made from client/arguments/commands.c and manual.c.\n"
          ".Dd November 21, 2026\n.Dt UZAWA 1\n.Os\n.Sh NAME\n.Nm uzawa\n"
          ".Nd solve frictionless contact problems by a contact solver service\n"
          ".Sh SYNOPSIS\n.Nm uzawa\n.Op Fl s Ar URL\n.Op Fl t Ar S\n.Ar command\n.Op Ar operand\n.Op Ar options\n"
          ".Sh DESCRIPTION\n"
          ".Nm\nsends problems to the service, waits for their answers and fetches them.\n"
          "Every answer carries a certified bound on its error;\n"
          "the exit status says whether it meets what was asked for.\n"
          "Options may stand before or after the command and its operand;\n.Fl \\-\nends them.\n"
          "An\n.Ar ID\nmay be cut to four digits and more that it begins or ends with,\n"
          "where only one of the newest 2000 jobs fits;\n.Cm @last\nis the newest job.\n"
          ".Pp\nThese hold for all commands that talk to the service:\n",
          to);
    print_options(to, CLIENT_COMMANDS, true);
    fputs(".Sh COMMANDS\n", to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        print_command(to, (client_command)i);
    static const char *const LINES[][2] = {
        {"UZAWA_SERVER", "the service, as for\n.Fl \\-server"},
        {"UZAWA_TOKEN", "the token to send; it is never a part of the command line, which others can see"},
        {"UZAWA_CA", "a file with certificates (PEM) to trust for https in place of the system's"},
        {"COLUMNS", "the width to write for where standard error is no terminal"},
        {"NO_COLOR", "if set, drawings have no colours"},
    };
    fputs(".Sh ENVIRONMENT\n.Bl -tag -width UZAWA_SERVER\n", to);
    for (size_t i = 0; i < sizeof LINES / sizeof *LINES; i++)
        fprintf(to, ".It Ev %s\n%s\n", LINES[i][0], LINES[i][1]);
    fputs(".El\n", to);
    fputs(".Sh EXIT STATUS\n.Bl -tag -width Ds -compact\n", to);
    for (const client_exit_line *line = CLIENT_EXITS; line->about; line++) {
        fprintf(to, ".It %d\n", line->code);
        print_paragraph(to, line->about);
    }
    fputs(".El\n", to);
    fputs(".Sh EXAMPLES\n", to);
    for (size_t i = 0; i < sizeof EXAMPLES / sizeof *EXAMPLES; i++) {
        fputs(i ? ".Pp\n" : "", to);
        print_paragraph(to, EXAMPLES[i].about);
        fputs(".Bd -literal -offset indent\n", to);
        print_roff(to, EXAMPLES[i].lines, false);
        fputs("\n.Ed\n", to);
    }
}

/* ------------------------------------------------------------------- JSON */

bool client_help_print_json(FILE *to)
{
    json_t *commands = json_array();
    for (int i = 0; commands && i < CLIENT_COMMANDS; i++) {
        const client_page *p = &CLIENT_PAGES[i];
        const uz_option_table table = CLIENT_OPTIONS;
        json_t *options = json_array();
        for (size_t k = 0; options && k < table.count; k++) {
            const uz_option *o = &table.rows[k];
            if (client_option_is_own(o, (client_command)i))
                json_array_append_new(options, json_pack("{s:s+, s:s?, s:s}", "name", "--", o->name, "value", o->value,
                                                         "about", o->about));
        }
        json_array_append_new(commands, json_pack("{s:s, s:s?, s:s, s:s, s:o}", "name", p->name, "operand", p->operand,
                                                  "usage", p->usage, "about", p->about, "options", options));
    }
    json_t *all = json_pack("{s:s, s:o}", "version", CLIENT_VERSION_TEXT, "commands", commands);
    bool ok = all && json_dumpf(all, to, JSON_INDENT(2)) == 0;
    fputc('\n', to);
    json_decref(all);
    return ok;
}
