// The film's sums and means.
#include "film/film.h"

#include <algorithm>
#include <stdexcept>

namespace vlp {

void Film::clear_splats(uint32_t row_begin, uint32_t row_end) {
    if (splats_.empty()) return;
    const auto row = [&](uint32_t y) {
        return splats_.begin() + static_cast<ptrdiff_t>(size_t{3} * y * window_.width);
    };
    std::fill(row(row_begin), row(row_end), ExactSum{});
}

void Film::clear() {
    std::fill(sums_.begin(), sums_.end(), ExactSum{});
    iterations_ = 0;
}

void Film::commit_rows(uint32_t begin, uint32_t end) {
    const size_t first = static_cast<size_t>(begin) * window_.width, last = static_cast<size_t>(end) * window_.width;
    for (size_t i = first; i < last; ++i) {
        for (size_t c = 0; c < 4; ++c) sums_[4 * i + c].add(frame_[i].rgba[c]);
        for (size_t c = 0; c < 3 && !splats_.empty(); ++c) sums_[4 * i + c].add(splats_[3 * i + c]);
    }
}

void Film::add(std::span<const ExactSum> sums, uint64_t iterations) {
    if (sums.size() != sums_.size()) throw std::invalid_argument("film state of another size than this film");
    for (size_t i = 0; i < sums.size(); ++i) sums_[i].add(sums[i]);
    iterations_ += iterations;
}

void Film::read(std::span<float> rgba) const {
    if (rgba.size() != sums_.size()) throw std::invalid_argument("picture of another size than this film");
    if (iterations_ == 0) {
        for (size_t i = 0; i < rgba.size(); ++i) rgba[i] = frame_[i / 4].rgba[i % 4];
        return;
    }
    const double scale = 1.0 / static_cast<double>(iterations_);
    for (size_t i = 0; i < rgba.size(); ++i) rgba[i] = static_cast<float>(sums_[i].value() * scale);
}

}  // namespace vlp
