// The eye path with guides.
#include "backend/guided_pixel.h"

namespace vlp {

PixelResult trace_guided_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                               const PixelTurn& turn, uint32_t x, uint32_t y) {
    return trace_pixel<GuidedSink>(scene, pass, cache, turn, x, y);
}

}  // namespace vlp
