/* decks.c: POST /v1/decks: a deck of another program as a request of this one. Nothing is stored. */
#include "codec/codec.h"
#include "http/api.h"

void decks_translate(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    codec_deck deck;
    upload_info info;
    bool good = codec_decode_deck(&deck, rq->body ? rq->body : "", rq->body_len, context->store, &problem);
    if (deck.upload[0] && store_upload_get(context->store, deck.upload, api_sees(rq), &info) == STORE_NOT_FOUND)
        good = problem_fill(&problem, 422, "unknown_upload", "An upload is not there",
                            "%.64s names no upload of yours on this server: send the text to POST /v1/uploads first",
                            deck.upload);
    if (good)
        reply_json(reply, 200, codec_encode_deck(&deck));
    else
        reply_problem(reply, &problem);
    codec_deck_clear(&deck);
}
