/* uzawa_trade.h: what accuracy took. Part of uzawa.h. */
#ifndef UZAWA_TRADE_H
#define UZAWA_TRADE_H

#include "uzawa_base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What accuracy took: when the run first established a bound on the relative error of uz_trade_error(k) or less. The
 * bounds are those that the run makes anyway: between iterations, which the certificate at the end confirms or takes
 * back, and by that certificate itself. */
enum { UZ_TRADE_PER_DECADE = 4, UZ_TRADE_STEPS = 48 };
typedef struct {
    double seconds;                   /* since the solve began; NaN: never established */
    int64_t iterations, applications; /* up to then: iterations or active set steps; products with N K^-1 N' */
    bool by_certificate;              /* the answer had been computed by then */
} uz_trade_step;
typedef struct {
    uz_trade_step step[UZ_TRADE_STEPS];
    double iterated_s; /* when the last iteration ended */
    double total_s;    /* answer, certificate and outputs with it; without waiting and parsing */
} uz_trade;
void uz_trade_clear(uz_trade *trade); /* nothing was established */
double uz_trade_error(int step);      /* 10^(-(step + 1) / UZ_TRADE_PER_DECADE) */
/* The first step that is known to meet relative_error; NULL: none was reached. It may be up to a quarter of a decade
 * better than asked for. */
const uz_trade_step *uz_trade_reach(const uz_trade *trade, double relative_error);
/* Seconds of the whole solve if it had ended there: what follows the iterations is spent all the same. */
double uz_trade_cost(const uz_trade *trade, const uz_trade_step *step);

#ifdef __cplusplus
}
#endif

#endif
