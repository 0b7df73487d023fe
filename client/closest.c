/* closest.c: edit distance with swaps of neighbours ("optimal string alignment", after Damerau 1964 and Wagner and
 * Fischer 1974), row by row. */
#include "closest.h"

#include <string.h>

enum { MOST_LETTERS = 40 };

static int least(int a, int b)
{
    return a < b ? a : b;
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
            now[j] = least(least(last[j], now[j - 1]) + 1, last[j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = least(now[j], before[j - 2] + 1);
        }
    }
    return row[n % 3][m];
}

void client_closest_try(client_closest *c, const char *candidate)
{
    const size_t len = strlen(candidate);
    if (c->len > MOST_LETTERS || len > MOST_LETTERS)
        return;
    const int d = distance(c->word, c->len, candidate, len);
    if (d > 1 + (int)c->len / 4 || d >= (int)c->len || (c->best && d >= c->distance))
        return;
    c->best = candidate;
    c->distance = d;
}
