/* utf8.h: which bytes are a character. */
#ifndef UZ_TEXT_UTF8_H
#define UZ_TEXT_UTF8_H

#include <stddef.h>

/* Length in bytes of the well-formed UTF-8 character at text[0..len), 0 if there is none: overlong, a surrogate, above
 * U+10FFFF, or cut short (The Unicode Standard 15, table 3-7). A NUL is a character of one byte. */
size_t uz_utf8_length(const char *text, size_t len);

/* Length in bytes of the character at text[0..len) if a terminal would obey it instead of showing it, or if it changes
 * the order or the lines of what stands around it (Unicode Standard Annex #9, explicit directional formatting, and
 * U+2028, U+2029): control characters of C0 and C1 and DEL among them. 0: it is a character like others, or none. */
size_t uz_utf8_unsafe(const char *text, size_t len);

#endif
