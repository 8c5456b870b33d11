// Bins along all three axes, and the cheapest split between them by the surface area heuristic (Wald 2007).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "bvh/layout.h"
#include "bvh/refs.h"
#include "core/simd.h"

namespace vlp::binning {

inline constexpr uint32_t k_max_bins = 32;

// Few refs need few bins, which take less time to clear and to sweep than refs to sort.
inline uint32_t bins_for(uint32_t refs) { return refs < 32 ? 8 : refs < 1024 ? 16 : k_max_bins; }

// Three numbers in one register, and a fourth that does not matter.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

inline Float4 min4(Float4 a, Float4 b) { return a < b ? a : b; }
inline Vec3 to_vec3(Float4 v) { return {v[0], v[1], v[2]}; }
inline Float4 all4(float x) { return Float4{x, x, x, x}; }

// A box: the low sides, and the high ones with the other sign, so that growing is one minimum of all six.
struct Bounds {
#if VLP_AVX2
    using Float8 = float __attribute__((vector_size(32)));

    Float8 sides;

    Bounds(Float4 low, Float4 high) : sides(_mm256_set_m128(-high, low)) {}
    void include(const Bounds& b) { sides = sides < b.sides ? sides : b.sides; }
    void include_numbers(const Bounds& b) { sides = b.sides < sides ? b.sides : sides; }  // leaves NaN out
    Float4 low() const { return _mm256_castps256_ps128(sides); }
    Float4 high() const { return -_mm256_extractf128_ps(sides, 1); }
#else
    Float4 sides[2];

    Bounds(Float4 low, Float4 high) : sides{low, -high} {}
    void include(const Bounds& b) {
        for (int i = 0; i < 2; ++i) sides[i] = min4(sides[i], b.sides[i]);
    }
    void include_numbers(const Bounds& b) {
        for (int i = 0; i < 2; ++i) sides[i] = min4(b.sides[i], sides[i]);
    }
    Float4 low() const { return sides[0]; }
    Float4 high() const { return -sides[1]; }
#endif
    Bounds() : Bounds(all4(k_infinity), all4(-k_infinity)) {}

    Box box() const { return {to_vec3(low()), to_vec3(high())}; }
    Float4 extent() const { return high() - low(); }
    float half_area() const {
        const Float4 e = extent();
        return e[0] >= 0 ? e[0] * (e[1] + e[2]) + e[1] * e[2] : 0;
    }
};

// A ref in two registers.
struct RefRows {
    Int4 low, high;

    explicit RefRows(const Ref& ref) {
        static_assert(sizeof(Ref) == sizeof(RefRows));
        std::memcpy(&low, &ref.low, sizeof low);  // one at a time, else they go by way of the stack
        std::memcpy(&high, &ref.high, sizeof high);
    }
    void store(Ref& ref) const {
        std::memcpy(static_cast<void*>(&ref.low), &low, sizeof low);
        std::memcpy(static_cast<void*>(&ref.high), &high, sizeof high);
    }
};

// A ref's corners and twice its centre.
struct RefBounds {
    Float4 low, high, center;

    explicit RefBounds(const RefRows& rows) {
        const Int4 numbers{-1, -1, -1, 0};  // indices as numbers would be denormal, and slow
        low = std::bit_cast<Float4>(rows.low & numbers), high = std::bit_cast<Float4>(rows.high & numbers);
        center = low + high;
    }
    explicit RefBounds(const Ref& ref) : RefBounds(RefRows(ref)) {}
    Bounds box() const { return {low, high}; }
};

// Which bin a centre falls into, along each axis. An axis along which nothing can be split has all in bin 0.
struct Binning {
    Float4 low, scale, last;
    uint32_t bins;

    Binning(const Bounds& centers, uint32_t bin_count)
        : low(centers.low()), scale{0, 0, 0, 0}, last(all4(static_cast<float>(bin_count - 1))), bins(bin_count) {
        for (int a = 0; a < 3; ++a) {
            const float extent = centers.extent()[a];
            const float s = extent > 0 ? static_cast<float>(bins) * (1 - 0x1p-20f) / extent : 0.0f;
            scale[a] = s < k_infinity ? s : 0.0f;
        }
    }
    Int4 bins_of(Float4 center) const { return __builtin_convertvector(min4((center - low) * scale, last), Int4); }
};

struct Split {
    float cost = k_infinity;  // areas times blocks, not yet divided by the node's area
    uint32_t axis = k_none;   // k_none: cut in halves
    int32_t bin = 0;          // first bin of the right side
};

// What fell into the bins of one index: a box and a count for each axis.
struct Bin {
    Bounds box[3];
    Int4 count;
};

struct Bins {
    std::array<Bin, k_max_bins> bin;
    uint32_t count;

    explicit Bins(uint32_t bins) : count(bins) { std::fill_n(bin.begin(), count, Bin{{}, {0, 0, 0, 0}}); }

    void add(const Ref* refs, uint32_t begin, uint32_t end, const Binning& binning) {
        for (uint32_t i = begin; i < end; ++i) {
            const RefBounds ref(refs[i]);
            const Bounds box = ref.box();
            const Int4 index = binning.bins_of(ref.center);
            for (int axis = 0; axis < 3; ++axis) {
                Bin& b = bin[static_cast<uint32_t>(index[axis])];
                b.box[axis].include(box);
                ++reinterpret_cast<int32_t*>(&b.count)[axis];
            }
        }
    }
    void include(const Bins& other) {
        for (uint32_t i = 0; i < count; ++i) {
            for (int axis = 0; axis < 3; ++axis) bin[i].box[axis].include(other.bin[i].box[axis]);
            bin[i].count += other.bin[i].count;
        }
    }
    // Refs on the left of a split.
    uint32_t count_below(const Split& split) const {
        int32_t refs = 0;
        for (int32_t i = 0; i < split.bin; ++i) refs += bin[static_cast<uint32_t>(i)].count[split.axis];
        return static_cast<uint32_t>(refs);
    }
};

// On which side of a split a ref lies: 1 if its bin is not below that of the split.
class SideOf {
public:
    SideOf(const Binning& binning, const Split& split)
        : axis_(split.axis),
          low_(binning.low[axis_]),
          scale_(binning.scale[axis_]),
          bin_(static_cast<float>(split.bin)) {}

    uint32_t operator()(const Ref& ref) const {
        const float center = (&ref.low.x)[axis_] + (&ref.high.x)[axis_];
        return (center - low_) * scale_ < bin_ ? 0 : 1;
    }

private:
    uint32_t axis_;
    float low_, scale_, bin_;
};

// The boxes of three axes and how many refs they have, which grow bin by bin.
struct Side {
    Bounds box[3];
    Int4 count{0, 0, 0, 0};

    void include(const Bin& bin) {
        for (int axis = 0; axis < 3; ++axis) box[axis].include(bin.box[axis]);
        count += bin.count;
    }
    // Half area times blocks of each axis; not a number where there is no ref.
    Float4 cost() const {
        const Float4 a = box[0].extent(), b = box[1].extent(), c = box[2].extent();
        const Float4 x{a[0], b[0], c[0], 0}, y{a[1], b[1], c[1], 0}, z{a[2], b[2], c[2], 0};
        static_assert(k_block_width == 4);
        return (x * (y + z) + y * z) * __builtin_convertvector((count + 3) >> 2, Float4);
    }
};

inline Split best_split(const Bins& bins) {
    std::array<Float4, k_max_bins> right_cost;
    Side right;
    for (uint32_t i = bins.count - 1; i > 0; --i) {
        right.include(bins.bin[i]);
        right_cost[i] = right.cost();
    }
    Side left;
    Float4 best = all4(k_infinity);
    Int4 first{0, 0, 0, 0};
    for (uint32_t i = 1; i < bins.count; ++i) {
        left.include(bins.bin[i - 1]);
        const Float4 cost = left.cost() + right_cost[i];
        const Int4 better = cost < best;
        best = better ? cost : best;
        first = better ? Int4{} + static_cast<int32_t>(i) : first;
    }
    Split split;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        if (best[axis] < split.cost) split = {best[axis], axis, first[axis]};
    }
    return split;
}

// The boxes of both sides.
inline std::array<Bounds, 2> boxes_of(const Bins& bins, const Split& split) {
    std::array<Bounds, 2> sides;
    for (uint32_t i = 0; i < bins.count; ++i) {
        sides[static_cast<int32_t>(i) < split.bin ? 0 : 1].include(bins.bin[i].box[split.axis]);
    }
    return sides;
}

}  // namespace vlp::binning
