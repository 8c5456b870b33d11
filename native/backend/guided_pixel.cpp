// The eye path with guides.
#include "backend/guided_pixel.h"

#include "integrator/guides.h"

namespace vlp {

uint32_t trace_guided_pixel(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                            uint32_t iteration, uint32_t x, uint32_t y, PixelSample& pixel, GuideSample& guide) {
    GuidedSink sink(pass, scene);
    const float alpha = trace_eye_path(scene, pass, cache, iteration, x, y, sink);
    const Rgb found = sink.pixel.radiance;
    pixel = {{found.r, found.g, found.b, alpha}};
    guide = sink.guide();
    return sink.pixel.dropped;
}

}  // namespace vlp
