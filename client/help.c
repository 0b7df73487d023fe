#include "arguments.h"

#include <string.h>

typedef struct {
    const char *name, *usage, *about, *details;
} page;

#define OUTCOME_EXITS                                                                                                  \
    "0 converged, 3 an assertion or the baseline is missed, 6 the job failed, 7 ended without converging,\n"           \
    "8 infeasible, 9 dismissed, 10 --timeout passed (the job goes on).\n"

static const page PAGES[CLIENT_COMMANDS] = {
    [CLIENT_SUBMIT] = {"submit", "submit FILE [options]", "send a problem, and wait for its answer if told to",
                       "FILE is a request in JSON, \"-\" is standard input. Prints the job's id, and with --wait its\n"
                       "summary. A repeat after a lost connection never makes a second job.\n"
                       "\n"
                       "  -w, --wait         wait until the job has ended and print the summary\n"
                       "  -t, --timeout S    with --wait: stop waiting after S seconds\n"
                       "      --tag WORD     label the job; may be repeated\n"
                       "  -k, --key KEY      idempotency key (default: random); the same key and file give the\n"
                       "                     same job\n"
                       "  -q, --quiet        print the id and nothing else\n"
                       "  -j, --json         print the job as JSON\n"
                       "      --junit FILE   write what became of it as a JUnit report, for a CI system\n"
                       "      --baseline ID  compare with another job, within --tolerance (default 1e-3, relative)\n"
                       "      --tolerance T  of energy, reactions, pressure, displacements and what touches\n"
                       "      --progress     show progress on stderr even where it is no terminal\n"
                       "\n"
                       "Exit status with --wait: " OUTCOME_EXITS},
    [CLIENT_UPLOAD] =
        {"upload", "upload FILE [--json]", "send a file that requests then name",
         "FILE is a matrix or vector in Matrix Market form or a Gmsh mesh, \"-\" is standard input; what\n"
         "ends in .gz is stored unpacked. Prints its id, which may stand in a request as\n"
         "{\"upload\": \"ID\"} in place of the text. The same bytes always have the same id.\n"
         "\n"
         "  -j, --json         print what the service knows of it as JSON\n"},
    [CLIENT_STATUS] = {"status", "status ID [--json]", "show a job", "Exit status 0 whatever became of the job.\n"},
    [CLIENT_WAIT] = {"wait", "wait ID [options]", "wait until a job has ended, then print its summary",
                     "  -t, --timeout S    stop waiting after S seconds\n"
                     "  -q, --quiet        print nothing; the exit status tells\n"
                     "  -j, --json         print the job as JSON\n"
                     "      --junit FILE   write what became of it as a JUnit report, for a CI system\n"
                     "      --baseline ID  compare with another job, within --tolerance (default 1e-3, relative)\n"
                     "      --tolerance T  of energy, reactions, pressure, displacements and what touches\n"
                     "      --progress     show progress on stderr even where it is no terminal\n"
                     "\nExit status: " OUTCOME_EXITS},
    [CLIENT_REFINE] = {"refine", "refine ID --accuracy A [options]",
                       "go on where an ended job stopped, to a new accuracy",
                       "Makes a new job and prints its id, and with --wait its summary. The old job stays as it is.\n"
                       "\n"
                       "  -a, --accuracy A   a relative error such as 1e-8, or quick, balanced, precise, exact\n"
                       "      --max-iterations N  counted from the start of the first run\n"
                       "      --time-limit S  of the new run\n"
                       "  -w, --wait         wait until the new job has ended and print the summary\n"
                       "  -t, --timeout S    with --wait: stop waiting after S seconds\n"
                       "  -k, --key KEY      idempotency key (default: random)\n"
                       "  -q, --quiet        print the id and nothing else\n"
                       "  -j, --json         print the job as JSON\n"
                       "      --junit FILE   write what became of it as a JUnit report, for a CI system\n"
                       "      --baseline ID  compare with another job, within --tolerance (default 1e-3, relative)\n"
                       "      --tolerance T  of energy, reactions, pressure, displacements and what touches\n"
                       "      --progress     show progress on stderr even where it is no terminal\n"
                       "\n"
                       "Exit status with --wait: " OUTCOME_EXITS},
    [CLIENT_VERIFY] = {"verify", "verify FILE [options]", "certify an answer from elsewhere",
                       "FILE is a problem and an answer in JSON, \"-\" is standard input. Prints what the certificate\n"
                       "says of the answer.\n"
                       "\n"
                       "  -t, --timeout S    stop waiting after S seconds\n"
                       "  -k, --key KEY      idempotency key (default: random)\n"
                       "  -q, --quiet        print nothing; the exit status tells\n"
                       "  -j, --json         print the job as JSON\n"
                       "      --junit FILE   write what became of it as a JUnit report, for a CI system\n"
                       "      --baseline ID  compare with another job, within --tolerance (default 1e-3, relative)\n"
                       "      --tolerance T  of energy, reactions, pressure, displacements and what touches\n"
                       "      --progress     show progress on stderr even where it is no terminal\n"
                       "\n"
                       "Exit status: 0 verified, 6 the job failed, 7 not verified,\n"
                       "9 dismissed, 10 --timeout passed (the job goes on).\n"},
    [CLIENT_RESULT] = {"result", "result ID [options]", "fetch the answer as JSON or as a file for ParaView",
                       "  -f, --format F     json (default), or vtu: scenes only\n"
                       "      --fields A,B   such as displacements, reactions, gaps, pressure, stress, von_mises\n"
                       "                     (default: reactions,gaps; of vtu: everything useful)\n"
                       "  -c, --case NAME    of this load case alone\n"
                       "  -o, --output FILE  write to FILE, whole or not at all\n"},
    [CLIENT_PICTURE] = {"picture", "picture ID [options]", "draw the deformed body of a scene as SVG",
                        "      --colour C     von_mises (default) or displacements\n"
                        "      --factor X     displacements are drawn X times as large (default: so that they show)\n"
                        "      --width N      of the picture, in pixels (default 900)\n"
                        "  -c, --case NAME    of this load case; needed where the job has some\n"
                        "  -o, --output FILE  write to FILE, whole or not at all\n"},
    [CLIENT_HISTORY] = {"history", "history ID [options]", "fetch or draw the convergence history",
                        "  -c, --case NAME    of this load case; needed where the job has some\n"
                        "      --csv          as CSV instead of JSON\n"
                        "      --plot         draw it: log10 of the error bound and of the residual\n"
                        "      --width N      of the drawing, in characters (default 72)\n"
                        "      --height N     of the drawing, in lines (default 20)\n"
                        "      --ascii        draw in plain ASCII (default where the locale is not UTF-8)\n"
                        "  -o, --output FILE  write to FILE, whole or not at all\n"},
    [CLIENT_LIST] = {"list", "list [options]", "list jobs, newest first",
                     "      --status S     accepted, running, successful, failed or dismissed\n"
                     "      --tag WORD     only jobs with this tag\n"
                     "  -n, --limit N      at most N jobs (default 20)\n"
                     "  -j, --json         as JSON\n"},
    [CLIENT_CANCEL] = {"cancel", "cancel ID", "dismiss a waiting or running job; delete an ended one",
                       "  -q, --quiet        print nothing\n"
                       "  -j, --json         print the server's reply\n"},
    [CLIENT_VERSION] = {"version", "version", "print the version", ""},
    [CLIENT_HELP] = {"help", "help [COMMAND]", "explain a command", ""},
};

static const char GENERAL[] =
    "General options:\n"
    "  -s, --server URL   the service (default: $UZAWA_SERVER, else http://127.0.0.1:8080)\n"
    "                     $UZAWA_TOKEN is sent as the token; $UZAWA_CA is a file of certificates to trust\n"
    "  -t, --timeout S    give up after S seconds; for wait and submit --wait: stop waiting\n"
    "      --retry S      keep trying to reach the server for S seconds (default 3; 30 while waiting)\n"
    "  -h, --help         explain the command\n"
    "  -V, --version      print the version\n";

static const char EXITS[] = "Exit status:\n"
                            "   0  done; wait, verify and --wait: ended and certified as asked\n"
                            "   2  the command line is wrong\n"
                            "   3  the answer fails an assertion or a comparison that was asked for\n"
                            "   4  the server refused the request; why is on stderr\n"
                            "   5  the server failed\n"
                            "   6  the job failed\n"
                            "   7  the job ended without converging (iteration, time or precision limit, paper rule),\n"
                            "      or the answer is not verified\n"
                            "   8  the problem is infeasible\n"
                            "   9  the job was dismissed\n"
                            "  10  the job goes on, but --timeout has passed\n"
                            "  11  a local file could not be read or written\n"
                            "  12  the server cannot be reached, or does not answer in time\n";

const char *client_command_name(client_command command)
{
    return command < CLIENT_COMMANDS ? PAGES[command].name : "";
}

bool client_command_find(client_command *out, const char *name)
{
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        if (strcmp(PAGES[i].name, name) != 0)
            continue;
        *out = (client_command)i;
        return true;
    }
    return false;
}

static void print_overview(FILE *to)
{
    fputs("usage: uzawa [--server URL] [--timeout S] COMMAND ...\n"
          "Solves frictionless contact problems by a contact solver service.\n\nCommands:\n",
          to);
    for (int i = 0; i < CLIENT_COMMANDS; i++)
        fprintf(to, "  %-9s %s\n", PAGES[i].name, PAGES[i].about);
    fprintf(to, "\n%s\n%s", GENERAL, EXITS);
}

void client_help_print(FILE *to, client_command command)
{
    if (command >= CLIENT_COMMANDS) {
        print_overview(to);
        return;
    }
    const page *p = &PAGES[command];
    fprintf(to, "usage: uzawa %s\n%c%s.\n", p->usage, p->about[0] - 'a' + 'A', p->about + 1);
    if (p->details[0])
        fprintf(to, "\n%s", p->details);
    fprintf(to, "\n%s", GENERAL);
}
