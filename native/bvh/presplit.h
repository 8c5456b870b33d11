// Cuts the boxes of triangles that fill them badly, long ones at an angle above all, before the tree is built.
#pragma once

#include "bvh/collapse.h"

namespace vlp {

// The budget: this many cuts, and one more for so many refs. Large meshes stay near the memory that they take without.
inline constexpr uint32_t k_free_splits = 65536, k_refs_per_split = 24;

// Adds refs of parts of triangles, within the budget, and narrows the first part's ref. The result depends on the refs
// alone, not on the number of threads (after Karras & Aila 2013).
void presplit(RawVector<Ref>& refs, const LeafSource& source, ThreadPool& pool);

}  // namespace vlp
