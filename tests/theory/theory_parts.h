/* theory_parts.h: the parts of build/theory.json that are not stress against theory. */
#ifndef TESTS_THEORY_PARTS_H
#define TESTS_THEORY_PARTS_H

#include <stdio.h>

/* Each writes members of a JSON object, the comma before them included, and prints a table. */
void theory_elements(FILE *json); /* "elements", "cook", "tubes" */
void theory_ladders(FILE *json);  /* "ladders" */

#endif
