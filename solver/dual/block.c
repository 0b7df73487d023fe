/* block.c: several loads with one pass over the factor, and their displacements with another. */
#include "dual/block.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/form.h"

#include <string.h>

uz_status uz_dual_block_create(uz_dual_block **out, const uz_dual *dual, int64_t blocks, uz_error *err)
{
    *out = NULL;
    uz_dual_block *block = uz_alloc_zero(1, sizeof *block);
    int64_t d = dual->d;
    bool ok = block != NULL;
    for (int k = 0; ok && k < 4; k++) {
        double **room[] = {&block->P, &block->U, &block->Y, &block->X};
        ok = (*room[k] = uz_alloc_zero(blocks * d, UZ_LANES * sizeof(double))) != NULL;
    }
    ok = ok && (block->room = uz_alloc(d, sizeof(double))) != NULL;
    if (ok) {
        block->dual = dual;
        block->blocks = blocks;
        *out = block;
        return UZ_OK;
    }
    uz_dual_block_free(block);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld loads on %lld dofs", (long long)(blocks * UZ_LANES),
                   (long long)d);
}

void uz_dual_block_free(uz_dual_block *block)
{
    if (!block)
        return;
    uz_free_all(block->P, block->U, block->Y, block->X, block->room, block);
}

uz_status uz_dual_block_forward(uz_dual_block *block, uz_error *err)
{
    const uz_factor *factor = block->dual->factor;
    const int64_t size = block->dual->d * UZ_LANES;
    for (int64_t b = 0; b < block->blocks; b++)
        uz_factor_permute_lanes(factor, block->Y + b * size, block->P + b * size);
    return uz_factor_solve_lanes(factor, block->Y, block->blocks, true, err);
}

/* Where a lane's entry 0 stands. */
static int64_t lane_start(const uz_dual_block *block, int64_t lane)
{
    return lane / UZ_LANES * block->dual->d * UZ_LANES + lane % UZ_LANES;
}

uz_status uz_dual_block_open(uz_dual_load **out, const uz_dual_block *block, int64_t lane, const uz_csc *K,
                             const double *h, uz_error *err)
{
    uz_dual_load *load = NULL;
    *out = NULL;
    uz_status status = uz_dual_load_create(&load, block->dual, K, NULL, h, err);
    if (status == UZ_OK)
        status = block->dual->form->load_lane(load, block->Y + lane_start(block, lane), UZ_LANES, block->room, err);
    if (status == UZ_OK)
        *out = load;
    else
        uz_dual_load_free(load);
    return status;
}

uz_status uz_dual_block_recover(uz_dual_block *block, uz_dual_load *const *loads, const double *const *r,
                                const bool *corrected, int64_t count, uz_error *err)
{
    const uz_dual *dual = block->dual;
    const int64_t size = dual->d * UZ_LANES;
    uz_status status = UZ_OK;
    memcpy(block->X, block->Y, (size_t)(block->blocks * size) * sizeof *block->X);
    for (int64_t lane = 0; status == UZ_OK && lane < count; lane++)
        status = dual->form->add_reactions(loads[lane], block->X + lane_start(block, lane), UZ_LANES, block->room,
                                           r[lane], corrected[lane] && loads[lane]->has_kept, err);
    if (status == UZ_OK)
        status = uz_factor_solve_lanes(dual->factor, block->X, block->blocks, false, err);
    for (int64_t b = 0; status == UZ_OK && b < block->blocks; b++)
        uz_factor_unpermute_lanes(dual->factor, block->U + b * size, block->X + b * size);
    return status;
}
