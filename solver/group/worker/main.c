/* main.c: uzawa-group: the processes that hold one body together (docs/architecture/dual-form.md).
 *
 * Started by the daemon through a command of the administrator's, as a rule mpirun. The first process reads what is
 * asked from a stream (wire.h) and passes it on; all of them do it. It sees matrices and vectors, never a request.
 * A process that finds something amiss ends the whole group, and the other end of the stream sees that. */
#include "stream.h"
#include "worker.h"

#include "group/wire.h"

#include <limits.h>
#include <malloc.h>
#include <petscmat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_PARTS = 4 }; /* of a message: values, counts, columns, modes */
enum { EACH_TIMES = 2 }; /* the numbers of rows are copied once */

/* A body, its rows by process. */
typedef struct {
    int64_t id; /* 0: this place is free */
    PetscInt nodes, bs, modes, arrived;
    PetscMPIInt *count, *first;    /* dofs of each process, and the first of them */
    int64_t blocks, filled_blocks; /* of the rows here, and those that have come */
    PetscInt here, filled;         /* nodes here, and those that have come */
    int32_t *counts;               /* filled: blocks of each; like the rows until the levels are made */
    spread_rows rows;
    spread_system system;
    bool made[VARIANTS];
} body;

/* Rows on their way through the first process to another one, which may be behind. */
enum { LETTERS = 8 };
typedef struct {
    void *rows;
    size_t room;
    int count; /* of requests that may be under way */
    MPI_Request request[ROWS_PARTS];
} letter;

typedef struct {
    int stream; /* of the first process */
    PetscMPIInt rank, size;
    body body[UZ_WIRE_BODIES];
    void *whole; /* what follows a head, or an answer; room of `room` bytes */
    size_t room;
    letter out[LETTERS]; /* taken in turn */
    fresh_pages fresh;
    int next;
} group;

#define IS_FIRST(g) ((g)->rank == 0)

void end_group(const char *why)
{
    fprintf(stderr, "uzawa-group: %s\n", why);
    MPI_Abort(PETSC_COMM_WORLD, 1);
}

static void take(group *g, void *to, size_t size)
{
    if (!stream_read(g->stream, to, size))
        end_group("the stream ended in the middle of a message");
}

static void put(group *g, const void *from, size_t size)
{
    if (!stream_write(g->stream, from, size))
        end_group("nobody reads the answer");
}

static void answer(group *g, uz_wire_head head)
{
    head.version = UZ_WIRE_VERSION;
    if (IS_FIRST(g))
        put(g, &head, sizeof head);
}

static body *find(group *g, int64_t id)
{
    for (int k = 0; k < UZ_WIRE_BODIES; k++)
        if (g->body[k].id == id)
            return &g->body[k];
    end_group("no such body, or too many");
    return NULL;
}

static void *grow(void **block, size_t *room, size_t bytes)
{
    if (*room < bytes) {
        free(*block);
        *block = new_room((int64_t)bytes, 1);
        *room = bytes;
    }
    return *block;
}

static void *need_room(group *g, size_t bytes)
{
    return grow(&g->whole, &g->room, bytes);
}

static letter *next_letter(group *g)
{
    letter *to = &g->out[g->next++ % LETTERS];
    wait_for(to->count, to->request);
    to->count = 0;
    return to;
}

/* All that was sent has arrived. */
static void free_letters(group *g)
{
    for (int k = 0; k < LETTERS; k++) {
        letter *one = next_letter(g);
        free(one->rows);
        *one = (letter){.rows = NULL};
    }
}

static size_t bytes_of_rows(size_t size[ROWS_PARTS], const body *b, const uz_wire_head *m)
{
    const size_t nodes = (size_t)m->a, blocks = (size_t)m->b, bs = (size_t)b->bs;
    if (m->a <= 0 || m->a > b->nodes || m->b < m->a || m->b > INT_MAX / (8 * 6 * 6 * 2))
        end_group("rows of no size that can be");
    size[0] = blocks * bs * bs * sizeof *b->rows.value;
    size[1] = nodes * sizeof *b->counts;
    size[2] = blocks * sizeof *b->rows.column;
    size[3] = nodes * bs * (size_t)b->modes * sizeof *b->rows.mode;
    return size[0] + size[1] + size[2] + size[3];
}

/* The places of rows that are this process's; they are taken. */
static void place_rows(void *to[ROWS_PARTS], body *b, const uz_wire_head *m)
{
    const PetscInt nodes = (PetscInt)m->a, bs = b->bs;
    if (b->filled + nodes > b->here || b->filled_blocks + m->b > b->blocks)
        end_group("more rows than were told of");
    to[0] = b->rows.value + b->filled_blocks * bs * bs;
    to[1] = b->counts + b->filled;
    to[2] = b->rows.column + b->filled_blocks;
    to[3] = b->rows.mode + b->filled * bs * b->modes;
    b->filled += nodes;
    b->filled_blocks += m->b;
}

static int lanes_of(const uz_wire_head *m)
{
    if (m->c < 1 || m->c > LANES)
        end_group("so many systems at once are not solved");
    return (int)m->c;
}

/* From the first process to another, and there. */
static void start_send(MPI_Request *request, int process, const void *from, size_t size)
{
    if (size > INT_MAX)
        end_group("more at once than a message holds");
    MPI_Isend(from, (int)size, MPI_BYTE, process, 1, PETSC_COMM_WORLD, request);
}

static void start_receive(MPI_Request *request, void *to, size_t size)
{
    if (size > INT_MAX)
        end_group("more at once than a message holds");
    MPI_Irecv(to, (int)size, MPI_BYTE, 0, 1, PETSC_COMM_WORLD, request);
}

static void send_to(int process, const void *from, size_t size)
{
    MPI_Request request;
    start_send(&request, process, from, size);
    wait_for(1, &request);
}

static void receive(void *to, size_t size)
{
    MPI_Request request;
    start_receive(&request, to, size);
    wait_for(1, &request);
}

/* Its own rows the first process reads where they belong, and another's on their way there. */
static void read_rows(group *g, const uz_wire_head *m)
{
    size_t size[ROWS_PARTS];
    void *to[ROWS_PARTS];
    body *b = find(g, m->id);
    const size_t all = bytes_of_rows(size, b, m);
    if (m->c < 0 || m->c >= g->size)
        end_group("rows for no process");
    if (m->c == 0) {
        place_rows(to, b, m);
        for (int k = 0; k < ROWS_PARTS; k++)
            take(g, to[k], size[k]);
        return;
    }
    letter *passed = next_letter(g);
    char *from = grow(&passed->rows, &passed->room, all);
    take(g, from, all);
    for (int k = 0; k < ROWS_PARTS; from += size[k++])
        start_send(&passed->request[passed->count++], (int)m->c, from, size[k]);
}

/* What follows a head the first process has read before the others hear of it: till then they sleep, and leave their
 * processors to who makes it. */
static void read_behind(group *g, const uz_wire_head *m)
{
    if (m->version != UZ_WIRE_VERSION)
        return;
    if (m->kind == UZ_WIRE_ROWS) {
        read_rows(g, m);
    } else if (m->kind == UZ_WIRE_HOLD || m->kind == UZ_WIRE_BEGIN || m->kind == UZ_WIRE_APPLY) {
        const body *b = find(g, m->id);
        size_t bytes = (size_t)(b->nodes * b->bs);
        if (m->kind != UZ_WIRE_HOLD)
            bytes *= sizeof(double) * (m->kind == UZ_WIRE_APPLY ? 1 : (size_t)lanes_of(m) * (m->b != 1 ? 2 : 1));
        take(g, need_room(g, bytes), bytes);
    }
}

/* ---- a body comes in */

/* Which process is to have each node: a partition of the graph of nodes (PT-Scotch, unless options say otherwise). */
static PetscErrorCode divide(group *g, PetscInt n, const int32_t *offset, const int32_t *neighbour, int32_t *part)
{
    const PetscInt share = n / g->size, first = share * g->rank, mine = g->rank == g->size - 1 ? n - first : share;
    PetscMPIInt count;
    MPI_Request request;
    PetscInt *ia, *ja;
    const PetscInt *found;
    Mat graph;
    MatPartitioning how;
    IS parts;
    PetscFunctionBeginUser;
    if (!IS_FIRST(g)) {
        PetscCall(PetscMalloc1(mine + 1, &ia));
        receive(ia, (size_t)(mine + 1) * sizeof *ia);
        PetscCall(PetscMalloc1(ia[mine] + 1, &ja));
        receive(ja, (size_t)ia[mine] * sizeof *ja);
    }
    for (PetscMPIInt to = g->size - 1; IS_FIRST(g) && to >= 0; to--) {
        const PetscInt from = share * to, nodes = to == g->size - 1 ? n - from : share;
        PetscCall(PetscMalloc1(nodes + 1, &ia));
        for (PetscInt i = 0; i <= nodes; i++)
            ia[i] = offset[from + i] - offset[from];
        PetscCall(PetscMalloc1(ia[nodes] + 1, &ja));
        for (PetscInt k = 0; k < ia[nodes]; k++)
            ja[k] = neighbour[offset[from] + k];
        if (to == 0)
            break;
        send_to(to, ia, (size_t)(nodes + 1) * sizeof *ia);
        send_to(to, ja, (size_t)ia[nodes] * sizeof *ja);
        PetscCall(PetscFree(ia));
        PetscCall(PetscFree(ja));
    }
    PetscCall(MatCreateMPIAdj(PETSC_COMM_WORLD, mine, n, ia, ja, NULL, &graph)); /* has both now */
    PetscCall(MatPartitioningCreate(PETSC_COMM_WORLD, &how));
    PetscCall(MatPartitioningSetAdjacency(how, graph));
    PetscCall(MatPartitioningSetType(how, MATPARTITIONINGPTSCOTCH));
    PetscCall(MatPartitioningSetFromOptions(how));
    PetscCall(MatPartitioningApply(how, &parts));
    PetscCall(ISGetIndices(parts, &found));
    PetscMPIInt *counts = NULL, *firsts = NULL;
    PetscCall(PetscMalloc2(g->size, &counts, g->size, &firsts));
    for (PetscMPIInt k = 0; k < g->size; k++) {
        firsts[k] = share * k;
        counts[k] = k == g->size - 1 ? n - firsts[k] : share;
    }
    PetscCall(PetscMPIIntCast(mine, &count));
    PetscCallMPI(
        MPI_Igatherv(found, count, MPIU_INT, part, counts, firsts, MPI_INT32_T, 0, PETSC_COMM_WORLD, &request));
    wait_for(1, &request);
    PetscCall(PetscFree2(counts, firsts));
    PetscCall(ISRestoreIndices(parts, &found));
    PetscCall(ISDestroy(&parts));
    PetscCall(MatPartitioningDestroy(&how));
    PetscCall(MatDestroy(&graph));
    PetscFunctionReturn(0);
}

static PetscErrorCode answer_parts(group *g, const uz_wire_head *m)
{
    const PetscInt n = (PetscInt)m->a;
    int32_t *offset = NULL, *neighbour = NULL, *part = NULL;
    PetscFunctionBeginUser;
    PetscCheck(m->a > 0 && m->a < INT_MAX, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%lld nodes", (long long)m->a);
    if (IS_FIRST(g)) {
        PetscCall(PetscMalloc1(n + 1, &offset));
        take(g, offset, (size_t)(n + 1) * sizeof *offset);
        PetscCall(PetscMalloc1(offset[n] + 1, &neighbour));
        take(g, neighbour, (size_t)offset[n] * sizeof *neighbour);
        PetscCall(PetscCalloc1(n, &part));
    }
    if (g->size > 1 && n >= 8 * g->size)
        PetscCall(divide(g, n, offset, neighbour, part));
    answer(g, (uz_wire_head){.kind = UZ_WIRE_PARTS, .id = m->id, .a = g->size});
    if (IS_FIRST(g))
        put(g, part, (size_t)n * sizeof *part);
    PetscCall(PetscFree(offset));
    PetscCall(PetscFree(neighbour));
    PetscCall(PetscFree(part));
    PetscFunctionReturn(0);
}

static PetscErrorCode begin_body(group *g, const uz_wire_head *m)
{
    body *b = find(g, 0);
    int64_t *of; /* of each process its nodes and blocks */
    MPI_Request request;
    PetscFunctionBeginUser;
    PetscCheck(m->a > 0 && m->b > 0 && m->b <= 3 && m->c > 0 && m->c <= 6 && m->a * m->b < INT_MAX, PETSC_COMM_WORLD,
               PETSC_ERR_ARG_OUTOFRANGE, "a body of %lld nodes", (long long)m->a);
    *b = (body){.id = m->id, .nodes = (PetscInt)m->a, .bs = (PetscInt)m->b, .modes = (PetscInt)m->c};
    b->rows = (spread_rows){.b = b->bs, .k = b->modes, .strong = m->x};
    PetscCall(PetscMalloc1(2 * g->size, &of));
    if (IS_FIRST(g))
        take(g, of, 2 * (size_t)g->size * sizeof *of);
    PetscCallMPI(MPI_Ibcast(of, 2 * g->size, MPI_INT64_T, 0, PETSC_COMM_WORLD, &request));
    wait_for(1, &request);
    PetscCall(PetscMalloc2(g->size, &b->count, g->size, &b->first));
    int64_t nodes = 0;
    for (PetscMPIInt k = 0; k < g->size; nodes += of[2 * k++])
        PetscCheck(of[2 * k] >= 0 && of[2 * k] <= m->a && of[2 * k + 1] >= of[2 * k], PETSC_COMM_WORLD,
                   PETSC_ERR_ARG_OUTOFRANGE, "%lld nodes of a process", (long long)of[2 * k]);
    PetscCheck(nodes == m->a, PETSC_COMM_WORLD, PETSC_ERR_ARG_SIZ, "%lld nodes of processes", (long long)nodes);
    for (PetscMPIInt k = 0, at = 0; k < g->size; at += b->count[k++]) {
        b->first[k] = at;
        b->count[k] = (PetscMPIInt)of[2 * k] * b->bs;
    }
    b->here = (PetscInt)of[2 * g->rank];
    b->blocks = of[2 * g->rank + 1];
    PetscCall(PetscFree(of));
    b->counts = new_room(b->here, sizeof *b->counts);
    b->rows.column = new_room(b->blocks, sizeof *b->rows.column);
    b->rows.value = new_room(b->blocks * b->bs * b->bs, sizeof *b->rows.value);
    b->rows.mode = new_room(b->here * b->bs * b->modes, sizeof *b->rows.mode);
    PetscFunctionReturn(0);
}

static void tell_made(group *g, const body *b, int which, double start)
{
    int64_t bytes = system_bytes(&b->system, which);
    combine_all(&bytes, 1, MPI_INT64_T, MPI_SUM);
    answer(g, (uz_wire_head){.kind = UZ_WIRE_MADE,
                             .id = b->id,
                             .a = system_levels(&b->system, which),
                             .b = bytes,
                             .x = b->system.most,
                             .y = MPI_Wtime() - start});
}

static void free_rows(body *b)
{
    free(b->counts);
    free(b->rows.ptr);
    free(b->rows.column);
    free(b->rows.value);
    free(b->rows.mode);
    b->counts = NULL;
    b->rows = (spread_rows){0};
}

/* first (size + 1): the first node of each process. Each own node has to have its diagonal block, and of others those
 * that spread_rows says: levels are made of them without a further look. */
static void check_rows(const group *g, const body *b, const int32_t *first)
{
    const int32_t begin = first[g->rank], end = first[g->rank + 1];
    int64_t at = 0;
    bool good = b->filled == b->here && b->filled_blocks == b->blocks;
    for (PetscInt i = 0; good && i < b->here; i++) {
        const int64_t stop = at + b->counts[i];
        bool own = false;
        good = b->counts[i] > 0 && stop <= b->blocks;
        for (int32_t before = -1; good && at < stop; before = b->rows.column[at++]) {
            const int32_t column = b->rows.column[at];
            own = own || column == begin + i;
            good = column > before && column < b->nodes && (column < begin || column >= begin + i || column >= end);
        }
        good = good && own;
    }
    if (!good || at != b->blocks)
        end_group("other rows than were told of");
}

/* All rows have come. */
static void make_system(group *g, body *b)
{
    const double start = MPI_Wtime();
    int32_t *first = new_zeros(g->size + 1, sizeof *first);
    for (int k = 0; k < g->size; k++)
        first[k + 1] = first[k] + b->count[k] / b->bs;
    b->rows.first = first;
    b->rows.ptr = new_zeros(b->here + 1, sizeof *b->rows.ptr);
    check_rows(g, b, first);
    for (PetscInt i = 0; i < b->here; i++)
        b->rows.ptr[i + 1] = b->rows.ptr[i] + b->counts[i];
    system_create(&b->system, &b->rows);
    b->made[VARIANT_WHOLE] = true;
    free(first);
    free_rows(b);
    tell_made(g, b, VARIANT_WHOLE, start);
}

static PetscErrorCode take_rows(group *g, const uz_wire_head *m)
{
    body *b = find(g, m->id);
    size_t size[ROWS_PARTS];
    void *to[ROWS_PARTS];
    MPI_Request request[ROWS_PARTS];
    PetscFunctionBeginUser;
    if (m->c != 0 && g->rank == m->c) {
        bytes_of_rows(size, b, m);
        place_rows(to, b, m);
        for (int k = 0; k < ROWS_PARTS; k++)
            start_receive(&request[k], to[k], size[k]);
        wait_for(ROWS_PARTS, request);
    }
    b->arrived += (PetscInt)m->a;
    if (b->arrived == b->nodes) {
        free_letters(g);
        fresh_end(&g->fresh);
        make_system(g, b);
    }
    PetscFunctionReturn(0);
}

static PetscErrorCode free_body(body *b)
{
    PetscFunctionBeginUser;
    system_free(&b->system);
    free_rows(b);
    PetscCall(PetscFree2(b->count, b->first));
    *b = (body){.id = 0};
    PetscFunctionReturn(0);
}

/* K_FF: without the dofs that are held. */
static void hold(group *g, body *b)
{
    const double start = MPI_Wtime();
    const int n = b->here * b->bs;
    char *held = new_zeros(n, 1);
    MPI_Request request;
    MPI_Iscatterv(g->whole, b->count, b->first, MPI_CHAR, held, n, MPI_CHAR, 0, PETSC_COMM_WORLD, &request);
    wait_for(1, &request);
    system_hold(&b->system, held);
    b->made[VARIANT_HELD] = true;
    free(held);
    tell_made(g, b, VARIANT_HELD, start);
}

/* ---- vectors and steps */

/* Of the vectors that came those from `first` on, one for each lane. In the solver's order a node has bs numbers, in
 * ours four; ours are of S^-1 u and S f. */
static void take_vectors(group *g, const body *b, double *v, int first, bool displacement)
{
    const int mine = b->count[g->rank], lanes = b->system.lanes;
    const int64_t n = (int64_t)b->nodes * b->bs;
    double *own = b->system.q;
    MPI_Request request;
    for (int l = 0; l < lanes; l++) {
        const double *from = IS_FIRST(g) ? (const double *)g->whole + (first + l) * n : NULL;
        MPI_Iscatterv(from, b->count, b->first, MPI_DOUBLE, own, mine, MPI_DOUBLE, 0, PETSC_COMM_WORLD, &request);
        wait_for(1, &request);
        for (int64_t i = 0; i < mine; i++) {
            const double scale = b->system.scale[i];
            v[(i / b->bs * lanes + l) * 4 + i % b->bs] = displacement ? own[i] / scale : own[i] * scale;
        }
    }
}

static void put_displacements(group *g, const body *b, const double *v)
{
    const int mine = b->count[g->rank], lanes = b->system.lanes;
    const int64_t n = (int64_t)b->nodes * b->bs;
    double *own = b->system.q, *all = IS_FIRST(g) ? need_room(g, (size_t)(lanes * n) * sizeof *all) : NULL;
    MPI_Request request;
    for (int l = 0; l < lanes; l++) {
        for (int64_t i = 0; i < mine; i++)
            own[i] = v[(i / b->bs * lanes + l) * 4 + i % b->bs] * b->system.scale[i];
        MPI_Igatherv(own, mine, MPI_DOUBLE, all ? all + l * n : NULL, b->count, b->first, MPI_DOUBLE, 0,
                     PETSC_COMM_WORLD, &request);
        wait_for(1, &request);
    }
    answer(g, (uz_wire_head){.kind = UZ_WIRE_VECTOR, .id = b->id});
    if (IS_FIRST(g))
        put(g, all, (size_t)(lanes * n) * sizeof *all);
}

static PetscErrorCode make_steps(group *g, spread_system *s, const uz_wire_head *m)
{
    bool flat;
    PetscFunctionBeginUser;
    PetscCheck(m->b > 0 && m->b <= UZ_WIRE_STEPS_MOST, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "too many steps");
    const int made = system_steps(s, (int)m->a, &flat, (int)m->b, m->x, m->y * m->y);
    answer(g, (uz_wire_head){.kind = UZ_WIRE_STATE, .id = m->id, .a = made, .b = flat, .x = system_square(s)});
    PetscFunctionReturn(0);
}

static void begin_solve(group *g, const body *b, spread_system *s, const uz_wire_head *m)
{
    const bool from_zero = m->b == 1;
    s->rough = false;
    s->lanes = lanes_of(m);
    memset(s->f, 0, 4 * (size_t)(s->lanes * s->near.here) * sizeof *s->f); /* surplus numbers stood elsewhere */
    memset(s->u, 0, 4 * (size_t)(s->lanes * s->near.here) * sizeof *s->u);
    if (!from_zero)
        take_vectors(g, b, s->u, 0, true);
    take_vectors(g, b, s->f, from_zero ? 0 : s->lanes, false);
}

static PetscErrorCode obey(group *g, const uz_wire_head *m)
{
    PetscFunctionBeginUser;
    if (m->kind == UZ_WIRE_GRAPH) {
        PetscCall(answer_parts(g, m));
        PetscFunctionReturn(0);
    }
    if (m->kind == UZ_WIRE_EXPECT) {
        fresh_begin(&g->fresh, m->a > 0 && m->a < INT64_MAX / EACH_TIMES ? EACH_TIMES * m->a : 0);
        PetscFunctionReturn(0);
    }
    if (m->kind == UZ_WIRE_BODY) {
        PetscCall(begin_body(g, m));
        PetscFunctionReturn(0);
    }
    if (m->kind == UZ_WIRE_ROWS) {
        PetscCall(take_rows(g, m));
        PetscFunctionReturn(0);
    }
    body *b = find(g, m->id);
    if (m->kind == UZ_WIRE_FREE) {
        PetscCall(free_body(b));
        PetscFunctionReturn(0);
    }
    if (m->kind == UZ_WIRE_HOLD) {
        PetscCheck(b->made[VARIANT_WHOLE], PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONGSTATE, "no such system");
        hold(g, b);
        PetscFunctionReturn(0);
    }
    PetscCheck((m->a == 0 || m->a == 1) && b->made[m->a], PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONGSTATE, "no such system");
    spread_system *s = &b->system;
    const int which = (int)m->a;
    if (m->kind == UZ_WIRE_BEGIN)
        begin_solve(g, b, s, m);
    else if (m->kind != UZ_WIRE_STEPS)
        system_settle(s);
    if (m->kind == UZ_WIRE_BEGIN || m->kind == UZ_WIRE_AGAIN) {
        system_begin(s, which, m->kind == UZ_WIRE_BEGIN && m->b == 1);
        answer(g, (uz_wire_head){.kind = UZ_WIRE_STATE, .id = m->id, .x = system_square(s)});
    } else if (m->kind == UZ_WIRE_STEPS) {
        PetscCall(make_steps(g, s, m));
    } else if (m->kind == UZ_WIRE_FETCH) {
        put_displacements(g, b, s->u);
    } else if (m->kind == UZ_WIRE_APPLY) {
        s->lanes = 1;
        memset(s->r, 0, 4 * (size_t)s->near.here * sizeof *s->r);
        take_vectors(g, b, s->r, 0, false);
        system_precondition(s, which, s->z, s->r);
        put_displacements(g, b, s->z);
    } else {
        SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "message of kind %d", m->kind);
    }
    PetscFunctionReturn(0);
}

/* ---- beginning and end */

/* What is asked next, from the first process to all. */
static PetscErrorCode hear(group *g, uz_wire_head *m)
{
    MPI_Request request;
    PetscFunctionBeginUser;
    if (IS_FIRST(g) && !stream_read(g->stream, m, sizeof *m))
        m->kind = 0;
    if (IS_FIRST(g) && m->kind != 0)
        read_behind(g, m);
    PetscCallMPI(MPI_Ibcast(m, (int)sizeof *m, MPI_BYTE, 0, PETSC_COMM_WORLD, &request));
    wait_for(1, &request);
    PetscFunctionReturn(0);
}

static PetscErrorCode serve(group *g)
{
    PetscFunctionBeginUser;
    answer(g, (uz_wire_head){.kind = UZ_WIRE_HELLO, .a = g->size});
    for (;;) {
        uz_wire_head m = {.kind = 0};
        PetscCall(hear(g, &m));
        if (m.kind == 0)
            break;
        PetscCheck(m.version == UZ_WIRE_VERSION, PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP, "message of another version");
        PetscCall(obey(g, &m));
    }
    for (int k = 0; k < UZ_WIRE_BODIES; k++)
        if (g->body[k].id)
            PetscCall(free_body(&g->body[k]));
    fresh_end(&g->fresh);
    free_letters(g);
    free(g->whole);
    PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
    static const char HELP[] = "uzawa-group SOCKET [PETSC OPTIONS]: how uzawad solves with `operator` distributed\n";
    const char *where = argc > 1 ? argv[1] : "";
    group g = {.stream = -1};
    if (PetscInitialize(&argc, &argv, NULL, HELP))
        return 1;
    PetscPopSignalHandler();
    MPI_Comm_rank(PETSC_COMM_WORLD, &g.rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &g.size);
    if (IS_FIRST(&g) && (g.stream = stream_open(where)) < 0)
        end_group("there is nobody at the socket: this is a program that uzawad starts");
    mallopt(M_MMAP_MAX, 0); /* what is freed is taken again: fresh pages are dear */
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
    uz_process_init(2); /* one thread of BLAS: the processes are the parallelism */
    uz_thread_init();
    if (serve(&g))
        MPI_Abort(PETSC_COMM_WORLD, 1);
    return PetscFinalize() ? 1 : 0;
}
