#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/error.h"

/* Keeps every second row, from row 0, and doubles the stride of what comes. */
static void thin(uz_history *history)
{
    int64_t kept = 0;
    for (int64_t i = 0; i < history->count; i += 2)
        history->rows[kept++] = history->rows[i];
    history->count = kept;
    history->stride *= 2;
}

/* The newest row is provisional unless its iteration falls on the stride: the next one takes its place. */
static bool is_provisional(const uz_history *history)
{
    return history->count > 1 && history->rows[history->count - 1].iteration % history->stride != 0;
}

uz_status uz_history_append(uz_history *history, const uz_history_row *row, uz_error *err)
{
    if (history->stride == 0)
        history->stride = 1;
    if (is_provisional(history))
        history->count--;
    if (history->count >= UZ_HISTORY_ROWS)
        thin(history);
    if (history->count == history->capacity) {
        int64_t capacity = history->capacity ? 2 * history->capacity : 64;
        uz_history_row *rows = uz_realloc(history->rows, capacity, sizeof *rows);
        if (!rows)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a history of %lld rows", (long long)capacity);
        history->rows = rows;
        history->capacity = capacity;
    }
    history->rows[history->count++] = *row;
    return UZ_OK;
}
