/* encode_assert.c: what became of assertions, at the end of a summary. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool codec_add_findings(char **summary, const codec_judged *list, int64_t n)
{
    static const char *const WORDS[CODEC_VERDICTS] = {"pass", "uncertain", "fail"};
    text t = {0};
    bool passed = true;
    text_bytes(&t, *summary, strlen(*summary) - 1); /* but the closing brace */
    text_open(&t, "assertions", '[');
    for (int64_t i = 0; i < n; i++) {
        const codec_assertion *a = list[i].of;
        const codec_finding *f = &list[i].found;
        const struct {
            const char *key, *word; /* a number where there is no word */
            double value;
        } MEMBERS[] = {{"name", a->name, 0},
                       {"quantity", a->quantity, 0},
                       {"case", f->case_name, 0},
                       {"min", NULL, a->least},
                       {"max", NULL, a->most},
                       {"near", NULL, a->near},
                       {"absolute", NULL, a->absolute},
                       {"relative", NULL, a->relative}};
        passed = passed && f->verdict == CODEC_PASS;
        text_open(&t, NULL, '{');
        for (size_t k = 0; k < sizeof MEMBERS / sizeof MEMBERS[0]; k++)
            if (MEMBERS[k].word && MEMBERS[k].word[0])
                text_string(&t, MEMBERS[k].key, MEMBERS[k].word);
            else if (!MEMBERS[k].word && !isnan(MEMBERS[k].value))
                text_number(&t, MEMBERS[k].key, MEMBERS[k].value);
        text_number(&t, "value", f->value);
        text_number(&t, "error", f->error);
        text_string(&t, "result", WORDS[f->verdict]);
        if (f->reason[0])
            text_string(&t, "reason", f->reason);
        if (list[i].of_cases) {
            text_open(&t, "cases", '{');
            for (int k = 0; k < CODEC_VERDICTS; k++)
                text_integer(&t, WORDS[k], f->counts[k]);
            text_close(&t, '}');
        }
        text_close(&t, '}');
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
