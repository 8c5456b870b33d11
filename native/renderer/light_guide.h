// What a pilot of eye paths tells of the lights: which of them the picture shows, and where their light comes in (host only).
#pragma once

#include "core/parallel.h"
#include "integrator/pass.h"

namespace vlp {

// Portals and favoured lights, where they make the light paths of a render worth at least so much more as k_least_gain says.
// The same on every machine, however many threads. `pass` as the user has it.
LightGuide learn_light_guide(const SceneView& scene, const PassSettings& pass, ThreadPool& pool);

}  // namespace vlp
