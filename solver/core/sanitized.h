/* sanitized.h: whether this is built with AddressSanitizer or ThreadSanitizer, under which the same work takes five to
 * twenty times as long, in memory and with system calls of their own. */
#ifndef UZ_CORE_SANITIZED_H
#define UZ_CORE_SANITIZED_H

#ifndef __has_feature
#define __has_feature(name) 0 /* clang's way of saying what gcc says with a macro */
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || __has_feature(address_sanitizer) ||               \
    __has_feature(thread_sanitizer)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

#endif
