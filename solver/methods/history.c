#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/error.h"

uz_status uz_history_append(uz_history *history, const uz_history_row *row, uz_error *err)
{
    if (history->stride == 0)
        history->stride = 1;
    /* The newest row is provisional unless its iteration falls on the stride: the next one takes its place. */
    if (history->count > 1 && history->rows[history->count - 1].iteration % history->stride != 0)
        history->count--;
    if (history->count >= UZ_HISTORY_ROWS) { /* every second row stays, from row 0, and of what comes as many */
        for (int64_t i = 0; i < history->count; i += 2)
            history->rows[i / 2] = history->rows[i];
        history->count = (history->count + 1) / 2;
        history->stride *= 2;
    }
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
