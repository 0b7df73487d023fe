/* upload_file.h: an upload on its way to disk: decompressed, hashed and written piece by piece. Knows files, not rows.
 */
#ifndef SERVER_STORE_UPLOAD_FILE_H
#define SERVER_STORE_UPLOAD_FILE_H

#include "store/uploads.h"

#define UPLOAD_INCOMING "incoming-" /* how names of unfinished files begin */

typedef struct upload_file upload_file;

/* Asks for room for so many more bytes on disk. */
typedef upload_status (*upload_room)(void *ctx, int64_t more);

/* A new file in the folder, which is made where it is missing. NULL: *status, and the reason in message. */
upload_file *upload_file_new(const char *folder, bool gzip, upload_room room, void *ctx, upload_status *status,
                             char *message, size_t size);
upload_status upload_file_write(upload_file *f, const void *data, size_t size, char *message, size_t message_size);
/* No more comes: the digest and the size; the bytes are on disk, still under the name of an unfinished file. */
upload_status upload_file_finish(upload_file *f, char id[UPLOAD_ID_LEN + 1], char *message, size_t size);
/* Gives it its name, durably. */
upload_status upload_file_publish(upload_file *f, const char *folder, const char *id, char *message, size_t size);
int64_t upload_file_bytes(const upload_file *f);
/* STORE_OK where all that can be read at fd has this digest, else STORE_DAMAGED; STORE_ERROR: it can't be read. Reads
 * with read(), not by a mapping: a bad sector is an error then, and not a signal. */
store_status upload_file_check(int fd, const char *id);
/* Closes it, and removes what was not published. NULL is fine. */
void upload_file_free(upload_file *f);

/* All bytes, however often the system asks again; false: errno says why. */
bool upload_write_all(int fd, const void *data, size_t size);

#endif
