/* reserve.c: big blocks from pages that are kept when a block is freed.
 *
 * A page that went back to the system is dear to get again, above all on virtual machines, where the first touch of 2
 * MB was seen to take 8 ms: a factor of 200 MB took twice as long on fresh pages, now and then. Freed blocks leave
 * their pages here, up to a number of bytes. A new block is made by moving such pages to a range of addresses of its
 * own (mremap(2) moves entries of page tables, not bytes), so that nothing is too small or lies in the way; what is
 * missing is fresh. */
#include "core/reserve.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)
#define FILL      (16 * HUGE_PAGE)

/* Huge pages in one mapping: mremap takes no more than one at a time. */
typedef struct piece {
    char *at;
    size_t bytes;
    struct piece *next;
} piece;

typedef struct block {
    char *at;
    size_t bytes;
    piece *pieces; /* which it consists of, in any order */
    struct block *next;
} block;

struct uz_reserve {
    pthread_mutex_t mutex; /* guards what follows; also held while pages move, which takes microseconds */
    block *blocks;
    piece *kept;
    size_t block_bytes, kept_bytes, most, ready;
    size_t largest; /* block since it was emptied last */
};

uz_reserve *uz_reserve_new(size_t most, size_t ready)
{
    uz_reserve *reserve = calloc(1, sizeof *reserve);
    if (!reserve)
        return NULL;
    reserve->most = most;
    reserve->ready = ready < most ? ready : most;
    pthread_mutex_init(&reserve->mutex, NULL);
    return reserve;
}

/* An address range of huge pages without any page; NULL: there is none. */
static char *map(size_t bytes)
{
    char *all =
        mmap(NULL, bytes + HUGE_PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (all == MAP_FAILED)
        return NULL;
    const size_t before = (HUGE_PAGE - (size_t)all % HUGE_PAGE) % HUGE_PAGE;
    if (before > 0)
        munmap(all, before);
    if (before < HUGE_PAGE)
        munmap(all + before + bytes, HUGE_PAGE - before);
    madvise(all + before, bytes, MADV_HUGEPAGE); /* a wish: where it is refused, small pages do */
    return all + before;
}

/* The block, fresh so far, gets what is kept, from its begin on: until it is full or none is left. false: no memory. */
static bool move_kept(uz_reserve *reserve, block *b)
{
    char *to = b->at, *const end = b->at + b->bytes;
    while (to < end) {
        piece *from = reserve->kept, *part = from;
        const size_t rest = (size_t)(end - to), moved = from && from->bytes < rest ? from->bytes : rest;
        if (!from || from->bytes > rest) {
            part = malloc(sizeof *part);
            if (!part)
                return false;
        }
        if (from && mremap(from->at + from->bytes - moved, moved, moved, MREMAP_MAYMOVE | MREMAP_FIXED, to) != to) {
            if (part != from)
                free(part);
            return false;
        }
        if (from == part)
            reserve->kept = from->next;
        else if (from)
            from->bytes -= moved;
        reserve->kept_bytes -= from ? moved : 0;
        *part = (piece){to, moved, b->pieces};
        b->pieces = part;
        to += moved;
    }
    return true;
}

static void unmap_pieces(piece *list)
{
    while (list) {
        piece *next = list->next;
        munmap(list->at, list->bytes);
        free(list);
        list = next;
    }
}

void *uz_reserve_take(uz_reserve *reserve, size_t bytes)
{
    if (bytes > PTRDIFF_MAX - 2 * HUGE_PAGE)
        return NULL;
    bytes = (bytes + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    block *b = calloc(1, sizeof *b);
    if (!b || !(b->at = map(bytes))) {
        free(b);
        return NULL;
    }
    b->bytes = bytes;
    pthread_mutex_lock(&reserve->mutex);
    const bool made = move_kept(reserve, b);
    if (made) {
        b->next = reserve->blocks;
        reserve->blocks = b;
        reserve->block_bytes += bytes;
        reserve->largest = bytes > reserve->largest ? bytes : reserve->largest;
    }
    pthread_mutex_unlock(&reserve->mutex);
    if (made)
        return b->at;
    munmap(b->at, bytes); /* its pieces too */
    while (b->pieces) {
        piece *next = b->pieces->next;
        free(b->pieces);
        b->pieces = next;
    }
    free(b);
    return NULL;
}

size_t uz_reserve_size(uz_reserve *reserve, const void *block_at)
{
    pthread_mutex_lock(&reserve->mutex);
    const block *b = reserve->blocks;
    while (b && b->at != block_at)
        b = b->next;
    const size_t bytes = b ? b->bytes : 0;
    pthread_mutex_unlock(&reserve->mutex);
    return bytes;
}

/* Keeps what may be kept of the pieces, and gives the rest to the system. Owns them. */
static void keep(uz_reserve *reserve, piece *freed)
{
    piece *out = NULL;
    pthread_mutex_lock(&reserve->mutex);
    while (freed) {
        piece *next = freed->next;
        const size_t all = reserve->block_bytes + reserve->kept_bytes;
        const size_t room = all < reserve->most ? (reserve->most - all) / HUGE_PAGE * HUGE_PAGE : 0;
        if (freed->bytes > room && room > 0) {
            munmap(freed->at + room, freed->bytes - room);
            freed->bytes = room;
        }
        const bool fits = freed->bytes <= room;
        piece **list = fits ? &reserve->kept : &out;
        reserve->kept_bytes += fits ? freed->bytes : 0;
        freed->next = *list;
        *list = freed;
        freed = next;
    }
    pthread_mutex_unlock(&reserve->mutex);
    unmap_pieces(out);
}

bool uz_reserve_give(uz_reserve *reserve, void *block_at)
{
    pthread_mutex_lock(&reserve->mutex);
    block **link = &reserve->blocks;
    while (*link && (*link)->at != block_at)
        link = &(*link)->next;
    block *found = *link;
    if (found) {
        *link = found->next;
        reserve->block_bytes -= found->bytes;
    }
    pthread_mutex_unlock(&reserve->mutex);
    if (!found)
        return false;
    keep(reserve, found->pieces);
    free(found);
    return true;
}

bool uz_reserve_fill(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    const size_t goal = reserve->largest < reserve->ready ? reserve->largest : reserve->ready;
    size_t bytes = goal > reserve->kept_bytes ? goal - reserve->kept_bytes : 0;
    pthread_mutex_unlock(&reserve->mutex);
    const bool more = bytes > FILL;
    bytes = (more ? FILL : bytes) / HUGE_PAGE * HUGE_PAGE;
    piece *fresh = bytes > 0 ? calloc(1, sizeof *fresh) : NULL;
    if (!fresh || !(fresh->at = map(bytes))) {
        free(fresh);
        return false;
    }
    fresh->bytes = bytes;
    memset(fresh->at, 0, bytes);
    keep(reserve, fresh);
    return more;
}

void uz_reserve_empty(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    piece *list = reserve->kept;
    reserve->kept = NULL;
    reserve->kept_bytes = reserve->largest = 0;
    pthread_mutex_unlock(&reserve->mutex);
    unmap_pieces(list);
}

size_t uz_reserve_bytes(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    const size_t bytes = reserve->kept_bytes;
    pthread_mutex_unlock(&reserve->mutex);
    return bytes;
}

void uz_reserve_free(uz_reserve *reserve)
{
    if (!reserve)
        return;
    uz_reserve_empty(reserve);
    pthread_mutex_destroy(&reserve->mutex);
    free(reserve);
}
