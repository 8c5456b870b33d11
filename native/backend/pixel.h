// What an iteration does in a pixel: traces its samples and means what they find. For both back ends.
#pragma once

#include <type_traits>

#include "film/guide.h"
#include "film/sample_rates.h"
#include "integrator/guides.h"

namespace vlp {

// Means over the samples.
struct PixelResult {
    PixelSample found;
    GuideSample guide;
    uint32_t dropped = 0;  // estimates that were not finite, in all
};

VLP_HD inline void add_share(PixelResult& sum, const PathFinds& finds, float alpha, float share) {
    const Rgb found = finds.radiance * share;
    sum.found.rgba[0] += found.r, sum.found.rgba[1] += found.g, sum.found.rgba[2] += found.b;
    sum.found.rgba[3] += alpha * share;
    sum.dropped += finds.dropped;
}

VLP_HD inline void add_share(PixelResult& sum, const GuidedFinds& finds, float alpha, float share) {
    add_share(sum, finds.path, alpha, share);
    const GuideSample guide = finds.guide();
    for (int c = 0; c < 3; ++c) {
        sum.guide.albedo[c] += guide.albedo[c] * share;
        sum.guide.normal[c] += guide.normal[c] * share;
    }
}

// Pixel (x, y) of the full picture, with guides if Sink gathers them.
template <typename Sink>
VLP_HD inline PixelResult trace_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                      const PixelTurn& turn, uint32_t x, uint32_t y) {
    PixelResult mean;
    const float share = 1.0f / static_cast<float>(turn.samples);
    for (uint32_t i = 0; i < turn.samples; ++i) {
        Sink sink(pass, scene);
        const float alpha = trace_eye_path(scene, pass, cache, {turn.sequence, turn.first_index + i}, x, y, sink);
        add_share(mean, sink.finds, alpha, share);
    }
    return mean;
}

}  // namespace vlp
