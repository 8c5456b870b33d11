// What a scene tells before its render, by a few paths with random numbers of their own: the same on every machine (host only).
#pragma once

#include "core/parallel.h"
#include "integrator/pass.h"

namespace vlp {

// What light paths leave.
struct Pilot {
    float vlps_per_path = 0;
    // Four cells along each axis, over sqrt(3) standard deviations on either side of the mean: all VLPs, were they even. One
    // along an axis on which they hardly spread.
    VlpGrid grid;
};
Pilot trace_pilot(const SceneView& scene, const PassSettings& pass, ThreadPool& pool);

// The settings with what the scene makes of them: the light guide, kappa and the VLPs' grid, and splats only where there are
// light paths. Where sampling is adaptive, light paths and connections are as well: R, F, and C = 0 where that is better (see
// trial.h).
PassSettings for_scene(const SceneView& scene, PassSettings pass, unsigned threads = 1);

}  // namespace vlp
