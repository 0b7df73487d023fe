/* encode_trade.h: the part of a summary that encode_trade.c writes. */
#ifndef SERVER_CODEC_ENCODE_TRADE_H
#define SERVER_CODEC_ENCODE_TRADE_H

#include "codec/text.h"
#include "uzawa.h"

/* The object, or null where nothing is suggested. */
void put_suggestion(text *t, const uz_suggestion *s);

#endif
