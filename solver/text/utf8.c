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
