/* encode_trade.c: what accuracy took: /v1/jobs/{id}/work-precision. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>

enum { DECADES = 10 };

/* What a relative error took; level NULL: none has it as its aim. seconds: when the bound was established, or what the
 * whole solve would have taken. */
static void put_reached(text *t, const char *level, double relative_error, const uz_trade *trade)
{
    const uz_trade_step *step = isfinite(relative_error) ? uz_trade_reach(trade, relative_error) : NULL;
    text_open(t, NULL, '{');
    if (level)
        text_string(t, "level", level);
    text_number(t, "relative_error", relative_error);
    text_number(t, "seconds", !step ? (double)NAN : level ? uz_trade_cost(trade, step) : step->seconds);
    if (step) {
        text_integer(t, "iterations", step->iterations);
        text_integer(t, "applications", step->applications);
    } else {
        text_raw(t, "iterations", NULL);
        text_raw(t, "applications", NULL);
    }
    text_string(t, "by", !step ? NULL : step->by_certificate ? "certificate" : "iteration");
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
    for (int k = 0; k < DECADES; k++)
        put_reached(&t, NULL, DECADE[k], trade);
    text_close(&t, ']');
    text_open(&t, "levels", '[');
    put_reached(&t, "quick", 1e-2, trade);
    put_reached(&t, "balanced", of->mesh_error > 0.0 ? fmin(1.0, 0.1 * of->mesh_error) : (double)NAN, trade);
    put_reached(&t, "precise", 1e-8, trade);
    put_reached(&t, "exact", 1e-12, trade);
    text_close(&t, ']');
    text_number(&t, "iterated_s", trade->iterated_s);
    text_number(&t, "total_s", trade->total_s);
    text_number(&t, "solver_error", of->solver_error);
    text_number(&t, "mesh_error", of->mesh_error);
    text_close(&t, '}');
    return text_finish(&t, len);
}
