#include "commands.h"
#include "arguments.h"

#include <limits.h>
#include <string.h>

#define OUTCOME_EXITS                                                                                                  \
    "0 converged, 3 an assertion or the baseline is missed, 6 the job failed, 7 ended without converging, "            \
    "8 infeasible, "                                                                                                   \
    "9 dismissed, 10 --timeout passed (the job goes on), 130 interrupted (the job goes on)."

static const client_page PAGES[CLIENT_COMMANDS] = {
    [CLIENT_SUBMIT] =
        {"submit", "submit [FILE] [options]", "send a problem, and wait for its answer if told to", "FILE",
         CLIENT_OPERAND_ALLOWED,
         "FILE is a request in JSON, \"-\" is standard input. Prints the job's id, and with --wait its summary. A "
         "repeat after a lost connection never makes a second job.\n"
         "A problem in matrices needs no FILE: --K, --N, --h and --p name files in Matrix Market form. With FILE they "
         "replace its matrices. Files of more than 64 KiB, and compressed or binary ones, are uploaded, unless the "
         "service has them already.\n"
         "A PATH is the way to a value by keys and indices (from 0) with dots between them, such as "
         "problem.loads.1.traction.0; it may begin inside the problem: loads.1.traction.0.\n"
         "--vary of a value below loads (of a scene), p or h (of matrices) makes one job with a load case for each "
         "value, named by it. Of any other value it makes one job for each, with a common tag that is printed on "
         "stderr unless --tag gives one. Several --vary make every combination.\n",
         "with --wait: " OUTCOME_EXITS " Of several jobs the first that is not 0."},
    [CLIENT_UPLOAD] = {"upload", "upload FILE [options]", "send a file that requests then name", "FILE",
                       CLIENT_OPERAND_NEEDED,
                       "FILE is a matrix or vector in Matrix Market form or a Gmsh mesh, \"-\" is standard input; what "
                       "ends in .gz is stored unpacked. Prints its id, which may stand in a request as "
                       "{\"upload\": \"ID\"} in place of the text. The same bytes always have the same id.\n",
                       NULL},
    [CLIENT_STATUS] = {"status", "status ID [options]", "show a job", "ID", CLIENT_OPERAND_NEEDED, "",
                       "0 whatever became of the job."},
    [CLIENT_WAIT] = {"wait", "wait ID [options]", "wait until a job has ended, then print its summary", "ID",
                     CLIENT_OPERAND_NEEDED, "", OUTCOME_EXITS},
    [CLIENT_REFINE] = {"refine", "refine ID --accuracy A [options]",
                       "go on where an ended job stopped, to a new accuracy", "ID", CLIENT_OPERAND_NEEDED,
                       "Makes a new job and prints its id, and with --wait its summary. The old job stays as it is.\n",
                       "with --wait: " OUTCOME_EXITS},
    [CLIENT_VERIFY] = {"verify", "verify FILE [options]", "certify an answer from elsewhere", "FILE",
                       CLIENT_OPERAND_NEEDED,
                       "FILE is a problem and an answer in JSON, \"-\" is standard input. Prints what the certificate "
                       "says of the answer.\n",
                       "0 verified, 6 the job failed, 7 not verified, 9 dismissed, 10 --timeout passed (the job goes "
                       "on), 130 interrupted (the job goes on)."},
    [CLIENT_RESULT] = {"result", "result ID [options]", "fetch the answer as JSON, a table, or a file for ParaView",
                       "ID", CLIENT_OPERAND_NEEDED,
                       "A table in CSV has a row for each node, or for each contact where the fields asked for are "
                       "those of contacts (reactions, gaps, pressure, contact_status), or for each unknown of a "
                       "problem in matrices; first its number and, of scenes, its coordinates.\n",
                       NULL},
    [CLIENT_PICTURE] = {"picture", "picture ID [options]", "draw the deformed body of a scene as SVG", "ID",
                        CLIENT_OPERAND_NEEDED, "", NULL},
    [CLIENT_HISTORY] = {"history", "history ID [options]", "fetch or draw the convergence history", "ID",
                        CLIENT_OPERAND_NEEDED, "", NULL},
    [CLIENT_PLOT] = {"plot", "plot ID [options]", "draw the convergence, the body or the price of digits", "ID",
                     CLIENT_OPERAND_NEEDED,
                     "Without --deformed or --trade the convergence is drawn: dual objective, residual and certified "
                     "bound. A file that ends in .png gets a PNG, by way of rsvg-convert (Debian: librsvg2-bin); any "
                     "other an SVG.\n",
                     NULL},
    [CLIENT_LIST] = {"list", "list [options]", "list jobs, newest first", NULL, 0, "", NULL},
    [CLIENT_CANCEL] =
        {"cancel", "cancel ID", "dismiss a waiting or running job", "ID", CLIENT_OPERAND_NEEDED,
         "A job that has ended is left alone and refused, so that no answer is lost where the job was quicker: see "
         "delete.\n",
         NULL},
    [CLIENT_DELETE] = {"delete", "delete ID", "delete an ended job and its answer", "ID", CLIENT_OPERAND_NEEDED,
                       "A job that waits or runs is left alone and refused: see cancel.\n", NULL},
    [CLIENT_FACTORS] = {"factors", "factors", "list the factors that the service keeps for the next job", NULL, 0, "",
                        NULL},
    [CLIENT_DOCTOR] = {"doctor", "doctor", "check the way to the service and the service itself", NULL, 0,
                       "Prints a line for each thing checked: ok, or what is wrong and what helps.\n",
                       "0 all is well, or only warnings; 4 the token is missing, wrong or allows too little; 5 the "
                       "service is not well; 12 it cannot be reached."},
    [CLIENT_VERSION] = {"version", "version", "print the version", NULL, 0, "", NULL},
    [CLIENT_HELP] = {"help", "help [COMMAND]", "explain a command", "COMMAND", CLIENT_OPERAND_ALLOWED, "", NULL},
};

#define IN(command) CLIENT_IN(CLIENT_##command)
#define ASKING      (CLIENT_EVERYWHERE & ~IN(VERSION) & ~IN(HELP)) /* commands that talk to the server */
#define MAKING      (IN(SUBMIT) | IN(REFINE))                      /* commands that make a job */
#define STAYING     (MAKING | IN(VERIFY) | IN(WAIT))
#define FILES       (IN(RESULT) | IN(PICTURE) | IN(HISTORY) | IN(PLOT)) /* commands whose output may go to a file */

#define FIELD(name) offsetof(client_options, name)
static const client_option OPTIONS[] = {
    {"--K", 0, CLIENT_TEXT, FIELD(K), IN(SUBMIT), 0, 0, "FILE", NULL, "the stiffness matrix, in Matrix Market form"},
    {"--N", 0, CLIENT_TEXT, FIELD(N), IN(SUBMIT), 0, 0, "FILE", NULL, "the contact normals, a row for each contact"},
    {"--h", 0, CLIENT_TEXT, FIELD(h), IN(SUBMIT), 0, 0, "FILE", NULL, "the initial gaps"},
    {"--p", 0, CLIENT_TEXT, FIELD(p), IN(SUBMIT), 0, 0, "FILE", NULL, "the load"},
    {"--mesh", 0, CLIENT_TEXT, FIELD(mesh), IN(SUBMIT), 0, 0, "FILE", NULL,
     "a Gmsh file (2.2 or 4.1) in place of the scene's mesh"},
    {"--set", 0, CLIENT_LIST_OF, FIELD(set), IN(SUBMIT), 0, CLIENT_MAX_WORDS, "PATH=VALUE", NULL,
     "put VALUE, as JSON or else as a string, at PATH of the request; may be repeated"},
    {"--vary", 0, CLIENT_LIST_OF, FIELD(vary), IN(SUBMIT), 0, 8, "PATH=VALUES", NULL,
     "solve for each of VALUES at PATH: FIRST:LAST:COUNT in equal steps, or a list A,B,C; may be repeated"},
    {"--accuracy", 'a', CLIENT_TEXT, FIELD(accuracy), IN(REFINE), 0, 0, "A", "quick balanced precise exact",
     "a relative error such as 1e-8, or quick, balanced, precise, exact"},
    {"--max-iterations", 0, CLIENT_COUNT, FIELD(max_iterations), IN(REFINE), 0, 1000000000, "N", NULL,
     "counted from the start of the first run"},
    {"--time-limit", 0, CLIENT_SECONDS, FIELD(time_limit_s), IN(REFINE), 0, 0, "S", NULL, "of the new run, in seconds"},
    {"--wait", 'w', CLIENT_FLAG, FIELD(wait), MAKING, 0, 0, NULL, NULL,
     "wait until the job has ended and print the summary"},
    {"--timeout", 't', CLIENT_SECONDS, FIELD(timeout_s), MAKING, 0, 0, "S", NULL,
     "with --wait: stop waiting after S seconds"},
    {"--timeout", 't', CLIENT_SECONDS, FIELD(timeout_s), STAYING, 0, 0, "S", NULL, "stop waiting after S seconds"},
    {"--tag", 0, CLIENT_LIST_OF, FIELD(tags), IN(SUBMIT), 0, CLIENT_MAX_TAGS, "WORD", NULL,
     "label the job; may be repeated"},
    {"--key", 'k', CLIENT_TEXT, FIELD(key), IN(SUBMIT), 0, 0, "KEY", NULL,
     "idempotency key (default: random); the same key and request give the same job"},
    {"--key", 'k', CLIENT_TEXT, FIELD(key), STAYING & ~IN(WAIT), 0, 0, "KEY", NULL,
     "idempotency key (default: random)"},
    {"--format", 'f', CLIENT_CHOICE, FIELD(format), IN(RESULT), 0, 0, "F", "json csv vtu",
     "json (default), csv: a table, or vtu: scenes only"},
    {"--format", 'f', CLIENT_CHOICE, FIELD(format), IN(HELP), 0, 0, "F", "text man bash json",
     "text (default); of all commands together: man, a manual page, bash, a completion, or json"},
    {"--fields", 0, CLIENT_LIST_OF, FIELD(fields), IN(RESULT), 0, CLIENT_MAX_WORDS, "A,B",
     "summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain "
     "stress_gauss",
     "such as displacements, reactions, gaps, pressure, stress, von_mises (default: reactions,gaps; of vtu: "
     "everything useful)"},
    {"--field", 0, CLIENT_LIST_OF, FIELD(fields), IN(RESULT), 0, CLIENT_MAX_WORDS, "NAME",
     "summary nodes reactions gaps pressure displacements contact_status stress principal von_mises strain "
     "stress_gauss",
     "one of them; may be repeated"},
    {"--junit", 0, CLIENT_TEXT, FIELD(junit), STAYING, 0, 0, "FILE", NULL,
     "write a JUnit report: whether the job converged, each assertion, each comparison"},
    {"--baseline", 0, CLIENT_TEXT, FIELD(baseline), STAYING, 0, 0, "ID", NULL,
     "compare with another job: energy, reactions, pressure, displacements and what touches"},
    {"--tolerance", 0, CLIENT_SECONDS, FIELD(tolerance), STAYING, 0, 0, "T", NULL,
     "what the comparison lets pass, relative (default 1e-3)"},
    {"--deformed", 0, CLIENT_FLAG, FIELD(deformed), IN(PLOT), 0, 0, NULL, NULL, "draw the deformed body of a scene"},
    {"--trade", 0, CLIENT_FLAG, FIELD(trade), IN(PLOT), 0, 0, NULL, NULL,
     "print what each certified digit took, as a table and a drawing"},
    {"--x", 0, CLIENT_CHOICE, FIELD(axis), IN(PLOT), 0, 0, "AXIS", "iterations seconds",
     "of the convergence: over iterations (default) or seconds"},
    {"--with", 0, CLIENT_LIST_OF, FIELD(with), IN(PLOT), 0, 8, "ID", NULL,
     "draw another job's convergence beside it; may be repeated"},
    {"--colour", 0, CLIENT_TEXT, FIELD(colour), IN(PICTURE), 0, 0, "C", "von_mises displacements",
     "von_mises (default) or displacements"},
    {"--factor", 0, CLIENT_TEXT, FIELD(factor), IN(PICTURE), 0, 0, "X", NULL,
     "displacements are drawn X times as large (default: so that they show)"},
    {"--width", 0, CLIENT_COUNT, FIELD(width), IN(PICTURE), 200, 4000, "N", NULL,
     "of the picture, in pixels (default 900)"},
    {"--colour", 0, CLIENT_TEXT, FIELD(colour), IN(PLOT), 0, 0, "C", "von_mises displacements",
     "with --deformed: von_mises (default) or displacements"},
    {"--factor", 0, CLIENT_TEXT, FIELD(factor), IN(PLOT), 0, 0, "X", NULL,
     "with --deformed: displacements are drawn X times as large"},
    {"--width", 0, CLIENT_COUNT, FIELD(width), IN(PLOT), 40, 4000, "N", NULL,
     "with --deformed: of the picture, in pixels; with --trade: of the drawing, in characters"},
    {"--csv", 0, CLIENT_FLAG, FIELD(csv), IN(HISTORY), 0, 0, NULL, NULL, "as CSV instead of JSON"},
    {"--plot", 0, CLIENT_FLAG, FIELD(plot), IN(HISTORY), 0, 0, NULL, NULL,
     "draw it: log10 of the error bound and of the residual"},
    {"--width", 0, CLIENT_COUNT, FIELD(width), IN(HISTORY), 24, 400, "N", NULL,
     "of the drawing, in characters (default 72, less on a narrow terminal)"},
    {"--height", 0, CLIENT_COUNT, FIELD(height), IN(HISTORY), 8, 200, "N", NULL,
     "of the drawing, in lines (default 20)"},
    {"--ascii", 0, CLIENT_FLAG, FIELD(ascii), IN(HISTORY) | IN(PLOT), 0, 0, NULL, NULL,
     "draw in plain ASCII (default where the locale is not UTF-8)"},
    {"--case", 'c', CLIENT_TEXT, FIELD(case_name), IN(RESULT), 0, 0, "NAME", NULL, "of this load case alone"},
    {"--case", 'c', CLIENT_TEXT, FIELD(case_name), FILES, 0, 0, "NAME", NULL,
     "of this load case; needed where the job has some"},
    {"--output", 'o', CLIENT_TEXT, FIELD(output), FILES, 0, 0, "FILE", NULL, "write to FILE, whole or not at all"},
    {"--status", 0, CLIENT_TEXT, FIELD(status), IN(LIST), 0, 0, "S", "accepted running successful failed dismissed",
     "accepted, running, successful, failed or dismissed"},
    {"--tag", 0, CLIENT_LIST_OF, FIELD(tags), IN(LIST), 0, CLIENT_MAX_TAGS, "WORD", NULL, "only jobs with this tag"},
    {"--limit", 'n', CLIENT_COUNT, FIELD(limit), IN(LIST), 1, 1000000, "N", NULL, "at most N jobs (default 20)"},
    {"--progress", 0, CLIENT_FLAG, FIELD(progress), STAYING, 0, 0, NULL, NULL,
     "show progress on stderr even where it is no terminal"},
    {"--quiet", 'q', CLIENT_FLAG, FIELD(quiet), MAKING, 0, 0, NULL, NULL, "print the id and nothing else"},
    {"--quiet", 'q', CLIENT_FLAG, FIELD(quiet), IN(LIST), 0, 0, NULL, NULL, "print the ids and nothing else"},
    {"--quiet", 'q', CLIENT_FLAG, FIELD(quiet), IN(DOCTOR), 0, 0, NULL, NULL, "print only what is wrong"},
    {"--quiet", 'q', CLIENT_FLAG, FIELD(quiet), IN(VERIFY) | IN(WAIT) | IN(CANCEL) | IN(DELETE), 0, 0, NULL, NULL,
     "print nothing; the exit status tells"},
    {"--json", 'j', CLIENT_FLAG, FIELD(json), IN(SUBMIT) | IN(REFINE) | IN(VERIFY) | IN(WAIT) | IN(STATUS), 0, 0, NULL,
     NULL, "print the job as JSON, and what is wrong too"},
    {"--json", 'j', CLIENT_FLAG, FIELD(json), IN(PICTURE), 0, 0, NULL, NULL,
     "with --output: print what was written as JSON"},
    {"--json", 'j', CLIENT_FLAG, FIELD(json), IN(PLOT), 0, 0, NULL, NULL,
     "with --output: print what was written as JSON; with --trade: print the numbers"},
    {"--json", 'j', CLIENT_FLAG, FIELD(json), CLIENT_EVERYWHERE, 0, 0, NULL, NULL,
     "print JSON, and what is wrong as JSON too"},
    {"--server", 's', CLIENT_TEXT, FIELD(server), ASKING, 0, 0, "URL", NULL,
     "the service (default: $UZAWA_SERVER, else http://127.0.0.1:8080); $UZAWA_TOKEN is sent as the token; $UZAWA_CA "
     "is a file of certificates to trust"},
    {"--timeout", 't', CLIENT_SECONDS, FIELD(timeout_s), ASKING, 0, 0, "S", NULL,
     "give up after S seconds; for wait and --wait: stop waiting"},
    {"--retry", 0, CLIENT_SECONDS, FIELD(retry_s), ASKING, 0, 0, "S", NULL,
     "keep trying to reach the server for S seconds (default 3; 30 while waiting)"},
    {"--help", 'h', CLIENT_FLAG, FIELD(help), CLIENT_EVERYWHERE, 0, 0, NULL, NULL, "explain the command"},
    {"--version", 'V', CLIENT_FLAG, FIELD(version), CLIENT_EVERYWHERE, 0, 0, NULL, NULL, "print the version"},
};
static const size_t N_OPTIONS = sizeof OPTIONS / sizeof *OPTIONS;

static const client_exit_line EXITS[] = {
    {0, "done; wait, verify and --wait: ended and certified as asked"},
    {2, "the command line is wrong, or a PATH is not in the request; nothing was sent"},
    {3, "the answer fails an assertion or a comparison that was asked for"},
    {4, "the server refused the request; why is on stderr"},
    {5, "the server failed"},
    {6, "the job failed"},
    {7, "the job ended without converging (iteration, time, precision or mesh limit, paper rule), or the answer is not "
        "verified"},
    {8, "the problem is infeasible"},
    {9, "the job was dismissed"},
    {10, "the job goes on, but --timeout has passed"},
    {11, "a local file could not be read or written"},
    {12, "the server cannot be reached, or does not answer in time"},
    {130, "interrupted; a job that was waited for goes on"},
};

const client_page *client_page_of(client_command command)
{
    return &PAGES[command];
}

const client_option *client_option_at(size_t i)
{
    return i < N_OPTIONS ? &OPTIONS[i] : NULL;
}

bool client_option_is_general(const client_option *option)
{
    return option->commands == ASKING || (option->commands == CLIENT_EVERYWHERE && option->letter != 'j');
}

const client_exit_line *client_exit_line_at(size_t i)
{
    return i < sizeof EXITS / sizeof *EXITS ? &EXITS[i] : NULL;
}

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
