// Puts the boxes of a node's children on its grid, rounded outwards, and the children where rays look for them.
#include "bvh/compressed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bvh/node_box.h"
#include "core/bits.h"

namespace vlp {

namespace {

constexpr uint32_t k_chunk = 1024;  // nodes
constexpr float k_most = std::numeric_limits<float>::max();

// Where margins have made infinities of the largest numbers, the numbers again.
double finite(float x) { return static_cast<double>(std::clamp(x, -k_most, k_most)); }

// To a float.
double rounded_down(double x) {
    const auto f = static_cast<float>(x);
    return static_cast<double>(static_cast<double>(f) > x ? std::nextafter(f, -k_most) : f);
}

// One axis of the grid. Differences are rounded in double precision, which is far less than the margin.
struct Axis {
    double margin, origin, step;
    uint32_t exponent;

    // Around all children.
    Axis(double low, double high) {
        margin = std::max(std::fabs(low), std::fabs(high)) * static_cast<double>(k_grid_margin);
        origin = rounded_down(std::max(low - margin, finite(-k_infinity)));
        int power;  // of the least step that is large enough, or twice that
        std::frexp((high + margin - origin) / 255, &power);
        exponent = static_cast<uint32_t>(std::max(power + 127, 1));
        step = static_cast<double>(float_of(static_cast<int32_t>(exponent << 23)));
    }
    uint32_t plane_below(double low) const { return to_byte(std::floor((low - margin - origin) / step)); }
    uint32_t plane_above(double high) const { return to_byte(std::ceil((high + margin - origin) / step)); }

    // Only what no float can be lies beyond the grid.
    static uint32_t to_byte(double plane) { return static_cast<uint32_t>(std::clamp(plane, 0.0, 255.0)); }
};

// Which child of the node stands at which place.
using Places = std::array<uint32_t, k_node_width>;

struct Offset {
    double along[3] = {0, 0, 0};
};

// Children should lie far towards the corners of their places: swaps pairs for as long as that gets better. The gain of a
// pair changes its sign with the swap, but rounding might let several pairs chase each other, hence an end.
Places choose_places(const BvhNode& node) {
    const Box whole = node_box(node);
    std::array<Offset, k_node_width> offset;  // twice from the middle; of absent children none
    for (uint32_t i = 0; i < k_node_width; ++i) {
        if (node.child[i] == k_none) continue;
        const Box box = child_box(node, i);
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const auto middle = [axis](const Box& b) { return finite((&b.low.x)[axis]) + finite((&b.high.x)[axis]); };
            offset[i].along[axis] = middle(box) - middle(whole);
        }
    }
    Places places{0, 1, 2, 3, 4, 5, 6, 7};
    const auto gain_of_swap = [&](uint32_t i, uint32_t j) {
        double gain = 0;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const int towards_j = static_cast<int>(j >> axis & 1) - static_cast<int>(i >> axis & 1);
            gain += towards_j * (offset[places[i]].along[axis] - offset[places[j]].along[axis]);
        }
        return gain;
    };
    bool better = true;
    for (int round = 0; better && round < 16; ++round) {
        better = false;
        for (uint32_t i = 0; i < k_node_width; ++i) {
            for (uint32_t j = i + 1; j < k_node_width; ++j) {
                if (!(gain_of_swap(i, j) > 0)) continue;
                std::swap(places[i], places[j]);
                better = true;
            }
        }
    }
    return places;
}

}  // namespace

CompressedNode compress(const BvhNode& node) {
    CompressedNode out{};
    const Places places = choose_places(node);
    for (uint32_t i = 0; i < k_node_width; ++i) {
        out.child[i] = node.child[places[i]];
        if (out.child[i] != k_none) out.grid.exponents |= 1u << (24 + i);
    }
    const Box whole = node_box(node);
    for (uint32_t a = 0; a < 3; ++a) {
        const Axis axis(finite((&whole.low.x)[a]), finite((&whole.high.x)[a]));
        out.grid.origin[a] = static_cast<float>(axis.origin);
        out.grid.exponents |= axis.exponent << (8 * a);
        for (uint32_t i = 0; i < k_node_width; ++i) {
            if (out.child[i] == k_none) continue;
            const double low = finite(node.bounds[a][places[i]]), high = finite(node.bounds[a + 3][places[i]]);
            out.grid.low[a][i / 4] |= axis.plane_below(low) << (8 * (i % 4));
            out.grid.high[a][i / 4] |= axis.plane_above(high) << (8 * (i % 4));
        }
    }
    return out;
}

std::vector<CompressedNode> compress(std::span<const BvhNode> nodes, ThreadPool& pool) {
    std::vector<CompressedNode> out(nodes.size());
    const size_t chunks = (nodes.size() + k_chunk - 1) / k_chunk;
    pool.run(static_cast<uint32_t>(chunks), [&](uint32_t chunk) {
        const size_t begin = size_t{chunk} * k_chunk, end = min_of(begin + k_chunk, nodes.size());
        for (size_t i = begin; i < end; ++i) out[i] = compress(nodes[i]);
    });
    return out;
}

}  // namespace vlp
