#include "codec/json_doc.h"

#include <string.h>

static bool continues(const char *text, size_t i)
{
    return ((unsigned char)text[i] & 0xc0) == 0x80;
}

/* Unicode 15, table 3-7: the second byte's range excludes overlongs, surrogates and what lies above U+10FFFF. */
size_t json_utf8_length(const char *text, size_t len)
{
    unsigned char a = len > 0 ? (unsigned char)text[0] : 0xff;
    unsigned char b = len > 1 ? (unsigned char)text[1] : 0;
    if (a < 0x80)
        return 1;
    if (a >= 0xc2 && a <= 0xdf)
        return len > 1 && continues(text, 1) ? 2 : 0;
    if (a >= 0xe0 && a <= 0xef) {
        unsigned char low = a == 0xe0 ? 0xa0 : 0x80, high = a == 0xed ? 0x9f : 0xbf;
        return len > 2 && b >= low && b <= high && continues(text, 2) ? 3 : 0;
    }
    if (a >= 0xf0 && a <= 0xf4) {
        unsigned char low = a == 0xf0 ? 0x90 : 0x80, high = a == 0xf4 ? 0x8f : 0xbf;
        return len > 3 && b >= low && b <= high && continues(text, 2) && continues(text, 3) ? 4 : 0;
    }
    return 0;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

/* The four hex digits at text[0..len), or -1. */
static int hex4(const char *text, size_t len)
{
    int value = 0;
    if (len < 4)
        return -1;
    for (int i = 0; i < 4; i++) {
        int digit = hex_digit(text[i]);
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

/* Length of the escape at text[0] == '\\'; 0: malformed, and *why says how. */
static size_t escape_length(const char *text, size_t len, const char **why)
{
    *why = "an escape must be one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX";
    if (len < 2)
        return 0;
    if (text[1] != '\0' && strchr("\"\\/bfnrt", text[1]))
        return 2;
    int high = text[1] == 'u' ? hex4(text + 2, len - 2) : -1;
    if (high < 0)
        return 0;
    if (high < 0xd800 || high > 0xdfff)
        return 6;
    *why = "half of a surrogate pair stands alone";
    int low = len >= 12 && text[6] == '\\' && text[7] == 'u' ? hex4(text + 8, len - 8) : -1;
    return high < 0xdc00 && low >= 0xdc00 && low <= 0xdfff ? 12 : 0;
}

const char *json_text_check(const char *text, size_t len, size_t at, size_t *end, bool *plain)
{
    const char *why = NULL;
    *plain = true;
    for (at++; at < len && text[at] != '"';) {
        unsigned char c = (unsigned char)text[at];
        size_t step = 1;
        if (c < 0x20) {
            why = "a control character stands in a string; write it as an escape (a line break is \\n)";
            step = 0;
        } else if (c == '\\') {
            *plain = false;
            step = escape_length(text + at, len - at, &why);
        } else if (c >= 0x80) {
            step = json_utf8_length(text + at, len - at);
            why = "the text is not UTF-8";
        }
        if (step == 0) {
            *end = at;
            return why;
        }
        at += step;
    }
    *end = at;
    return at < len ? NULL : "a string has no closing quote";
}

static size_t put_utf8(char *out, unsigned code)
{
    if (code < 0x80) {
        out[0] = (char)code;
        return 1;
    }
    if (code < 0x800) {
        out[0] = (char)(0xc0 | code >> 6);
        out[1] = (char)(0x80 | (code & 0x3f));
        return 2;
    }
    if (code < 0x10000) {
        out[0] = (char)(0xe0 | code >> 12);
        out[1] = (char)(0x80 | (code >> 6 & 0x3f));
        out[2] = (char)(0x80 | (code & 0x3f));
        return 3;
    }
    out[0] = (char)(0xf0 | code >> 18);
    out[1] = (char)(0x80 | (code >> 12 & 0x3f));
    out[2] = (char)(0x80 | (code >> 6 & 0x3f));
    out[3] = (char)(0x80 | (code & 0x3f));
    return 4;
}

/* Decodes the checked escape at from[0]; returns its length and adds what it stands for to out. */
static size_t decode_escape(char *out, size_t *used, const char *from)
{
    static const char NAMES[] = "bfnrt", MEANS[] = "\b\f\n\r\t";
    const char *name = strchr(NAMES, from[1]);
    if (from[1] != 'u') {
        out[(*used)++] = name ? MEANS[name - NAMES] : from[1];
        return 2;
    }
    unsigned code = (unsigned)hex4(from + 2, 4);
    bool pair = code >= 0xd800 && code <= 0xdbff;
    if (pair)
        code = 0x10000 + ((code - 0xd800) << 10) + ((unsigned)hex4(from + 8, 4) - 0xdc00);
    *used += put_utf8(out + *used, code);
    return pair ? 12 : 6;
}

size_t json_text_decode(char *out, const char *from, size_t len)
{
    size_t used = 0;
    for (size_t i = 0; i < len;) {
        const char *escape = memchr(from + i, '\\', len - i);
        size_t run = escape ? (size_t)(escape - from) - i : len - i;
        memcpy(out + used, from + i, run);
        used += run;
        i += run;
        if (escape)
            i += decode_escape(out, &used, from + i);
    }
    return used;
}
