// The film: what each iteration adds up to, exactly, so that neither order nor number of iterations changes a bit (host).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "film/exact_sum.h"
#include "film/guide.h"
#include "film/pixel_sample.h"
#include "film/window.h"

namespace vlp {

class Film {
public:
    static constexpr size_t k_guided_channels = 13;

    // `splats`: light paths splat on it. `guides`: it keeps those of a denoiser.
    explicit Film(Window window, bool splats = false, bool guides = false)
        : window_(window),
          frame_(window.pixel_count()),
          guide_frame_(guides ? window.pixel_count() : 0),
          splats_(splats ? window.pixel_count() * 3 : 0),
          point_splats_(splats && guides ? window.pixel_count() * 3 : 0),
          sums_(window.pixel_count() * (guides ? k_guided_channels : 4)) {}

    const Window& window() const { return window_; }
    bool has_splats() const { return !splats_.empty(); }
    bool has_guides() const { return !guide_frame_.empty(); }
    // Sums a pixel: red, green, blue and alpha; with guides then the colour to be denoised, 3, which has each splat in one
    // pixel, albedo, 3, and normal + 1, 3, as no sum may be negative.
    size_t channels() const { return has_guides() ? k_guided_channels : 4; }
    // The iteration under way, row by row from the bottom; counts only once it is committed. Stays afterwards.
    std::span<PixelSample> frame() { return frame_; }
    std::span<GuideSample> guide_frame() { return guide_frame_; }
    // What light paths add to its pixels, red, green and blue, in any order (see add_shared).
    std::span<ExactSum> splats() { return splats_; }
    // The same splats, each in one pixel alone; none without guides.
    std::span<ExactSum> point_splats() { return point_splats_; }
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
    // The same of what a denoiser gets, 3 numbers a pixel each: colour, albedo in [0, 1], normal of length 1 or less.
    void read_guided(std::span<float> color, std::span<float> albedo, std::span<float> normal) const;
    size_t bytes() const {
        return frame_.size() * sizeof(PixelSample) + guide_frame_.size() * sizeof(GuideSample) +
               (splats_.size() + point_splats_.size() + sums_.size()) * sizeof(ExactSum);
    }

private:
    Window window_;
    uint64_t iterations_ = 0;
    std::vector<PixelSample> frame_;
    std::vector<GuideSample> guide_frame_;  // or none
    std::vector<ExactSum> splats_, point_splats_;  // 3 a pixel, or none
    std::vector<ExactSum> sums_;  // channels() a pixel
};

}  // namespace vlp
