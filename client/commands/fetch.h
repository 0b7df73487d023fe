/* fetch.h: what the commands share that fetch something of a job. */
#ifndef CLIENT_FETCH_H
#define CLIENT_FETCH_H

#include "commands/run.h"

typedef struct {
    const char *name, *value; /* value NULL: left out */
} client_query;

/* Appends "a,b" of the words, "" of none. False: no memory. */
bool client_append_words(client_buffer *out, const uz_words *words);
/* Appends "&name=value", escaped; nothing where value is NULL. False: no memory. */
bool client_append_query(client_buffer *path, const char *name, const char *value);
/* "/v1/jobs/ID/result?a=1&b=2"; a part without a name ends the list. The caller frees. NULL: no memory, said. */
char *client_path_with_query(client_session *s, const char *id, const char *suffix, const client_query *part);

/* To --output or standard output, whole or not at all; with --json it says what was written. */
client_exit client_deliver(client_session *s, const char *text, size_t len);

/* Closes a stream into memory (open_memstream); false: there is not all of it, or it is NULL. */
bool client_stream_end(FILE *to);
/* CSV (length bytes and a NUL) as it is, or in columns for a person: numbers with five digits, "-" for none. */
client_exit client_deliver_rows(client_session *s, const char *csv, size_t length, bool columns);

/* A picture as PNG, by way of rsvg-convert, appended to *png; what is in the way is told on s->err. */
client_exit client_picture_to_png(client_session *s, const client_buffer *svg, client_buffer *png);

/* The fields ("a,b") of the job's answer as CSV, or in columns. */
client_exit client_table(client_session *s, const char *fields, bool columns);
/* The numbers of the answer, or of each of its cases, likewise. */
client_exit client_numbers(client_session *s, bool columns);
/* FILE.pvd, which --output names, and FILE-1.vtu, ... of the cases, with these fields (NULL: those by default). */
client_exit client_series_of_files(client_session *s, const char *fields);
/* A history in CSV as a drawing; it goes where the data would. */
client_exit client_draw_history(client_session *s, const char *csv);
/* What each digit took (work-precision.json), as a table with bars. */
void client_draw_trade(client_session *s, const json_t *trade);
/* Of a result with load cases of large deformation the force that changes most over the largest displacement, as a
 * drawing, or with --json as numbers. */
client_exit client_draw_path(client_session *s, const json_t *result);

#endif
