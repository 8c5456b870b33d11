// The film: what each iteration adds up to, exactly, so that neither order nor number of iterations changes a bit (host).
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace vlp {

// A sum of floats in 128-bit fixed point with 64 bits after the point: exact for values of 2^-40 and more (smaller ones
// lose what is below 2^-64), whatever the order, up to 2^63 in all, where it stays.
struct ExactSum {
    uint64_t fraction = 0;  // in units of 2^-64
    int64_t whole = 0;

    // Neither may be negative.
    void add(const ExactSum& other) {
        constexpr int64_t k_most = std::numeric_limits<int64_t>::max();
        fraction += other.fraction;
        const int64_t carry = fraction < other.fraction ? 1 : 0;
        if (whole > k_most - other.whole - carry) {
            *this = {~uint64_t{0}, k_most};
        } else {
            whole += other.whole + carry;
        }
    }
    // `value` must be finite and not negative.
    void add(float value) {
        if (!(value < 0x1p62f)) value = 0x1p62f;
        const double whole_part = std::floor(static_cast<double>(value));
        add({static_cast<uint64_t>((static_cast<double>(value) - whole_part) * 0x1p64),
             static_cast<int64_t>(whole_part)});
    }
    double value() const { return static_cast<double>(whole) + static_cast<double>(fraction) * 0x1p-64; }
};

// One iteration's estimate of a pixel: premultiplied radiance and alpha.
struct PixelSample {
    float rgba[4] = {0, 0, 0, 0};
};

// The part of the picture that is rendered (pixels; y counts from the bottom).
struct Window {
    uint32_t x = 0, y = 0, width = 0, height = 0;
    size_t pixel_count() const { return static_cast<size_t>(width) * height; }
};

class Film {
public:
    explicit Film(Window window) : window_(window), frame_(window.pixel_count()), sums_(window.pixel_count() * 4) {}

    const Window& window() const { return window_; }
    // The iteration under way, row by row from the bottom; counts only once it is committed.
    std::span<PixelSample> frame() { return frame_; }
    // Adds rows [begin, end) of the frame to the sums.
    void commit_rows(uint32_t begin, uint32_t end);
    void count_iteration() { ++iterations_; }

    uint64_t iterations() const { return iterations_; }
    std::span<const ExactSum> sums() const { return sums_; }
    // Adds what another film of the same window summed up over `iterations` others.
    void add(std::span<const ExactSum> sums, uint64_t iterations);

    // The mean over the iterations so far, or the unfinished frame before the first is complete.
    void read(std::span<float> rgba) const;
    size_t bytes() const { return frame_.size() * sizeof(PixelSample) + sums_.size() * sizeof(ExactSum); }

private:
    Window window_;
    uint64_t iterations_ = 0;
    std::vector<PixelSample> frame_;
    std::vector<ExactSum> sums_;  // 4 a pixel
};

}  // namespace vlp
