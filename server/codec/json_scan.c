/* json_scan.c: the judge of what is JSON: recursive descent over the raw bytes, at most JSON_MAX_DEPTH deep.
 *
 * A function that returns false has stopped the scan and said why. A refusal of well-formed JSON (a key twice, a number
 * beyond double precision) only records the first problem and goes on, so that a text which is no JSON at all is always
 * answered with 400. */
#include "codec/json.h"
#include "codec/problem.h"
#include "codec/room.h"
#include "uzawa.h"

#include <math.h>
#include <search.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    const char *text;
    size_t len, at;
    json_tree *tree;
    problem_details *problem;
    size_t values;
    int depth;
    json_value *stack; /* what stands in arrays and objects that are still open */
    size_t used, capacity;
} scanner;

static const char EXPECTED[] = "a value was expected (an object, array, string, number, true, false or null)";

static bool scan_value(scanner *s, json_value *out);
static bool stop_syntax(scanner *s, size_t at, const char *why);
static int peek(scanner *s);

bool json_scan(json_tree *tree, const char *body, size_t len, problem_details *problem)
{
    scanner s = {.text = body, .len = len, .tree = tree, .problem = problem};
    *tree = (json_tree){NULL, NULL};
    *problem = (problem_details){0};
    json_value *root = json_room(tree, sizeof *root);
    if (!root) {
        problem_no_memory(problem);
        return false;
    }
    *root = (json_value){.parent = NULL};
    if (len >= 3 && memcmp(body, "\xef\xbb\xbf", 3) == 0)
        stop_syntax(&s, 0, "the text begins with a byte order mark; remove it");
    else if (peek(&s) < 0)
        stop_syntax(&s, s.at, "the body is empty; a JSON object was expected");
    else if (scan_value(&s, root) && peek(&s) >= 0)
        stop_syntax(&s, s.at, "something follows the end of the JSON text");
    free(s.stack);
    tree->root = root;
    if (problem->status == 0)
        return true;
    json_clear(tree);
    return false;
}

/* ------------------------------------------------------------- failures */

static bool stop_syntax(scanner *s, size_t at, const char *why)
{
    char found[24] = "the end";
    size_t line = 1, start = 0;
    for (size_t i = 0; i < at && i < s->len; i++)
        if (s->text[i] == '\n') {
            line++;
            start = i + 1;
        }
    if (at < s->len) {
        unsigned char c = (unsigned char)s->text[at];
        snprintf(found, sizeof found, c > 0x20 && c < 0x7f ? "'%c'" : "byte 0x%02x", c);
    }
    problem_set(s->problem, 400, "json_syntax", NULL, "Line %zu, column %zu (byte %zu, found %s): %s.", line,
                at - start + 1, at, found, why);
    s->problem->line = (int64_t)line;
    return false;
}

/* One more value at this place, or an array or object that is opened there. */
static bool allow(scanner *s, const json_value *at, bool opens)
{
    const size_t most = opens ? (size_t)json_depth_limit() : JSON_MAX_VALUES;
    const size_t have = opens ? (size_t)s->depth + 1 : ++s->values;
    if (have <= most)
        return true;
    problem_set(s->problem, opens ? 400 : 413, opens ? "json_depth" : "too_many_values", at,
                "More than %zu %s (byte %zu).", most,
                opens ? "levels of arrays and objects"
                      : "values besides long number arrays; write vectors as one flat array",
                s->at);
    return false;
}

/* -------------------------------------------------------------- tokens */

/* The next byte after white space, -1 at the end. */
static int peek(scanner *s)
{
    while (s->at < s->len &&
           (s->text[s->at] == ' ' || s->text[s->at] == '\n' || s->text[s->at] == '\t' || s->text[s->at] == '\r'))
        s->at++;
    return s->at < s->len ? (unsigned char)s->text[s->at] : -1;
}

/* After an item: true if another follows, false at the closing bracket or after a failure. */
static bool next_item(scanner *s, char close, bool *failed)
{
    int c = peek(s);
    if (c == ',' || c == close) {
        s->at++;
        return c == ',';
    }
    *failed = true;
    return stop_syntax(s, s->at, close == ']' ? "a comma or ']' was expected" : "a comma or '}' was expected");
}

static size_t digits_end(const scanner *s, size_t at)
{
    while (at < s->len && s->text[at] >= '0' && s->text[at] <= '9')
        at++;
    return at;
}

/* The number at s->at by the grammar of RFC 8259, section 6. */
static bool scan_number(scanner *s, const json_value *at, double *value)
{
    const size_t start = s->at, whole = start + (s->text[start] == '-');
    size_t part = whole, end = whole < s->len && s->text[whole] == '0' ? whole + 1 : digits_end(s, whole);
    bool good = end > part && digits_end(s, end) == end;
    if (good && end < s->len && s->text[end] == '.') {
        part = end + 1;
        end = digits_end(s, part);
        good = end > part;
    }
    if (good && end < s->len && (s->text[end] == 'e' || s->text[end] == 'E')) {
        part = end + 1;
        part += part < s->len && (s->text[part] == '+' || s->text[part] == '-');
        end = digits_end(s, part);
        good = end > part;
    }
    if (!good)
        return stop_syntax(s, end, "a number is malformed");
    if (uz_parse_double(value, s->text + start, end - start) != end - start)
        return stop_syntax(s, start, "a number is malformed");
    if (!isfinite(*value)) {
        *value = 0;
        if (s->problem->status == 0) /* recorded; the scan goes on and a later syntax error replaces it */
            problem_set(s->problem, 422, "number_out_of_range", at,
                        "The number %.*s%s is larger than double precision holds (about 1.8e308).",
                        (int)(end - start > 40 ? 40 : end - start), s->text + start, end - start > 40 ? "..." : "");
    }
    s->at = end;
    return true;
}

/* The string at s->at: the bytes, short ones copied and long ones as they stand; a key is always copied. */
static const char *scan_string(scanner *s, bool key, size_t *bytes)
{
    const size_t start = s->at + 1;
    size_t end;
    const char *why = json_text_check(s->text, s->len, s->at, &end, bytes);
    if (why) {
        stop_syntax(s, end, why);
        return NULL;
    }
    s->at = end + 1;
    if (*bytes > JSON_SHORT_TEXT && !key)
        return s->text + start;
    char *copy = json_room(s->tree, *bytes + 1);
    if (!copy) {
        problem_no_memory(s->problem);
        return NULL;
    }
    if (*bytes == end - start)
        memcpy(copy, s->text + start, *bytes);
    else
        json_text_decode(copy, s->text + start, *bytes);
    copy[*bytes] = '\0';
    return copy;
}

/* ------------------------------------------------------ blocks of numbers */

enum { OTHER, DIGIT, SIGN, SPACE, COMMA, OPEN, CLOSE };
static const unsigned char CLASS[256] = {
    ['0'] = DIGIT,  ['1'] = DIGIT, ['2'] = DIGIT, ['3'] = DIGIT, ['4'] = DIGIT,  ['5'] = DIGIT,
    ['6'] = DIGIT,  ['7'] = DIGIT, ['8'] = DIGIT, ['9'] = DIGIT, ['.'] = SIGN,   ['-'] = SIGN,
    ['+'] = SIGN,   ['e'] = SIGN,  ['E'] = SIGN,  [' '] = SPACE, ['\n'] = SPACE, ['\t'] = SPACE,
    ['\r'] = SPACE, [','] = COMMA, ['['] = OPEN,  [']'] = CLOSE};

/* Does the array at s->at look like numbers, or like rows of the same number of numbers each (*columns > 0)? The
 * grammar is checked later, item by item; this only decides which way to go and how much room to make. */
static bool looks_like_numbers(const scanner *s, size_t *count, size_t *columns)
{
    size_t commas = 0, in_row = 0, rows = 0, width = 0;
    bool inside = false, flat = false, digits = false; /* digits: there are some, in this row */
    for (size_t i = s->at + 1; i < s->len; i++) {
        switch (CLASS[(unsigned char)s->text[i]]) {
        case DIGIT:
            digits = true;
            while (i + 1 < s->len && CLASS[(unsigned char)s->text[i + 1]] == DIGIT)
                i++; /* fall through */
        case SIGN:
            if (!inside && rows > 0)
                return false;
            flat = flat || !inside;
            break;
        case SPACE:
            break;
        case COMMA:
            commas += !inside;
            in_row += inside;
            break;
        case OPEN:
            if (inside || flat)
                return false;
            inside = true;
            digits = false;
            in_row = 1;
            break;
        case CLOSE:
            *count = rows ? rows : commas + 1;
            *columns = width;
            if (!inside)
                return rows || digits || commas >= JSON_SHORT_ARRAY;
            inside = false;
            width = rows++ ? width : in_row;
            if (in_row != width || !digits || width > INT32_MAX)
                return false;
            break;
        default:
            return false;
        }
    }
    *count = rows; /* not closed: it is told as a long table's mistake */
    *columns = width;
    return !inside && rows > JSON_SHORT_ARRAY && width <= JSON_SHORT_ARRAY;
}

/* The numbers from the bracket at s->at on. one: they count as one value together. */
static bool scan_row(scanner *s, const json_value *row, double *numbers, bool one)
{
    bool failed = false;
    s->at++;
    for (size_t i = 0;; i++) {
        const json_value here = {.parent = row, .place = i};
        const int c = peek(s);
        if (!one && !allow(s, &here, false))
            return false;
        if (c != '-' && (c < '0' || c > '9'))
            return stop_syntax(s, s->at, one ? "a number was expected" : EXPECTED);
        if (!scan_number(s, &here, &numbers[i]))
            return false;
        if (!next_item(s, ']', &failed))
            return !failed;
    }
}

/* The block at s->at, of which looks_like_numbers said how large it is. */
static bool scan_numbers(scanner *s, json_value *out, size_t count, size_t columns)
{
    const bool one = count > JSON_SHORT_ARRAY && columns <= JSON_SHORT_ARRAY; /* counts as one value */
    const size_t row_size = (columns ? columns : 1) * sizeof(double);
    const bool is_long = count * row_size > JSON_SHORT_ARRAY * sizeof(double);
    double *numbers = is_long ? room_for(count, row_size) : json_room(s->tree, count * row_size);
    bool failed = false, more = columns > 0;
    if (!numbers)
        return problem_no_memory(s->problem);
    if (columns == 0)
        failed = !scan_row(s, out, numbers, one);
    else
        s->at++;
    for (size_t i = 0; more; i++) {
        const json_value row = {.parent = out, .place = i};
        const int c = peek(s);
        failed = !one && !allow(s, &row, false);
        if (!failed && c != '[')
            failed = !stop_syntax(s, s->at, one ? "a row of numbers was expected" : EXPECTED);
        failed = failed || (!one && !allow(s, &row, true)) ||
                 !scan_row(s, &row, numbers + i * columns, one || columns > JSON_SHORT_ARRAY);
        more = !failed && next_item(s, ']', &failed);
    }
    if (failed && is_long)
        free(numbers);
    if (failed)
        return false;
    out->kind = JSON_IS_NUMBERS;
    out->numbers = numbers;
    out->count = count;
    out->columns = (uint32_t)columns;
    out->is_long = is_long;
    return true;
}

/* ------------------------------------------------------ arrays and objects */

static int compare_keys(const void *a, const void *b)
{
    const json_value *x = a, *y = b;
    const size_t n = x->place < y->place ? x->place : y->place;
    const int order = memcmp(x->key, y->key, n);
    return order ? order : (x->place > y->place) - (x->place < y->place);
}

/* The key of a member and the colon. Is it among those from `base` on? A few are compared one by one; more are kept in
 * *keys, a red-black tree, which no choice of keys makes slow. */
static bool scan_key(scanner *s, size_t base, json_value *member, void **keys)
{
    enum { FEW = 16 };
    const size_t n = s->used - base;
    bool twice = false;
    char shown[64];
    if (peek(s) != '"')
        return stop_syntax(s, s->at, "a key in double quotes was expected");
    member->key = scan_string(s, true, &member->place);
    if (!member->key)
        return false;
    if (peek(s) != ':')
        return stop_syntax(s, s->at, "a colon was expected after the key");
    s->at++;
    for (size_t i = base; n < FEW && i < s->used && !twice; i++)
        twice = compare_keys(&s->stack[i], member) == 0;
    for (size_t i = n == FEW ? 0 : n; n >= FEW && i <= n; i++) {
        json_value *entry = json_room(s->tree, sizeof *entry);
        void *found = NULL;
        if (entry) {
            *entry = i < n ? s->stack[base + i] : *member;
            found = tsearch(entry, keys, compare_keys);
        }
        if (!found)
            return problem_no_memory(s->problem);
        twice = i == n && *(json_value **)found != entry;
    }
    if (twice && s->problem->status == 0) {
        problem_quote(shown, sizeof shown, member->key, member->place);
        problem_set(s->problem, 422, "duplicate_key", member, "The key %s stands twice in the same object.", shown);
    }
    return true;
}

static void keep_key(void *key)
{
    (void)key;
}

/* An array or object, whose opening bracket stands at s->at. */
static bool scan_container(scanner *s, json_value *out, bool object)
{
    const size_t base = s->used;
    const char close = object ? '}' : ']';
    size_t count, columns;
    bool failed = false;
    void *keys = NULL;
    if (!allow(s, out, true))
        return false;
    s->depth++;
    if (!object && looks_like_numbers(s, &count, &columns)) {
        failed = !scan_numbers(s, out, count, columns);
        s->depth--;
        return !failed;
    }
    s->at++;
    bool more = peek(s) != close;
    s->at += !more;
    while (more) {
        json_value item = {.parent = out, .place = s->used - base};
        failed = (object && !scan_key(s, base, &item, &keys)) || !scan_value(s, &item);
        if (!failed && s->used == s->capacity) {
            const size_t capacity = s->capacity ? 2 * s->capacity : 64;
            json_value *grown = room_grow(s->stack, capacity, sizeof *grown);
            failed = !grown && !problem_no_memory(s->problem);
            if (failed)
                json_free_numbers(&item);
            s->stack = grown ? grown : s->stack;
            s->capacity = grown ? capacity : s->capacity;
        }
        if (!failed)
            s->stack[s->used++] = item;
        more = !failed && next_item(s, close, &failed);
    }
    /* What was pushed moves into the tree, where what is in it learns where that is. */
    json_value *items = failed ? NULL : json_room(s->tree, (s->used - base) * sizeof *items);
    if (!failed && !items)
        failed = !problem_no_memory(s->problem);
    if (!failed) {
        out->kind = object ? JSON_IS_OBJECT : JSON_IS_ARRAY;
        out->items = items;
        out->count = s->used - base;
        if (out->count > 0)
            memcpy(items, s->stack + base, out->count * sizeof *items);
        for (size_t i = 0; i < out->count; i++)
            if (items[i].kind == JSON_IS_ARRAY || items[i].kind == JSON_IS_OBJECT)
                for (size_t k = 0; k < items[i].count; k++)
                    items[i].items[k].parent = &items[i];
        s->used = base;
    }
    while (s->used > base)
        json_free_numbers(&s->stack[--s->used]);
    tdestroy(keys, keep_key);
    s->depth--;
    return !failed;
}

/* out: where it stands is filled in. */
static bool scan_value(scanner *s, json_value *out)
{
    static const struct {
        const char *word;
        json_kind kind;
        bool truth;
    } WORDS[] = {{"true", JSON_IS_BOOLEAN, true}, {"false", JSON_IS_BOOLEAN, false}, {"null", JSON_IS_NULL, false}};
    const int c = peek(s);
    if (!allow(s, out, false))
        return false;
    switch (c) {
    case '{':
    case '[':
        return scan_container(s, out, c == '{');
    case '"':
        out->text = scan_string(s, false, &out->count);
        out->kind = out->text ? JSON_IS_STRING : JSON_IS_NULL;
        out->is_long = out->count > JSON_SHORT_TEXT;
        return out->text != NULL;
    default:
        if (c == '-' || (c >= '0' && c <= '9')) {
            out->kind = JSON_IS_NUMBER;
            return scan_number(s, out, &out->number);
        }
        for (size_t i = 0; i < sizeof WORDS / sizeof WORDS[0]; i++) {
            const size_t n = strlen(WORDS[i].word);
            if (s->len - s->at < n || memcmp(s->text + s->at, WORDS[i].word, n) != 0)
                continue;
            s->at += n;
            out->kind = WORDS[i].kind;
            out->truth = WORDS[i].truth;
            return true;
        }
        return stop_syntax(s, s->at, EXPECTED);
    }
}
