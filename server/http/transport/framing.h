/* framing.h: where a request ends, decided as strictly as RFC 9112 allows, so that no proxy in front can disagree.
 *
 * libmicrohttpd 0.9.75 accepts Content-Length beside Transfer-Encoding, two lengths, "Content-Length : 5", bare LF,
 * NUL in a header and folded lines. Each is refused here with 400, and the connection closes: what follows such a
 * request on the connection can't be trusted. */
#ifndef SERVER_HTTP_FRAMING_H
#define SERVER_HTTP_FRAMING_H

#include "http/transport/transport.h"

typedef struct {
    bool chunked;
    uint64_t length; /* of the body when it is not chunked; 0 when there is none */
} framing;

/* Reads the framing, and takes white space behind the values of fields away; false with the problem: 400 for anything
 * ambiguous or malformed, 417, 431, 505. */
bool framing_read(framing *out, const char *version, header_list *headers, problem_details *problem);

/* Where libmicrohttpd left the parts of a header block in its read buffer. It parses in place and writes NULs over the
 * separators, so the parts must tile the block, with one byte between words and two (CR LF) between lines. A bare LF,
 * a NUL in the text, a folded line, a doubled space each break the tiling. */
typedef struct {
    const char *method, *target, *version;
    size_t target_len; /* before libmicrohttpd decoded it in place */
    size_t block_len;  /* of the whole header block, empty line included */
} framing_layout;
bool framing_tiles(const framing_layout *layout, const header_list *headers);

/* A chunked body (RFC 9112, section 7.1), followed byte by byte: sizes of at most 15 digits, extensions without control
 * characters, CR LF and nothing else at the end of size lines, data and trailer fields. Begins zeroed. */
typedef struct {
    enum {
        CHUNKS_SIZE,
        CHUNKS_EXTENSION,
        CHUNKS_SIZE_LF,
        CHUNKS_DATA,
        CHUNKS_DATA_CR,
        CHUNKS_DATA_LF,
        CHUNKS_TRAILER, /* at the start of a line */
        CHUNKS_FIELD,
        CHUNKS_FIELD_LF,
        CHUNKS_LAST_LF,
        CHUNKS_DONE
    } state;
    int digits;
    uint64_t left;   /* of this chunk's data; of the size so far */
    uint64_t beyond; /* bytes that came behind the body */
} chunk_follower;
/* False: what came is not that. */
bool chunks_follow(chunk_follower *f, const char *data, size_t size);

#endif
