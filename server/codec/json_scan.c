/* The judge of what is JSON: recursive descent over the raw bytes, at most JSON_MAX_DEPTH deep.
 *
 * A function that returns NULL or false has stopped the scan and said why. A refusal of well-formed JSON (a key twice,
 * a number beyond double precision) only records the first problem and goes on, so that a text which is no JSON at all
 * is always answered with 400. */
#include "codec/json_doc.h"
#include "codec/problem.h"
#include "codec/room.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *text;
    size_t len, at;
    json_doc *doc;
    problem_details *problem;
    size_t values;
    int depth;
} scanner;

static json_t *scan_value(scanner *s, const json_path *path);

/* ------------------------------------------------------------- failures */

static void *stop_memory(scanner *s)
{
    problem_set(s->problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return NULL;
}

static void *stop_syntax(scanner *s, size_t at, const char *why)
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
    return NULL;
}

static void *stop_limit(scanner *s, int status, const char *code, const json_path *path, const char *what, int limit)
{
    problem_set(s->problem, status, code, path, "More than %d %s (byte %zu).", limit, what, s->at);
    return NULL;
}

/* Records a refusal; the scan goes on and a later syntax error replaces it. */
static void refuse_number(scanner *s, const json_path *path, size_t start, size_t end)
{
    if (s->problem->status)
        return;
    problem_set(s->problem, 422, "number_out_of_range", path,
                "The number %.*s%s is larger than double precision holds (about 1.8e308).",
                (int)(end - start > 40 ? 40 : end - start), s->text + start, end - start > 40 ? "..." : "");
}

static void refuse_key(scanner *s, const json_path *path)
{
    char shown[64];
    if (s->problem->status)
        return;
    problem_quote(shown, sizeof shown, path->key, path->key_len);
    problem_set(s->problem, 422, "duplicate_key", path, "The key %s stands twice in the same object.", shown);
}

/* -------------------------------------------------------------- tokens */

static void skip_space(scanner *s)
{
    while (s->at < s->len &&
           (s->text[s->at] == ' ' || s->text[s->at] == '\n' || s->text[s->at] == '\t' || s->text[s->at] == '\r'))
        s->at++;
}

/* The next byte after white space, -1 at the end. */
static int peek(scanner *s)
{
    skip_space(s);
    return s->at < s->len ? (unsigned char)s->text[s->at] : -1;
}

static bool is_digit(const scanner *s, size_t at)
{
    return at < s->len && s->text[at] >= '0' && s->text[at] <= '9';
}

static size_t digits_end(const scanner *s, size_t at)
{
    while (is_digit(s, at))
        at++;
    return at;
}

/* End of the number that starts at s->at by the grammar of RFC 8259, section 6; 0 if there is none, and *bad is the
 * offending byte. */
static size_t number_end(const scanner *s, size_t *bad)
{
    size_t at = s->at + (s->text[s->at] == '-');
    size_t end = at < s->len && s->text[at] == '0' ? at + 1 : digits_end(s, at);
    *bad = end;
    if (end == at || is_digit(s, end))
        return 0;
    if (end < s->len && s->text[end] == '.') {
        at = end + 1;
        *bad = end = digits_end(s, at);
        if (end == at)
            return 0;
    }
    if (end < s->len && (s->text[end] == 'e' || s->text[end] == 'E')) {
        at = end + 1;
        at += at < s->len && (s->text[at] == '+' || s->text[at] == '-');
        *bad = end = digits_end(s, at);
        if (end == at)
            return 0;
    }
    return end;
}

static bool scan_number(scanner *s, const json_path *path, double *value)
{
    size_t bad, start = s->at, end = number_end(s, &bad);
    if (end == 0)
        return stop_syntax(s, bad, "a number is malformed") != NULL;
    if (uz_parse_double(value, s->text + start, end - start) != end - start)
        return stop_syntax(s, start, "a number is malformed") != NULL;
    if (!isfinite(*value)) {
        refuse_number(s, path, start, end);
        *value = 0;
    }
    s->at = end;
    return true;
}

static json_t *made(scanner *s, json_t *value)
{
    return value ? value : stop_memory(s);
}

static json_t *scan_word(scanner *s, const char *word, json_t *value)
{
    size_t n = strlen(word);
    if (s->len - s->at < n || memcmp(s->text + s->at, word, n) != 0)
        return stop_syntax(s, s->at, "a value was expected (an object, array, string, number, true, false or null)");
    s->at += n;
    return value;
}

/* -------------------------------------------------------------- lifting */

/* Registers a lifted value, which the document owns from here on even when this fails. */
static json_t *lift(scanner *s, json_lifted item)
{
    json_doc *doc = s->doc;
    if (doc->n_lifted == doc->capacity) {
        size_t capacity = doc->capacity ? 2 * doc->capacity : 8;
        json_lifted *grown = room_grow(doc->lifted, capacity, sizeof *grown);
        if (!grown) {
            free(item.numbers);
            free(item.text);
            return stop_memory(s);
        }
        doc->lifted = grown;
        doc->capacity = capacity;
    }
    doc->lifted[doc->n_lifted++] = item;
    return made(s, json_integer((json_int_t)doc->n_lifted - 1));
}

/* How many items the array at s->at has if it looks like a flat array of numbers, else 0. The grammar is checked
 * later, item by item; this only decides which way to go and how much room to make. */
static int64_t count_numbers(const scanner *s)
{
    int64_t count = 1;
    for (size_t i = s->at + 1; i < s->len; i++) {
        char c = s->text[i];
        if (c == ']')
            return count;
        if (c == ',')
            count++;
        else if (!((c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E' || c == ' ' ||
                   c == '\n' || c == '\t' || c == '\r'))
            return 0;
    }
    return 0;
}

/* Counts rows and columns of the array at s->at if it looks like a table of numbers: rows of the same number of
 * numbers each. rows 0: it does not. As above, this only decides which way to go. */
static void count_table(const scanner *s, int64_t *rows, int64_t *columns)
{
    int64_t in_row = 0, first = 0, found = 0;
    bool inside = false, digits = false; /* digits: the row is not empty */
    *rows = *columns = 0;
    for (size_t i = s->at + 1; i < s->len; i++) {
        char c = s->text[i];
        if (inside ? c == '[' : c == ']')
            break;
        if (c == '[') {
            inside = true;
            digits = false;
            in_row = 1;
        } else if (c == ']') {
            inside = false;
            first = found++ ? first : in_row;
            if (in_row != first || in_row > JSON_LIFT_NUMBERS || !digits)
                return;
        } else if (inside && c == ',') {
            in_row++;
        } else if (c != ',' && !strchr(inside ? "0123456789-+.eE \n\t\r" : " \n\t\r", c)) {
            return;
        }
        digits = digits || (c >= '0' && c <= '9');
    }
    *rows = inside ? 0 : found;
    *columns = first;
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
    stop_syntax(s, s->at, close == ']' ? "a comma or ']' was expected" : "a comma or '}' was expected");
    return false;
}

/* The numbers of the array at s->at, which count_numbers has counted; false when the scan stops. */
static bool scan_numbers(scanner *s, const json_path *path, double *numbers)
{
    bool failed = false;
    s->at++;
    for (size_t i = 0;; i++) {
        json_path here = {path, NULL, 0, i};
        int c = peek(s);
        if (c != '-' && !is_digit(s, s->at)) {
            failed = true;
            stop_syntax(s, s->at, "a number was expected");
        } else {
            failed = !scan_number(s, &here, &numbers[i]);
        }
        if (failed || !next_item(s, ']', &failed))
            return !failed;
    }
}

static json_t *lift_numbers(scanner *s, const json_path *path, int64_t count)
{
    double *numbers = room_for((size_t)count, sizeof *numbers);
    if (!numbers)
        return stop_memory(s);
    if (scan_numbers(s, path, numbers))
        return lift(s, (json_lifted){.numbers = numbers, .count = count});
    free(numbers);
    return NULL;
}

static json_t *lift_table(scanner *s, const json_path *path, int64_t rows, int64_t columns)
{
    bool failed = false;
    double *numbers = room_for((size_t)rows, (size_t)columns * sizeof *numbers);
    if (!numbers)
        return stop_memory(s);
    s->at++;
    for (int64_t i = 0;; i++) {
        json_path here = {path, NULL, 0, (size_t)i};
        failed = peek(s) != '[';
        if (failed)
            stop_syntax(s, s->at, "a row of numbers was expected");
        else
            failed = !scan_numbers(s, &here, numbers + i * columns);
        if (failed || !next_item(s, ']', &failed))
            break;
    }
    if (!failed)
        return lift(s, (json_lifted){.numbers = numbers, .count = rows, .columns = columns});
    free(numbers);
    return NULL;
}

/* -------------------------------------------------------------- values */

/* The decoded string at s->at, NUL-terminated, owned by the caller. */
static char *scan_bytes(scanner *s, size_t *len)
{
    size_t start = s->at + 1, end;
    bool plain;
    const char *why = json_text_check(s->text, s->len, s->at, &end, &plain);
    if (why)
        return stop_syntax(s, end, why);
    char *text = room_for(end - start + 1, 1);
    if (!text)
        return stop_memory(s);
    *len = end - start;
    if (plain)
        memcpy(text, s->text + start, *len);
    else
        *len = json_text_decode(text, s->text + start, *len);
    text[*len] = '\0';
    s->at = end + 1;
    return text;
}

static json_t *scan_string(scanner *s)
{
    size_t len;
    char *text = scan_bytes(s, &len);
    if (!text)
        return NULL;
    if (len > JSON_LIFT_TEXT_LEN)
        return lift(s, (json_lifted){.is_text = true, .text = text, .len = len});
    json_t *value = json_stringn_nocheck(text, len);
    free(text);
    return made(s, value);
}

static json_t *scan_array(scanner *s, const json_path *path)
{
    int64_t count = count_numbers(s);
    if (count > JSON_LIFT_NUMBERS)
        return lift_numbers(s, path, count);
    int64_t rows, columns;
    count_table(s, &rows, &columns);
    if (rows > JSON_LIFT_NUMBERS)
        return lift_table(s, path, rows, columns);
    bool failed = false;
    json_t *array = made(s, json_array());
    s->at++;
    bool more = array && peek(s) != ']';
    s->at += array && !more;
    for (size_t i = 0; more; i++) {
        json_path here = {path, NULL, 0, i};
        json_t *item = scan_value(s, &here);
        failed = !item;
        if (item && json_array_append_new(array, item) != 0) {
            failed = true;
            stop_memory(s);
        }
        more = !failed && next_item(s, ']', &failed);
    }
    if (!failed)
        return array;
    json_decref(array);
    return NULL;
}

/* One "key": value into the object; false when the scan stops. */
static bool scan_member(scanner *s, json_t *object, const json_path *path)
{
    json_path here = {path, "", 0, 0};
    json_t *value = NULL;
    bool done = false;
    if (peek(s) != '"')
        return stop_syntax(s, s->at, "a key in double quotes was expected") != NULL;
    char *key = scan_bytes(s, &here.key_len);
    if (!key)
        return false;
    here.key = key;
    if (peek(s) != ':') {
        stop_syntax(s, s->at, "a colon was expected after the key");
        goto end;
    }
    s->at++;
    if (json_object_getn(object, key, here.key_len))
        refuse_key(s, &here);
    value = scan_value(s, &here);
    if (!value)
        goto end;
    done = json_object_setn_new_nocheck(object, key, here.key_len, value) == 0;
    if (!done)
        stop_memory(s);
end:
    free(key);
    return done;
}

static json_t *scan_object(scanner *s, const json_path *path)
{
    bool failed = false;
    json_t *object = made(s, json_object());
    s->at++;
    bool more = object && peek(s) != '}';
    s->at += object && !more;
    while (more) {
        failed = !scan_member(s, object, path);
        more = !failed && next_item(s, '}', &failed);
    }
    if (!failed)
        return object;
    json_decref(object);
    return NULL;
}

static json_t *scan_container(scanner *s, const json_path *path, bool object)
{
    if (s->depth == json_depth_limit())
        return stop_limit(s, 400, "json_depth", path, "levels of arrays and objects", json_depth_limit());
    s->depth++;
    json_t *value = object ? scan_object(s, path) : scan_array(s, path);
    s->depth--;
    return value;
}

static json_t *scan_value(scanner *s, const json_path *path)
{
    double number;
    int c = peek(s);
    if (++s->values > JSON_MAX_VALUES)
        return stop_limit(s, 413, "too_many_values", path,
                          "values besides long number arrays; write vectors as one flat array", JSON_MAX_VALUES);
    switch (c) {
    case '{':
        return scan_container(s, path, true);
    case '[':
        return scan_container(s, path, false);
    case '"':
        return scan_string(s);
    case 't':
        return scan_word(s, "true", json_true());
    case 'f':
        return scan_word(s, "false", json_false());
    case '-':
        break;
    default:
        if (c < '0' || c > '9')
            return scan_word(s, "null", json_null());
    }
    return scan_number(s, path, &number) ? made(s, json_real(number)) : NULL;
}

bool json_scan(json_doc *doc, const char *body, size_t len, problem_details *problem)
{
    scanner s = {.text = body, .len = len, .doc = doc, .problem = problem};
    *doc = (json_doc){0};
    *problem = (problem_details){0};
    if (len >= 3 && memcmp(body, "\xef\xbb\xbf", 3) == 0)
        stop_syntax(&s, 0, "the text begins with a byte order mark; remove it");
    else if (peek(&s) < 0)
        stop_syntax(&s, s.at, "the body is empty; a JSON object was expected");
    else if ((doc->root = scan_value(&s, NULL)) && peek(&s) >= 0)
        stop_syntax(&s, s.at, "something follows the end of the JSON text");
    if (problem->status == 0)
        return true;
    json_doc_clear(doc);
    return false;
}
