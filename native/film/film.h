// The film: what each iteration adds up to, exactly, so that neither order nor number of iterations changes a bit (host).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "film/exact_sum.h"
#include "film/window.h"

namespace vlp {

// What one iteration's eye path finds for a pixel: premultiplied radiance and alpha.
struct PixelSample {
    float rgba[4] = {0, 0, 0, 0};
};

class Film {
public:
    // `splats`: light paths splat on it.
    explicit Film(Window window, bool splats = false)
        : window_(window),
          frame_(window.pixel_count()),
          splats_(splats ? window.pixel_count() * 3 : 0),
          sums_(window.pixel_count() * 4) {}

    const Window& window() const { return window_; }
    bool has_splats() const { return !splats_.empty(); }
    // The iteration under way, row by row from the bottom; counts only once it is committed.
    std::span<PixelSample> frame() { return frame_; }
    // What light paths add to its pixels, red, green and blue, in any order (see add_shared).
    std::span<ExactSum> splats() { return splats_; }
    void clear_splats(uint32_t row_begin, uint32_t row_end);
    // Adds rows [begin, end) of the frame, and of the splats, to the sums.
    void commit_rows(uint32_t begin, uint32_t end);
    void count_iteration() { ++iterations_; }
    // Forgets all iterations.
    void clear();

    uint64_t iterations() const { return iterations_; }
    std::span<const ExactSum> sums() const { return sums_; }
    // Adds what another film of the same window summed up over `iterations` others.
    void add(std::span<const ExactSum> sums, uint64_t iterations);

    // The mean over the iterations so far, or the unfinished frame before the first is complete.
    void read(std::span<float> rgba) const;
    size_t bytes() const {
        return frame_.size() * sizeof(PixelSample) + (splats_.size() + sums_.size()) * sizeof(ExactSum);
    }

private:
    Window window_;
    uint64_t iterations_ = 0;
    std::vector<PixelSample> frame_;
    std::vector<ExactSum> splats_;  // 3 a pixel, or none
    std::vector<ExactSum> sums_;  // 4 a pixel
};

}  // namespace vlp
