/* json_doc.h: a JSON text as values. What is small is jansson; what is big never becomes jansson values.
 *
 * Every number of the text is a jansson *real*. A jansson *integer* therefore never comes from a user: it is the index
 * of a lifted value, and nothing that a user writes can be taken for one. */
#ifndef SERVER_CODEC_JSON_DOC_H
#define SERVER_CODEC_JSON_DOC_H

#include "base/problem_details.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct store;

#define JSON_MAX_DEPTH 64 /* nested arrays and objects */
/* The depth allowed to requests, at most JSON_MAX_DEPTH (codec_set_limits). */
int json_depth_limit(void);
#define JSON_MAX_VALUES   200000 /* each lifted array or string counts as one; about 100 bytes each */
#define JSON_LIFT_NUMBERS 64    /* an array of more numbers than this, and of nothing else, is lifted; and a table of */
                                /* more rows than this, of the same number of numbers each, at most this many */
#define JSON_LIFT_TEXT_LEN 4096 /* a string of more bytes than this is lifted */

/* An array of numbers or of rows of numbers (text NULL), or a decoded string (numbers NULL). Who takes a buffer out
 * sets it to NULL. */
typedef struct {
    double *numbers; /* count, or count x columns row by row */
    int64_t count;   /* items of the array */
    int64_t columns; /* numbers in each item of a table; 0: the items are numbers */
    char *text;      /* len bytes of UTF-8 and a NUL; NUL bytes may stand inside too */
    size_t len;
    bool is_text;
} json_lifted;

typedef struct {
    json_t *root;
    json_lifted *lifted; /* n_lifted */
    size_t n_lifted, capacity;
    struct store *store; /* where uploads are read that the document names; NULL: there are none */
    char (*uploads)[65]; /* n_uploads ids that were read; who takes them out sets it to NULL */
    size_t n_uploads;
} json_doc;

void json_doc_clear(json_doc *doc);

/* The lifted value that `value` stands for, or NULL if it is an ordinary one. */
json_lifted *json_doc_lifted(const json_doc *doc, const json_t *value);

/* Strict RFC 8259 scan of body[0..len) into *doc. False: *problem says why and *doc is empty.
 * Not JSON: 400 json_syntax (with line), or json_depth. JSON that is refused: 422 duplicate_key, number_out_of_range
 * (with pointer); 413 too_many_values; 503 out_of_memory. Memory: at most 4 bytes per byte of number arrays ("0,"),
 * 1 of strings, and JSON_MAX_VALUES other values. */
bool json_scan(json_doc *doc, const char *body, size_t len, problem_details *problem);

/* ---- places: a chain from the value up to the root, kept on the stack of who walks down. NULL is the root. */
typedef struct json_path {
    const struct json_path *parent;
    const char *key; /* key_len bytes; NULL: an array index */
    size_t key_len, index;
} json_path;

/* Writes the JSON pointer (RFC 6901). What does not fit is left out in whole steps; control characters, which no
 * pointer of ours needs, become '?'. */
void json_path_write(char *out, size_t size, const json_path *path);

/* ---- texts within the text: shared by values and keys (json_text.c) */

/* Checks the string whose opening quote is at text[at]. On success *end is the offset of the closing quote and *plain
 * says that there are no escapes. On failure returns what is wrong, and *end is where. NULL: fine. */
const char *json_text_check(const char *text, size_t len, size_t at, size_t *end, bool *plain);
/* Undoes the escapes of a checked string's inside from[0..len) into out (room for len); returns the bytes written. */
size_t json_text_decode(char *out, const char *from, size_t len);
/* Length in bytes of the well-formed UTF-8 character at text[0..len), 0 if it is none (overlong, surrogate, ...). */
size_t json_utf8_length(const char *text, size_t len);

#endif
