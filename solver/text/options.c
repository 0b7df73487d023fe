#include "text/options.h"
#include "text/edit_distance.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- values */

/* An integer or a number within its limits. */
static bool set_number(void *out, const uz_option *row, const char *text)
{
    const bool integer = row->kind == UZ_OPTION_INTEGER;
    char *end;
    errno = 0;
    const long whole = integer ? strtol(text, &end, 10) : 0;
    const double value = integer ? (double)whole : strtod(text, &end);
    if ((integer && errno) || end == text || *end || !isfinite(value) || value < row->least ||
        ((integer || row->most > 0) && value > row->most))
        return false;
    if (integer)
        *(int *)out = (int)whole;
    else
        *(double *)out = value;
    return true;
}

static bool set_size(size_t *out, const uz_option *row, const char *text)
{
    static const char SUFFIXES[] = "KMG";
    char *end;
    errno = 0;
    unsigned long long value = strtoull(text, &end, 10), factor = 1;
    if (errno || end == text || text[0] == '-' || (double)value < row->least)
        return false;
    const char *suffix = *end ? strchr(SUFFIXES, *end) : NULL;
    if (*end && (!suffix || end[1]))
        return false;
    for (const char *at = SUFFIXES; suffix && at <= suffix; at++)
        factor *= row->kind == UZ_OPTION_BYTES ? 1024 : 1000;
    if (value > (SIZE_MAX >> 2) / factor)
        return false;
    *out = (size_t)(value * factor);
    return true;
}

/* Which of the words with spaces between them; -1: none. */
static int find_word(const char *words, const char *word)
{
    const size_t len = strlen(word);
    for (int i = 0; *words; i++) {
        const size_t n = strcspn(words, " ");
        if (n == len && memcmp(words, word, n) == 0)
            return i;
        words += n + strspn(words + n, " ");
    }
    return -1;
}

static bool set_list(char *out, const uz_option *row, const char *text)
{
    char word[UZ_OPTION_ROOM], list[UZ_OPTION_ROOM] = "";
    size_t used = 0, count = 0;
    while (*(text += strspn(text, " \t"))) {
        const size_t len = strcspn(text, " \t");
        if (used + len + 2 > sizeof list || ++count > (size_t)row->most)
            return false;
        snprintf(word, sizeof word, "%.*s", (int)len, text);
        if (!row->check(word))
            return false;
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", used ? " " : "", word);
        text += len;
    }
    memcpy(out, list, used + 1);
    return true;
}

bool uz_option_set(void *values, const uz_option *row, const char *text)
{
    void *at = (char *)values + row->offset;
    uz_words *words = at;
    int word;
    if (row->kind == UZ_OPTION_FLAG) {
        *(bool *)at = true;
        return !text;
    }
    text = text ? text : "yes"; /* a switch alone: the walk lets no other option without a value pass */
    switch (row->kind) {
    case UZ_OPTION_SWITCH:
        word = find_word("no yes false true 0 1", text);
        if (word >= 0)
            *(bool *)at = word % 2 == 1;
        return word >= 0;
    case UZ_OPTION_INTEGER:
    case UZ_OPTION_NUMBER:
        return set_number(at, row, text);
    case UZ_OPTION_BYTES:
    case UZ_OPTION_COUNT:
        return set_size(at, row, text);
    case UZ_OPTION_TEXT:
        if (strlen(text) >= UZ_OPTION_ROOM || (!text[0] && !(row->normal && !row->normal[0])))
            return false;
        strcpy(at, text);
        return true;
    case UZ_OPTION_LIST:
        return set_list(at, row, text);
    case UZ_OPTION_LEVEL:
        word = find_word(row->choices, text);
        if (word >= 0)
            *(int *)at = word;
        return word >= 0;
    case UZ_OPTION_CHOICE:
        if (find_word(row->choices, text) < 0)
            return false;
        break;
    case UZ_OPTION_WORDS:
        if (!text[0] || words->count >= (int)row->most)
            return false;
        words->item[words->count++] = text;
        return true;
    case UZ_OPTION_WORD:
    case UZ_OPTION_FLAG:
        break;
    }
    if (!text[0])
        return false;
    *(const char **)at = text;
    return true;
}

void uz_option_wants(char *out, size_t size, const uz_option *row)
{
    size_t used = 0;
    switch (row->kind) {
    case UZ_OPTION_FLAG:
        snprintf(out, size, "no value");
        return;
    case UZ_OPTION_SWITCH:
        snprintf(out, size, "yes or no");
        return;
    case UZ_OPTION_INTEGER:
        snprintf(out, size, "an integer from %.0f to %.0f", row->least, row->most);
        return;
    case UZ_OPTION_NUMBER:
        if (row->most > 0)
            snprintf(out, size, "%s from %g to %g", row->unit ? row->unit : "a number", row->least, row->most);
        else
            snprintf(out, size, "a number%s%s, %g or more", row->unit ? " of " : "", row->unit ? row->unit : "",
                     row->least);
        return;
    case UZ_OPTION_BYTES:
        snprintf(out, size, "a number of bytes%s, with K, M or G where you like: 64M",
                 row->least > 0 ? " above 0" : "");
        return;
    case UZ_OPTION_COUNT:
        snprintf(out, size, "a number above 0, with K, M or G where you like: 2M is 2 million");
        return;
    case UZ_OPTION_TEXT:
        snprintf(out, size, "a text of at most %d bytes", UZ_OPTION_ROOM - 1);
        return;
    case UZ_OPTION_LIST:
        snprintf(out, size, "%s, at most %.0f with spaces between", row->wants, row->most);
        return;
    case UZ_OPTION_LEVEL:
    case UZ_OPTION_CHOICE:
        for (const char *words = row->choices, *rest; *words; words = rest) { /* "a, b or c" */
            const int len = (int)strcspn(words, " ");
            rest = words + len + strspn(words + len, " ");
            const char *between = !*rest ? "" : strchr(rest, ' ') ? ", " : " or ";
            used += (size_t)snprintf(out + used, size - used, "%.*s%s", len, words, between);
            used = used < size ? used : size - 1;
        }
        return;
    case UZ_OPTION_WORD:
        snprintf(out, size, "a value that is not empty");
        return;
    case UZ_OPTION_WORDS:
        snprintf(out, size, "a %s, at most %.0f times", row->value, row->most);
        return;
    }
}

/* ---- names */

const uz_option *uz_option_find(uz_option_table table, unsigned places, const char *name, size_t len)
{
    const uz_option *row = table.rows;
    for (size_t i = 0; i < table.count; i++, row++)
        if (row->places & places && strlen(row->name) == len && memcmp(row->name, name, len) == 0)
            return row;
    return NULL;
}

const char *uz_option_closest(uz_option_table table, unsigned places, const char *name, size_t len)
{
    enum { MOST = 128 };
    const char *names[MOST];
    for (size_t i = 0; i < table.count && i < MOST; i++)
        names[i] = table.rows[i].places & places ? table.rows[i].name : NULL;
    const int near = uz_closest(name, len, names, table.count < MOST ? table.count : MOST);
    return near < 0 ? NULL : names[near];
}

const char *uz_option_environment(const uz_option *row, const char *prefix, char name[64])
{
    snprintf(name, 64, "%s%s", prefix, row->name);
    for (char *at = name; *at; at++)
        *at = *at == '-' ? '_' : (char)(*at >= 'a' && *at <= 'z' ? *at - 32 : *at);
    return getenv(name);
}

/* ---- the walk */

static const uz_option *find_long(const uz_option_walk *walk, const char *name, size_t len)
{
    const uz_option *other = NULL, *begins = NULL;
    bool several = false;
    for (size_t i = 0; i < walk->table.count; i++) {
        const uz_option *row = &walk->table.rows[i];
        if (strncmp(row->name, name, len) != 0)
            continue;
        if (row->name[len]) {
            several |= begins != NULL;
            begins = row;
        } else if (row->places & walk->places) {
            return row;
        } else {
            other = row;
        }
    }
    return other ? other : walk->abbreviated && !several && len > 0 ? begins : NULL;
}

uz_walk_step uz_option_next(uz_option_walk *walk)
{
    walk->row = NULL;
    walk->value = NULL;
    if (walk->next + 1 >= walk->argc)
        return UZ_WALK_END;
    const char *word = walk->word = walk->argv[++walk->next];
    if (walk->ended || word[0] != '-' || !word[1])
        return UZ_WALK_OPERAND;
    if (strcmp(word, "--") == 0) {
        walk->ended = true;
        return uz_option_next(walk);
    }
    if (word[1] == '-') {
        const size_t len = strcspn(word + 2, "=");
        walk->row = find_long(walk, word + 2, len);
        walk->value = word[2 + len] ? word + 3 + len : NULL;
    } else if (!word[2]) {
        for (size_t i = 0; i < walk->table.count; i++) {
            const uz_option *row = &walk->table.rows[i];
            if (row->letter != word[1])
                continue;
            walk->row = row;
            if (row->places & walk->places)
                break;
        }
    }
    if (!walk->row)
        return UZ_WALK_UNKNOWN;
    const bool alone = walk->row->kind == UZ_OPTION_FLAG ||
                       (walk->row->kind == UZ_OPTION_SWITCH && walk->row->normal && walk->row->normal[0] == 'n');
    if (walk->value || alone)
        return UZ_WALK_OPTION;
    if (walk->next + 1 >= walk->argc)
        return UZ_WALK_LACKS;
    walk->value = walk->argv[++walk->next];
    return UZ_WALK_OPTION;
}

/* ---- for people */

const char *uz_write_wrapped(FILE *to, const char *text, int at, const char *margin, int indent, int width)
{
    while (*text && *text != '\n') {
        const int word = (int)strcspn(text, " \n");
        if (at > indent && at + 1 + word > width) {
            fprintf(to, "\n%s%*s", margin, indent - (int)strlen(margin), "");
            at = indent;
        } else if (at > indent) {
            fputc(' ', to);
            at++;
        }
        fprintf(to, "%.*s", word, text);
        at += word;
        text += word;
        text += strspn(text, " ");
    }
    return *text ? text + 1 : text;
}

void uz_option_print(FILE *to, const uz_option *row, const char *about, int column, int width, bool letters)
{
    int used = 0;
    if (letters && row->letter)
        used = fprintf(to, "  -%c,", row->letter);
    else if (letters)
        used = fprintf(to, "     ");
    else
        used = fprintf(to, " ");
    used += fprintf(to, " --%s%s%s", row->name, row->value ? " " : "", row->value ? row->value : "");
    if (used + 2 > column)
        fprintf(to, "\n%*s", column, "");
    else
        fprintf(to, "%*s", column - used, "");
    uz_write_wrapped(to, about, column, "", column, width);
    fputc('\n', to);
}
