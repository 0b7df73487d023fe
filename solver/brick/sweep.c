/* sweep.c: products on a grid, with what follows each plane of nodes done while it is in the cache.
 *
 * Once both layers of cells beside a plane of nodes are through, K x is known there, and x there is not read again: a
 * step of the smoother can change it on the spot. The next step follows a plane behind, so that all steps of a
 * smoother, with what comes before and after, pass through the vectors once (a wavefront: Wittmann, Hager and Wellein,
 * "Multicore-aware parallel temporal blocking of stencil codes for shared and distributed memory", IPDPS Workshops,
 * 2010). Threads share a sweep in slabs of planes. What a slab needs of planes beside it, it computes once more for
 * itself, with the same bits. Where the slab above has begun by then, which begins there, the last such planes are
 * taken from it instead. */
#include "brick/levels.h"

#include "core/alloc.h"
#include "core/cpu.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define REAL float
#include "brick/line.inc"

/* A slab has so many planes for each stage of a sweep, as it does planes beside it once more. */
enum { PLANES_OF_STAGE = 4 };
/* Planes of the stage before the last one that a slab takes from the one above: the last of its own and the next. */
enum { HANDED = 2 };

/* Stages of the longest sweep that has a slab for this part: coarser grids have no more planes. */
static int64_t stages_of(const uz_brick_level *level, int part)
{
    const int64_t most = (level->cells[2] + 1) / (PLANES_OF_STAGE * (part + 1));
    return part > 0 && most < UZ_BRICK_DEGREE_MOST ? most : UZ_BRICK_DEGREE_MOST;
}

bool uz_brick_planes_init(uz_brick_planes *room, const uz_brick_level *level, size_t *bytes)
{
    const int64_t plane = level->axes * level->plane + 2 * UZ_BRICK_PAD,
                  sums = fields_of(level->axes) * line_room(level->stride), line = 2 * (level->stride + UZ_BRICK_PAD);
    bool ok = (room->of_plane = uz_alloc_zero(level->cells[2] + 1, sizeof(double)));
    *bytes += 8 * (size_t)(level->cells[2] + 1);
    room->most = uz_aside_count();
    for (int part = 0; part < room->most; part++) {
        struct uz_brick_room *of = &room->of[part];
        /* reach: planes of x and of d, below and above, where there are two slabs */
        const int64_t stages = stages_of(level, part),
                      reach = room->most < 2 ? 0 : stages_of(level, part > 0 ? part : 1),
                      beside = reach > 0 ? (4 * reach + 1) * level->axes * level->plane + 2 * UZ_BRICK_PAD : 0;
        for (int k = 0; k < 2 * stages; k++)
            ok = (of->plane[k / 2][k % 2] = uz_alloc_zero(plane, sizeof(float))) && ok;
        ok = (of->sums = uz_alloc_zero(sums, sizeof(float))) && ok;
        ok = (of->line = uz_alloc_zero(line, sizeof(float))) && ok;
        ok = (beside == 0 || (of->beside = uz_alloc_zero(beside, sizeof(float)))) && ok;
        *bytes += 4 * (size_t)(2 * stages * plane + sums + line + beside);
    }
    return ok;
}

void uz_brick_planes_clear(uz_brick_planes *room)
{
    for (int part = 0; part < room->most; part++) {
        struct uz_brick_room *of = &room->of[part];
        for (int k = 0; k < 2 * UZ_BRICK_DEGREE_MOST; k++)
            free(of->plane[k / 2][k % 2]);
        uz_free_all(of->sums, of->line, of->beside);
    }
    free(room->of_plane);
    memset(room, 0, sizeof *room);
}

/* What a layer of cells lies between: a plane of nodes and the next one, whose components begin so many numbers apart.
 */
typedef struct {
    const float *near, *far;
    int64_t apart_near, apart_far;
} nodes;

/* What the cells of a layer do to the nodes is added to near, and is all that far has. */
static inline __attribute__((always_inline)) void layer(const uz_brick_level *level, float *sums, const nodes *x,
                                                        float *near, float *far, const int axes)
{
    const int lines = lines_of(axes), below = lines / 2; /* those of near */
    for (int64_t j = 0; j < rows_of(level->cells, axes); j++) {
        const float *in[COMPONENTS * LINES];
        float *out[COMPONENTS * LINES];
        for (int m = 0; m < axes; m++)
            for (int q = 0; q < lines; q++) {
                const int64_t line = (j + q % below) * level->stride;
                in[m * lines + q] = q < below ? x->near + m * x->apart_near + line : x->far + m * x->apart_far + line;
                out[m * lines + q] = (q < below ? near : far) + m * level->plane + line;
            }
        cells_of_line(sums, in, level->cells[0], level->stride, level->block, axes);
        nodes_of_line(out, sums, level->stride, j == 0, axes);
    }
}

/* Functions of their own: a slab has to compute what the one below it has to the last bit. */
#define OF_AXES(NAME, AXES, FOR_PROCESSOR)                                                                             \
    FOR_PROCESSOR static __attribute__((noinline)) void NAME(const uz_brick_level *level, float *sums, const nodes *x, \
                                                             float *near, float *far)                                  \
    {                                                                                                                  \
        layer(level, sums, x, near, far, AXES);                                                                        \
    }
OF_AXES(solid_wide, 3, UZ_AVX2_FMA)
OF_AXES(solid_narrow, 3, )
OF_AXES(plane_wide, 2, UZ_AVX2_FMA)
OF_AXES(plane_narrow, 2, )

/* What is done to a plane: x = d = q inverse b; of a polynomial, x += d, its first step, d = q inverse (b - K x), and
 * the others, d = p d + the same; t = b - K x and t = K x at free dofs. */
typedef enum { ZERO_STEP, FIRST_STEP, STEP, RESIDUAL, CURVATURE } task;
typedef struct {
    task what;
    float p, q;
} stage;

typedef int32_t masks __attribute__((vector_size(32)));
typedef float four_singles __attribute__((vector_size(16), aligned(4), may_alias));
typedef double fours __attribute__((vector_size(32)));

/* Numbers of a plane of one component, registers of them. Returns x't of a curvature. */
static inline __attribute__((always_inline)) double finish(const uz_brick_vectors *v, int64_t n, const float *Kx,
                                                           const stage *s)
{
    float *restrict x = v->x, *restrict d = v->d, *restrict t = v->t;
    const float *restrict b = v->b, *restrict inverse = v->inverse, p = s->p, q = s->q;
    for (int64_t i = 0; s->what == ZERO_STEP && i < n; i++)
        x[i] = d[i] = q * inverse[i] * b[i];
    for (int64_t i = 0; s->what == FIRST_STEP && i < n; i++) {
        d[i] = q * inverse[i] * (b[i] - Kx[i]);
        x[i] += d[i];
    }
    for (int64_t i = 0; s->what == STEP && i < n; i++) {
        d[i] = p * d[i] + q * inverse[i] * (b[i] - Kx[i]);
        x[i] += d[i];
    }
    for (int64_t i = 0; s->what == RESIDUAL && i < n; i += WIDTH) {
        const lanes left = *(const lanes *)(b + i) - *(const lanes *)(Kx + i);
        *(lanes *)(t + i) = (lanes)((masks)left & (*(const lanes *)(inverse + i) != 0.0F));
    }
    if (s->what != CURVATURE)
        return 0.0;
    fours sums[2] = {{0.0}};
    for (int64_t i = 0; i < n; i += WIDTH) {
        const lanes of = *(const lanes *)(Kx + i);
        *(lanes *)(t + i) = (lanes)((masks)of & (*(const lanes *)(inverse + i) != 0.0F));
        for (int half = 0; half < 2; half++)
            sums[half] += __builtin_convertvector(*(const four_singles *)(x + i + 4 * half), fours) *
                          __builtin_convertvector(*(const four_singles *)(t + i + 4 * half), fours);
    }
    const fours all = sums[0] + sums[1];
    return (all[0] + all[1]) + (all[2] + all[3]);
}

__attribute__((noinline)) UZ_AVX2_FMA static double finish_wide(const uz_brick_vectors *v, int64_t n, const float *Kx,
                                                                const stage *s)
{
    return finish(v, n, Kx, s);
}

__attribute__((noinline)) static double finish_narrow(const uz_brick_vectors *v, int64_t n, const float *Kx,
                                                      const stage *s)
{
    return finish(v, n, Kx, s);
}

/* A sweep as the threads that share it see it. Stage 0 is of planes alone: x += P coarse, a ZERO_STEP, or, where x is
 * not changed, nothing. */
typedef struct {
    const uz_brick_level *level, *next;
    const uz_brick_vectors *v;
    const uz_brick_planes *room;
    const float *coarse; /* NULL: nothing is added */
    stage first, of[UZ_BRICK_DEGREE_MOST];
    int stages; /* beside the first */
    bool changes, from_zero;
    int slabs;
    atomic_bool *hands; /* of each slab: its planes for the one below can be taken */
} sweep;

typedef struct {
    const sweep *s;
    struct uz_brick_room room;
    int part;
    int64_t begin, end; /* its planes */
    bool spared;        /* the slab above hands it planes */
} slab;

static slab slab_of(const sweep *s, int part)
{
    const int64_t planes = s->level->cells[2] + 1;
    return (slab){
        s,    s->room->of[part], part, uz_brick_slab(planes, part, s->slabs), uz_brick_slab(planes, part + 1, s->slabs),
        false};
}

/* Planes that a stage has to reach, so that the last one has those of the slab. What is handed ends the stage before
 * that one at the last plane of the slab. */
static int64_t lowest(const slab *own, int number)
{
    const int64_t k = own->begin - (own->s->stages - number);
    return k > 0 ? k : 0;
}

static int64_t highest(const slab *own, int number)
{
    const int64_t spared = own->spared && number < own->s->stages ? HANDED : 0,
                  k = own->end - 1 - spared + (own->s->stages - number), last = own->s->level->cells[2];
    return k < last ? k : last;
}

/* Where plane k of x (0) or d (1) stands for this slab, and how far apart its components are. */
static float *plane_of(int64_t *apart, const slab *own, int vector, int64_t k)
{
    const sweep *s = own->s;
    const int64_t plane = s->level->plane;
    *apart = s->level->size;
    if (!s->changes || (k >= own->begin && k < own->end))
        return (vector == 0 ? s->v->x : s->v->d) + k * plane;
    *apart = plane;
    const int64_t reach = s->stages, place = k < own->begin ? reach - (own->begin - k) : reach + k - own->end;
    return own->room.beside + (2 * vector * reach + place) * s->level->axes * plane;
}

static void copy_plane(const slab *own, float *to, int64_t apart_to, const float *from, int64_t apart_from)
{
    for (int m = 0; m < own->s->level->axes; m++)
        memcpy(to + m * apart_to, from + m * apart_from, (size_t)own->s->level->plane * sizeof(float));
}

/* x beside the slab as it is before others change it there. */
static void copy_beside(void *ctx, int part)
{
    const slab own = slab_of(ctx, part);
    const sweep *s = own.s;
    for (int64_t k = lowest(&own, 0); k <= highest(&own, 0); k++) {
        int64_t apart;
        float *x = plane_of(&apart, &own, 0, k);
        if (k < own.begin || k >= own.end)
            copy_plane(&own, x, apart, s->v->x + k * s->level->plane, s->level->size);
    }
}

/* The layer of cells above plane k. */
static void add_layer(const slab *own, int64_t k, float *near, float *far)
{
    nodes x;
    x.near = plane_of(&x.apart_near, own, 0, k);
    x.far = plane_of(&x.apart_far, own, 0, k + 1);
    const bool wide = uz_cpu_has_avx2_fma();
    if (own->s->level->axes == 2)
        (wide ? plane_wide : plane_narrow)(own->s->level, own->room.sums, &x, near, far);
    else
        (wide ? solid_wide : solid_narrow)(own->s->level, own->room.sums, &x, near, far);
}

static void finish_plane(const slab *own, int64_t k, const float *Kx, const stage *what)
{
    const sweep *s = own->s;
    const int64_t plane = s->level->plane;
    int64_t apart;
    float *x = plane_of(&apart, own, 0, k), *d = s->changes ? plane_of(&apart, own, 1, k) : NULL;
    double sum = 0.0;
    for (int m = 0; m < s->level->axes; m++) {
        const int64_t at = m * s->level->size + k * plane;
        const uz_brick_vectors v = {.x = x + m * apart,
                                    .d = d ? d + m * apart : NULL,
                                    .b = what->what == CURVATURE ? NULL : s->v->b + at,
                                    .t = s->v->t + at,
                                    .inverse = s->v->inverse + at};
        sum += (uz_cpu_has_avx2_fma() ? finish_wide : finish_narrow)(&v, plane, Kx ? Kx + m * plane : NULL, what);
    }
    if (what->what == CURVATURE)
        s->room->of_plane[k] = sum;
}

static void begin_plane(const slab *own, int64_t k)
{
    const sweep *s = own->s;
    int64_t apart;
    float *x = plane_of(&apart, own, 0, k);
    if (s->from_zero)
        finish_plane(own, k, NULL, &s->first);
    else if (s->coarse)
        uz_brick_prolong_plane(s->level, s->next, s->v->inverse, s->coarse, own->room.line, k, x, apart);
}

/* Its first plane as the stage before the last one leaves it; that below stays as it is beside the slab. */
static float *handed_plane(const slab *own)
{
    return own->room.beside + 4 * own->s->stages * own->s->level->axes * own->s->level->plane;
}

static void hand(const slab *own)
{
    int64_t apart;
    const float *x = plane_of(&apart, own, 0, own->begin);
    copy_plane(own, handed_plane(own), own->s->level->plane, x, apart);
    atomic_store_explicit(&own->s->hands[own->part], true, memory_order_release);
}

/* When the first stage would go beyond what it has to reach of a slab that is spared the rest. */
static void be_spared(slab *own)
{
    const sweep *s = own->s;
    own->spared = own->part + 1 < s->slabs && atomic_load_explicit(&s->hands[own->part + 1], memory_order_acquire);
    if (!own->spared)
        return;
    const slab above = slab_of(s, own->part + 1);
    int64_t apart, apart_from;
    for (int vector = 0; vector < 2; vector++) {
        float *to = plane_of(&apart, own, vector, own->end - 1);
        const float *from = plane_of(&apart_from, &above, vector, own->end - 1);
        copy_plane(own, to, apart, from, apart_from);
    }
    float *next = plane_of(&apart, own, 0, own->end);
    copy_plane(own, next, apart, handed_plane(&above), s->level->plane);
}

/* A stage that has come to the layer above plane k. */
static void go_on(slab *own, int number, int64_t k)
{
    const sweep *s = own->s;
    float **sums = own->room.plane[number - 1], *const done = sums[0];
    const int64_t low = lowest(own, number);
    if (k + 1 < low || k > highest(own, number) || k < 0)
        return;
    if (k == 0)
        memset(sums[0], 0, (size_t)(s->level->axes * s->level->plane) * sizeof(float));
    if (k < s->level->cells[2])
        add_layer(own, k, sums[0], sums[1]);
    if (k >= low)
        finish_plane(own, k, sums[0], &s->of[number - 1]);
    if (own->part > 0 && s->changes && k == own->begin && number == s->stages - 1)
        hand(own);
    sums[0] = sums[1];
    sums[1] = done;
}

static void sweep_slab(void *ctx, int part)
{
    slab own = slab_of(ctx, part);
    const int stages = own.s->stages;
    for (int64_t k = lowest(&own, 0); k < own.end + stages; k++) {
        if (own.s->changes && k == own.end + stages - HANDED)
            be_spared(&own);
        if (k <= highest(&own, 0))
            begin_plane(&own, k);
        for (int number = 1; number <= stages; number++)
            go_on(&own, number, k - number);
    }
}

static void share(sweep *s)
{
    const int64_t planes = s->level->cells[2] + 1;
    atomic_bool hands[UZ_ASIDE_MOST] = {false};
    s->hands = hands;
    s->slabs = uz_brick_slabs(planes, s->level->size, s->room->most);
    while (s->slabs > 1 && s->slabs * PLANES_OF_STAGE * s->stages > planes)
        s->slabs--;
    if (s->changes && !s->from_zero && s->slabs > 1)
        uz_aside_share(copy_beside, s, s->slabs);
    uz_aside_share(sweep_slab, s, s->slabs);
}

void uz_brick_smooth_down(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    const uz_brick_smoother *by = &level->smoother;
    sweep s = {.level = level,
               .v = v,
               .room = room,
               .first = {ZERO_STEP, 0.0F, by->q[0]},
               .stages = by->degree,
               .changes = true,
               .from_zero = true};
    for (int k = 1; k < by->degree; k++)
        s.of[k - 1] = (stage){STEP, by->p[k], by->q[k]};
    s.of[by->degree - 1] = (stage){RESIDUAL, 0.0F, 0.0F};
    share(&s);
}

void uz_brick_smooth_up(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                        const float *coarse, const uz_brick_planes *room)
{
    const uz_brick_smoother *by = &level->smoother;
    sweep s = {
        .level = level, .next = next, .v = v, .room = room, .coarse = coarse, .stages = by->degree, .changes = true};
    for (int k = 0; k < by->degree; k++)
        s.of[k] = (stage){k == 0 ? FIRST_STEP : STEP, by->p[k], by->q[k]};
    share(&s);
}

/* A stage that changes no x. */
static void look_at(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room, task what)
{
    sweep s = {.level = level, .v = v, .room = room, .of = {{what, 0.0F, 0.0F}}, .stages = 1};
    share(&s);
}

void uz_brick_residual(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    look_at(level, v, room, RESIDUAL);
}

double uz_brick_curvature(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    double sum = 0.0;
    look_at(level, v, room, CURVATURE);
    for (int64_t k = 0; k <= level->cells[2]; k++)
        sum += room->of_plane[k];
    return sum;
}
