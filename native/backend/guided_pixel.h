// A pixel's eye path that gathers a denoiser's guides as well, for the CPU back end.
#pragma once

#include "film/film.h"
#include "integrator/pass.h"

namespace vlp {

// Writes what the path through pixel (x, y) of the full picture finds; returns how many estimates were not finite.
//
// Compiled by itself: with two kinds of eye path in one translation unit the compiler inlines less into either, which cost
// a tenth of the time without guides.
uint32_t trace_guided_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                            uint32_t iteration, uint32_t x, uint32_t y, PixelSample& pixel, GuideSample& guide);

}  // namespace vlp
