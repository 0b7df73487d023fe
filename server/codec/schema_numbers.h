/* schema_numbers.h: schemas of numbers that need no visit for each of a million of them. */
#ifndef SERVER_CODEC_SCHEMA_NUMBERS_H
#define SERVER_CODEC_SCHEMA_NUMBERS_H

#include "codec/schema.h"

/* What a schema asks of a number, where it asks for nothing but a type and a range. */
typedef struct {
    bool plain; /* false: more is asked, or nothing that a number could meet */
    bool whole;
    double least, above, most, below; /* x >= least, x > above, x <= most, x < below */
} schema_numbers;

schema_numbers schema_plain_numbers(schema_at at);
/* The same of the numbers in an array of so many as have been checked, where the schema asks nothing of the array but
 * its length and its items. */
schema_numbers schema_row_numbers(schema_at row);
/* Do these numbers surely satisfy it? */
bool schema_numbers_fit(schema_numbers numbers, const double *x, int64_t count);

#endif
