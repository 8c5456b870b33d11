// What an iteration finds in a pixel.
#pragma once

namespace vlp {

// Premultiplied radiance and alpha: of an eye path, or the mean of several.
struct PixelSample {
    float rgba[4] = {0, 0, 0, 0};
};

}  // namespace vlp
