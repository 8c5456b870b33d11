// The film's sums and means.
#include "film/film.h"

#include <algorithm>
#include <stdexcept>

namespace vlp {

void Film::clear_splats(uint32_t row_begin, uint32_t row_end) {
    for (std::vector<ExactSum>* splats : {&splats_, &point_splats_}) {
        if (splats->empty()) continue;
        const auto row = [&](uint32_t y) {
            return splats->begin() + static_cast<ptrdiff_t>(size_t{3} * y * window_.width);
        };
        std::fill(row(row_begin), row(row_end), ExactSum{});
    }
}

void Film::clear() {
    std::fill(sums_.begin(), sums_.end(), ExactSum{});
    iterations_ = 0;
}

void Film::commit_rows(uint32_t begin, uint32_t end) {
    const size_t first = static_cast<size_t>(begin) * window_.width, last = static_cast<size_t>(end) * window_.width;
    ExactSum* sum = sums_.data() + first * channels();
    for (size_t i = first; i < last; ++i, sum += channels()) {
        for (size_t c = 0; c < 4; ++c) sum[c].add(frame_[i].rgba[c]);
        for (size_t c = 0; c < 3 && has_splats(); ++c) sum[c].add(splats_[3 * i + c]);
        for (size_t c = 0; c < 3 && has_guides(); ++c) {
            sum[4 + c].add(frame_[i].rgba[c]);
            if (has_splats()) sum[4 + c].add(point_splats_[3 * i + c]);
            sum[7 + c].add(guide_frame_[i].albedo[c]);
            sum[10 + c].add(std::max(guide_frame_[i].normal[c] + 1, 0.0f));  // unit vectors are rounded, too
        }
    }
}

void Film::add(std::span<const ExactSum> sums, uint64_t iterations) {
    if (sums.size() != sums_.size()) throw std::invalid_argument("film state of another size than this film");
    for (size_t i = 0; i < sums.size(); ++i) sums_[i].add(sums[i]);
    iterations_ += iterations;
}

void Film::read(std::span<float> rgba) const {
    if (rgba.size() != frame_.size() * 4) throw std::invalid_argument("picture of another size than this film");
    const double scale = 1.0 / static_cast<double>(iterations_);
    for (size_t i = 0; i < rgba.size(); ++i) {
        const size_t pixel = i / 4, c = i % 4;
        rgba[i] = iterations_ == 0 ? frame_[pixel].rgba[c]
                                   : static_cast<float>(sums_[pixel * channels() + c].value() * scale);
    }
}

void Film::read_guided(std::span<float> color, std::span<float> albedo, std::span<float> normal) const {
    if (!has_guides()) throw std::invalid_argument("this film keeps no guides");
    const size_t size = frame_.size() * 3;
    if (color.size() != size || albedo.size() != size || normal.size() != size) {
        throw std::invalid_argument("picture of another size than this film");
    }
    const double scale = 1.0 / static_cast<double>(iterations_);
    for (size_t i = 0; i < size; ++i) {
        const size_t pixel = i / 3, c = i % 3;
        if (iterations_ == 0) {
            color[i] = frame_[pixel].rgba[c];
            albedo[i] = std::min(guide_frame_[pixel].albedo[c], 1.0f);
            normal[i] = guide_frame_[pixel].normal[c];
            continue;
        }
        const ExactSum* sum = &sums_[pixel * channels()];
        color[i] = static_cast<float>(sum[4 + c].value() * scale);
        albedo[i] = static_cast<float>(std::min(sum[7 + c].value() * scale, 1.0));
        normal[i] = static_cast<float>(sum[10 + c].value() * scale - 1);
    }
}

}  // namespace vlp
