/* neighbours.c: waits for other processes; ghosts, and the exchange of what is known of nodes. */
#include "worker.h"

#include "core/order.h"

#include <math.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* A process that waits asks all the time for so long, since most of what it waits for comes at once; then it sleeps
 * between, for a share of what it has waited, which is as late as it may be. MPI's own wait would take a processor from
 * those who are waited for, where there are fewer processors than processes. */
#define SPIN_S  2e-4
#define LATE    0.05
#define LEAST_S 50e-6 /* as short as a sleep can be, about */
#define MOST_S  1e-4  /* large messages go on only while they are asked for */
#define LONG_S  0.5   /* what has not come by then is not one of these */
#define IDLE_S  2e-3

void wait_for(int count, MPI_Request *requests)
{
    const double since = MPI_Wtime();
    for (;;) {
        int there;
        MPI_Testall(count, requests, &there, MPI_STATUSES_IGNORE);
        if (there)
            return;
        const double waited = MPI_Wtime() - since, most = waited < LONG_S ? MOST_S : IDLE_S;
        const double nap = fmin(most, fmax(LEAST_S, LATE * waited));
        if (waited < SPIN_S)
            sched_yield();
        else
            nanosleep(&(struct timespec){.tv_nsec = (long)(1e9 * nap)}, NULL);
    }
}

void combine_all(void *x, int count, MPI_Datatype type, MPI_Op op)
{
    MPI_Request request;
    MPI_Iallreduce(MPI_IN_PLACE, x, count, type, op, MPI_COMM_WORLD, &request);
    wait_for(1, &request);
}

static void list_ghosts(neighbours *n, int32_t begin, int32_t end, const int64_t *ptr, const int32_t *column)
{
    int64_t count = 0;
    for (int64_t e = 0; e < ptr[n->here]; e++)
        count += column[e] < begin || column[e] >= end;
    n->number = new_zeros(count, sizeof *n->number);
    count = 0;
    for (int64_t e = 0; e < ptr[n->here]; e++)
        if (column[e] < begin || column[e] >= end)
            n->number[count++] = column[e];
    qsort(n->number, (size_t)count, sizeof *n->number, uz_ascending_32);
    for (int64_t g = 0; g < count; g++)
        if (g == 0 || n->number[g] != n->number[g - 1])
            n->number[n->ghosts++] = n->number[g];
}

static void sum_up(int *first, const int *count, int size)
{
    first[0] = 0;
    for (int p = 1; p < size; p++)
        first[p] = first[p - 1] + count[p - 1];
}

void neighbours_init(neighbours *n, const int32_t *first, const int64_t *ptr, const int32_t *column)
{
    MPI_Comm_rank(MPI_COMM_WORLD, &n->rank);
    MPI_Comm_size(MPI_COMM_WORLD, &n->size);
    n->here = first[n->rank + 1] - first[n->rank];
    list_ghosts(n, first[n->rank], first[n->rank + 1], ptr, column);
    int **each[] = {&n->send_count, &n->send_first, &n->take_count, &n->take_first};
    for (size_t k = 0; k < sizeof each / sizeof each[0]; k++)
        *each[k] = new_zeros(n->size, sizeof(int));
    n->request = new_zeros(2 * (int64_t)n->size, sizeof *n->request);
    for (int64_t g = 0, p = 0; g < n->ghosts; g++) {
        while (n->number[g] >= first[p + 1])
            p++;
        n->take_count[p]++;
    }
    MPI_Ialltoall(n->take_count, 1, MPI_INT, n->send_count, 1, MPI_INT, MPI_COMM_WORLD, n->request);
    wait_for(1, n->request);
    sum_up(n->take_first, n->take_count, n->size);
    sum_up(n->send_first, n->send_count, n->size);
    n->sent = n->send_first[n->size - 1] + n->send_count[n->size - 1];
    n->send = new_zeros(n->sent, sizeof *n->send);
    MPI_Ialltoallv(n->number, n->take_count, n->take_first, MPI_INT32_T, n->send, n->send_count, n->send_first,
                   MPI_INT32_T, MPI_COMM_WORLD, n->request);
    wait_for(1, n->request);
    for (int64_t s = 0; s < n->sent; s++)
        n->send[s] -= first[n->rank];
}

char *neighbours_room(neighbours *n, size_t each)
{
    if (n->room < (size_t)n->sent * each) {
        free(n->packed);
        n->room = (size_t)n->sent * each;
        n->packed = new_zeros((int64_t)n->room, 1);
    }
    return n->packed;
}

void neighbours_exchange(neighbours *n, void *ghosts, size_t each)
{
    int requests = 0;
    for (int p = 0; p < n->size; p++)
        if (n->take_count[p] > 0)
            MPI_Irecv((char *)ghosts + (size_t)n->take_first[p] * each, (int)((size_t)n->take_count[p] * each),
                      MPI_BYTE, p, 7, MPI_COMM_WORLD, &n->request[requests++]);
    for (int p = 0; p < n->size; p++)
        if (n->send_count[p] > 0)
            MPI_Isend(n->packed + (size_t)n->send_first[p] * each, (int)((size_t)n->send_count[p] * each), MPI_BYTE, p,
                      7, MPI_COMM_WORLD, &n->request[requests++]);
    wait_for(requests, n->request);
}

void neighbours_fetch(neighbours *n, void *ghosts, const void *own, size_t each)
{
    char *packed = neighbours_room(n, each);
    for (int64_t s = 0; s < n->sent; s++)
        memcpy(packed + (size_t)s * each, (const char *)own + (size_t)n->send[s] * each, each);
    neighbours_exchange(n, ghosts, each);
}

void neighbours_free(neighbours *n)
{
    void *own[] = {n->number,     n->send,       n->send_count, n->send_first,
                   n->take_count, n->take_first, n->packed,     n->request};
    for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
        free(own[k]);
    memset(n, 0, sizeof *n);
}
