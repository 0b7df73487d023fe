/* json_text.c: strings of a JSON text: UTF-8 and escapes (RFC 8259, section 7). */
#include "codec/json.h"
#include "text/utf8.h"

#include <string.h>

/* The four hex digits at text[0..len), or -1. */
static int hex4(const char *text, size_t len)
{
    static const char DIGITS[] = "0123456789abcdefABCDEF";
    int value = 0;
    if (len < 4)
        return -1;
    for (int i = 0; i < 4; i++) {
        const char *digit = text[i] ? strchr(DIGITS, text[i]) : NULL;
        if (!digit)
            return -1;
        value = value * 16 + (int)(digit - DIGITS) - (digit - DIGITS > 15 ? 6 : 0);
    }
    return value;
}

/* The escape at text[0] == '\\': its length, and the character that it stands for; 0: malformed, and *why says how. */
static inline size_t read_escape(const char *text, size_t len, unsigned *code, const char **why)
{
    static const char NAMES[] = "\"\\/bfrt", MEANS[] = "\"\\/\b\f\r\t";
    if (len > 1 && text[1] == 'n') { /* most of them are: a file has lines */
        *code = '\n';
        return 2;
    }
    *why = "an escape must be one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX";
    if (len < 2)
        return 0;
    for (size_t i = 0; i < sizeof NAMES - 1; i++)
        if (text[1] == NAMES[i]) {
            *code = (unsigned char)MEANS[i];
            return 2;
        }
    const int high = text[1] == 'u' ? hex4(text + 2, len - 2) : -1;
    if (high < 0)
        return 0;
    *code = (unsigned)high;
    if (high < 0xd800 || high > 0xdfff)
        return 6;
    *why = "half of a surrogate pair stands alone";
    const int low = len >= 12 && text[6] == '\\' && text[7] == 'u' ? hex4(text + 8, len - 8) : -1;
    if (high >= 0xdc00 || low < 0xdc00 || low > 0xdfff)
        return 0;
    *code = 0x10000 + ((unsigned)(high - 0xd800) << 10) + (unsigned)(low - 0xdc00);
    return 12;
}

static size_t utf8_bytes(unsigned code)
{
    return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
}

const char *json_text_check(const char *text, size_t len, size_t at, size_t *end, size_t *bytes)
{
    const char *why = NULL;
    const size_t start = ++at;
    size_t saved = 0; /* by undoing the escapes */
    while (at < len && text[at] != '"') {
        const unsigned char c = (unsigned char)text[at];
        size_t step = 1;
        unsigned code = 0;
        if (c >= 0x20 && c < 0x80 && c != '\\') {
            at++;
            continue;
        }
        if (c < 0x20) {
            why = "a control character stands in a string; write it as an escape (a line break is \\n)";
            step = 0;
        } else if (c == '\\') {
            step = read_escape(text + at, len - at, &code, &why);
            saved += step - utf8_bytes(code); /* of no use where step is 0 */
        } else {
            step = uz_utf8_length(text + at, len - at);
            why = "the text is not UTF-8";
        }
        if (step == 0) {
            *end = at;
            return why;
        }
        at += step;
    }
    *end = at;
    *bytes = at - start - saved;
    return at < len ? NULL : "a string has no closing quote";
}

size_t json_text_decode(char *out, const char *from, size_t bytes)
{
    static const unsigned char FIRST[] = {0, 0, 0xc0, 0xe0, 0xf0}; /* bits of the first of so many bytes */
    size_t used = 0;
    while (used < bytes) {
        const char *escape = memchr(from, '\\', bytes - used);
        const size_t run = escape ? (size_t)(escape - from) : bytes - used;
        memcpy(out + used, from, run);
        used += run;
        from += run;
        if (!escape)
            break;
        unsigned code = 0;
        const char *why;
        from += read_escape(from, 12, &code, &why); /* was checked: what is behind a shorter one is not looked at */
        const size_t length = utf8_bytes(code);
        for (size_t i = length - 1; i > 0; i--, code >>= 6)
            out[used + i] = (char)(0x80 | (code & 0x3f));
        out[used] = (char)(FIRST[length] | code);
        used += length;
    }
    return used;
}

size_t json_text_characters(const json_value *string)
{
    size_t count = 0;
    if (!string->is_long) {
        for (size_t i = 0; i < string->count; i++)
            count += ((unsigned char)string->text[i] & 0xc0) != 0x80;
        return count;
    }
    for (const char *at = string->text; *at != '"';) {
        unsigned code;
        const char *why;
        count += ((unsigned char)*at & 0xc0) != 0x80;
        at += *at == '\\' ? read_escape(at, 12, &code, &why) : 1;
    }
    return count;
}
