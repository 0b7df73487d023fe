/* The whole way of a request body. Whatever comes, the answer is a request or a problem that can be sent. */
#include "codec/codec.h"
#include "codec/json.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    char message[256];
    (void)argc;
    (void)argv;
    if (codec_init(NULL, message, sizeof message))
        return 0;
    fprintf(stderr, "fuzz_request: %s\n", message);
    abort();
}

/* The problem document is JSON, whatever bytes of the request it quotes. */
static void check_problem(const problem_details *problem)
{
    json_tree doc;
    problem_details again;
    char *text = codec_encode_problem(problem);
    if (!text || problem->status < 400 || !problem->code[0] || !problem->detail[0] ||
        !json_scan(&doc, text, strlen(text), &again))
        abort();
    json_clear(&doc);
    free(text);
}

/* A request made of a valid one is valid, has the same problem and tags, and goes on where the other stopped. */
static void check_refined(const char *body, size_t size, const codec_request *old)
{
    static const char ID[] = "0123456789abcdef0123456789abcdef", CHANGE[] = "{\"accuracy\": \"quick\"}";
    codec_request request;
    problem_details problem = {0};
    size_t len;
    char *made = codec_refine(body, size, ID, CHANGE, sizeof CHANGE - 1, &len, &problem);
    if (!made || !codec_same_problem(body, size, made, len) ||
        !codec_decode(&request, CODEC_SOLVE, made, len, NULL, &problem))
        abort();
    if (!request.start.continued || strcmp(request.start.job, ID) != 0 || strcmp(request.tags, old->tags) != 0 ||
        request.settings.relative_error != 1e-2 || request.settings.method != old->settings.method ||
        request.problem.n_cases != old->problem.n_cases)
        abort();
    codec_request_clear(&request);
    free(made);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *body = (const char *)data;
    codec_request request;
    problem_details problem;
    size_t answer_len;
    if (!codec_decode(&request, CODEC_STORED, body, size, NULL, &problem)) {
        check_problem(&problem);
        return 0;
    }
    if (!request.tags || (request.problem.kind == UZ_PROBLEM_MATRICES && !request.problem.qp.p) ||
        (json_member_text(body, size, "answer", &answer_len) != NULL) != (request.answer.u != NULL))
        abort();
    const bool solves = !request.answer.u;
    codec_request_clear(&request);
    if (!solves)
        return 0;
    /* A new one is looked at more closely than what is stored already. */
    if (!codec_decode(&request, CODEC_SOLVE, body, size, NULL, &problem)) {
        check_problem(&problem);
        return 0;
    }
    check_refined(body, size, &request);
    codec_request_clear(&request);
    return 0;
}
