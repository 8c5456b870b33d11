// What a pilot of eye paths tells of the lights: which of them the picture shows, and where their light comes in (host only).
#pragma once

#include "core/parallel.h"
#include "integrator/pass.h"

namespace vlp {

// Portals and favoured lights, where they take enough of the variance of what light paths bring (k_most_left). The same on every
// machine, however many threads. `pass` as the user has it.
LightGuide learn_light_guide(const SceneView& scene, const PassSettings& pass, ThreadPool& pool);

}  // namespace vlp
