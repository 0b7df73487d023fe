/* gmsh.h: a Gmsh file while it is read. Private to uz_gmsh_read.
 *
 * Source of the formats: Gmsh reference manual, sections "MSH file format" (4.1) and "MSH file format version 2"; that
 * of Gmsh 4.0 for 4.0, whose numbers of nodes and elements have 4 bytes, and whose heads another order. */
#ifndef UZ_SCENE_GMSH_H
#define UZ_SCENE_GMSH_H

#include "element/element_type.h"
#include "uzawa.h"

/* ---- the text (gmsh_text.c) */

typedef struct {
    const char *begin, *at, *end;
    int64_t line; /* 1-based, of `at`; not counted within binary data */
    bool binary;  /* numbers are bytes, but for those that say *_text */
    uz_error *err;
} gmsh_text;

/* Fails at a line, or in a binary file at a byte: a place that was passed before, or that the text has come to. */
uz_status gmsh_fail_at(const gmsh_text *text, const gmsh_text *place, uz_status status, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
#define gmsh_fail(text, ...) gmsh_fail_at(text, text, __VA_ARGS__)

/* A number: 4 bytes, 8 bytes without a sign, 8 bytes, or a word. `what` is what it should be, for the message. */
uz_status gmsh_int(gmsh_text *text, int64_t *value, const char *what);
uz_status gmsh_size(gmsh_text *text, int64_t *value, const char *what);
/* So many reals, which xyz NULL skips. */
uz_status gmsh_reals(gmsh_text *text, int count, double *xyz);
/* Words also in a binary file. */
uz_status gmsh_int_text(gmsh_text *text, int64_t *value, const char *what);
uz_status gmsh_real_text(gmsh_text *text, double *value);
/* A text in double quotes: at most 63 bytes of UTF-8 without control characters. */
uz_status gmsh_quoted(gmsh_text *text, char out[64]);

/* The head of a section in version 4.0 and 4.1: numbers of blocks and of items, in 4.1 the least and the largest tag.
 * what: the numbers of blocks, of items, and of one of them, for messages. */
uz_status gmsh_head_4(gmsh_text *text, int version, int64_t *blocks, int64_t *count, const char *const what[3]);

/* A count of items that take at least so many bytes each: refused if the file is too short for them. */
uz_status gmsh_count(const gmsh_text *text, int64_t count, size_t each, const char *what);

enum { GMSH_NAME = 48 };
/* Moves behind the line "$name"; name "" at the end of the text. */
uz_status gmsh_section(gmsh_text *text, char name[GMSH_NAME]);
/* Moves behind the end of the current line, on which there is nothing more. */
uz_status gmsh_end_line(gmsh_text *text);
/* Requires "$Endname". */
uz_status gmsh_section_end(gmsh_text *text, const char *name);
/* Moves behind "$Endname" without looking at what is before it. */
uz_status gmsh_skip_section(gmsh_text *text, const char *name);

/* ---- what a file says */

typedef struct {
    int dim;
    int64_t tag;
} gmsh_key;
/* By dimension, then by tag, for qsort and bsearch: keys, and what begins with one. */
int gmsh_compare(const void *a, const void *b);

/* What elements of one entity (4.0, 4.1), or with one physical tag (2.2), belong to. */
typedef struct {
    gmsh_key key;
    int64_t first, count; /* physical[first..first + count) */
    bool used;
} gmsh_part;

typedef struct {
    gmsh_key key;
    char name[64];
} gmsh_name;

typedef struct {
    gmsh_text text;
    int version; /* 22, 40 or 41 */
    size_t max_bytes;

    int64_t n_nodes;
    double *xyz;      /* n_nodes x 3 */
    int64_t *tag;     /* n_nodes */
    int64_t *by_tag;  /* dense: index of tag low_tag + i, -1: none; else the nodes sorted by tag */
    int64_t n_by_tag; /* dense: how many */
    int64_t low_tag;
    bool dense;

    int64_t n_elements, element_room, place_room;
    unsigned char *type; /* Gmsh's number of the element type */
    int64_t *part_tag;   /* entity (4.1) or physical tag (2.2); 0: none */
    int64_t *first;      /* n_elements + 1 */
    int64_t *node;       /* from 0 */
    gmsh_text elements_at;

    gmsh_part *parts;
    int64_t n_parts, part_room;
    int64_t *physical, n_physical, physical_room;
    gmsh_name *names;
    int64_t n_names;
    bool entities_read;
} gmsh_file;

uz_status gmsh_no_memory(const gmsh_file *file);

/* ---- sections: each starts behind its "$Name" line and ends before "$EndName" */
uz_status gmsh_read_names(gmsh_file *file);
uz_status gmsh_read_entities(gmsh_file *file, bool partitioned);
uz_status gmsh_read_nodes(gmsh_file *file);
uz_status gmsh_read_elements(gmsh_file *file);

/* Index of the node with that tag, -1: there is none. */
int64_t gmsh_find_node(const gmsh_file *file, int64_t tag);

/* ---- elements of Gmsh */

/* What is known of a type; nodes 0: unknown. */
typedef struct {
    int dim, nodes;
    const char *name, *remedy; /* remedy: what to do where no element is of this type */
} gmsh_type;
gmsh_type gmsh_type_of(int64_t type);
/* The element of that type; -1: none. */
int gmsh_kind_of(int64_t type);

#endif
