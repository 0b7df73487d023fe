/* table.h: reference-counted objects by kind and digest, bounded in bytes, the least recently used first out
 * (meshes before all others), with one creator per object while others wait for it. What the objects are is their
 * owners' business: setups (run/setup_cache.h), factors and analyses (parts.h), meshes of files (meshes.c).
 *
 * An object may hold uses of others in the same table and give them back when it is destroyed: nothing is destroyed
 * under the mutex. */
#ifndef UZ_TABLE_H
#define UZ_TABLE_H

#include "uzawa.h"

typedef enum { UZ_ITEM_SETUP, UZ_ITEM_FACTOR, UZ_ITEM_ANALYSIS, UZ_ITEM_MESH } uz_item_kind;
typedef struct uz_item uz_item;

/* A use of the item, which the caller gives back with uz_table_release. *create: nobody has it and the caller must
 * make it, then publish or abandon it. A waiter whose hooks say cancelled gets UZ_ERR_CANCELLED. */
uz_status uz_table_acquire(uz_item **item, bool *create, uz_cache *cache, uz_item_kind kind, const char digest[65],
                           const uz_hooks *hooks, uz_error *err);
/* The creator's two ends. publish: the table owns the object from now on and the caller keeps its use of the item.
 * abandon: waiters try themselves; the item is gone. */
void uz_table_publish(uz_cache *cache, uz_item *item, void *object, size_t bytes, void (*destroy)(void *object));
void uz_table_abandon(uz_cache *cache, uz_item *item);
/* Between acquire and publish: the object will take about so many bytes, which what nobody uses makes room for now, so
 * that the object can lie where that was. */
void uz_table_expect(uz_cache *cache, uz_item *item, size_t bytes);
/* Destroys what nobody uses of this kind. */
void uz_table_forget(uz_cache *cache, uz_item_kind kind);
/* NULL is fine. */
void uz_table_release(uz_cache *cache, uz_item *item);

/* A use of the most recently used object of this kind that `fits`, or NULL. fits is called under the mutex. */
uz_item *uz_table_search(uz_cache *cache, uz_item_kind kind, bool (*fits)(const void *object, void *ctx), void *ctx);

/* SHA-256 of a matrix, hex: of its pattern, and of pattern and values; or what its owner calls them. */
typedef struct {
    char pattern[65], values[65];
} uz_matrix_key;
/* Of a table that one owner has for matrices that come once: while A's arrays stand where they are and have what they
 * have, `key` is what uz_matrix_digest says of it, which reads them all. Another name takes the place of the last. */
void uz_table_name(uz_cache *cache, const uz_csc *A, const uz_matrix_key *key);
/* false: nobody has told. cache NULL is legal. */
bool uz_table_find_name(uz_matrix_key *key, uz_cache *cache, const uz_csc *A);

void *uz_item_object(const uz_item *item); /* NULL until it is published */

/* Calls visit for each published object of the kind, most recently used first, under the mutex. */
void uz_table_visit(uz_cache *cache, uz_item_kind kind,
                    void (*visit)(const void *object, const char *digest, int64_t hits, size_t bytes, void *ctx),
                    void *ctx);

#endif
