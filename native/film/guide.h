// What one iteration tells a denoiser about a pixel, see integrator/guides.h.
#pragma once

namespace vlp {

// Colour of what is seen, and its shading normal in world space: unit where one surface alone is seen, 0 for none.
struct GuideSample {
    float albedo[3] = {0, 0, 0};
    float normal[3] = {0, 0, 0};
};

}  // namespace vlp
