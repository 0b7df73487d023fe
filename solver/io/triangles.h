/* triangles.h: the file formats that a surface of triangles is read from. Private to uz_triangles_read. To add one: a
 * row of the table in triangles.c. */
#ifndef UZ_IO_TRIANGLES_H
#define UZ_IO_TRIANGLES_H

#include "uzawa.h"

/* A surface while it is read. */
typedef struct {
    uz_triangles *out;
    int64_t room;     /* corners that there is room for */
    size_t max_bytes; /* 0: no bound */
    uz_error *err;
} triangles_in;

/* Appends a triangle; line: for refusals (0: none). UZ_ERR_LIMIT, _MEMORY. */
uz_status triangles_add(triangles_in *in, const double corner[3][3], int64_t line);

/* The next line of a text that is not blank, without blanks at its ends. */
typedef struct {
    const char *next, *end; /* what is behind the line */
    const char *line, *line_end;
    int64_t number; /* of the line, from 1 */
} triangles_text;
bool triangles_next_line(triangles_text *text);
/* The next word of the line; false: there is none. */
bool triangles_word(const char **word, size_t *len, triangles_text *text);
bool triangles_is(const char *word, size_t len, const char *what);
/* Three numbers from the line; what: "a vertex", for messages. UZ_ERR_FORMAT, _NOT_FINITE. */
uz_status triangles_reals(double x[3], triangles_text *text, const char *what, uz_error *err);

/* Rows of the table. */
uz_status triangles_stl_read(triangles_in *in, const char *text, size_t len);
uz_status triangles_obj_read(triangles_in *in, const char *text, size_t len);

#endif
