// Which light a light path starts from, in proportion to power, and which one next event asks, by what it may bring.
#pragma once

#include "geometry/surface.h"
#include "light/light_tree.h"
#include "scene/scene_view.h"

namespace vlp {

// For a light path. index k_none: the scene has no light.
VLP_HD inline DiscreteSample choose_source(const SceneView& scene, uint32_t u) {
    return scene.light_choice.count == 0 ? DiscreteSample{k_none, 0} : sample(scene.light_choice, u);
}

VLP_HD inline float pdf_choose_source(const SceneView& scene, uint32_t light) { return pdf(scene.light_choice, light); }

// For next event at `receiver`. The scene must have a light.
VLP_HD inline DiscreteSample choose_light(const SceneView& scene, const SurfacePoint& receiver, uint32_t u) {
    return sample(scene.light_tree, receiver.position, receiver.geometric_normal, u);
}

VLP_HD inline float pdf_choose_light(const SceneView& scene, const SurfacePoint& receiver, uint32_t light) {
    return pdf(scene.light_tree, receiver.position, receiver.geometric_normal, light);
}

}  // namespace vlp
