/* edit_distance.h: what a mistyped word was probably meant to be. */
#ifndef UZ_TEXT_EDIT_DISTANCE_H
#define UZ_TEXT_EDIT_DISTANCE_H

#include <stddef.h>

/* The candidate closest to text[0..len) in edits (insert, delete, replace, swap neighbours), the first of several;
 * upper and lower case are alike. -1: none is close, which is at most one edit, and one more for each four letters of
 * the text, and fewer edits than it has letters. candidates[i] may be NULL: passed over. */
int uz_closest(const char *text, size_t len, const char *const *candidates, size_t count);

#endif
