/* stand_in.h: another end of the stream to a group of processes: conjugate gradients on a dense matrix in a thread,
 * preconditioned by the diagonal, and wrong in a chosen way. */
#ifndef TESTS_STAND_IN_H
#define TESTS_STAND_IN_H

#include "group/wire.h"
#include "uzawa.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

typedef enum {
    STAND_IN_HONEST,
    STAND_IN_DROPS,   /* M^-1 is 0 at the first dof */
    STAND_IN_LIES,    /* of every start it says that it solves the equations */
    STAND_IN_SOFTER,  /* its K is softer by 1 % in the first dof */
    STAND_IN_SHIFTS,  /* adds 1e-3 of its largest number to each solution */
    STAND_IN_SKEW,    /* M^-1 is not symmetric */
    STAND_IN_NEGATIVE /* M^-1 is negative at the first dof */
} stand_in_fault;

enum { STAND_IN_MOST = 64 };

typedef struct {
    int stream, honest_solves; /* the fault begins after so many solves */
    stand_in_fault fault;
    pthread_t thread;
    double most;                                           /* what it says that diag(K)^-1 M is bounded by */
    double weak;                                           /* M is so many times the diagonal; 0: once */
    int64_t processes;                                     /* that it says it is of */
    int64_t next[STAND_IN_MOST];                           /* of each the node whose rows are to come next */
    int64_t nodes, bs, modes, n, at, solves, steps, again; /* again: residuals that were found anew */
    double K[2][STAND_IN_MOST][STAND_IN_MOST];
    int lanes; /* systems that are solved at once */
    struct {
        double x[STAND_IN_MOST], b[STAND_IN_MOST], r[STAND_IN_MOST], z[STAND_IN_MOST], p[STAND_IN_MOST], square;
    } lane[2];
} stand_in;

static inline bool stand_in_take(stand_in *s, void *to, size_t size)
{
    for (char *at = to; size > 0;) {
        const ssize_t got = read(s->stream, at, size);
        if (got <= 0)
            return false;
        at += got;
        size -= (size_t)got;
    }
    return true;
}

static inline void stand_in_put(stand_in *s, const void *from, size_t size)
{
    for (const char *at = from; size > 0;) {
        const ssize_t sent = send(s->stream, at, size, MSG_NOSIGNAL);
        if (sent <= 0)
            return;
        at += sent;
        size -= (size_t)sent;
    }
}

static inline void stand_in_answer(stand_in *s, uz_wire_head head)
{
    head.version = UZ_WIRE_VERSION;
    stand_in_put(s, &head, sizeof head);
}

static inline bool stand_in_is_wrong(const stand_in *s, stand_in_fault fault)
{
    return s->fault == fault && s->solves > s->honest_solves;
}

static inline double stand_in_cycle(stand_in *s, int which, double *z, const double *r)
{
    double square = 0.0;
    for (int64_t i = 0; i < s->n; i++)
        z[i] = r[i] / s->K[which][i][i] / (s->weak > 0.0 ? s->weak : 1.0);
    if (stand_in_is_wrong(s, STAND_IN_DROPS))
        z[0] = 0.0;
    if (stand_in_is_wrong(s, STAND_IN_NEGATIVE))
        z[0] = -z[0];
    for (int64_t i = 1; i < s->n && stand_in_is_wrong(s, STAND_IN_SKEW); i++)
        z[i] += 0.9 * r[i - 1] / s->K[which][i][i];
    for (int64_t i = 0; i < s->n; i++)
        square += r[i] * z[i];
    return stand_in_is_wrong(s, STAND_IN_LIES) ? 0.0 : square;
}

static inline void stand_in_multiply(const stand_in *s, int which, double *y, const double *x)
{
    for (int64_t i = 0; i < s->n; i++) {
        y[i] = 0.0;
        for (int64_t j = 0; j < s->n; j++)
            y[i] += s->K[which][i][j] * x[j];
    }
    if (stand_in_is_wrong(s, STAND_IN_SOFTER))
        y[0] -= 0.01 * s->K[which][0][0] * x[0];
}

static inline double stand_in_square(const stand_in *s)
{
    return s->lanes == 1 ? s->lane[0].square : fmax(s->lane[0].square, s->lane[1].square);
}

static inline void stand_in_begin(stand_in *s, int which)
{
    for (int l = 0; l < s->lanes; l++) {
        stand_in_multiply(s, which, s->lane[l].r, s->lane[l].x);
        for (int64_t i = 0; i < s->n; i++)
            s->lane[l].r[i] = s->lane[l].b[i] - s->lane[l].r[i];
        s->lane[l].square = stand_in_cycle(s, which, s->lane[l].z, s->lane[l].r);
        memcpy(s->lane[l].p, s->lane[l].z, sizeof s->lane[l].p);
    }
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_STATE, .x = stand_in_square(s)});
}

/* Until its square is not above the goal; *flat: the next step would be along a direction without resistance. */
static inline int64_t stand_in_step_lane(stand_in *s, int l, bool *flat, const uz_wire_head *m)
{
    const int which = (int)m->a;
    double q[STAND_IN_MOST], *x = s->lane[l].x, *r = s->lane[l].r, *z = s->lane[l].z, *p = s->lane[l].p;
    int64_t made = 0;
    while (made < m->b && s->lane[l].square > m->x) {
        double curvature = 0.0;
        const double last = s->lane[l].square;
        stand_in_multiply(s, which, q, p);
        for (int64_t i = 0; i < s->n; i++)
            curvature += p[i] * q[i];
        *flat = !(curvature > 0.0);
        if (*flat)
            break;
        const double alpha = last / curvature;
        for (int64_t i = 0; i < s->n; i++) {
            x[i] += alpha * p[i];
            r[i] -= alpha * q[i];
        }
        s->lane[l].square = stand_in_cycle(s, which, z, r);
        const double beta = s->lane[l].square / last;
        for (int64_t i = 0; i < s->n; i++)
            p[i] = z[i] + beta * p[i];
        made++;
    }
    return made;
}

static inline void stand_in_steps(stand_in *s, const uz_wire_head *m)
{
    int64_t most = 0;
    bool flat = false;
    for (int l = 0; l < s->lanes && !flat; l++) {
        const int64_t made = stand_in_step_lane(s, l, &flat, m);
        most = made > most ? made : most;
    }
    s->steps += most;
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_STATE, .a = most, .b = flat, .x = stand_in_square(s)});
}

static inline void stand_in_fetch(stand_in *s)
{
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_VECTOR});
    for (int l = 0; l < s->lanes; l++) {
        double most = 0.0, *x = s->lane[l].x;
        for (int64_t i = 0; i < s->n; i++)
            most = fmax(most, fabs(x[i]));
        for (int64_t i = 0; i < s->n && stand_in_is_wrong(s, STAND_IN_SHIFTS); i++)
            x[i] += 1e-3 * most;
        stand_in_put(s, x, (size_t)s->n * sizeof *x);
    }
}

static inline bool stand_in_take_body(stand_in *s, const uz_wire_head *m)
{
    int64_t count[2 * STAND_IN_MOST], first = 0;
    s->nodes = m->a;
    s->bs = m->b;
    s->modes = m->c;
    s->n = s->nodes * s->bs;
    s->at = 0;
    memset(s->K, 0, sizeof s->K);
    if (s->n > STAND_IN_MOST || !stand_in_take(s, count, 2 * (size_t)s->processes * sizeof *count))
        return false;
    for (int64_t p = 0; p < s->processes; first += count[2 * p++])
        s->next[p] = first;
    return first == s->nodes;
}

/* Node after node goes to the next process. */
static inline bool stand_in_divide(stand_in *s, const uz_wire_head *m)
{
    int32_t offset[STAND_IN_MOST + 1], neighbour[STAND_IN_MOST * STAND_IN_MOST], part[STAND_IN_MOST];
    if (m->a > STAND_IN_MOST || !stand_in_take(s, offset, (size_t)(m->a + 1) * sizeof *offset) ||
        !stand_in_take(s, neighbour, (size_t)offset[m->a] * sizeof *neighbour))
        return false;
    for (int64_t i = 0; i < m->a; i++)
        part[i] = (int32_t)(i % s->processes);
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_PARTS, .a = s->processes});
    stand_in_put(s, part, (size_t)m->a * sizeof *part);
    return true;
}

static inline void stand_in_answer_made(stand_in *s)
{
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_MADE, .a = 1, .x = s->most});
}

static inline bool stand_in_take_rows(stand_in *s, const uz_wire_head *m)
{
    const int64_t bs = s->bs;
    int32_t count[STAND_IN_MOST], column[STAND_IN_MOST * STAND_IN_MOST];
    double value[STAND_IN_MOST * STAND_IN_MOST];
    float mode[STAND_IN_MOST * 6];
    if (!stand_in_take(s, value, (size_t)(m->b * bs * bs) * sizeof *value) ||
        !stand_in_take(s, count, (size_t)m->a * sizeof *count) ||
        !stand_in_take(s, column, (size_t)m->b * sizeof *column) ||
        !stand_in_take(s, mode, (size_t)(m->a * bs * s->modes) * sizeof *mode))
        return false;
    int64_t block = 0, from = 0, at = s->next[m->c];
    for (int64_t i = 0; i < m->a; block += count[i++], at++)
        for (int64_t c = 0; c < bs; c++)
            for (int64_t k = 0; k < count[i]; k++)
                for (int64_t e = 0; e < bs; e++) {
                    const int64_t row = at * bs + c, other = column[block + k] * bs + e;
                    s->K[UZ_WIRE_WHOLE][row][other] = s->K[UZ_WIRE_WHOLE][other][row] = value[from++];
                }
    s->next[m->c] = at;
    s->at += m->a;
    if (s->at == s->nodes)
        stand_in_answer_made(s);
    return true;
}

static inline bool stand_in_hold(stand_in *s)
{
    char held[STAND_IN_MOST];
    if (!stand_in_take(s, held, (size_t)s->n))
        return false;
    for (int64_t i = 0; i < s->n; i++)
        for (int64_t j = 0; j < s->n; j++)
            s->K[UZ_WIRE_FREE_DOFS][i][j] = held[i] || held[j] ? (double)(i == j) : s->K[UZ_WIRE_WHOLE][i][j];
    stand_in_answer_made(s);
    return true;
}

static inline bool stand_in_obey(stand_in *s, const uz_wire_head *m)
{
    const size_t size = (size_t)s->n * sizeof(double);
    const int which = (int)m->a;
    switch (m->kind) {
    case UZ_WIRE_EXPECT:
        return true;
    case UZ_WIRE_GRAPH:
        return stand_in_divide(s, m);
    case UZ_WIRE_BODY:
        return stand_in_take_body(s, m);
    case UZ_WIRE_ROWS:
        return stand_in_take_rows(s, m);
    case UZ_WIRE_HOLD:
        return stand_in_hold(s);
    case UZ_WIRE_BEGIN:
        s->lanes = (int)m->c;
        s->solves += m->c;
        for (int l = 0; l < s->lanes; l++)
            memset(s->lane[l].x, 0, sizeof s->lane[l].x);
        for (int l = 0; l < s->lanes && m->b == 0; l++)
            if (!stand_in_take(s, s->lane[l].x, size))
                return false;
        for (int l = 0; l < s->lanes; l++)
            if (!stand_in_take(s, s->lane[l].b, size))
                return false;
        stand_in_begin(s, which);
        return true;
    case UZ_WIRE_AGAIN:
        s->again++;
        stand_in_begin(s, which);
        return true;
    case UZ_WIRE_STEPS:
        stand_in_steps(s, m);
        return true;
    case UZ_WIRE_FETCH:
        stand_in_fetch(s);
        return true;
    case UZ_WIRE_APPLY:
        if (!stand_in_take(s, s->lane[0].b, size))
            return false;
        stand_in_cycle(s, which, s->lane[0].z, s->lane[0].b);
        stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_VECTOR});
        stand_in_put(s, s->lane[0].z, size);
        return true;
    default:
        return m->kind == UZ_WIRE_FREE;
    }
}

static inline void *stand_in_run(void *arg)
{
    stand_in *s = arg;
    uz_wire_head m;
    stand_in_answer(s, (uz_wire_head){.kind = UZ_WIRE_HELLO, .a = s->processes});
    while (stand_in_take(s, &m, sizeof m) && stand_in_obey(s, &m))
        ;
    close(s->stream);
    return NULL;
}

/* The end of the stream that is to be asked. */
static inline int stand_in_start_many(stand_in *s, int64_t processes, stand_in_fault fault, int honest_solves,
                                      double most)
{
    int pair[2];
    memset(s, 0, sizeof *s);
    s->processes = processes;
    s->fault = fault;
    s->honest_solves = honest_solves;
    s->most = most;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0)
        abort();
    s->stream = pair[1];
    if (pthread_create(&s->thread, NULL, stand_in_run, s) != 0)
        abort();
    return pair[0];
}

static inline int stand_in_start(stand_in *s, stand_in_fault fault, int honest_solves, double most)
{
    return stand_in_start_many(s, 1, fault, honest_solves, most);
}

#endif
