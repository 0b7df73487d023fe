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

static int distance(const char *a, size_t n, const char *b, size_t m)
{
    int row[3][MOST_LETTERS + 1] = {{0}}; /* of the prefixes of a with i - 2, i - 1 and i letters, modulo 3 */
    for (size_t j = 0; j <= m; j++)
        row[0][j] = (int)j;
    for (size_t i = 1; i <= n; i++) {
        int *now = row[i % 3];
        const int *last = row[(i + 2) % 3], *before = row[(i + 1) % 3];
        now[0] = (int)i;
        for (size_t j = 1; j <= m; j++) {
            now[j] = least(least(last[j], now[j - 1]) + 1, last[j - 1] + !same_letter(a[i - 1], b[j - 1]));
            if (i > 1 && j > 1 && same_letter(a[i - 1], b[j - 2]) && same_letter(a[i - 2], b[j - 1]))
                now[j] = least(now[j], before[j - 2] + 1);
        }
    }
    return row[n % 3][m];
}

int uz_closest(const char *text, size_t len, const char *const *candidates, size_t count)
{
    int best = -1, most = least(1 + (int)len / 4, (int)len - 1);
    for (size_t i = 0; i < count && len <= MOST_LETTERS; i++) {
        const size_t n = candidates[i] ? strlen(candidates[i]) : MOST_LETTERS + 1;
        const int d = n <= MOST_LETTERS ? distance(text, len, candidates[i], n) : most + 1;
        if (d > most)
            continue;
        best = (int)i;
        most = d - 1; /* the next must be closer */
    }
    return best;
}
