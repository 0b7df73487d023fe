/* streams.h: the standard streams of a program. */
#ifndef UZ_TEXT_STREAMS_H
#define UZ_TEXT_STREAMS_H

/* For main, before anything else is opened: descriptors 0 to 2 that the caller closed stay unusable, and nobody else's.
 * Else the next file or socket gets the number, and what is said on standard output or error goes into it. */
void uz_hold_standard_streams(void);

#endif
