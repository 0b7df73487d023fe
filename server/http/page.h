/* page.h: the files of the web page (client/page), put into the program at build time by client/page/bundle.sh. */
#ifndef SERVER_HTTP_PAGE_H
#define SERVER_HTTP_PAGE_H

#include <stddef.h>

typedef struct {
    const char *name, *type;  /* "index.html" and its media type */
    const char *plain, *gzip; /* the content and its gzip; not NUL-terminated */
    size_t plain_len, gzip_len;
} page_file;

page_file page_file_at(size_t i); /* name NULL past the end */

#endif
