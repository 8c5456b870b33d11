// Which light a light path starts from, and which one next event asks. Both choose in proportion to power; next event is
// told the receiver.
#pragma once

#include "geometry/surface.h"
#include "scene/scene_view.h"

namespace vlp {

// For a light path. index k_none: the scene has no light.
VLP_HD inline DiscreteSample choose_source(const SceneView& scene, uint32_t u) {
    return scene.light_choice.count == 0 ? DiscreteSample{k_none, 0} : sample(scene.light_choice, u);
}

VLP_HD inline float pdf_choose_source(const SceneView& scene, uint32_t light) { return pdf(scene.light_choice, light); }

// For next event at `receiver`. A choice by what each light brings there, as by a light tree, would change these two alone.
VLP_HD inline DiscreteSample choose_light(const SceneView& scene, const SurfacePoint& /*receiver*/, uint32_t u) {
    return choose_source(scene, u);
}

VLP_HD inline float pdf_choose_light(const SceneView& scene, const SurfacePoint& /*receiver*/, uint32_t light) {
    return pdf_choose_source(scene, light);
}

}  // namespace vlp
