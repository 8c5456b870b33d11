// What share of the picture's light the window of path lengths loses: the paper's truncation bias, measured (host only).
#pragma once

#include "core/parallel.h"
#include "integrator/pass.h"

namespace vlp {

struct LostLight {
    float share = 0;  // of the light of a path tracer whose paths have up to k_max_walk surface hits
    float standard_error = 0;  // of `share`
};

// By a pilot of path tracing with roulette over a grid of pixels of the whole picture, with random numbers of its own. `pass`
// must be as the render has it, kappa included. What a path tracer does not find (caustics of point lights) is not counted.
LostLight measure_lost_light(const SceneView& scene, const PassSettings& pass, ThreadPool& pool);

}  // namespace vlp
