// A pixel's samples that gather a denoiser's guides as well, for the CPU back end.
#pragma once

#include "backend/pixel.h"

namespace vlp {

// trace_pixel<GuidedSink>, compiled by itself: with two kinds of eye path in one translation unit the compiler inlines less
// into either, which cost a tenth of the time without guides.
PixelResult trace_guided_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                               const PixelTurn& turn, uint32_t x, uint32_t y);

}  // namespace vlp
