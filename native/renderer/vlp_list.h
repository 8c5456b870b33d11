// The list of the virtual light points of a light pass that one thread has traced (host only).
#pragma once

#include <numeric>
#include <vector>

#include "integrator/vlp_groups.h"

namespace vlp {

// Lists those of slots[0] ... slots[vertices - 1] that can be connected in `stored`, which must outlive what is returned.
inline LightVertexCache list_vlps(const SceneView& scene, const PassSettings& pass, const LightVertex* slots,
                                  uint32_t vertices, std::vector<VlpCandidate>& stored) {
    std::vector<uint32_t> groups(k_vlp_groups + 1);
    count_groups(pass.vlp_grid, slots, 0, vertices, groups.data(), 1);
    std::exclusive_scan(groups.begin(), groups.end(), groups.begin(), 0u);
    const Hands hands(pass.vlp_candidates, groups.back());
    stored.resize(hands.places());
    list_groups(scene, pass, slots, 0, vertices, groups.data(), 1, hands, stored.data());
    list_blanks(hands, groups.back(), stored.data());
    return {slots, stored.data(), hands.count};
}

}  // namespace vlp
