// Which light a path starts from or next event asks: one in proportion to its power.
#pragma once

#include "scene/scene_view.h"

namespace vlp {

// index k_none: the scene has no light.
VLP_HD inline DiscreteSample choose_light(const SceneView& scene, uint32_t u) {
    return scene.light_choice.count == 0 ? DiscreteSample{k_none, 0} : sample(scene.light_choice, u);
}

VLP_HD inline float pdf_choose_light(const SceneView& scene, uint32_t light) { return pdf(scene.light_choice, light); }

}  // namespace vlp
