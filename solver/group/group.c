/* group.c: the stream to a group of processes, and solves by them (wire.h says what passes). */
#include "group/group.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/clock.h"
#include "core/error.h"
#include "group/spread.h"
#include "group/wire.h"
#include "linalg/linalg.h"
#include "linalg/pieces.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

struct uz_process_group {
    int stream;
    bool lost;
    int64_t processes; /* 0: it has not said yet */
    int64_t next_id;
    pthread_mutex_t mutex; /* of an exchange: a question, its answer, and what both share with others of a solve */
};

uz_process_group *uz_process_group_new(int stream)
{
    uz_process_group *group = uz_alloc_zero(1, sizeof *group);
    if (!group) {
        close(stream);
        return NULL;
    }
    group->stream = stream;
    group->next_id = 1;
    pthread_mutex_init(&group->mutex, NULL);
    return group;
}

bool uz_process_group_is_lost(const uz_process_group *group)
{
    return group->lost;
}

void uz_process_group_free(uz_process_group *group)
{
    if (!group)
        return;
    close(group->stream); /* it ends then */
    pthread_mutex_destroy(&group->mutex);
    free(group);
}

/* ---- the stream */

static bool put(uz_process_group *group, const void *from, size_t size)
{
    struct iovec part = {.iov_base = (void *)(uintptr_t)from, .iov_len = size};
    const struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
    while (!group->lost && part.iov_len > 0) {
        const ssize_t sent = sendmsg(group->stream, &message, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            group->lost = true;
        else
            part = (struct iovec){.iov_base = (char *)part.iov_base + sent, .iov_len = part.iov_len - (size_t)sent};
    }
    return !group->lost;
}

static bool take(uz_process_group *group, void *to, size_t size)
{
    for (char *at = to; !group->lost && size > 0;) {
        const ssize_t got = read(group->stream, at, size);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            group->lost = true;
        } else {
            at += got;
            size -= (size_t)got;
        }
    }
    return !group->lost;
}

static bool ask(uz_process_group *group, uz_wire_head head)
{
    head.version = UZ_WIRE_VERSION;
    return put(group, &head, sizeof head);
}

static bool hear(uz_process_group *group, uz_wire_head *head, uz_wire_kind kind)
{
    if (take(group, head, sizeof *head) && (head->kind != (int32_t)kind || head->version != UZ_WIRE_VERSION))
        group->lost = true; /* of another build, or no group at all */
    return !group->lost;
}

static uz_status fail_lost(uz_error *err)
{
    return uz_fail(err, UZ_ERR_INTERNAL, "", "the group of processes that held the body was lost");
}

static uz_status fail_wrong(uz_error *err)
{
    return uz_fail(err, UZ_ERR_INTERNAL, "operator",
                   "operator distributed: what the group of processes says of its residual is not true of K: use "
                   "matrix_free, and report the request");
}

/* ---- systems */

typedef struct {
    uz_multigrid base;
    uz_process_group *group;
    int64_t id;
    uz_spread map; /* of dofs to places */
    double *wide;  /* map.size: a vector in the group's order */
} far_multigrid;

/* Which of the body's systems a thread works on. */
struct uz_multigrid_room {
    int which;        /* UZ_WIRE_WHOLE, or FREE_DOFS where some are held */
    const bool *held; /* d; NULL: none */
    double square;    /* r'M^-1 r of the last step, as the group says */
    double most;      /* of the system: see uz_multigrid */
    double *half;     /* d: what the later columns of K make of a vector */
};

/* Both together, as a call has them. */
typedef struct {
    const far_multigrid *body;
    uz_multigrid_room *room;
} far_system;

/* Vectors of d numbers, for loops that threads share. */
typedef struct {
    const far_system *of;
    double *to;
    const double *from, *b;
    const uz_csc *K;
    bool zeros;
} far_vectors;

static bool is_held(const far_system *s, int64_t j)
{
    return s->room->held && s->room->held[j];
}

static far_system system_of(const uz_multigrid *mg, uz_multigrid_room *room)
{
    return (far_system){(const far_multigrid *)mg, room};
}

static void free_room(uz_multigrid_room *room)
{
    if (room)
        free(room->half);
    free(room);
}

static uz_multigrid_room *make_room(const uz_multigrid *mg, size_t *bytes)
{
    uz_multigrid_room *room = uz_alloc_zero(1, sizeof *room);
    *bytes = sizeof *room + (size_t)mg->n * sizeof *room->half;
    if (!room || !(room->half = uz_alloc(mg->n, sizeof *room->half))) {
        free_room(room);
        return NULL;
    }
    room->most = mg->most;
    return room;
}

static void free_multigrid(uz_multigrid *mg)
{
    far_multigrid *body = (far_multigrid *)mg;
    pthread_mutex_lock(&body->group->mutex);
    if (body->id > 0)
        ask(body->group, (uz_wire_head){.kind = UZ_WIRE_FREE, .id = body->id});
    pthread_mutex_unlock(&body->group->mutex);
    uz_spread_clear(&body->map);
    free(body->wide);
    free(body);
}

/* K x by two shares of its columns, of as many entries: the group waits meanwhile, and its processors are idle. */
typedef struct {
    const uz_csc *K;
    const double *x;
    double *y[2];
    int64_t middle; /* the first column of the second share, which reaches no row before it */
} product;

static void multiply_share(void *ctx, int share)
{
    const product *p = ctx;
    const int64_t begin = share == 0 ? 0 : p->middle, end = share == 0 ? p->middle : p->K->cols;
    memset(p->y[share] + begin, 0, (size_t)(p->K->cols - begin) * sizeof *p->y[share]);
    uz_csc_symv_columns(p->y[share], p->K, 1.0, p->x, begin, end);
}

static void add_half(void *ctx, int64_t begin, int64_t end)
{
    const product *p = ctx;
    for (int64_t j = p->middle + begin; j < p->middle + end; j++)
        p->y[0][j] += p->y[1][j];
}

static void multiply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *y, const double *x)
{
    product p = {.K = K, .x = x, .y = {y, room->half}};
    while (p.middle < mg->n && K->ptr[p.middle] < K->ptr[mg->n] / 2)
        p.middle++;
    uz_aside_share(multiply_share, &p, 2);
    uz_by_pieces(add_half, &p, mg->n - p.middle);
}

static void put_some(void *ctx, int64_t begin, int64_t end)
{
    const far_vectors *v = ctx;
    const int64_t *dof = v->of->body->map.dof;
    for (int64_t k = begin; k < end; k++)
        v->to[k] = dof[k] < 0 || is_held(v->of, dof[k]) ? 0.0 : v->from[dof[k]];
}

/* x at dofs that are not held, and zeros. */
static bool put_vector(const far_system *s, const double *x)
{
    const far_multigrid *body = s->body;
    uz_by_pieces(put_some, &(far_vectors){.of = s, .to = body->wide, .from = x}, body->map.size);
    return put(body->group, body->wide, (size_t)body->map.size * sizeof *body->wide);
}

static void take_some(void *ctx, int64_t begin, int64_t end)
{
    const far_vectors *v = ctx;
    const int64_t *place = v->of->body->map.place;
    for (int64_t j = begin; j < end; j++)
        if (!is_held(v->of, j))
            v->to[j] = v->from[place[j]];
        else if (v->zeros)
            v->to[j] = 0.0;
}

/* zeros: x is 0 at held dofs; else it stays there. */
static bool take_vector(const far_system *s, double *x, bool zeros)
{
    const far_multigrid *body = s->body;
    if (!take(body->group, body->wide, (size_t)body->map.size * sizeof *body->wide))
        return false;
    far_vectors v = {.of = s, .to = x, .from = body->wide, .zeros = zeros};
    uz_by_pieces(take_some, &v, body->map.d);
    return true;
}

static bool ask_of(const far_system *s, uz_wire_head head)
{
    head.id = s->body->id;
    head.a = s->room->which;
    return ask(s->body->group, head);
}

static bool hear_vector(const far_system *s)
{
    uz_wire_head head;
    return hear(s->body->group, &head, UZ_WIRE_VECTOR);
}

static bool hear_square(const far_system *s)
{
    uz_wire_head head = {.kind = 0};
    const bool heard = hear(s->body->group, &head, UZ_WIRE_STATE);
    s->room->square = head.x;
    return heard;
}

static uz_status apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err)
{
    const far_system of = system_of(mg, room), *s = &of;
    (void)K;
    pthread_mutex_lock(&s->body->group->mutex);
    const bool done = ask_of(s, (uz_wire_head){.kind = UZ_WIRE_APPLY}) && put_vector(s, r) && hear_vector(s) &&
                      take_vector(s, z, true);
    pthread_mutex_unlock(&s->body->group->mutex);
    return done ? UZ_OK : fail_lost(err);
}

static bool begin(const far_system *s, const double *x, const double *b, int count)
{
    const int64_t d = s->body->map.d;
    bool zero = true;
    for (int64_t j = 0; zero && j < count * d; j++)
        zero = x[j] == 0.0 || is_held(s, j % d);
    bool done = ask_of(s, (uz_wire_head){.kind = UZ_WIRE_BEGIN, .b = zero, .c = count});
    for (int k = 0; done && !zero && k < count; k++)
        done = put_vector(s, x + k * d);
    for (int k = 0; done && k < count; k++)
        done = put_vector(s, b + k * d);
    return done && hear_square(s);
}

static bool fetch(const far_system *s, double *x, int count)
{
    bool done = ask_of(s, (uz_wire_head){.kind = UZ_WIRE_FETCH}) && hear_vector(s);
    for (int k = 0; done && k < count; k++)
        done = take_vector(s, x + k * s->body->map.d, false);
    return done;
}

/* A share of the residual that is believed in single precision until drift is known: before that there are trials
 * alone, whose residuals are found here and looked at. */
#define TRIAL_LEFT 1e-2

/* Up to `most` steps while the square is above goal2. */
static bool make_steps(const far_system *s, int *made, bool *flat, int most, double goal2)
{
    uz_wire_head head;
    *made = 0;
    const double drift = s->body->base.drift, believed = drift > 0.0 ? drift / UZ_HIDDEN : TRIAL_LEFT;
    const uz_wire_head question = {.kind = UZ_WIRE_STEPS, .b = most, .x = goal2, .y = believed};
    if (!ask_of(s, question) || !hear(s->body->group, &head, UZ_WIRE_STATE))
        return false;
    if (head.a < 0 || head.a > most)
        return false;
    *made = (int)head.a;
    *flat = head.b != 0;
    s->room->square = head.x;
    return true;
}

/* ---- conjugate gradients, as amg/cg.c has them: where the recurrence has gone so far that rounding may have led it
 * away from the true residual, it is begun again from that until that meets the goal too, or gains nothing more */

enum { RESTARTS_MOST = 4 };
#define DRIFTS 1e-10

/* The group's residual and the one found here are alike but for rounding: a share that says that they are not, and the
 * rounding of a product, relative. */
#define BELIEVED 0.01
#define ROUNDED  1e-11

/* Between two looks whether to go on. */
#define SLICE_S 0.02

static bool should_stop(const uz_cg_info *info, const uz_cg_stop *stop)
{
    return info->iterations >= stop->max_iterations || uz_cancelled(stop->hooks) || uz_seconds() >= stop->deadline;
}

static bool run_steps(const far_system *s, uz_cg_info *info, bool *flat, const uz_cg_stop *stop, double goal2)
{
    for (int most = 1; s->room->square > goal2 && !*flat && !should_stop(info, stop);) {
        const double start = uz_seconds();
        const int64_t left = stop->max_iterations - info->iterations;
        int made;
        if (!make_steps(s, &made, flat, left < most ? (int)left : most, goal2))
            return false;
        info->iterations += made;
        if (made == 0) /* nothing more to gain */
            break;
        if (uz_seconds() - start < SLICE_S && most < UZ_WIRE_STEPS_MOST)
            most *= 2;
    }
    return true;
}

/* to: r. */
static double find_least(void *ctx, int64_t begin, int64_t end)
{
    const far_vectors *v = ctx;
    const double *r = v->to, *x = v->from, *b = v->b;
    double least = 0.0, size = 0.0;
    for (int64_t j = begin; j < end; j++) {
        const double own = v->K->val[v->K->ptr[j]];
        if (is_held(v->of, j))
            continue;
        least += r[j] * r[j] / own;
        size += b[j] * b[j] / own + x[j] * x[j] * own;
    }
    return BELIEVED * least - ROUNDED * ROUNDED * size;
}

/* What r'M^-1 r can't be less than: M <= most diag(K). The square is the group's word, r is not, nor is what rounding
 * makes of r in x and b. */
static bool is_possible(const far_system *s, const uz_csc *K, double *r, const double *x, const double *b)
{
    far_vectors v = {.of = s, .to = r, .from = x, .b = b, .K = K};
    return s->room->square * s->room->most >= uz_sum_by_pieces(find_least, &v, s->body->map.d);
}

static void copy_free(void *ctx, int64_t begin, int64_t end)
{
    const far_vectors *v = ctx;
    for (int64_t j = begin; j < end; j++)
        v->to[j] = is_held(v->of, j) ? 0.0 : v->from[j];
}

static void leave_free(void *ctx, int64_t begin, int64_t end)
{
    const far_vectors *v = ctx;
    for (int64_t j = begin; j < end; j++)
        v->to[j] = is_held(v->of, j) ? 0.0 : v->b[j] - v->to[j];
}

/* r = b - K x on the dofs that are not held. */
static void find_residual(const far_system *s, const uz_csc *K, double *r, const double *x, const double *b)
{
    const int64_t d = s->body->map.d;
    double *free_part = s->body->wide; /* a vector in the group's order is not longer */
    uz_by_pieces(copy_free, &(far_vectors){.of = s, .to = free_part, .from = x}, d);
    multiply(&s->body->base, K, s->room, r, free_part);
    uz_by_pieces(leave_free, &(far_vectors){.of = s, .to = r, .b = b}, d);
}

/* The group's part of it: false: it was lost. */
static bool solve_there(const far_system *s, uz_cg_info *info, bool *flat, double *x, const double *b, int count,
                        const uz_cg_stop *stop)
{
    double goal = 0.0, before = INFINITY;
    bool done = begin(s, x, b, count);
    for (int k = 0; done; k++) {
        done = k == 0 || (ask_of(s, (uz_wire_head){.kind = UZ_WIRE_AGAIN}) && hear_square(s));
        info->last = uz_root(s->room->square);
        if (k == 0) {
            info->first = info->last;
            goal = fmax(stop->absolute, stop->relative * info->first);
        }
        info->met = info->last <= goal;
        if (!done || (k > 0 && should_stop(info, stop)) || k == RESTARTS_MOST || !(info->last > goal) ||
            !(info->last < 0.5 * before))
            break;
        before = info->last;
        done = run_steps(s, info, flat, stop, goal * goal);
        info->last = uz_root(s->room->square);
        info->met = info->last <= goal;
        if (*flat || (info->met && info->last > DRIFTS * info->first))
            break;
    }
    return done && fetch(s, x, count);
}

static uz_status solve(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, uz_cg_info *info, double *x,
                       double *r, const double *b, int count, const uz_cg_stop *stop, uz_error *err)
{
    const far_system of = system_of(mg, room), *s = &of;
    bool flat = false, possible = true;
    pthread_mutex_lock(&s->body->group->mutex);
    const bool done = solve_there(s, info, &flat, x, b, count, stop);
    const bool looks = done && !(stop->unchecked && info->met);
    for (int64_t at = 0; looks && at < count * mg->n; at += mg->n)
        find_residual(s, K, r + at, x + at, b + at);
    pthread_mutex_unlock(&s->body->group->mutex);
    if (!done)
        return fail_lost(err);
    if (flat)
        return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                       "K is not positive definite: conjugate gradients met a direction that it does not resist. "
                       "Support the body so that it can't move freely, or check the signs of K.");
    for (int64_t at = 0; looks && possible && at < count * mg->n; at += mg->n)
        possible = is_possible(s, K, r + at, x + at, b + at);
    return possible ? UZ_OK : fail_wrong(err);
}

/* ---- making them */

/* The group says how many processes it is of, once. */
static bool meet(uz_process_group *group)
{
    uz_wire_head head;
    if (group->processes == 0 && hear(group, &head, UZ_WIRE_HELLO)) {
        group->lost = head.a < 1;
        group->processes = head.a;
    }
    return !group->lost;
}

void uz_group_expect(uz_process_group *group, const uz_csc *K)
{
    pthread_mutex_lock(&group->mutex);
    if (meet(group))
        ask(group,
            (uz_wire_head){.kind = UZ_WIRE_EXPECT, .a = K->ptr[K->cols] * (int64_t)sizeof *K->val / group->processes});
    pthread_mutex_unlock(&group->mutex);
}

static bool hear_made(uz_process_group *group, uz_multigrid *info)
{
    uz_wire_head head;
    if (!hear(group, &head, UZ_WIRE_MADE))
        return false;
    info->levels = (int)head.a;
    info->bytes = (size_t)head.b;
    info->most = head.x;
    return true;
}

static uz_status hold(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, const bool *held, size_t *bytes,
                      const uz_stop *stop, uz_error *err)
{
    const far_multigrid *body = (const far_multigrid *)mg;
    uz_multigrid free_dofs;
    (void)K;
    *bytes = 0;
    room->which = UZ_WIRE_WHOLE;
    room->held = NULL;
    room->most = mg->most;
    if (!held)
        return UZ_OK;
    if (uz_stop_is_due(stop))
        return uz_fail(err, UZ_ERR_CANCELLED, "", "stopped before the multigrid was made");
    char *marks = uz_alloc_zero(body->map.size, sizeof *marks);
    if (!marks)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld dofs", (long long)mg->n);
    for (int64_t j = 0; j < body->map.d; j++)
        marks[body->map.place[j]] = held[j];
    pthread_mutex_lock(&body->group->mutex);
    const bool made = ask(body->group, (uz_wire_head){.kind = UZ_WIRE_HOLD, .id = body->id}) &&
                      put(body->group, marks, (size_t)body->map.size) && hear_made(body->group, &free_dofs);
    pthread_mutex_unlock(&body->group->mutex);
    free(marks);
    if (!made)
        return fail_lost(err);
    room->which = UZ_WIRE_FREE_DOFS;
    room->held = held;
    room->most = free_dofs.most;
    return UZ_OK;
}

static const uz_multigrid_kind KIND = {.apply = apply,
                                       .multiply = multiply,
                                       .room = make_room,
                                       .free_room = free_room,
                                       .hold = hold,
                                       .free = free_multigrid,
                                       .solve = solve};

/* Rows, process after process, of which each has its nodes in a row. */
static bool put_rows(uz_process_group *group, int64_t id, const uz_spread *map, const uz_spread_rows *rows)
{
    const size_t squared = (size_t)(map->bs * map->bs);
    const uz_wire_head head = {.kind = UZ_WIRE_ROWS, .id = id, .a = rows->nodes, .b = rows->blocks, .c = rows->process};
    return ask(group, head) && put(group, rows->values, (size_t)rows->blocks * squared * sizeof *rows->values) &&
           put(group, rows->counts, (size_t)rows->nodes * sizeof *rows->counts) &&
           put(group, rows->columns, (size_t)rows->blocks * sizeof *rows->columns) &&
           put(group, rows->modes, (size_t)(rows->nodes * map->bs * map->modes) * sizeof *rows->modes);
}

typedef struct {
    far_multigrid *body;
    const uz_csc *K;
    const uz_modes *modes;
    pthread_mutex_t stream; /* of a whole message, and of the two below */
    uz_status status;
    uz_error *err;
} sending;

/* All rows of a process. */
static uz_status send_process(sending *s, int64_t process, uz_error *err)
{
    const uz_spread *map = &s->body->map;
    uz_spread_rows rows = {.process = process};
    const uz_status status = uz_spread_begin(&rows, map, s->K, s->modes, err);
    bool goes_on = status == UZ_OK;
    while (goes_on && uz_spread_next(&rows, map)) {
        pthread_mutex_lock(&s->stream);
        goes_on = s->status == UZ_OK && put_rows(s->body->group, s->body->id, map, &rows);
        pthread_mutex_unlock(&s->stream);
    }
    uz_spread_rows_clear(&rows);
    return status;
}

static void send_share(void *ctx, int share)
{
    sending *s = ctx;
    uz_error err = {0};
    uz_status status = UZ_OK;
    for (int64_t p = share; status == UZ_OK && p < s->body->group->processes; p += UZ_ASIDE_MOST)
        status = send_process(s, p, &err);
    if (status == UZ_OK)
        return;
    pthread_mutex_lock(&s->stream);
    s->status = status;
    *s->err = err;
    pthread_mutex_unlock(&s->stream);
}

/* While rows of one process are on their way, another thread makes those of the next. */
static uz_status send_rows(far_multigrid *body, const uz_csc *K, const uz_modes *modes, uz_error *err)
{
    sending s = {.body = body, .K = K, .modes = modes, .err = err};
    const int64_t processes = body->group->processes;
    pthread_mutex_init(&s.stream, NULL);
    uz_aside_share(send_share, &s, processes < UZ_ASIDE_MOST ? (int)processes : UZ_ASIDE_MOST);
    pthread_mutex_destroy(&s.stream);
    return s.status;
}

/* By where nodes are, else by their graph, which the group divides: it takes as long as it takes to make a level. */
static uz_status divide_nodes(far_multigrid *body, const uz_modes *modes, uz_error *err)
{
    uz_process_group *group = body->group;
    uz_spread *map = &body->map;
    bool divided = group->processes == 1;
    uz_wire_head head = {.kind = UZ_WIRE_GRAPH, .a = map->nodes};
    const uz_status status = divided ? UZ_OK : uz_spread_divide(&divided, map, modes, group->processes, err);
    if (status != UZ_OK || divided)
        return status;
    const bool heard = ask(group, head) && put(group, map->offset, (size_t)(map->nodes + 1) * sizeof *map->offset) &&
                       put(group, map->neighbour, (size_t)map->offset[map->nodes] * sizeof *map->neighbour) &&
                       hear(group, &head, UZ_WIRE_PARTS) &&
                       take(group, map->part, (size_t)map->nodes * sizeof *map->part);
    return heard ? UZ_OK : fail_lost(err);
}

static uz_status begin_body(far_multigrid *body, double strong, uz_error *err)
{
    uz_process_group *group = body->group;
    const uz_spread *map = &body->map;
    int64_t *count = uz_alloc_zero(2 * group->processes, sizeof *count);
    if (!count)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a body");
    body->id = group->next_id++;
    const uz_wire_head head = {
        .kind = UZ_WIRE_BODY, .id = body->id, .a = map->nodes, .b = map->bs, .c = map->modes, .x = strong};
    for (int64_t i = 0; i < map->nodes; i++) {
        count[2 * map->part[i]]++;
        count[2 * map->part[i] + 1] += uz_spread_blocks(map, i);
    }
    const bool begun = ask(group, head) && put(group, count, (size_t)(2 * group->processes) * sizeof *count);
    free(count);
    return begun ? UZ_OK : fail_lost(err);
}

static uz_status send_body(far_multigrid *body, const uz_csc *K, const uz_modes *modes, uz_error *err)
{
    uz_process_group *group = body->group;
    if (!meet(group))
        return fail_lost(err);
    uz_status status = divide_nodes(body, modes, err);
    if (status == UZ_OK)
        status = uz_spread_number(&body->map, group->processes, err);
    if (status != UZ_OK)
        return status;
    status = begin_body(body, modes->strong, err);
    if (status == UZ_OK)
        status = send_rows(body, K, modes, err);
    if (status != UZ_OK) {
        group->lost = true; /* it waits for the rest */
        return status;
    }
    return group->lost ? fail_lost(err) : UZ_OK;
}

uz_status uz_group_multigrid(uz_multigrid **out, uz_process_group *group, const uz_csc *K, const uz_modes *modes,
                             uz_error *err)
{
    far_multigrid *body = uz_alloc_zero(1, sizeof *body);
    *out = NULL;
    if (!body)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a body");
    body->base.kind = &KIND;
    body->base.n = K->cols;
    body->group = group;
    uz_status status = uz_spread_init(&body->map, K, modes, err);
    if (status == UZ_OK && !(body->wide = uz_alloc(body->map.size, sizeof *body->wide)))
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a vector of %lld numbers", (long long)body->map.size);
    if (status == UZ_OK) {
        pthread_mutex_lock(&group->mutex);
        status = send_body(body, K, modes, err);
        pthread_mutex_unlock(&group->mutex);
    }
    if (status == UZ_OK)
        *out = &body->base;
    else
        free_multigrid(&body->base);
    return status;
}

uz_status uz_group_await(uz_multigrid *mg, uz_error *err)
{
    far_multigrid *body = (far_multigrid *)mg;
    pthread_mutex_lock(&body->group->mutex);
    const bool made = hear_made(body->group, mg);
    pthread_mutex_unlock(&body->group->mutex);
    return made ? UZ_OK : fail_lost(err);
}
