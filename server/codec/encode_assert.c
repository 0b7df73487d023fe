/* encode_assert.c: what became of assertions, at the end of a summary. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put_word(text *t, const char *key, const char *value)
{
    if (value[0])
        text_string(t, key, value);
}

static void put_finding(text *t, const codec_judged *judged)
{
    static const char *const WORDS[CODEC_VERDICTS] = {"pass", "uncertain", "fail"};
    const codec_assertion *a = judged->of;
    const codec_finding *f = &judged->found;
    const struct {
        const char *key;
        double value;
    } GIVEN[] = {
        {"min", a->least}, {"max", a->most}, {"near", a->near}, {"absolute", a->absolute}, {"relative", a->relative}};
    text_open(t, NULL, '{');
    put_word(t, "name", a->name);
    put_word(t, "quantity", a->quantity);
    put_word(t, "case", f->case_name);
    for (size_t i = 0; i < sizeof GIVEN / sizeof GIVEN[0]; i++)
        if (!isnan(GIVEN[i].value))
            text_number(t, GIVEN[i].key, GIVEN[i].value);
    text_number(t, "value", f->value);
    text_number(t, "error", f->error);
    put_word(t, "result", WORDS[f->verdict]);
    put_word(t, "reason", f->reason);
    if (judged->of_cases) {
        text_open(t, "cases", '{');
        for (int i = 0; i < CODEC_VERDICTS; i++)
            text_integer(t, WORDS[i], f->counts[i]);
        text_close(t, '}');
    }
    text_close(t, '}');
}

bool codec_add_findings(char **summary, const codec_judged *list, int64_t n)
{
    text t = {0};
    bool passed = true;
    text_bytes(&t, *summary, strlen(*summary) - 1); /* but the closing brace */
    text_open(&t, "assertions", '[');
    for (int64_t i = 0; i < n; i++) {
        passed = passed && list[i].found.verdict == CODEC_PASS;
        put_finding(&t, &list[i]);
    }
    text_close(&t, ']');
    text_bool(&t, "assertions_passed", passed);
    text_close(&t, '}');
    char *longer = text_finish(&t, NULL);
    if (!longer)
        return false;
    free(*summary);
    *summary = longer;
    return true;
}
