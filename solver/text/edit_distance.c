/* edit_distance.c: edit distance with swaps of neighbours ("optimal string alignment", after Damerau 1964 and Wagner
 * and Fischer 1974), row by row. */
#include "text/edit_distance.h"

#include <ctype.h>
#include <stdbool.h>
#include <string.h>

enum { MOST_LETTERS = 40 };

static int least(int a, int b)
{
    return a < b ? a : b;
}

static bool same_letter(char a, char b)
{
    return tolower((unsigned char)a) == tolower((unsigned char)b);
}

int uz_closest(const char *text, size_t len, const char *const *candidates, size_t count)
{
    int best = -1, most = least(1 + (int)len / 4, (int)len - 1);
    for (size_t k = 0; k < count && len <= MOST_LETTERS; k++) {
        const char *word = candidates[k];
        const size_t n = word ? strlen(word) : MOST_LETTERS + 1;
        int row[3][MOST_LETTERS + 1] = {{0}}; /* of the prefixes of text with i - 2, i - 1 and i letters, modulo 3 */
        if (n > MOST_LETTERS)
            continue;
        for (size_t j = 0; j <= n; j++)
            row[0][j] = (int)j;
        for (size_t i = 1; i <= len; i++) {
            int *now = row[i % 3];
            const int *last = row[(i + 2) % 3], *before = row[(i + 1) % 3];
            now[0] = (int)i;
            for (size_t j = 1; j <= n; j++) {
                now[j] = least(least(last[j], now[j - 1]) + 1, last[j - 1] + !same_letter(text[i - 1], word[j - 1]));
                if (i > 1 && j > 1 && same_letter(text[i - 1], word[j - 2]) && same_letter(text[i - 2], word[j - 1]))
                    now[j] = least(now[j], before[j - 2] + 1);
            }
        }
        if (row[len % 3][n] > most)
            continue;
        best = (int)k;
        most = row[len % 3][n] - 1; /* the next must be closer */
    }
    return best;
}
