/* cad.c: a part from a CAD program, of which gmsh makes a mesh: a program of its own, within limits of time and memory.
 */
#include "request/build.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* What gmsh may take. A mesh of some million nodes is made in a tenth of that. */
#define MOST_SECONDS 600
#define MOST_BYTES   ((rlim_t)8 << 30)

#define SCRIPT "mesh.geo"
#define MESH   "part.msh"
#define TOLD   "gmsh.txt"

/* The ending by which gmsh knows the format; NULL: none of a part. */
static const char *ending_of(const char *path)
{
    static const char *const ENDINGS[] = {".step", ".stp", ".iges", ".igs", ".brep"};
    for (size_t i = 0; path && i < sizeof ENDINGS / sizeof *ENDINGS; i++)
        if (client_ends_in(path, ENDINGS[i], false))
            return ENDINGS[i];
    return NULL;
}

bool client_is_cad(const char *path)
{
    return ending_of(path) != NULL;
}

/* ---- the folder that gmsh works in: the part, under a name without anything to quote, and the script */

/* Quadratic tetrahedra with their middle nodes on the part's faces, twelve around a circle at least, and a group for
 * each face and each body. Lengths are in millimetres, whatever unit the file has. */
static const char SCRIPT_TEXT[] =
    "SetFactory(\"OpenCASCADE\");\n"
    "Geometry.OCCTargetUnit = \"MM\";\n"
    "v() = ShapeFromFile(\"part%s\");\n"
    "f() = Surface{:};\n"
    "For i In {0:#f()-1}\n"
    "  Physical Surface(Sprintf(\"face%%g\", i + 1)) = {f(i)};\n"
    "  b() = BoundingBox Surface{f(i)};\n"
    "  Printf(\"face%%g: %%g %%g %%g %%g %%g %%g\", i + 1, b(0), b(3), b(1), b(4), b(2), b(5));\n"
    "EndFor\n"
    "v() = Volume{:};\n"
    "For i In {0:#v()-1}\n"
    "  Physical Volume(Sprintf(\"body%%g\", i + 1)) = {v(i)};\n"
    "EndFor\n"
    "Mesh.CharacteristicLengthMax = %.17g;\n"
    "Mesh.CharacteristicLengthFromCurvature = 1;\n"
    "Mesh.MinimumElementsPerTwoPi = 12;\n"
    "Mesh.ElementOrder = 2;\n"
    "Mesh.HighOrderOptimize = 1;\n";

static bool fill_folder(const char *folder, const char *path, double size)
{
    char name[PATH_MAX], *whole = realpath(path, NULL);
    const char *ending = ending_of(path);
    snprintf(name, sizeof name, "%s/part%s", folder, ending);
    bool ok = whole && symlink(whole, name) == 0;
    free(whole);
    snprintf(name, sizeof name, "%s/" SCRIPT, folder);
    FILE *script = ok ? fopen(name, "w") : NULL;
    if (!script)
        return false;
    ok = fprintf(script, SCRIPT_TEXT, ending, size) > 0;
    return fclose(script) == 0 && ok;
}

static void remove_folder(const char *folder, const char *path)
{
    const char *const names[] = {SCRIPT, MESH, TOLD};
    char name[PATH_MAX];
    snprintf(name, sizeof name, "%s/part%s", folder, ending_of(path));
    unlink(name);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(name, sizeof name, "%s/%s", folder, names[i]);
        unlink(name);
    }
    rmdir(folder);
}

/* ---- gmsh */

/* In the child: what it says goes into a file, and it has nothing to read. */
static _Noreturn void become_gmsh(const char *folder)
{
    const struct rlimit time = {MOST_SECONDS, MOST_SECONDS}, memory = {MOST_BYTES, MOST_BYTES}, none = {0, 0};
    const int in = open("/dev/null", O_RDONLY);
    const int out = chdir(folder) == 0 ? open(TOLD, O_WRONLY | O_CREAT | O_EXCL, 0600) : -1;
    setrlimit(RLIMIT_CPU, &time);
    setrlimit(RLIMIT_AS, &memory);
    setrlimit(RLIMIT_CORE, &none);
    if (in >= 0 && out >= 0 && dup2(in, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0 &&
        dup2(out, STDERR_FILENO) >= 0)
        execlp("gmsh", "gmsh", "-3", "-v", "3", "-format", "msh41", "-o", MESH, SCRIPT, (char *)NULL);
    _exit(127);
}

/* How it ended, as waitpid tells; -1: there was no process. */
static int run_gmsh(const char *folder)
{
    int status = -1;
    fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0)
        become_gmsh(folder);
    while (pid > 0 && waitpid(pid, &status, 0) < 0)
        if (errno != EINTR)
            return -1;
    return status;
}

/* ---- what it said */

/* "face1: ..." as the space that the face takes; gmsh adds a little to it on each side. */
static void tell_face(client_session *s, const char *line, double size)
{
    double x[6];
    int number;
    const double grain = 1e-5 * size;
    if (sscanf(line, "face%d: %lf %lf %lf %lf %lf %lf", &number, x, x + 1, x + 2, x + 3, x + 4, x + 5) != 7)
        return;
    fprintf(s->err, "uzawa: face%d:", number);
    for (int c = 0; c < 3; c++) {
        const double low = round(x[2 * c] / grain) * grain + 0.0, high = round(x[2 * c + 1] / grain) * grain + 0.0;
        if (high - low < 2 * grain)
            fprintf(s->err, "%s %c %.5g", c ? "," : "", 'x' + c, low);
        else
            fprintf(s->err, "%s %c %.5g to %.5g", c ? "," : "", 'x' + c, low, high);
    }
    fputc('\n', s->err);
}

/* The first error that gmsh names, "" where there is none; or tells of each face. */
static void read_said(client_session *s, char *error, size_t room, const char *folder, double size)
{
    char name[PATH_MAX], line[400];
    snprintf(name, sizeof name, "%s/" TOLD, folder);
    FILE *file = fopen(name, "r");
    while (file && fgets(line, sizeof line, file)) {
        const char *said = strstr(line, "Error   : ");
        line[strcspn(line, "\n")] = '\0';
        if (!error)
            tell_face(s, line, size);
        else if (said && !*error)
            snprintf(error, room, "%s", said + strlen("Error   : "));
    }
    if (file)
        fclose(file);
}

static client_exit tell_failure(client_session *s, const char *path, int status, const char *error)
{
    char message[900];
    const int end = status != -1 && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (status != -1 && WIFEXITED(status) && WEXITSTATUS(status) == 127)
        snprintf(message, sizeof message,
                 "a part from CAD wants the program gmsh (Debian: gmsh), which makes a mesh of it; a mesh file needs "
                 "nothing");
    else if (end == SIGXCPU || end == SIGKILL)
        snprintf(message, sizeof message,
                 "gmsh took more than %d s of processor time for %.200s: give a larger --size, or a mesh file",
                 MOST_SECONDS, path);
    else if (end)
        snprintf(message, sizeof message,
                 "gmsh broke down over %.200s, perhaps for want of memory, of which it gets %d GiB: give a larger "
                 "--size, or a mesh file",
                 path, (int)(MOST_BYTES >> 30));
    else
        snprintf(message, sizeof message, "gmsh made no mesh of %.200s: %.400s", path,
                 *error ? error : "it has no solid body");
    return client_complain(s, CLIENT_LOCAL, message);
}

client_exit client_put_cad(client_session *s, json_t *mesh, const char *path)
{
    const char *room = getenv("TMPDIR");
    const double size = s->options->size;
    char folder[512], made[PATH_MAX], error[400], message[512];
    if (access(path, R_OK) != 0) {
        snprintf(message, sizeof message, "cannot read %.400s: %s", path, strerror(errno));
        return client_complain(s, CLIENT_LOCAL, message);
    }
    snprintf(folder, sizeof folder, "%.480s/uzawa-XXXXXX", room && *room ? room : "/tmp");
    if (!mkdtemp(folder))
        return client_complain(s, CLIENT_LOCAL, "cannot make a temporary folder for gmsh");
    client_exit code = CLIENT_LOCAL;
    if (fill_folder(folder, path, size)) {
        const int status = run_gmsh(folder);
        *error = '\0';
        read_said(s, error, sizeof error, folder, size);
        snprintf(made, sizeof made, "%s/" MESH, folder);
        const bool good = status != -1 && WIFEXITED(status) && WEXITSTATUS(status) == 0 && !*error;
        if (good && access(made, R_OK) == 0) {
            if (!s->options->quiet)
                read_said(s, NULL, 0, folder, size);
            code = client_put_file(s, mesh, "gmsh", made);
        } else {
            code = tell_failure(s, path, status, error);
        }
    } else {
        client_complain(s, code, "cannot write into the temporary folder for gmsh");
    }
    remove_folder(folder, path);
    return code;
}
