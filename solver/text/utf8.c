#include "text/utf8.h"

/* The second byte's range excludes overlongs, surrogates and what lies above U+10FFFF. */
size_t uz_utf8_length(const char *text, size_t len)
{
    const unsigned char a = len > 0 ? (unsigned char)text[0] : 0xff, b = len > 1 ? (unsigned char)text[1] : 0;
    const unsigned char low = a == 0xe0 ? 0xa0 : a == 0xf0 ? 0x90 : 0x80;
    const unsigned char high = a == 0xed ? 0x9f : a == 0xf4 ? 0x8f : 0xbf;
    if (a < 0x80)
        return 1;
    const size_t bytes = a < 0xc2 ? 0 : a <= 0xdf ? 2 : a <= 0xef ? 3 : a <= 0xf4 ? 4 : 0;
    if (bytes == 0 || len < bytes || b < low || b > high)
        return 0;
    for (size_t i = 2; i < bytes; i++)
        if (((unsigned char)text[i] & 0xc0) != 0x80)
            return 0;
    return bytes;
}

size_t uz_utf8_unsafe(const char *text, size_t len)
{
    static const struct {
        unsigned first, last;
    } UNSAFE[] = {{0x00, 0x1f}, {0x7f, 0x9f}, {0x61c, 0x61c}, {0x200e, 0x200f}, {0x2028, 0x202e}, {0x2066, 0x2069}};
    const size_t n = uz_utf8_length(text, len);
    const unsigned char *byte = (const unsigned char *)text;
    const unsigned code = n == 1   ? byte[0]
                          : n == 2 ? (byte[0] & 0x1fu) << 6 | (byte[1] & 0x3fu)
                          : n == 3 ? (byte[0] & 0x0fu) << 12 | (byte[1] & 0x3fu) << 6 | (byte[2] & 0x3fu)
                                   : 0xffffffu;
    for (size_t i = 0; i < sizeof UNSAFE / sizeof UNSAFE[0]; i++)
        if (code >= UNSAFE[i].first && code <= UNSAFE[i].last)
            return n;
    return 0;
}
