/* reserve.c: big blocks from pages that are kept when a block is freed.
 *
 * A page that went back to the system is dear to get again, above all on virtual machines, where the first touch of 2
 * MB was seen to take 8 ms: a factor of 200 MB took twice as long on fresh pages, now and then. Freed blocks leave
 * their pages here, up to a number of bytes. A new block is made by moving such pages to a range of addresses of its
 * own (mremap(2) moves entries of page tables, not bytes), so that nothing is too small or lies in the way; what is
 * missing is fresh. Fresh pages are touched ahead of their owner by a thread of the reserve's own, which asks the
 * kernel for them and writes nothing: before a block is taken, as far as it was announced, and while it is filled. What
 * no factor takes is moved to a free range of the heap in the same way. */
#include "core/reserve.h"

#include "core/alloc.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define FILL (16 * UZ_HUGE_PAGE)
#define LONG (4 * UZ_HUGE_PAGE) /* less is not worth waking the helper */

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
    pthread_cond_t news;
    pthread_t helper; /* only while has_helper */
    bool has_helper, ends;
    char *ahead, *ahead_end; /* fresh pages of the block that was taken last */
    size_t expected;         /* bytes that shall be kept for a block to come */
    size_t lent_bytes;       /* that the heap was given since the reserve was emptied */
};

uz_reserve *uz_reserve_new(size_t most, size_t ready)
{
    uz_reserve *reserve = calloc(1, sizeof *reserve);
    if (!reserve)
        return NULL;
    reserve->most = most;
    reserve->ready = ready < most ? ready : most;
    reserve->largest = reserve->ready; /* the first block may be large, and finds nothing else that is kept */
    pthread_mutex_init(&reserve->mutex, NULL);
    pthread_cond_init(&reserve->news, NULL);
    return reserve;
}

/* An address range of huge pages without any page; NULL: there is none. */
static char *map(size_t bytes)
{
    char *all =
        mmap(NULL, bytes + UZ_HUGE_PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (all == MAP_FAILED)
        return NULL;
    const size_t before = (UZ_HUGE_PAGE - (size_t)all % UZ_HUGE_PAGE) % UZ_HUGE_PAGE;
    if (before > 0)
        munmap(all, before);
    if (before < UZ_HUGE_PAGE)
        munmap(all + before + bytes, UZ_HUGE_PAGE - before);
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

static void free_list(piece *list)
{
    while (list) {
        piece *next = list->next;
        free(list);
        list = next;
    }
}

static void unmap_pieces(piece *list)
{
    for (const piece *part = list; part; part = part->next)
        munmap(part->at, part->bytes);
    free_list(list);
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
        const size_t room = all < reserve->most ? (reserve->most - all) / UZ_HUGE_PAGE * UZ_HUGE_PAGE : 0;
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

/* Keeps fresh pages, which are there. */
static bool keep_fresh(uz_reserve *reserve, size_t bytes)
{
    piece *fresh = calloc(1, sizeof *fresh);
    if (!fresh || !(fresh->at = map(bytes))) {
        free(fresh);
        return false;
    }
    fresh->bytes = bytes;
    memset(fresh->at, 0, bytes);
    keep(reserve, fresh);
    return true;
}

static void *touch_ahead(void *arg)
{
    uz_reserve *reserve = arg;
    bool good = true;
    pthread_mutex_lock(&reserve->mutex);
    while (!reserve->ends) {
        char *const at = reserve->ahead;
        const size_t all = reserve->block_bytes + reserve->kept_bytes;
        if (at < reserve->ahead_end) {
            reserve->ahead += UZ_HUGE_PAGE;
            pthread_mutex_unlock(&reserve->mutex);
            /* false too where the block has gone meanwhile */
            good = madvise(at, UZ_HUGE_PAGE, MADV_POPULATE_WRITE) == 0;
            pthread_mutex_lock(&reserve->mutex);
            if (!good)
                reserve->ahead = reserve->ahead_end;
        } else if (reserve->kept_bytes < reserve->expected && all + UZ_HUGE_PAGE <= reserve->most) {
            pthread_mutex_unlock(&reserve->mutex);
            good = keep_fresh(reserve, UZ_HUGE_PAGE);
            pthread_mutex_lock(&reserve->mutex);
            if (!good)
                reserve->expected = 0;
        } else {
            pthread_cond_wait(&reserve->news, &reserve->mutex);
        }
    }
    pthread_mutex_unlock(&reserve->mutex);
    return NULL;
}

/* Under the mutex. Without a thread pages come when they are touched. */
static void start_helper(uz_reserve *reserve)
{
    if (reserve->has_helper)
        return;
    reserve->has_helper = pthread_create(&reserve->helper, NULL, touch_ahead, reserve) == 0;
    if (reserve->has_helper)
        pthread_setname_np(reserve->helper, "uzawad-pages");
}

static void wake_helper(uz_reserve *reserve)
{
    start_helper(reserve);
    pthread_cond_signal(&reserve->news);
}

void uz_reserve_start(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    start_helper(reserve);
    pthread_mutex_unlock(&reserve->mutex);
}

void uz_reserve_expect(uz_reserve *reserve, size_t bytes)
{
    pthread_mutex_lock(&reserve->mutex);
    reserve->expected = bytes < reserve->ready ? bytes : reserve->ready;
    if (reserve->kept_bytes < reserve->expected)
        wake_helper(reserve);
    pthread_mutex_unlock(&reserve->mutex);
}

void *uz_reserve_take(uz_reserve *reserve, size_t bytes)
{
    if (bytes > PTRDIFF_MAX - 2 * UZ_HUGE_PAGE)
        return NULL;
    bytes = (bytes + UZ_HUGE_PAGE - 1) / UZ_HUGE_PAGE * UZ_HUGE_PAGE;
    block *b = calloc(1, sizeof *b);
    if (!b || !(b->at = map(bytes))) {
        free(b);
        return NULL;
    }
    b->bytes = bytes;
    pthread_mutex_lock(&reserve->mutex);
    size_t kept = reserve->kept_bytes;
    const bool made = move_kept(reserve, b);
    if (made) {
        kept -= reserve->kept_bytes;
        if (bytes >= reserve->expected / 2)
            reserve->expected = 0;
        if (bytes - kept >= LONG) {
            reserve->ahead = b->at + kept;
            reserve->ahead_end = b->at + bytes;
            wake_helper(reserve);
        }
        b->next = reserve->blocks;
        reserve->blocks = b;
        reserve->block_bytes += bytes;
        reserve->largest = bytes > reserve->largest ? bytes : reserve->largest;
    }
    pthread_mutex_unlock(&reserve->mutex);
    if (made)
        return b->at;
    munmap(b->at, bytes); /* its pieces too */
    free_list(b->pieces);
    free(b);
    return NULL;
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
        if (reserve->ahead >= found->at && reserve->ahead < found->at + found->bytes)
            reserve->ahead = reserve->ahead_end = NULL;
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
    bytes = (more ? FILL : bytes) / UZ_HUGE_PAGE * UZ_HUGE_PAGE;
    return bytes > 0 && keep_fresh(reserve, bytes) && more;
}

void uz_reserve_give_to_heap(uz_reserve *reserve, size_t bytes)
{
    block whole = {.at = NULL};
    pthread_mutex_lock(&reserve->mutex);
    reserve->expected = 0;
    whole.bytes = (bytes < reserve->kept_bytes ? bytes : reserve->kept_bytes) / UZ_HUGE_PAGE * UZ_HUGE_PAGE;
    const bool some = whole.bytes > 0;
    whole.at = some ? uz_malloc_huge(whole.bytes) : NULL; /* and freed with other pages: nobody reads it */
    const bool made = !some || (whole.at && move_kept(reserve, &whole));
    if (reserve->largest > reserve->kept_bytes)
        reserve->largest = reserve->kept_bytes;
    reserve->lent_bytes += made ? whole.bytes : 0;
    pthread_mutex_unlock(&reserve->mutex);
    free_list(whole.pieces);
    free(whole.at);
    if (!made)
        uz_reserve_empty(reserve);
}

void uz_reserve_empty(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    piece *out = reserve->kept;
    reserve->kept = NULL;
    reserve->expected = reserve->largest = reserve->kept_bytes = reserve->lent_bytes = 0;
    pthread_mutex_unlock(&reserve->mutex);
    unmap_pieces(out);
}

size_t uz_reserve_lent(uz_reserve *reserve)
{
    pthread_mutex_lock(&reserve->mutex);
    const size_t bytes = reserve->lent_bytes;
    pthread_mutex_unlock(&reserve->mutex);
    return bytes;
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
    pthread_mutex_lock(&reserve->mutex);
    reserve->ends = true;
    pthread_cond_signal(&reserve->news);
    pthread_mutex_unlock(&reserve->mutex);
    if (reserve->has_helper)
        pthread_join(reserve->helper, NULL);
    uz_reserve_empty(reserve);
    pthread_cond_destroy(&reserve->news);
    pthread_mutex_destroy(&reserve->mutex);
    free(reserve);
}
