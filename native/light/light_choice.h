// Which light a light path starts from, by power and what a pilot learnt, and which one next event asks, by what it may bring.
#pragma once

#include "geometry/surface.h"
#include "light/light_tree.h"
#include "scene/scene_view.h"

namespace vlp {

// The probability with which a light path starts from `light`: by power, and for half of them among favoured lights, if any.
VLP_HD inline float pdf_choose_source(const SceneView& scene, uint32_t light) {
    const float by_power = pdf(scene.light_choice, light);
    const FavouredLights& favoured = scene.light_guide.favoured;
    if (favoured.count == 0) return by_power;
    float among = 0;
    for (uint32_t i = 0; i < favoured.count; ++i) {
        if (favoured.light[i] == light) among = pdf(Distribution{favoured.below, favoured.count}, i);
    }
    return 0.5f * (by_power + among);
}

// For a light path. index k_none: the scene has no light.
VLP_HD inline DiscreteSample choose_source(const SceneView& scene, uint32_t u) {
    if (scene.light_choice.count == 0) return {k_none, 0};
    const FavouredLights& favoured = scene.light_guide.favoured;
    if (favoured.count == 0) return sample(scene.light_choice, u);
    const uint32_t rest = u << 1;
    const Distribution among{favoured.below, favoured.count};
    const uint32_t light =
        u >> 31 == 0 ? favoured.light[sample(among, rest).index] : sample(scene.light_choice, rest).index;
    return {light, pdf_choose_source(scene, light)};
}

// For next event at `receiver`. The scene must have a light.
VLP_HD inline DiscreteSample choose_light(const SceneView& scene, const SurfacePoint& receiver, uint32_t u) {
    return sample(scene.light_tree, receiver.position, receiver.geometric_normal, u);
}

VLP_HD inline float pdf_choose_light(const SceneView& scene, const SurfacePoint& receiver, uint32_t light) {
    return pdf(scene.light_tree, receiver.position, receiver.geometric_normal, light);
}

}  // namespace vlp
