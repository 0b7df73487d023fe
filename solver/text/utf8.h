/* utf8.h: which bytes are a character. */
#ifndef UZ_TEXT_UTF8_H
#define UZ_TEXT_UTF8_H

#include <stddef.h>

/* Length in bytes of the well-formed UTF-8 character at text[0..len), 0 if there is none: overlong, a surrogate, above
 * U+10FFFF, or cut short (The Unicode Standard 15, table 3-7). A NUL is a character of one byte. */
size_t uz_utf8_length(const char *text, size_t len);

#endif
