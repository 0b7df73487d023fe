/* all_events.h: what streams over all jobs share: the texts of the latest changes, each encoded once for all of them.
 */
#ifndef SERVER_HTTP_ALL_EVENTS_H
#define SERVER_HTTP_ALL_EVENTS_H

typedef struct told_changes told_changes;

told_changes *told_changes_new(void);    /* NULL: no memory */
void told_changes_free(told_changes *t); /* NULL is fine */

#endif
