/* encode_trade.c: what accuracy took: /v1/jobs/{id}/work-precision. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>

enum { DECADES = 10 };

static void put_count(text *t, const char *key, const int64_t *value)
{
    text_key(t, key);
    if (value)
        text_integer(t, NULL, *value);
    else
        text_raw(t, NULL, NULL);
}

/* seconds: when the bound was established, or what the whole solve would have taken. step NULL: it never was. */
static void put_step(text *t, double seconds, const uz_trade_step *step)
{
    text_number(t, "seconds", seconds);
    put_count(t, "iterations", step ? &step->iterations : NULL);
    put_count(t, "applications", step ? &step->applications : NULL);
    text_string(t, "by", !step ? NULL : step->by_certificate ? "certificate" : "iteration");
}

static void put_level(text *t, const char *name, double relative_error, const uz_trade *trade)
{
    const uz_trade_step *step = isfinite(relative_error) ? uz_trade_reach(trade, relative_error) : NULL;
    text_open(t, NULL, '{');
    text_string(t, "level", name);
    text_number(t, "relative_error", relative_error);
    put_step(t, step ? uz_trade_cost(trade, step) : NAN, step);
    text_close(t, '}');
}

char *codec_encode_trade(const codec_trade *of, size_t *len)
{
    text t = {0};
    const uz_trade *trade = &of->trade;
    static const double DECADE[DECADES] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
    text_open(&t, NULL, '{');
    text_string(&t, "job", of->job_id);
    if (of->case_name)
        text_string(&t, "case", of->case_name);
    text_open(&t, "decades", '[');
    for (int k = 0; k < DECADES; k++) {
        const uz_trade_step *step = uz_trade_reach(trade, DECADE[k]);
        text_open(&t, NULL, '{');
        text_number(&t, "relative_error", DECADE[k]);
        put_step(&t, step ? step->seconds : (double)NAN, step);
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_open(&t, "levels", '[');
    put_level(&t, "quick", 1e-2, trade);
    put_level(&t, "balanced", of->mesh_error > 0.0 ? fmin(1.0, 0.1 * of->mesh_error) : (double)NAN, trade);
    put_level(&t, "precise", 1e-8, trade);
    put_level(&t, "exact", 1e-12, trade);
    text_close(&t, ']');
    text_number(&t, "iterated_s", trade->iterated_s);
    text_number(&t, "total_s", trade->total_s);
    text_number(&t, "solver_error", of->solver_error);
    text_number(&t, "mesh_error", of->mesh_error);
    text_close(&t, '}');
    return text_finish(&t, len);
}
