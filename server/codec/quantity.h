/* quantity.h: the numbers of a summary by name: "contact.max_pressure", "resultants.contacts.0.force.1". What may be
 * named is what schemas/summary.json says is a number, so that a new entry there can be asserted at once.
 *
 * A number in an array is named by its index from 0, a warning's value by its code ("warnings.large_strain"; 0 where
 * that warning was not given), a quantity's by its name ("quantities.contact_force_top"). An array's own name is the
 * number of its items: "warnings". */
#ifndef SERVER_CODEC_QUANTITY_H
#define SERVER_CODEC_QUANTITY_H

#include "codec/schema.h"

enum { QUANTITY_NAME = 128 }; /* bytes of a name and its NUL */

/* True if the schema of summaries has a number of this name, a string of the request. False: *problem names what was
 * probably meant. */
bool quantity_check(const schemas *all, const json_value *name, problem_details *problem);

/* The number in a summary. False: the summary has no such entry. True: *value, NaN where the entry is null, so not
 * known. */
bool quantity_read(double *value, const json_value *summary, const char *name);

#endif
