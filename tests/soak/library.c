/* library.c: what the library takes for the problem of a request, for comparison with the daemon.
 *
 * usage: library BODY_FILE [FOLDER]
 * With FOLDER the scene's matrices are written there as K.mtx, N.mtx, h.mtx and p.mtx. Then each line of standard input
 * asks for one solve, nothing cached: "scene" or "matrices"; each is answered by a line with its seconds. */
#include "codec/codec.h"
#include "core/clock.h"
#include "mm_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char *read_file(const char *path, size_t *len)
{
    enum { MOST = 1 << 20 };
    FILE *file = fopen(path, "rb");
    char *text = file ? malloc(MOST) : NULL;
    *len = text ? fread(text, 1, MOST, file) : 0;
    if (file)
        fclose(file);
    return text;
}

static bool write_matrices(const uz_qp *qp, const char *folder)
{
    static const char *const NAME[4] = {"K", "N", "h", "p"};
    bool ok = true;
    for (int k = 0; k < 4; k++) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s.mtx", folder, NAME[k]);
        FILE *file = fopen(path, "wb");
        if (file && k < 2)
            mm_put_matrix(file, k == 0 ? &qp->K : &qp->N, k == 0 ? UZ_MM_SYMMETRIC : UZ_MM_GENERAL);
        else if (file)
            mm_put_vector(file, k == 2 ? qp->h : qp->p, k == 2 ? qp->N.rows : qp->K.rows);
        ok = file && !ferror(file) && ok;
        ok = file && fclose(file) == 0 && ok;
    }
    return ok;
}

static bool solve(const uz_problem *problem, const uz_settings *settings)
{
    uz_result **results = NULL;
    double start = uz_seconds();
    uz_status status = uz_solve_cases(&results, problem, settings, NULL, NULL, NULL, NULL);
    double seconds = uz_seconds() - start;
    bool ok = status == UZ_OK && results[0]->summary.outcome == UZ_CONVERGED;
    uz_results_free(results, status == UZ_OK ? 1 : 0);
    printf("%.9f\n", ok ? seconds : -1.0);
    fflush(stdout);
    return ok;
}

int main(int argc, char **argv)
{
    codec_request request = {0};
    problem_details why = {0};
    uz_problem matrices = {.kind = UZ_PROBLEM_MATRICES};
    uz_mesh_info info = {0};
    char line[32];
    size_t len = 0;
    char *body = argc > 1 ? read_file(argv[1], &len) : NULL;
    bool ok = body && codec_init(NULL, line, sizeof line) &&
              codec_decode(&request, CODEC_SOLVE, body, len, NULL, &why) && request.problem.kind == UZ_PROBLEM_SCENE &&
              uz_scene_to_qp(&matrices.qp, &info, &request.problem.scene, NULL) == UZ_OK &&
              (argc < 3 || write_matrices(&matrices.qp, argv[2]));
    while (ok && fgets(line, sizeof line, stdin))
        ok = solve(strncmp(line, "scene", 5) == 0 ? &request.problem : &matrices, &request.settings);
    if (!ok)
        fprintf(stderr, "library: no answer for %s %s\n", argc > 1 ? argv[1] : "no file", why.detail);
    uz_mesh_info_clear(&info);
    uz_qp_clear(&matrices.qp);
    codec_request_clear(&request);
    codec_end();
    free(body);
    return ok ? 0 : 1;
}
