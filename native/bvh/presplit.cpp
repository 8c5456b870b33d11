// Cuts go through the middle planes of the scene's box, of its halves, quarters and so on, so that parts of neighbours align.
#include "bvh/presplit.h"

#include <algorithm>
#include <bit>

namespace vlp {

namespace {

constexpr uint32_t k_chunk = 16384;
constexpr uint32_t k_max_splits = 64;  // of one triangle
constexpr float k_tolerated_waste = 32;  // in shares of the scene's box, one share a triangle
constexpr uint32_t k_levels = 20;  // of halving

// The coarsest plane of halving that cuts a box.
struct Plane {
    uint32_t axis = k_none;  // k_none: no plane does
    uint32_t level = k_levels;
    float at = 0;
};

class Halving {
public:
    explicit Halving(const Box& scene) : low_(scene.low) {
        const Vec3 e = scene.high - scene.low;
        const float most = max_of(max_of(e.x, e.y), e.z);
        cell_ = most * (1.0f + 0x1p-20f) / static_cast<float>(1u << k_levels);
    }
    bool is_possible() const { return cell_ > 0 && cell_ < k_infinity; }

    Plane plane_of(const Box& box) const {
        Plane plane;
        float longest = 0;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const float base = (&low_.x)[axis], low = (&box.low.x)[axis], high = (&box.high.x)[axis];
            const uint32_t a = cell_of(low - base), b = cell_of(high - base);
            if (a == b) continue;
            const uint32_t bit = 31u - static_cast<uint32_t>(std::countl_zero(a ^ b));
            const uint32_t level = k_levels - 1 - bit;
            const float at = base + static_cast<float>(b >> bit << bit) * cell_;
            if (!(at > low && at < high)) continue;
            if (level < plane.level || (level == plane.level && high - low > longest)) {
                plane = {axis, level, at};
                longest = high - low;
            }
        }
        return plane;
    }

private:
    uint32_t cell_of(float x) const {
        return static_cast<uint32_t>(max_of(0.0f, min_of(x / cell_, static_cast<float>((1u << k_levels) - 1))));
    }

    Vec3 low_;
    float cell_;
};

bool is_empty(const Box& b) { return b.low.x > b.high.x || b.low.y > b.high.y || b.low.z > b.high.z; }

Box intersection(const Box& a, const Box& b) { return {max_of(a.low, b.low), min_of(a.high, b.high)}; }

// The two parts of the triangle in `box`, on either side of the plane; a little wider than rounding moves the cut.
void cut(const Corners& triangle, const Box& box, const Plane& plane, Box (&part)[2]) {
    part[0] = part[1] = Box{};
    for (int i = 0; i < 3; ++i) {
        const Vec3 a = triangle.v[i], b = triangle.v[(i + 1) % 3];
        const float from = (&a.x)[plane.axis], to = (&b.x)[plane.axis];
        if (from <= plane.at) part[0].include(a);
        if (from >= plane.at) part[1].include(a);
        if ((from < plane.at) == (to < plane.at) || from == plane.at || to == plane.at) continue;
        const Vec3 crossing = a + (b - a) * ((plane.at - from) / (to - from));
        const auto size = [](float x, float y) { return max_of(std::fabs(x), std::fabs(y)); };
        const Vec3 error = Vec3{size(a.x, b.x), size(a.y, b.y), size(a.z, b.z)} * 0x1p-21f;
        for (Box& p : part) p.include(crossing - error), p.include(crossing + error);
    }
    (&part[0].high.x)[plane.axis] = plane.at;
    (&part[1].low.x)[plane.axis] = plane.at;
    for (Box& p : part) p = intersection(p, box);
}

// What a triangle's box has beyond four times its projections, which most triangles of fine meshes keep to.
float waste_of(const Corners& c, const Box& box) {
    const Vec3 n = cross(c.v[1] - c.v[0], c.v[2] - c.v[0]);  // twice the areas of its projections
    return box.half_area() - 2 * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z));
}

class Splitter {
public:
    // `scene`: around all refs.
    Splitter(RawVector<Ref>& refs, const Box& scene, const LeafSource& source, ThreadPool& pool)
        : refs_(refs),
          source_(source),
          pool_(pool),
          chunks_((size() + k_chunk - 1) / k_chunk),
          halving_(scene),
          tolerated_waste_(k_tolerated_waste * scene.half_area() / static_cast<float>(size())) {}

    void split() {
        if (!halving_.is_possible()) return;
        RawVector<float> priority(size());
        for_chunks([&](uint32_t, uint32_t i) { priority[i] = priority_of(refs_[i]); });
        const float factor = factor_for(priority);
        if (factor == 0) return;
        std::vector<RawVector<Ref>> added(chunks_);
        for_chunks([&](uint32_t chunk, uint32_t i) {
            const uint32_t splits = splits_of(priority[i], factor);
            if (splits > 0) split(refs_[i], splits, source_.corners_of(refs_[i]), added[chunk]);
        });
        for (const auto& parts : added) refs_.insert(refs_.end(), parts.begin(), parts.end());
    }

private:
    uint32_t size() const { return static_cast<uint32_t>(refs_.size()); }

    template <typename Body>
    void for_chunks(const Body& body) {
        const uint32_t count = size();
        pool_.run(chunks_, [&](uint32_t chunk) {
            const uint32_t end = min_of(count, (chunk + 1) * k_chunk);
            for (uint32_t i = chunk * k_chunk; i < end; ++i) body(chunk, i);
        });
    }

    // How much a cut promises: 0 for what cannot be cut.
    float priority_of(const Ref& ref) const {
        if (!(ref.box().half_area() > tolerated_waste_)) return 0;  // most are done with here
        if (ref.primitive == k_none || source_.geometry_of(ref).kind != GeometryKind::mesh) return 0;
        const Plane plane = halving_.plane_of(ref.box());
        if (plane.axis == k_none) return 0;
        const float waste = waste_of(source_.corners_of(ref), ref.box()) - tolerated_waste_;
        return waste > 0 && waste < k_infinity ? std::cbrt(std::ldexp(waste, -static_cast<int>(plane.level))) : 0.0f;
    }

    static uint32_t splits_of(float priority, float factor) {
        return static_cast<uint32_t>(min_of(priority * factor, static_cast<float>(k_max_splits)));
    }

    // The largest factor by which the splits stay within the budget; 0: none.
    float factor_for(const RawVector<float>& priority) {
        const float most = *std::max_element(priority.begin(), priority.end());
        if (!(most > 0)) return 0;
        const auto budget = k_free_splits + size() / k_refs_per_split;
        float low = 0, high = static_cast<float>(k_max_splits + 1) / most;
        for (int step = 0; step < 24; ++step) {
            const float middle = step == 0 ? high : (low + high) * 0.5f;
            std::vector<uint64_t> counts(chunks_);
            for_chunks([&](uint32_t chunk, uint32_t i) { counts[chunk] += splits_of(priority[i], middle); });
            uint64_t total = 0;
            for (const uint64_t c : counts) total += c;
            if (total <= budget) {
                low = middle;
                if (step == 0) break;
            } else {
                high = middle;
            }
        }
        return low;
    }

    // Leaves the first part in `ref` and adds the others.
    void split(Ref& ref, uint32_t splits, const Corners& triangle, RawVector<Ref>& added) const {
        const Plane plane = splits > 0 ? halving_.plane_of(ref.box()) : Plane{};
        if (plane.axis == k_none) return;
        Box part[2];
        cut(triangle, ref.box(), plane, part);
        for (const uint32_t side : {0u, 1u}) {
            if (!is_empty(part[side])) continue;  // after earlier cuts the triangle may lie on the other side alone
            ref.low = part[1 - side].low, ref.high = part[1 - side].high;
            return split(ref, splits - 1, triangle, added);
        }
        const float longest[2] = {longest_side(part[0]), longest_side(part[1])};
        const float share = longest[0] / (longest[0] + longest[1]);
        if (!(share >= 0 && share <= 1)) return;
        const auto left = static_cast<uint32_t>(static_cast<float>(splits - 1) * share + 0.5f);
        Ref other{part[1].low, ref.instance, part[1].high, ref.primitive};
        ref.low = part[0].low, ref.high = part[0].high;
        split(ref, left, triangle, added);
        split(other, splits - 1 - left, triangle, added);
        added.push_back(other);
    }

    static float longest_side(const Box& box) {
        const Vec3 e = box.high - box.low;
        return max_of(max_of(e.x, e.y), e.z);
    }

    RawVector<Ref>& refs_;
    const LeafSource& source_;
    ThreadPool& pool_;
    uint32_t chunks_;
    Halving halving_;
    float tolerated_waste_;
};

}  // namespace

void presplit(RawVector<Ref>& refs, const LeafSource& source, ThreadPool& pool) {
    const auto count = static_cast<uint32_t>(refs.size());
    std::vector<Box> boxes((count + k_chunk - 1) / k_chunk);
    pool.run(static_cast<uint32_t>(boxes.size()), [&](uint32_t chunk) {
        Box box;
        const uint32_t end = min_of(count, (chunk + 1) * k_chunk);
        for (uint32_t i = chunk * k_chunk; i < end; ++i) box.include(refs[i].box());
        boxes[chunk] = box;
    });
    Box scene;
    for (const Box& box : boxes) scene.include(box);
    if (!refs.empty()) Splitter(refs, scene, source, pool).split();
}

}  // namespace vlp
