/* trade.h: what accuracy took, as one vector of the store. */
#ifndef SERVER_WORK_TRADE_H
#define SERVER_WORK_TRADE_H

#include "uzawa.h"

/* The name of the vector in the store. */
#define TRADE_VECTOR "work_precision"

/* Steps that were reached at the same moment are kept once. */
enum { TRADE_HEAD = 4, TRADE_COLUMNS = 5, TRADE_NUMBERS = TRADE_HEAD + TRADE_COLUMNS * UZ_TRADE_STEPS };
/* Fills out and returns how many numbers. */
int64_t trade_pack(double out[TRADE_NUMBERS], const uz_trade *trade);
/* False: damaged, or written by another version; *out then has nothing. */
bool trade_unpack(uz_trade *out, const double *x, int64_t count);

/* A run that continued another: what that one had reached stands, and its time went before. */
void trade_join(uz_trade *later, const uz_trade *earlier);

#endif
