/* json.c: the tree's memory, and how it is read. */
#include "codec/json.h"
#include "codec/room.h"

#include <stdio.h>
#include <string.h>

/* ---- memory */

struct json_block {
    json_block *next;
    size_t used, size;
    _Alignas(8) char data[];
};

enum { FIRST_BLOCK = 4096, LARGEST_BLOCK = 1 << 20 };

void *json_room(json_tree *tree, size_t size)
{
    json_block *head = tree->blocks;
    const size_t need = (size + 7) / 8 * 8;
    if (head && need <= head->size - head->used) {
        head->used += need;
        return head->data + head->used - need;
    }
    size_t next = !head ? FIRST_BLOCK : head->size < LARGEST_BLOCK ? 2 * head->size : LARGEST_BLOCK;
    const bool alone = need > next / 2; /* the room that is left in the first block is not lost for it */
    next = alone ? need : next;
    json_block *block = need >= size && next <= SIZE_MAX - sizeof *block ? malloc(sizeof *block + next) : NULL;
    if (!block)
        return NULL;
    json_block **at = alone && head ? &head->next : &tree->blocks;
    *block = (json_block){*at, need, next};
    *at = block;
    return block->data;
}

void json_free_numbers(json_value *value)
{
    if (value->kind == JSON_IS_NUMBERS && value->is_long)
        free(value->numbers);
    if (value->kind == JSON_IS_ARRAY || value->kind == JSON_IS_OBJECT)
        for (size_t i = 0; i < value->count; i++)
            json_free_numbers(&value->items[i]);
}

void json_clear(json_tree *tree)
{
    if (tree->root)
        json_free_numbers(tree->root);
    while (tree->blocks) {
        json_block *next = tree->blocks->next;
        free(tree->blocks);
        tree->blocks = next;
    }
    tree->root = NULL;
}

/* ---- reading */

bool json_is(const json_value *value, json_kind kind)
{
    return value && value->kind == kind;
}

bool json_is_list(const json_value *value)
{
    return value && (value->kind == JSON_IS_ARRAY || value->kind == JSON_IS_NUMBERS);
}

size_t json_size(const json_value *value)
{
    return json_is_list(value) || json_is(value, JSON_IS_OBJECT) ? value->count : 0;
}

const json_value *json_get_n(const json_value *object, const char *key, size_t len)
{
    for (size_t i = 0; json_is(object, JSON_IS_OBJECT) && i < object->count; i++)
        if (object->items[i].place == len && memcmp(object->items[i].key, key, len) == 0)
            return &object->items[i];
    return NULL;
}

const json_value *json_get(const json_value *object, const char *key)
{
    return json_get_n(object, key, strlen(key));
}

const json_value *json_item(const json_value *array, size_t i, json_value *room)
{
    if (!json_is_list(array) || i >= array->count)
        return NULL;
    if (array->kind == JSON_IS_ARRAY)
        return &array->items[i];
    *room = (json_value){.parent = array, .place = i, .kind = array->columns ? JSON_IS_NUMBERS : JSON_IS_NUMBER};
    if (array->columns) {
        room->numbers = array->numbers + i * array->columns;
        room->count = array->columns;
    } else {
        room->number = array->numbers[i];
    }
    return room;
}

double json_number(const json_value *value, double otherwise)
{
    return json_is(value, JSON_IS_NUMBER) ? value->number : otherwise;
}

bool json_truth(const json_value *value)
{
    return json_is(value, JSON_IS_BOOLEAN) && value->truth;
}

const char *json_text(const json_value *value)
{
    return json_is(value, JSON_IS_STRING) && !value->is_long ? value->text : NULL;
}

bool json_text_is(const json_value *value, const char *word)
{
    const char *text = json_text(value);
    return text && value->count == strlen(word) && memcmp(text, word, value->count) == 0;
}

bool json_same(const json_value *a, const json_value *b)
{
    if (!a || !b || a->kind != b->kind)
        return a == b;
    if (a->kind == JSON_IS_NULL)
        return true;
    if (a->kind == JSON_IS_BOOLEAN)
        return a->truth == b->truth;
    if (a->kind == JSON_IS_NUMBER)
        return a->number == b->number;
    if (a->count != b->count)
        return false;
    if (a->kind == JSON_IS_STRING && !a->is_long)
        return memcmp(a->text, b->text, a->count) == 0;
    if (a->kind == JSON_IS_STRING) {
        char *x = json_copy_text(a), *y = json_copy_text(b);
        const bool equal = x && y && memcmp(x, y, a->count) == 0;
        free(x);
        free(y);
        return equal;
    }
    bool same = a->kind != JSON_IS_NUMBERS || a->columns == b->columns;
    for (size_t i = 0; same && i < a->count * (a->columns ? a->columns : 1); i++)
        same =
            a->kind == JSON_IS_NUMBERS
                ? a->numbers[i] == b->numbers[i]
                : json_same(&a->items[i], a->kind == JSON_IS_ARRAY ? &b->items[i]
                                                                   : json_get_n(b, a->items[i].key, a->items[i].place));
    return same;
}

char *json_copy_text(const json_value *string)
{
    char *copy = string->count < PTRDIFF_MAX - 1 ? malloc(string->count + 1) : NULL;
    if (!copy)
        return NULL;
    if (string->is_long)
        json_text_decode(copy, string->text, string->count);
    else
        memcpy(copy, string->text, string->count);
    copy[string->count] = '\0';
    return copy;
}

double *json_take_numbers(const json_value *array)
{
    const size_t count = array->count * (array->columns ? array->columns : 1);
    double *numbers = array->numbers;
    if (array->is_long) {
        ((json_value *)array)->numbers = NULL;
        return numbers;
    }
    double *copy = room_for(count, sizeof *copy);
    if (copy)
        memcpy(copy, numbers, count * sizeof *copy);
    return copy;
}

/* ---- pointers */

void json_pointer(char *out, size_t size, const json_value *value)
{
    const json_value *steps[JSON_MAX_DEPTH + 2];
    size_t n = 0, used = 0;
    for (; value && value->parent && n < sizeof steps / sizeof steps[0]; value = value->parent)
        steps[n++] = value;
    if (size > 0)
        out[0] = '\0';
    while (n > 0 && size > 0) {
        const json_value *step = steps[--n];
        size_t end = used; /* of this step, if all of it is written */
        if (step->key) {
            for (size_t i = 0; i <= step->place; i++) {
                const unsigned char c = i == 0 ? 0 : (unsigned char)step->key[i - 1];
                const char one[2] = {(char)(i == 0 ? '/' : c < 0x20 || c == 0x7f ? '?' : c), '\0'};
                for (const char *shown = c == '~' ? "~0" : c == '/' ? "~1" : one; *shown; shown++, end++)
                    if (end < size)
                        out[end] = *shown;
            }
        } else {
            end += (size_t)snprintf(out + used, size - used, "/%zu", step->place);
        }
        if (end < size)
            used = end;
        out[used] = '\0';
        if (end != used)
            return;
    }
}

/* ---- the outermost object of a valid text */

static size_t skip_space(const char *json, size_t len, size_t at)
{
    while (at < len && strchr(" \t\r\n", json[at]))
        at++;
    return at;
}

/* Behind the closing quote of the string that begins at `at`. */
static size_t string_end(const char *json, size_t len, size_t at)
{
    for (at++; at < len && json[at] != '"'; at++)
        at += json[at] == '\\';
    return at + 1;
}

const char *json_member_text(const char *json, size_t len, const char *key, size_t *member_len)
{
    const size_t wanted = strlen(key);
    size_t at = skip_space(json, len, skip_space(json, len, 0) + 1);
    *member_len = 0;
    while (at < len && json[at] == '"') {
        const size_t end = string_end(json, len, at), inside = end - at - 2;
        const size_t value = skip_space(json, len, skip_space(json, len, end) + 1);
        int depth = 0;
        size_t behind = value;
        while (behind < len && (depth > 0 || (json[behind] != ',' && json[behind] != '}'))) {
            const char c = json[behind];
            depth += (c == '{' || c == '[') - (c == '}' || c == ']');
            behind = c == '"' ? string_end(json, len, behind) : behind + 1;
        }
        const size_t next = behind;
        while (behind > 0 && strchr(" \t\r\n", json[behind - 1]))
            behind--;

        /* the key may be written with escapes, at most six bytes for each of its own */
        char plain[64];
        size_t quote, bytes = 0;
        if (inside <= 6 * wanted && wanted + 4 <= sizeof plain &&
            !json_text_check(json + at, inside + 2, 0, &quote, &bytes) && bytes == wanted &&
            json_text_decode(plain, json + at + 1, bytes) == wanted && memcmp(plain, key, wanted) == 0) {
            *member_len = behind - value;
            return json + value;
        }
        at = skip_space(json, len, next + (next < len && json[next] == ','));
    }
    return NULL;
}
