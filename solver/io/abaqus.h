/* abaqus.h: an input file of Abaqus or CalculiX while its mesh is read. Private to uz_abaqus_read.
 *
 * Source of the format: CalculiX CrunchiX user's manual, "Input deck format"; what both programs read alike. */
#ifndef UZ_IO_ABAQUS_H
#define UZ_IO_ABAQUS_H

#include "element/element_type.h"
#include "uzawa.h"

/* ---- lines and their fields (abaqus_text.c) */

enum { ABAQUS_KEYWORD = 1024, ABAQUS_FIELD = 96, ABAQUS_NAME = 64 };

typedef struct {
    const char *at, *end; /* what is behind the current line */
    int64_t number;       /* of the current line, from 1; 0: before the first */
    const char *line;     /* length bytes, without blanks at its ends */
    size_t length;
    size_t taken; /* of them by abaqus_field */
    uz_error *err;
} abaqus_text;

uz_status abaqus_fail(const abaqus_text *text, uz_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Another line of the same text, for abaqus_fail. */
#define ABAQUS_LINE(text, line) (&(abaqus_text){.number = (line), .err = (text)->err})
/* Moves to the next line that is neither blank nor a comment; false, and an empty line: there is none. */
bool abaqus_next_line(abaqus_text *text);
static inline bool abaqus_is_keyword(const abaqus_text *text)
{
    return text->line[0] == '*';
}

/* A keyword line, with the lines that continue it: its name in capitals, then its parameters. */
typedef struct {
    int64_t line;
    char text[ABAQUS_KEYWORD]; /* fields, each with a NUL behind it */
    size_t length;
} abaqus_keyword;
uz_status abaqus_read_keyword(abaqus_keyword *out, abaqus_text *text);
/* What is behind a name that the text begins with, blanks aside, which CalculiX does not read either ("ENDSTEP",
 * "REFNODE"); NULL: it begins otherwise. */
const char *abaqus_behind(const char *text, const char *name);
static inline bool abaqus_keyword_is(const abaqus_keyword *keyword, const char *name)
{
    const char *behind = abaqus_behind(keyword->text, name);
    return behind && *behind == '\0';
}
/* The value of a parameter ("" if it has none), without quotes; NULL: it is not there. */
const char *abaqus_parameter(const abaqus_keyword *keyword, const char *name);
/* The value of a parameter as a name of a set or surface; where it is not there and not needed, "". */
uz_status abaqus_name(char out[ABAQUS_NAME], const abaqus_keyword *keyword, const char *parameter, bool needed,
                      const abaqus_text *text);

/* The next field of the current line without blanks and quotes, in field; false: there is no further one. A comma at
 * the end of a line has no field behind it. */
bool abaqus_field(char field[ABAQUS_FIELD], abaqus_text *text);
/* A field as a number; an empty one is 0.0. what: what it should be. */
uz_status abaqus_int(int64_t *value, const char *field, const char *what, const abaqus_text *text);
uz_status abaqus_real(double *value, const char *field, const char *what, const abaqus_text *text);

/* ---- what a file says */

/* Numbers of a file in the order that they came, and where each stands. */
typedef struct {
    int64_t count, room;
    int64_t *tag;    /* count */
    int64_t *by_tag; /* count, by abaqus_tags_sort: indices, by tag; NULL: they ascend as they came */
} abaqus_tags;
/* Prepares abaqus_tags_at and _find; refuses a number that two have. */
uz_status abaqus_tags_sort(abaqus_tags *tags, const char *what, const abaqus_text *text);
/* The place of a tag, or of the first larger one, in the order of tags; index: what stands there. */
int64_t abaqus_tags_at(const abaqus_tags *tags, int64_t tag);
static inline int64_t abaqus_tags_index(const abaqus_tags *tags, int64_t place)
{
    return tags->by_tag ? tags->by_tag[place] : place;
}
int64_t abaqus_tags_find(const abaqus_tags *tags, int64_t tag); /* its index, -1: there is none */

enum { ABAQUS_SLOTS = 16384 };

typedef enum { ABAQUS_NSET, ABAQUS_ELSET, ABAQUS_SURFACE } abaqus_set_kind;

/* A part of a set: numbers first, first + step, ... last, or all of a set. Of a surface: these elements' face; of one
 * of nodes, face 0: these nodes. */
typedef struct {
    int64_t line, first, last, step;
    int64_t set;    /* -1: numbers */
    int face;       /* from 1; 0: nodes; -1: the nodes of a set of elements */
    bool generated; /* a range, which may have gaps */
} abaqus_item;

typedef struct {
    abaqus_set_kind kind;
    char name[ABAQUS_NAME];
    int64_t n_items, room;
    abaqus_item *item;
} abaqus_set;

/* Members of a set: indices of nodes or elements, ascending, each once; of a surface, with the side of each element, in
 * the order given. */
typedef struct {
    int64_t count, room, face_room, *index;
    unsigned char *face; /* of a surface; NULL: none */
} abaqus_members;

typedef struct {
    abaqus_text text;
    size_t max_bytes;
    abaqus_tags nodes, elements;
    int64_t xyz_room, type_room, line_room, first_room, place_room;
    double *xyz;         /* nodes x 3 */
    unsigned char *type; /* elements: number of abaqus_type */
    int64_t *line;       /* elements: where each begins */
    int64_t *first;      /* elements + 1 */
    int64_t *node;       /* tags */
    abaqus_set *sets;
    int64_t n_sets, sets_room;
    abaqus_members *members;    /* n_sets, by abaqus_make_groups; NULL: not yet */
    int32_t slot[ABAQUS_SLOTS]; /* by a hash of kind and name: index of a set + 1; 0: empty */
    int64_t n_parts, n_instances;
} abaqus_file;

uz_status abaqus_no_memory(const abaqus_text *text);

/* What is no part of a body, as "a shell", and what to do with it. */
typedef struct {
    const char *what, *remedy;
} abaqus_family;

/* A type of element: one of the body, or what is not, but may say which its sides are. */
typedef struct {
    int dim, nodes;
    int kind;                    /* uz_element_kind; -1: a side or a line */
    const abaqus_family *family; /* of a side or a line; NULL: of the body */
} abaqus_type;
enum { ABAQUS_SIDES = UZ_ELEMENT_KINDS }; /* types from here on are no elements of a body */
abaqus_type abaqus_type_of(int number);
/* Refuses an element of a family: its line, what it is, and the remedy. */
uz_status abaqus_fail_no_body(const abaqus_file *file, int64_t element);

/* ---- sets (abaqus_sets.c) */

/* The index of the set, which is made where it is not there. Names are compared without case. */
uz_status abaqus_set_of(int64_t *set, abaqus_file *file, abaqus_set_kind kind, const char *name);
int64_t abaqus_set_find(abaqus_file *file, abaqus_set_kind kind, const char *name); /* -1: there is none */
uz_status abaqus_set_add(abaqus_file *file, int64_t set, abaqus_item item);
/* Blocks *NSET, *ELSET, *SURFACE, from behind the keyword to before the next one. */
uz_status abaqus_read_set(abaqus_file *file, const abaqus_keyword *keyword, abaqus_set_kind kind);
uz_status abaqus_read_surface(abaqus_file *file, const abaqus_keyword *keyword);
/* The corners of a side of an element, by their places in it from 1, as "1562"; NULL: it has no such side. */
const char *abaqus_side(uz_element_kind kind, int face);
/* Groups of the mesh, whose nodes are there, and file->members. new_element (elements): the number of each in the mesh,
 * -1: a side. */
uz_status abaqus_make_groups(uz_given_mesh *out, abaqus_file *file, const int64_t *new_element);

/* ---- the file (abaqus.c) */

/* The mesh of a whole file, and what the file has said; new_element as above, for free. The caller clears all of them,
 * whatever happens. */
uz_status abaqus_read_mesh(uz_given_mesh *out, abaqus_file *file, int64_t **new_element);
void abaqus_clear(abaqus_file *file);

#endif
