// The order in which virtual light points are listed: by groups of those that light a surface alike. A pixel's draws are
// spread evenly over the list, so they are spread over the scene as well.
#pragma once

#include "integrator/vlp_candidates.h"

namespace vlp {

// Nine ranges of what a VLP faces, and in each 4 x 4 x 4 cells of where it lies.
inline constexpr uint32_t k_vlp_groups = 9 * 64;

namespace detail {

// Thirds of the octahedral map (geometry/octahedral.h): the axes lie in the middle of theirs, or in its corners.
VLP_HD inline uint32_t third_of(uint32_t bits) { return bits * 3 >> 16; }

// Along one axis: the bits of the cell where they stand in a Morton code.
VLP_HD inline uint32_t cell_of(float at) {
    const auto cell = static_cast<uint32_t>(clamp(at, 0.0f, 3.0f));
    return (cell & 1) | (cell & 2) << 2;
}

}  // namespace detail

VLP_HD inline uint32_t group_of(const VlpGrid& grid, const LightVertex& vlp) {
    const uint32_t facing =
        3 * detail::third_of(vlp.geometric_normal.bits >> 16) + detail::third_of(vlp.geometric_normal.bits & 0xffffu);
    const Vec3 at = (vlp.position - grid.low) * grid.cells_per_metre;
    return facing * 64 + (detail::cell_of(at.x) | detail::cell_of(at.y) << 1 | detail::cell_of(at.z) << 2);
}

// A stable counting sort of runs of slots. Runs count their groups, each in a column of its own of a table with a row for
// every group; exclusive sums over the table, row by row, tell where a run lists each group; then runs list their slots.
// `column`: that of the run, `stride` from row to row.
VLP_HD inline void count_groups(const VlpGrid& grid, const LightVertex* slots, uint32_t begin, uint32_t end,
                                uint32_t* column, uint32_t stride) {
    for (uint32_t slot = begin; slot < end; ++slot) {
        if (slots[slot].connectible()) ++column[size_t{stride} * group_of(grid, slots[slot])];
    }
}
VLP_HD inline void list_groups(const SceneView& scene, const PassSettings& pass, const LightVertex* slots,
                               uint32_t begin, uint32_t end, uint32_t* column, uint32_t stride, const Hands& hands,
                               VlpCandidate* stored) {
    for (uint32_t slot = begin; slot < end; ++slot) {
        if (!slots[slot].connectible()) continue;
        const uint32_t number = column[size_t{stride} * group_of(pass.vlp_grid, slots[slot])]++;
        stored[hands.place(number)] = make_candidate(scene, pass, slots, slot);
    }
}
// After the V that were listed.
VLP_HD inline void list_blanks(const Hands& hands, uint32_t stored_count, VlpCandidate* stored) {
    for (uint32_t number = stored_count; number < hands.places(); ++number) stored[hands.place(number)] = {};
}

}  // namespace vlp
