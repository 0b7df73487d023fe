/* json.h: a JSON text as a tree; everything in the daemon that reads JSON reads this one.
 *
 * An array of numbers, or of rows of as many numbers each, is one value: a block of doubles, so that a mesh or a vector
 * takes eight bytes a number. A long string is not copied: its value points into the text, which must outlive the tree,
 * and its escapes are undone when somebody asks for its bytes. All else lies in a few large blocks.
 *
 * Functions that read take NULL, which is a value that is not there. Source: RFC 8259. */
#ifndef SERVER_CODEC_JSON_H
#define SERVER_CODEC_JSON_H

#include "base/problem_details.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define JSON_MAX_DEPTH 64 /* nested arrays and objects */
/* The depth allowed to requests, at most JSON_MAX_DEPTH (codec_init). */
int json_depth_limit(void);
/* Values of a text. What is long counts as one: a string; an array of more than JSON_SHORT_ARRAY numbers; a table of
 * more rows than that of at most so many numbers each. A value takes sizeof(json_value) bytes, and while it is read
 * twice as many. */
#define JSON_MAX_VALUES  200000
#define JSON_SHORT_ARRAY 64
#define JSON_SHORT_TEXT  4096 /* a string of more bytes is long */

typedef enum {
    JSON_IS_NULL,
    JSON_IS_BOOLEAN,
    JSON_IS_NUMBER,
    JSON_IS_STRING,
    JSON_IS_ARRAY,   /* of anything; [] too */
    JSON_IS_NUMBERS, /* an array with numbers, or with rows of the same number of numbers each */
    JSON_IS_OBJECT
} json_kind;

typedef struct json_value {
    const struct json_value *parent; /* NULL: the root */
    const char *key;                 /* of a member: with a NUL behind it. NULL: an item, or the root */
    size_t place;                    /* bytes of the key; the index of an item */
    union {
        bool truth;
        double number;
        const char *text;         /* a short string with a NUL behind it, or a long one as it stands in the text */
        double *numbers;          /* row by row; NULL once they were taken */
        struct json_value *items; /* of an array, or the members of an object, in their order */
    };
    size_t count;     /* bytes of a string without escapes; items, rows, members */
    uint32_t columns; /* numbers in each row; 0: the items are numbers */
    json_kind kind : 8;
    bool is_long; /* a string that was not copied, or a block of numbers that can be taken */
} json_value;

typedef struct json_block json_block;
typedef struct {
    json_value *root;
    json_block *blocks; /* what the values lie in */
} json_tree;

/* Reads body[0..len) into *tree, strictly. False: *problem says why and *tree is empty.
 * Not JSON: 400 json_syntax (with line), or json_depth. JSON that is refused: 422 duplicate_key, number_out_of_range
 * (with pointer); 413 too_many_values; 503 out_of_memory. Memory: at most 4 bytes per byte of number arrays ("0,"),
 * 1 of short strings, and JSON_MAX_VALUES other values. */
bool json_scan(json_tree *tree, const char *body, size_t len, problem_details *problem);
void json_clear(json_tree *tree);

/* ---- reading (json.c) */

bool json_is(const json_value *value, json_kind kind); /* false for NULL */
bool json_is_list(const json_value *value);            /* an array, of numbers or not */
size_t json_size(const json_value *value);             /* items, rows or members; 0 of what has none */
/* A member of an object, or NULL. */
const json_value *json_get(const json_value *object, const char *key);
const json_value *json_get_n(const json_value *object, const char *key, size_t len);
/* Item i of an array, or NULL. One of a block of numbers has no value of its own: it is put into *room, and a row of
 * them still belongs to the block. */
const json_value *json_item(const json_value *array, size_t i, json_value *room);
double json_number(const json_value *value, double otherwise);
bool json_truth(const json_value *value); /* true, and nothing else */
/* The bytes of a short string; NULL for all else. */
const char *json_text(const json_value *value);
bool json_text_is(const json_value *value, const char *word);
/* Do two values say the same? Numbers as doubles, members in any order. */
bool json_same(const json_value *a, const json_value *b);

/* The bytes of a string, short or long, owned by the caller and with a NUL behind them; NULL: no memory. */
char *json_copy_text(const json_value *string);
/* The numbers of a JSON_IS_NUMBERS, owned by the caller; those of a long array leave the tree. NULL: no memory. */
double *json_take_numbers(const json_value *array);

/* Writes the JSON pointer (RFC 6901) of a value; NULL is the root. What does not fit is left out in whole steps;
 * control characters, which no pointer of ours needs, become '?'. */
void json_pointer(char *out, size_t size, const json_value *value);

/* The text of a member of the outermost object of a text that is known to be valid; *len 0: there is none. Nothing is
 * read but keys and brackets. */
const char *json_member_text(const char *json, size_t len, const char *key, size_t *member_len);

/* ---- used by the scanner */

void *json_room(json_tree *tree, size_t size); /* lives as long as the tree; NULL: no memory */
void json_free_numbers(json_value *value);     /* of the value and of all below it */

/* ---- strings (json_text.c) */

/* Checks the string whose opening quote is at text[at]. On success *end is the offset of the closing quote and *bytes
 * the length without escapes. On failure returns what is wrong, and *end is where. NULL: fine. */
const char *json_text_check(const char *text, size_t len, size_t at, size_t *end, size_t *bytes);
/* Undoes the escapes of a checked string until there are `bytes` bytes, or up to 3 more where they end within an
 * escape; returns how many. */
size_t json_text_decode(char *out, const char *from, size_t bytes);
/* Characters of a string, short or long. */
size_t json_text_characters(const json_value *string);

#endif
