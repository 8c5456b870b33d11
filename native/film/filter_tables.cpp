// Filters inverted: distances from the centre by the share of the filter that lies beyond them.
#include "film/filter_tables.h"

#include <cmath>
#include <numbers>

namespace vlp {

namespace {

// Per width.
double density(Filter filter, double distance) {
    if (filter == Filter::gaussian) {
        return 4 / std::sqrt(2 * std::numbers::pi) * std::exp(-8 * distance * distance);
    }
    const double a = std::numbers::pi * (1 - distance);
    return 0.5 * (1 - (0.48829 * std::cos(a) - 0.14128 * std::cos(2 * a) + 0.01168 * std::cos(3 * a)) / 0.35875);
}

double distance_of(Filter filter, double share) {
    double low = 0, high = filter == Filter::gaussian ? 1.5 : 1.0;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (filter_share_beyond(filter, middle) > share ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Each piece takes its values and slopes at both ends from the filter (Hermite).
void append_table(Filter filter, std::vector<float>& table) {
    for (uint32_t piece = 0; piece < k_filter_pieces; ++piece) {
        const double octave = std::ldexp(static_cast<double>(k_least_filter_share), static_cast<int>(piece / 16));
        const double low = octave * (1 + piece % 16 / 16.0), high = low + octave / 16;
        if (low >= 0.5) {  // the centre itself
            table.insert(table.end(), {0, 0, 0, 0});
            continue;
        }
        const double d0 = distance_of(filter, low), d1 = distance_of(filter, high);
        const double s0 = -(high - low) / density(filter, d0), s1 = -(high - low) / density(filter, d1);
        for (const double c : {d0, s0, 3 * (d1 - d0) - 2 * s0 - s1, 2 * (d0 - d1) + s0 + s1}) {
            table.push_back(static_cast<float>(c));
        }
    }
}

}  // namespace

double filter_share_beyond(Filter filter, double distance) {
    if (filter == Filter::gaussian) return 0.5 * std::erfc(std::sqrt(8.0) * distance);
    const double x = 0.5 * (1 - distance), a = 2 * std::numbers::pi * x;
    const double waves = 0.48829 * std::sin(a) - 0.14128 / 2 * std::sin(2 * a) + 0.01168 / 3 * std::sin(3 * a);
    return x - waves / (0.35875 * 2 * std::numbers::pi);
}

const std::vector<float>& filter_tables() {
    static const std::vector<float> tables = [] {
        std::vector<float> both;
        append_table(Filter::gaussian, both);
        append_table(Filter::blackman_harris, both);
        return both;
    }();
    return tables;
}

}  // namespace vlp
