/* The whole way of a request body. Whatever comes, the answer is a request or a problem that can be sent. */
#include "codec/codec.h"
#include "codec/json_doc.h"

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
    if (codec_init(message, sizeof message))
        return 0;
    fprintf(stderr, "fuzz_request: %s\n", message);
    abort();
}

/* The problem document is JSON, whatever bytes of the request it quotes. */
static void check_problem(const problem_details *problem)
{
    json_doc doc;
    problem_details again;
    char *text = codec_encode_problem(problem);
    if (!text || problem->status < 400 || !problem->code[0] || !problem->detail[0] ||
        !json_scan(&doc, text, strlen(text), &again))
        abort();
    json_doc_clear(&doc);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    codec_request request;
    problem_details problem;
    if (!codec_decode_request(&request, (const char *)data, size, &problem))
        check_problem(&problem);
    else if (!request.tags || (request.problem.kind == UZ_PROBLEM_MATRICES && !request.problem.qp.p))
        abort();
    else
        codec_request_clear(&request);
    return 0;
}
