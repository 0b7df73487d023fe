/* A history that grows beyond its room keeps rows at equal distances, the first and the newest among them. */
#include "harness.h"
#include "methods/iterate.h"

TEST(long_histories_keep_every_second_row)
{
    uz_history history = {0};
    uz_error err = {0};
    for (int64_t i = 0; i < 5 * (int64_t)UZ_HISTORY_ROWS / 2; i++) {
        const uz_history_row row = {.iteration = i};
        CHECK(uz_history_append(&history, &row, &err) == UZ_OK);
        CHECK(history.count <= UZ_HISTORY_ROWS && history.rows[history.count - 1].iteration == i);
    }
    CHECK_INT(history.stride, 4);
    for (int64_t k = 0; k + 1 < history.count; k++)
        CHECK(history.rows[k].iteration == 4 * k);
    free(history.rows);
}
