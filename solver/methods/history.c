#include "methods/method.h"

#include "core/alloc.h"
#include "core/error.h"

uz_status uz_history_append(uz_history *history, const uz_history_row *row, uz_error *err)
{
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
