#include "arguments/commands.h"
#include "arguments/arguments.h"

#include <string.h>

#define OUTCOME_EXITS                                                                                                  \
    "0 converged, 3 an assertion or the baseline is missed, 6 the job failed, 7 ended without converging, "            \
    "8 infeasible, "                                                                                                   \
    "9 dismissed, 10 --timeout passed (the job goes on), 130 interrupted (the job goes on)."

const client_page CLIENT_PAGES[CLIENT_COMMANDS] = {
    [CLIENT_SUBMIT] =
        {"submit", "submit [FILE] [options]", "send a problem, and wait for its answer if told to", "FILE",
         CLIENT_OPERAND_ALLOWED,
         "FILE is a request in JSON, \"-\" is standard input. Prints the job's id, and with --wait its summary. A "
         "repeat after a lost connection never makes a second job.\n"
         "FILE may be a deck of Abaqus or CalculiX (.inp): the service makes a scene of it, and what is not in that as "
         "it was is told on stderr, line by line.\n"
         "FILE, or the file of --mesh, may be a part from CAD (.step, .stp, .iges, .igs, .brep), of which the program "
         "gmsh (Debian: gmsh) makes quadratic tetrahedra of the length --size, in mm. Its groups are face1, face2, "
         "..., "
         "which are listed on stderr with where they are, and body1, ...; materials, supports, loads and contacts come "
         "by --set, or are those of a scene in FILE.\n"
         "A problem in matrices needs no FILE: --K, --N, --h and --p name files in Matrix Market form, or of NumPy "
         "and SciPy (.npy, .npz). With FILE they replace its matrices. Files of more than 64 KiB, and compressed or "
         "binary ones, are uploaded, unless the "
         "service has them already.\n"
         "A PATH is the way to a value by keys and indices (from 0) with dots between them, such as "
         "problem.loads.1.traction.0; it may begin inside the problem: loads.1.traction.0.\n"
         "--vary of a value below loads (of a scene), p or h (of matrices) makes one job with a load case for each "
         "value, named by it. Of any other value it makes one job for each, with a common tag that is printed on "
         "stderr unless --tag gives one. Several --vary make every combination.\n",
         "with --wait: " OUTCOME_EXITS " Of several jobs the first that is not 0."},
    [CLIENT_IMPORT] =
        {"import", "import FILE [options]", "make a request of a deck of Abaqus or CalculiX", "FILE",
         CLIENT_OPERAND_NEEDED,
         "FILE is an .inp file, also packed. Writes the scene that submit would send for its first, static step: mesh, "
         "materials, supports, loads "
         "and contact pairs. Each line of the deck that has no place in it is told on stderr. What would change the "
         "answer is refused unless --leave-out is given.\n",
         NULL},
    [CLIENT_UPLOAD] =
        {"upload", "upload FILE [options]", "send a file that requests then name", "FILE", CLIENT_OPERAND_NEEDED,
         "FILE is a matrix or vector in Matrix Market form or of NumPy's, or a mesh, \"-\" is standard input; what "
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
    [CLIENT_RESULT] =
        {"result", "result ID [options]", "fetch the answer as JSON, a table, or a file for ParaView", "ID",
         CLIENT_OPERAND_NEEDED,
         "A table in CSV has a row for each node, or for each contact where the fields asked for are "
         "those of contacts (reactions, gaps, pressure, contact_status), or for each unknown of a "
         "problem in matrices; first its number and, of scenes, its coordinates. With --fields summary it has a "
         "row for each load case instead, with its numbers: of a path of loads the part of the load, "
         "displacement and forces.\n",
         NULL},
    [CLIENT_PATH] = {"path", "path ID --from P --to P [options]", "tabulate displacement and stress along a line", "ID",
                     CLIENT_OPERAND_NEEDED,
                     "A P is a point of the body before it was deformed, in the scene's coordinates: 0,20 or, of a "
                     "solid, 0,20,5. A row for each of equally spaced points: distance from the first, place, "
                     "displacement, stress, von Mises stress; nothing where a point is not in the body.\n",
                     NULL},
    [CLIENT_PICTURE] = {"picture", "picture ID [options]", "draw the deformed body of a scene as SVG", "ID",
                        CLIENT_OPERAND_NEEDED,
                        "A file that ends in .png gets a PNG, by way of rsvg-convert (Debian: librsvg2-bin).\n", NULL},
    [CLIENT_HISTORY] = {"history", "history ID [options]", "fetch or draw the convergence history", "ID",
                        CLIENT_OPERAND_NEEDED, "", NULL},
    [CLIENT_PLOT] = {"plot", "plot ID [options]", "draw the convergence, the body, a path or the price of accuracy",
                     "ID", CLIENT_OPERAND_NEEDED,
                     "Without --deformed, --error, --path or --trade the convergence is drawn: dual objective, "
                     "residual and certified bound. A file that ends in .png gets a PNG, by way of rsvg-convert "
                     "(Debian: librsvg2-bin); any other an SVG.\n",
                     NULL},
    [CLIENT_REPORT] = {"report", "report ID [options]", "write all that is known of an answer into one HTML file", "ID",
                       CLIENT_OPERAND_NEEDED,
                       "For the archive and for print: the verdict with the whole error, quantities, contacts, "
                       "assertions, warnings, pictures, and the request that it is the answer to. The file needs no "
                       "network and no other file. Of a job with load cases it tells of the worst, and lists all.\n",
                       NULL},
    [CLIENT_REQUEST] = {"request", "request ID [options]", "fetch the request that a job was made of", "ID",
                        CLIENT_OPERAND_NEEDED, "As it was sent, to be changed and submitted again.\n", NULL},
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
    [CLIENT_NODES] = {"nodes", "nodes", "list the daemons that share the service's jobs, and what they hold", NULL, 0,
                      "", NULL},
    [CLIENT_DOCTOR] = {"doctor", "doctor", "check the way to the service and the service itself", NULL, 0,
                       "Prints a line for each thing checked: ok, or what is wrong and what helps.\n",
                       "0 all is well, or only warnings; 4 the token is missing, wrong or allows too little; 5 the "
                       "service is not well; 12 it cannot be reached."},
    [CLIENT_MCP] = {"mcp", "mcp", "offer the service to a language model as tools", NULL, 0,
                    "Speaks the Model Context Protocol over standard input and output, for programs that start it with "
                    "the command line \"uzawa --server URL mcp\": submit_job, validate_request, wait_for_job, "
                    "get_result, get_picture. It ends with its input.\n",
                    NULL},
    [CLIENT_VERSION] = {"version", "version", "print the version", NULL, 0, "", NULL},
    [CLIENT_HELP] = {"help", "help [COMMAND]", "explain a command", "COMMAND", CLIENT_OPERAND_ALLOWED, "", NULL},
};

#define IN(command) CLIENT_IN(CLIENT_##command)
#define ASKING      (CLIENT_EVERYWHERE & ~IN(VERSION) & ~IN(HELP)) /* commands that talk to the server */
#define MAKING      (IN(SUBMIT) | IN(REFINE))                      /* commands that make a job */
#define STAYING     (MAKING | IN(VERIFY) | IN(WAIT))
#define OF_A_CASE   (IN(PATH) | IN(PICTURE) | IN(HISTORY) | IN(PLOT))
#define FILES       (IN(IMPORT) | IN(RESULT) | OF_A_CASE | IN(REPORT) | IN(REQUEST)) /* whose output may go to a file */

#define OPTION(NAME, LETTER, KIND, MEMBER, COMMANDS, ...)                                                              \
    {                                                                                                                  \
        .name = NAME, .letter = LETTER, .kind = UZ_OPTION_##KIND, .offset = offsetof(client_options, MEMBER),          \
        .places = COMMANDS, __VA_ARGS__                                                                                \
    }
static const uz_option OPTIONS[] = {
    OPTION("K", 0, WORD, K, IN(SUBMIT), .value = "FILE", .about = "the stiffness matrix: .mtx, .npy or .npz"),
    OPTION("N", 0, WORD, N, IN(SUBMIT), .value = "FILE", .about = "the contact normals, a row for each contact"),
    OPTION("h", 0, WORD, h, IN(SUBMIT), .value = "FILE", .about = "the initial gaps"),
    OPTION("p", 0, WORD, p, IN(SUBMIT), .value = "FILE", .about = "the load"),
    OPTION("mesh", 0, WORD, mesh, IN(SUBMIT), .value = "FILE",
           .about = "a mesh file (Gmsh, Abaqus, CalculiX, NASTRAN, VTK) or a part from CAD (STEP, IGES, BREP) in place "
                    "of the scene's mesh"),
    OPTION("size", 0, NUMBER, size, IN(SUBMIT), .value = "H", .unit = "mm",
           .about = "of a part from CAD: the length of its elements, in mm"),
    OPTION("surface", 0, WORD, surface, IN(SUBMIT), .value = "FILE",
           .about = "an STL or OBJ file for each obstacle {\"surface\": {}} of the scene that names no file itself"),
    OPTION("leave-out", 0, FLAG, leave_out, IN(SUBMIT) | IN(IMPORT),
           .about = "of a deck, leave out what a scene has no words for, although the answer is another one with it"),
    OPTION("set", 0, WORDS, set, IN(SUBMIT), .most = CLIENT_MAX_WORDS, .value = "PATH=VALUE",
           .about = "put VALUE, as JSON or else as a string, at PATH of the request; may be repeated"),
    OPTION("vary", 0, WORDS, vary, IN(SUBMIT), .most = 8, .value = "PATH=VALUES",
           .about =
               "solve for each of VALUES at PATH: FIRST:LAST:COUNT in equal steps, or a list A,B,C; may be repeated"),
    OPTION("accuracy", 'a', WORD, accuracy, IN(REFINE), .value = "A", .choices = "quick balanced precise exact",
           .about = "a relative error such as 1e-8, or quick, balanced, precise, exact"),
    OPTION("max-iterations", 0, INTEGER, max_iterations, IN(REFINE), .most = 1000000000, .value = "N",
           .about = "counted from the start of the first run"),
    OPTION("time-limit", 0, NUMBER, time_limit_s, IN(REFINE), .value = "S", .unit = "seconds",
           .about = "of the new run, in seconds"),
    OPTION("validate", 0, FLAG, validate, IN(SUBMIT),
           .about = "only check the request: tell all mistakes, or what it will take; nothing is solved"),
    OPTION("wait", 'w', FLAG, wait, MAKING, .about = "wait until the job has ended and print the summary"),
    OPTION("timeout", 't', NUMBER, timeout_s, MAKING, .value = "S", .unit = "seconds",
           .about = "with --wait: stop waiting after S seconds"),
    OPTION("timeout", 't', NUMBER, timeout_s, STAYING, .value = "S", .unit = "seconds",
           .about = "stop waiting after S seconds"),
    OPTION("tag", 0, WORDS, tags, IN(SUBMIT), .most = CLIENT_MAX_TAGS, .value = "WORD",
           .about = "label the job; may be repeated"),
    OPTION("name", 0, WORD, name, IN(SUBMIT), .value = "NAME", .about = "what to call the job in lists"),
    OPTION("key", 'k', WORD, key, IN(SUBMIT), .value = "KEY",
           .about = "idempotency key (default: random); the same key and request give the same job"),
    OPTION("key", 'k', WORD, key, STAYING & ~IN(WAIT), .value = "KEY", .about = "idempotency key (default: random)"),
    OPTION("format", 'f', CHOICE, format, IN(RESULT), .value = "F", .choices = "json table csv npz vtu pvd",
           .about = "json (default), table: with five digits, csv: with all, npz: arrays for NumPy; scenes only: vtu, "
                    "or pvd: a vtu of each load "
                    "case, as one series"),
    OPTION("format", 'f', CHOICE, format, IN(PATH), .value = "F", .choices = "table csv json",
           .about = "table (default) with five digits, csv or json with all"),
    OPTION("format", 'f', CHOICE, format, IN(LIST), .value = "F", .choices = "table csv json",
           .about = "table (default), csv with whole names, or json with all that is known"),
    OPTION("from", 0, WORD, from, IN(PATH), .value = "P", .about = "the first point, such as 0,20"),
    OPTION("to", 0, WORD, to, IN(PATH), .value = "P", .about = "the last point"),
    OPTION("count", 'n', INTEGER, count, IN(PATH), .least = 2, .most = 10000, .value = "N",
           .about = "how many points, both ends among them (default 101)"),
    OPTION("format", 'f', CHOICE, format, IN(HELP), .value = "F", .choices = "text man bash zsh fish json",
           .about =
               "text (default); of all commands together: man, a manual page, bash, zsh, fish, a completion, or json"),
    OPTION("fields", 0, WORDS, fields, IN(RESULT), .most = CLIENT_MAX_WORDS, .value = "A,B",
           .choices = "summary nodes reactions gaps pressure displacements contact_status stress principal von_mises "
                      "strain stress_gauss",
           .about = "such as displacements, reactions, gaps, pressure, stress, von_mises (default: reactions,gaps; of "
                    "vtu: everything useful)"),
    OPTION("field", 0, WORDS, fields, IN(RESULT), .most = CLIENT_MAX_WORDS, .value = "NAME",
           .choices = "summary nodes reactions gaps pressure displacements contact_status stress principal von_mises "
                      "strain stress_gauss",
           .about = "one of them; may be repeated"),
    OPTION("junit", 0, WORD, junit, STAYING, .value = "FILE",
           .about = "write a JUnit report: whether the job converged, each assertion, each comparison"),
    OPTION("baseline", 0, WORD, baseline, STAYING, .value = "ID",
           .about = "compare with another job: energy, reactions, pressure, displacements and what touches"),
    OPTION("tolerance", 0, NUMBER, tolerance, STAYING, .value = "T",
           .about = "what the comparison lets pass, relative (default 1e-3)"),
    OPTION("deformed", 0, FLAG, deformed, IN(PLOT), .about = "draw the deformed body of a scene"),
    OPTION("error", 0, FLAG, whole_error, IN(PLOT),
           .about = "draw the whole error over time and, where the mesh was chosen, over unknowns"),
    OPTION("trade", 0, FLAG, trade, IN(PLOT),
           .about = "print what each certified digit took, as a table and a drawing"),
    OPTION("path", 0, FLAG, along_path, IN(PLOT),
           .about = "draw, in the terminal, force over displacement along the load cases of large deformation"),
    OPTION("x", 0, CHOICE, axis, IN(PLOT), .value = "AXIS", .choices = "iterations seconds",
           .about = "of the convergence: over iterations (default) or seconds"),
    OPTION("with", 0, WORDS, with, IN(PLOT), .most = 8, .value = "ID",
           .about = "draw another job's convergence beside it; may be repeated"),
    OPTION("colour", 0, WORD, colour, IN(PICTURE), .value = "C", .choices = "von_mises displacements pressure",
           .about = "von_mises (default), displacements or pressure"),
    OPTION("factor", 0, WORD, factor, IN(PICTURE), .value = "X",
           .about = "displacements are drawn X times as large (default: so that they show)"),
    OPTION("view", 0, WORD, view, IN(PICTURE) | IN(PLOT), .value = "V",
           .choices = "corner below front back left right top bottom",
           .about = "of a solid: corner (default), below, front, back, left, right, top or bottom"),
    OPTION("up", 0, WORD, up, IN(PICTURE) | IN(PLOT), .value = "AXIS", .choices = "y z",
           .about = "of a solid: what points upwards, y (default) or z"),
    OPTION("width", 0, INTEGER, width, IN(PICTURE), .least = 200, .most = 4000, .value = "N",
           .about = "of the picture, in pixels (default 900)"),
    OPTION("colour", 0, WORD, colour, IN(PLOT), .value = "C", .choices = "von_mises displacements pressure",
           .about = "with --deformed: von_mises (default), displacements or pressure"),
    OPTION("factor", 0, WORD, factor, IN(PLOT), .value = "X",
           .about = "with --deformed: displacements are drawn X times as large"),
    OPTION("width", 0, INTEGER, width, IN(PLOT), .least = 40, .most = 4000, .value = "N",
           .about = "with --deformed and --error: of the picture, in pixels; with --path and --trade: of the "
                    "drawing, in characters"),
    OPTION("csv", 0, FLAG, csv, IN(HISTORY), .about = "as CSV instead of JSON"),
    OPTION("plot", 0, FLAG, plot, IN(HISTORY), .about = "draw it: log10 of the error bound and of the residual"),
    OPTION("width", 0, INTEGER, width, IN(HISTORY), .least = 24, .most = 400, .value = "N",
           .about = "of the drawing, in characters (default 72, less on a narrow terminal)"),
    OPTION("height", 0, INTEGER, height, IN(HISTORY), .least = 8, .most = 200, .value = "N",
           .about = "of the drawing, in lines (default 20)"),
    OPTION("ascii", 0, FLAG, ascii, IN(HISTORY) | IN(PLOT),
           .about = "draw in plain ASCII (default where the locale is not UTF-8)"),
    OPTION("case", 'c', WORD, case_name, IN(RESULT), .value = "NAME", .about = "of this load case alone"),
    OPTION("case", 'c', WORD, case_name, IN(REPORT), .value = "NAME",
           .about = "of this load case (default: the worst)"),
    OPTION("case", 'c', WORD, case_name, OF_A_CASE, .value = "NAME",
           .about = "of this load case; needed where the job has some"),
    OPTION("output", 'o', WORD, output, FILES, .value = "FILE", .about = "write to FILE, whole or not at all"),
    OPTION("status", 0, WORD, status, IN(LIST), .value = "S", .choices = "accepted running successful failed dismissed",
           .about = "accepted, running, successful, failed or dismissed"),
    OPTION("tag", 0, WORDS, tags, IN(LIST), .most = CLIENT_MAX_TAGS, .value = "WORD",
           .about = "only jobs with this tag"),
    OPTION("name", 0, WORD, name, IN(LIST), .value = "NAME", .about = "only jobs that are called so"),
    OPTION("limit", 'n', INTEGER, limit, IN(LIST), .least = 1, .most = 1000000, .value = "N",
           .about = "at most N jobs (default 20)"),
    OPTION("progress", 0, FLAG, progress, STAYING, .about = "show progress on stderr even where it is no terminal"),
    OPTION("quiet", 'q', FLAG, quiet, MAKING, .about = "print the id and nothing else"),
    OPTION("quiet", 'q', FLAG, quiet, IN(IMPORT), .about = "tell nothing of what is not in the request"),
    OPTION("quiet", 'q', FLAG, quiet, IN(LIST), .about = "print the ids and nothing else"),
    OPTION("quiet", 'q', FLAG, quiet, IN(DOCTOR), .about = "print only what is wrong"),
    OPTION("quiet", 'q', FLAG, quiet, IN(VERIFY) | IN(WAIT) | IN(CANCEL) | IN(DELETE),
           .about = "print nothing; the exit status tells"),
    OPTION("json", 'j', FLAG, json, IN(SUBMIT) | IN(REFINE) | IN(VERIFY) | IN(WAIT) | IN(STATUS),
           .about = "print the job as JSON, and what is wrong too"),
    OPTION("json", 'j', FLAG, json, IN(PICTURE) | IN(REPORT) | IN(REQUEST),
           .about = "with --output: print what was written as JSON"),
    OPTION("json", 'j', FLAG, json, IN(PLOT),
           .about = "with --output: print what was written as JSON; with --path and --trade: print the numbers"),
    OPTION("json", 'j', FLAG, json, CLIENT_EVERYWHERE, .about = "print JSON, and what is wrong as JSON too"),
    OPTION("context", 0, WORD, context, ASKING, .value = "NAME",
           .about =
               "the service that ~/.config/uzawa/config has under this name, with its token (default: $UZAWA_CONTEXT, "
               "else what the file says; $UZAWA_SERVER and --server come before that)"),
    OPTION("server", 's', WORD, server, ASKING, .value = "URL",
           .about = "the service (default: $UZAWA_SERVER, else http://127.0.0.1:8080); $UZAWA_TOKEN is sent as the "
                    "token; $UZAWA_CA is a file of certificates to trust"),
    OPTION("timeout", 't', NUMBER, timeout_s, ASKING, .value = "S", .unit = "seconds",
           .about = "give up after S seconds; for wait and --wait: stop waiting"),
    OPTION("retry", 0, NUMBER, retry_s, ASKING, .value = "S", .unit = "seconds",
           .about = "keep trying to reach the server for S seconds (default 3; 30 while waiting)"),
    OPTION("help", 'h', FLAG, help, CLIENT_EVERYWHERE, .about = "explain the command"),
    OPTION("version", 'V', FLAG, version, CLIENT_EVERYWHERE, .about = "print the version"),
};

const client_exit_line CLIENT_EXITS[] = {
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
    {0, NULL},
};

const uz_option_table CLIENT_OPTIONS = {OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

bool client_option_is_own(const uz_option *option, client_command command)
{
    const bool general = option->places == ASKING || (option->places == CLIENT_EVERYWHERE && option->letter != 'j');
    if (command == CLIENT_COMMANDS || !(option->places & CLIENT_IN(command)))
        return command == CLIENT_COMMANDS && general;
    for (const uz_option *before = OPTIONS; before != option; before++)
        if (strcmp(before->name, option->name) == 0 && before->places & CLIENT_IN(command))
            return false;
    return true;
}

bool client_command_find(client_command *out, const char *name)
{
    for (int i = 0; i < CLIENT_COMMANDS; i++) {
        if (strcmp(CLIENT_PAGES[i].name, name) != 0)
            continue;
        *out = (client_command)i;
        return true;
    }
    return false;
}
