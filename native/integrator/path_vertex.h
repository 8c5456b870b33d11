// The vertices of a path as the passes keep them: what an estimator and the weights need of each.
#pragma once

#include "bvh/bvh_view.h"
#include "core/rgb.h"
#include "geometry/octahedral.h"

namespace vlp {

// Densities of one vertex of a walk, light or eye, for the weights. "Forward" is the walk's own direction, "reverse" is
// the way in which the other walk would have come. Both are per area of surface. Not initialised: walks hold 65 of them.
struct VertexDensity {
    float pdf_area;      // forward density of this vertex; of z_1 over one pixel
    // Times the solid-angle density of scattering back from this vertex: reverse over forward density of the previous
    // vertex. That is |cos| / dist^2 / pdf_area of the previous vertex; 0 where it cannot be reached by a ray.
    float rev_geometry;
    float rev_ratio;  // reverse over forward density of the previous vertex, known once the walk has gone on
    bool specular;  // the walk went on by a delta distribution: neither edge here can be a connection
};

// A light path's hit y_i, i >= 1; a virtual light point when `connectible`. One random read takes one whole cache line.
struct alignas(64) LightVertex {
    static constexpr uint32_t k_connectible = 1u << 31, k_specular = 1u << 30;
    static constexpr uint32_t k_index_shift = 22, k_index_mask = 127;
    static constexpr uint32_t k_material_mask = (1u << k_index_shift) - 1;

    Vec3 position;
    OctNormal geometric_normal, shading_normal;
    OctNormal to_previous;  // unit direction to y_{i-1}
    Rgb throughput;  // (6): emitted radiance times all factors up to arrival here, over all densities
    uint32_t instance, primitive;
    float pdf_area, rev_geometry, rev_ratio;  // as in VertexDensity
    float next_event_ratio;  // y_1: density of next event choosing y_0 over density of emission choosing it
    uint32_t packed;  // flags, i, material

    VLP_HD bool connectible() const { return (packed & k_connectible) != 0; }
    VLP_HD bool specular() const { return (packed & k_specular) != 0; }
    VLP_HD uint32_t index() const { return (packed >> k_index_shift) & k_index_mask; }
    VLP_HD uint32_t material() const { return packed & k_material_mask; }
};
static_assert(sizeof(LightVertex) == 64, "one random connection reads one cache line");

}  // namespace vlp
