/* given_file.h: the files that options name. */
#ifndef BASE_GIVEN_FILE_H
#define BASE_GIVEN_FILE_H

#include <stdio.h>

/* Opened for reading. Of a pipe, as <(...) is one, somebody has to be writing: it is not waited for who might. NULL
 * with errno, ENXIO where nobody writes. */
FILE *given_file_open(const char *path);

#endif
