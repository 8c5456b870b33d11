// The part of the picture that is rendered.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/device.h"

namespace vlp {

// In pixels; y counts from the bottom.
struct Window {
    uint32_t x = 0, y = 0, width = 0, height = 0;
    VLP_HD size_t pixel_count() const { return static_cast<size_t>(width) * height; }
};

}  // namespace vlp
