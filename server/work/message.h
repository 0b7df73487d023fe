/* message.h: what the daemon and a process that solves say to each other.
 *
 * One message at a time goes over a socket of packets. What is large lies in segments: requests and pieces of stored
 * results in the inbox, which the daemon writes, answers in the outbox, which the process writes. The board has what
 * changes while a job runs. A conversation:
 *
 *     <- READY                      once, when it has started
 *     -> JOB                        its text is in the inbox
 *     <- ASK     -> ANSWER          an upload, or a part of an earlier job; as often as it likes; or a stream to a
 *                                   group of processes, once, which takes a while: nothing else is asked meanwhile
 *     <- READ                       the text was read; names of the cases are in the outbox
 *     <- KEPT                       an outcome is in the outbox that holds if the process is ended before it is done
 *     <- DONE                       the outcome is in the outbox; not where one lies that was kept
 *     -> PREDICT <- PREDICTED       a text in the inbox whose cost is asked for; it may ASK meanwhile
 *     -> LIST    <- LISTED          between jobs: what its cache has, in the outbox */
#ifndef SERVER_WORK_MESSAGE_H
#define SERVER_WORK_MESSAGE_H

#include "store/store.h"
#include "work/live.h"
#include "work/pace.h"
#include "work/solve.h"

/* In shared memory, written while a job runs. */
typedef struct {
    atomic_bool stop;    /* by the daemon: the job is to end with its best answer so far */
    atomic_bool heard;   /* by the process: it has seen that, and makes its answer */
    atomic_int threads;  /* by the daemon: that the job may take now; 0: none runs, and it may take one */
    atomic_bool starved; /* by the process: it dies because there was no memory */
    live live;           /* by the process */
} board;

typedef enum {
    MESSAGE_READY,
    MESSAGE_JOB,
    MESSAGE_ASK,
    MESSAGE_ANSWER,
    MESSAGE_READ,
    MESSAGE_KEPT,
    MESSAGE_DONE,
    MESSAGE_LIST,
    MESSAGE_LISTED,
    MESSAGE_PREDICT,
    MESSAGE_PREDICTED
} message_kind;
typedef enum { ASK_UPLOAD, ASK_BLOB, ASK_CASE, ASK_GROUP } ask_kind;

enum { CASE_NAME = 64 }; /* bytes of a name in the list of cases */

typedef struct {
    int32_t kind, status; /* message_kind; of ANSWER a store_status */
    union {
        struct {
            bool confined; /* it can do nothing but solve (work/confine.h) */
        } ready;
        struct {
            char id[33];
            bool damaged;  /* there is no text: what was stored is damaged */
            uint64_t size; /* of the text */
            double queue_s, max_solve_s;
            uint64_t memory;
            double pace[PACE_FORMS]; /* of predicted seconds */
        } job;                       /* of PREDICT the size and the memory */
        struct {
            ask_kind what;
            char id[65]; /* of the upload, or of the job */
            bool named;  /* ASK_BLOB: a vector of this name; else the history with iterations > after */
            char name[CASE_NAME];
            int64_t number, after;
        } ask;
        struct {
            uint64_t at, size; /* in the inbox */
            int64_t value;     /* bytes of the upload, or number of the case */
        } answer;
        struct {
            int64_t n_cases;     /* names from the begin of the outbox on, CASE_NAME bytes each */
            double time_limit_s; /* from now on; infinity: none */
        } read;
        struct {
            bool stopped, start_lost; /* as a solution has them */
            solve_figures figures;
            uint64_t at, size;     /* of the parcel in the outbox */
            bool listed;           /* what follows is set: the cache has changed */
            uint64_t cached, held; /* entries and bytes of the cache */
        } done;                    /* of KEPT up to the size */
        struct {
            uint64_t count; /* entries from the begin of the outbox on */
        } listed;
        struct {
            bool known; /* else nothing tells it but the solve */
            uz_prediction cost;
        } predicted;
    } u;
} packet;

/* fd: a descriptor that goes with it, -1: none. False: the other side is gone. */
bool message_send(int socket, const packet *m, int fd);
/* Waits for one. *fd (may be NULL): the descriptor that came with it, which the caller closes; -1: none. False: the
 * other side is gone, or says what is no message. */
bool message_receive(int socket, packet *m, int *fd);

#endif
