// Binned surface area heuristic: large nodes with all threads on each, then small ones with one thread on each.
#include "bvh/binary.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "bvh/layout.h"

namespace vlp {

namespace {

constexpr uint32_t k_max_bins = 32;
constexpr uint32_t k_chunk = 16384;
constexpr uint32_t k_min_job = 4096;        // refs in a subtree that is worth a thread
constexpr uint32_t k_min_parallel = 65536;  // refs in a node that is worth all threads

// Few refs need few bins, which take less time to clear and to sweep than refs to sort.
uint32_t bins_for(uint32_t refs) { return refs < 32 ? 8 : refs < 1024 ? 16 : k_max_bins; }

// Three floats and a zero in one register.
using Float4 = float __attribute__((vector_size(16)));

Float4 min4(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 max4(Float4 a, Float4 b) { return a > b ? a : b; }
Vec3 to_vec3(Float4 v) { return {v[0], v[1], v[2]}; }

struct Bounds {
    Float4 low, high;

    void include(Float4 from, Float4 to) { low = min4(low, from), high = max4(high, to); }
    void include(const Bounds& b) { include(b.low, b.high); }
    Box box() const { return {to_vec3(low), to_vec3(high)}; }
    float half_area() const {
        const Float4 e = high - low;
        return e[0] >= 0 ? e[0] * (e[1] + e[2]) + e[1] * e[2] : 0;
    }
};

constexpr Bounds k_nothing{{k_infinity, k_infinity, k_infinity, 0}, {-k_infinity, -k_infinity, -k_infinity, 0}};

// A ref's corners and its centre.
struct RefBounds {
    Float4 low, high, center;

    explicit RefBounds(const Ref& ref) {
        static_assert(sizeof(Ref) == 2 * sizeof(Float4));
        Float4 rows[2];
        std::memcpy(rows, &ref, sizeof rows);
        low = rows[0], high = rows[1];
        low[3] = high[3] = 0;  // indices, which as numbers would be denormal, and slow
        center = (low + high) * 0.5f;
    }
};

// Refs [begin, end) and their bounds.
struct Range {
    uint32_t begin = 0, end = 0;
    uint32_t depth = 0;
    Bounds box = k_nothing, centers = k_nothing;

    uint32_t size() const { return end - begin; }
    void include(const RefBounds& ref) { box.include(ref.low, ref.high), centers.include(ref.center, ref.center); }
    void include(const Range& r) { box.include(r.box), centers.include(r.centers); }
};

struct Bin {
    Bounds box;
    uint32_t count;
};

// `count` bins along each axis; the others are never touched.
struct Bins {
    std::array<std::array<Bin, k_max_bins>, 3> axis;
    uint32_t count;

    explicit Bins(uint32_t bins) : count(bins) {
        for (auto& row : axis) std::fill_n(row.begin(), count, Bin{k_nothing, 0});
    }

    void include(const Bins& other) {
        for (size_t a = 0; a < 3; ++a) {
            for (size_t i = 0; i < count; ++i) {
                axis[a][i].box.include(other.axis[a][i].box);
                axis[a][i].count += other.axis[a][i].count;
            }
        }
    }
};

// Which bin a centre falls into, along each axis.
struct Binning {
    Float4 low, scale;
    uint32_t bins;

    Binning(const Bounds& centers, uint32_t bin_count) : low(centers.low), scale{0, 0, 0, 0}, bins(bin_count) {
        for (int a = 0; a < 3; ++a) {
            const float extent = centers.high[a] - centers.low[a];
            scale[a] = extent > 0 ? static_cast<float>(bins) * (1 - 0x1p-20f) / extent : 0.0f;
        }
    }
    // An extent whose inverse overflows makes infinite scales: min_of keeps every index in range.
    uint32_t index(float x) const { return x < static_cast<float>(bins) ? static_cast<uint32_t>(x) : bins - 1; }
    std::array<uint32_t, 3> bins_of(Float4 c) const {
        const Float4 b = (c - low) * scale;
        return {index(b[0]), index(b[1]), index(b[2])};
    }
    uint32_t bin_of(Float4 c, uint32_t axis) const { return index((c[axis] - low[axis]) * scale[axis]); }
    bool splits(uint32_t axis) const { return scale[axis] > 0 && scale[axis] < k_infinity; }
};

struct Split {
    float cost = k_infinity;  // areas times blocks, not yet divided by the node's area
    uint32_t axis = k_none;   // k_none: cut in halves
    uint32_t bin = 0;         // first bin of the right side
};

float blocks(uint32_t refs) { return static_cast<float>(blocks_for(refs)); }

Split best_split(const Bins& bins, const Binning& binning) {
    Split best;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        if (!binning.splits(axis)) continue;
        const auto& row = bins.axis[axis];
        std::array<float, k_max_bins> right_cost;
        std::array<uint32_t, k_max_bins> right_count;
        Bounds box = k_nothing;
        uint32_t count = 0;
        for (uint32_t i = bins.count - 1; i > 0; --i) {
            box.include(row[i].box);
            count += row[i].count;
            right_cost[i] = box.half_area() * blocks(count);
            right_count[i] = count;
        }
        box = k_nothing, count = 0;
        for (uint32_t i = 1; i < bins.count; ++i) {
            box.include(row[i - 1].box);
            count += row[i - 1].count;
            if (count == 0 || right_count[i] == 0) continue;
            const float cost = box.half_area() * blocks(count) + right_cost[i];
            if (cost < best.cost) best = {cost, axis, i};
        }
    }
    return best;
}

void add_to_bins(const Ref* refs, uint32_t begin, uint32_t end, const Binning& binning, Bins& bins) {
    for (uint32_t i = begin; i < end; ++i) {
        const RefBounds ref(refs[i]);
        const std::array<uint32_t, 3> b = binning.bins_of(ref.center);
        for (uint32_t axis = 0; axis < 3; ++axis) {
            Bin& bin = bins.axis[axis][b[axis]];
            bin.box.include(ref.low, ref.high);
            ++bin.count;
        }
    }
}

class Builder {
public:
    Builder(std::vector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool, BinaryTree& tree)
        : refs_(refs), rule_(rule), max_depth_(max_depth), pool_(pool), tree_(tree) {}

    void build() {
        const auto count = static_cast<uint32_t>(refs_.size());
        const Range all = bounds(0, count, true);
        tree_.box = all.box.box();
        tree_.nodes.resize(count);
        std::vector<Job> large{{all, &tree_.root}}, small;
        const uint32_t limit = max_of(k_min_job, count / 128);
        while (!large.empty()) {
            const Job job = large.back();
            large.pop_back();
            if (job.range.size() < limit) {
                small.push_back(job);
                continue;
            }
            const Cut cut = split(job.range, job.range.size() >= k_min_parallel);
            if (cut.leaf) continue;
            descend(job, cut, large);
        }
        std::stable_sort(small.begin(), small.end(),
                         [](const Job& a, const Job& b) { return a.range.size() > b.range.size(); });
        pool_.run(static_cast<uint32_t>(small.size()), [&](uint32_t i) { build_small(small[i]); });
    }

private:
    // A range and where its node's index is to be written.
    struct Job {
        Range range;
        uint32_t* place;
    };
    struct Cut {
        bool leaf;
        uint32_t split;
        Range side[2];
    };

    // Writes the node of a cut, and puts its sides on the stack, left one on top.
    void descend(const Job& job, const Cut& cut, std::vector<Job>& stack) {
        BinaryNode& node = tree_.nodes[cut.split];
        *job.place = cut.split;
        node.box[0] = cut.side[0].box.box(), node.box[1] = cut.side[1].box.box();
        node.child[0] = node.child[1] = k_leaf_flag;
        node.begin = job.range.begin, node.end = job.range.end;
        stack.push_back({cut.side[1], &node.child[1]});
        stack.push_back({cut.side[0], &node.child[0]});
    }

    void build_small(const Job& first) {
        std::vector<Job> stack{first};
        while (!stack.empty()) {
            const Job job = stack.back();
            stack.pop_back();
            if (job.range.size() == 1) continue;
            const Cut cut = split(job.range, false);
            if (cut.leaf) continue;
            descend(job, cut, stack);
        }
    }

    Cut split(const Range& range, bool parallel) {
        const Binning binning(range.centers, bins_for(range.size()));
        Split best;
        if (range.depth < max_depth_) {
            Bins bins(binning.bins);
            if (parallel) {
                bin_in_parallel(range, binning, bins);
            } else {
                add_to_bins(refs_.data(), range.begin, range.end, binning, bins);
            }
            best = best_split(bins, binning);
        }
        const float area = range.box.half_area();
        const float leaf_cost = rule_.block_cost * blocks(range.size()) * area;
        const float split_cost = area + rule_.block_cost * best.cost;
        if (range.size() <= rule_.max_refs && !(split_cost < leaf_cost) && alike(range)) return {true, 0, {}};
        Cut cut{false, 0, {}};
        if (best.axis == k_none) {
            cut.split = range.begin + range.size() / 2;
            halve(range, cut.split);
            cut.side[0] = bounds(range.begin, cut.split, parallel);
            cut.side[1] = bounds(cut.split, range.end, parallel);
        } else if (parallel) {
            partition_in_parallel(range, binning, best, cut);
        } else {
            partition(range, binning, best, cut);
        }
        cut.side[0].begin = range.begin, cut.side[0].end = cut.side[1].begin = cut.split, cut.side[1].end = range.end;
        cut.side[0].depth = cut.side[1].depth = range.depth + 1;
        return cut;
    }

    // Refs of one leaf are of one kind, and an instance is alone in its leaf.
    bool alike(const Range& range) const {
        const Ref& first = refs_[range.begin];
        if (range.size() == 1) return true;
        for (uint32_t i = range.begin; i < range.end; ++i) {
            if (refs_[i].primitive == k_none) return false;
            if (rule_.kind_of_instance &&
                rule_.kind_of_instance[refs_[i].instance] != rule_.kind_of_instance[first.instance]) {
                return false;
            }
        }
        return true;
    }

    Range bounds(uint32_t begin, uint32_t end, bool parallel) {
        const uint32_t chunks = (end - begin + k_chunk - 1) / k_chunk;
        Range all;
        all.begin = begin, all.end = end;
        if (!parallel) {
            for (uint32_t i = begin; i < end; ++i) all.include(RefBounds(refs_[i]));
            return all;
        }
        std::vector<Range> parts(chunks);
        pool_.run(chunks, [&](uint32_t chunk) {
            const uint32_t stop = min_of(end, begin + (chunk + 1) * k_chunk);
            for (uint32_t i = begin + chunk * k_chunk; i < stop; ++i) parts[chunk].include(RefBounds(refs_[i]));
        });
        for (const Range& part : parts) all.include(part);
        return all;
    }

    // Puts the lower centres along the longest axis first; equal ones stay as they stand.
    void halve(const Range& range, uint32_t middle) {
        const Vec3 e = to_vec3(range.centers.high - range.centers.low);
        const uint32_t axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
        if (!((&e.x)[axis] > 0)) return;
        const auto key = [axis](const Ref& r) { return (&r.low.x)[axis] + (&r.high.x)[axis]; };
        std::nth_element(refs_.begin() + range.begin, refs_.begin() + middle, refs_.begin() + range.end,
                         [&](const Ref& a, const Ref& b) { return key(a) < key(b); });
    }

    void partition(const Range& range, const Binning& binning, const Split& best, Cut& cut) {
        uint32_t left = range.begin, right = range.end;
        const auto goes_left = [&](const RefBounds& r) { return binning.bin_of(r.center, best.axis) < best.bin; };
        for (;;) {
            for (; left < right; ++left) {
                const RefBounds ref(refs_[left]);
                if (!goes_left(ref)) break;
                cut.side[0].include(ref);
            }
            for (; left < right; --right) {
                const RefBounds ref(refs_[right - 1]);
                if (goes_left(ref)) break;
                cut.side[1].include(ref);
            }
            if (left == right) break;
            std::swap(refs_[left], refs_[right - 1]);
        }
        cut.split = left;
    }

    void bin_in_parallel(const Range& range, const Binning& binning, Bins& bins) {
        const uint32_t chunks = (range.size() + k_chunk - 1) / k_chunk;
        std::vector<Bins> parts(chunks, Bins(binning.bins));
        pool_.run(chunks, [&](uint32_t chunk) {
            const uint32_t begin = range.begin + chunk * k_chunk;
            add_to_bins(refs_.data(), begin, min_of(range.end, begin + k_chunk), binning, parts[chunk]);
        });
        for (const Bins& part : parts) bins.include(part);
    }

    // Every chunk counts, then writes its refs to their places in a second array: the order stays.
    void partition_in_parallel(const Range& range, const Binning& binning, const Split& best, Cut& cut) {
        const uint32_t chunks = (range.size() + k_chunk - 1) / k_chunk;
        scratch_.resize(refs_.size());
        std::vector<std::array<Range, 2>> parts(chunks);
        std::vector<std::array<uint32_t, 2>> counts(chunks);
        const auto chunk_end = [&](uint32_t chunk) { return min_of(range.end, range.begin + (chunk + 1) * k_chunk); };
        const auto side_of = [&](const RefBounds& r) {
            return binning.bin_of(r.center, best.axis) < best.bin ? 0u : 1u;
        };
        pool_.run(chunks, [&](uint32_t chunk) {
            for (uint32_t i = range.begin + chunk * k_chunk; i < chunk_end(chunk); ++i) {
                const RefBounds ref(refs_[i]);
                const uint32_t side = side_of(ref);
                parts[chunk][side].include(ref);
                ++counts[chunk][side];
            }
        });
        uint32_t left = range.begin;
        for (uint32_t chunk = 0; chunk < chunks; ++chunk) {
            cut.side[0].include(parts[chunk][0]), cut.side[1].include(parts[chunk][1]);
            left += counts[chunk][0];
        }
        cut.split = left;
        uint32_t next[2] = {range.begin, left};
        for (uint32_t chunk = 0; chunk < chunks; ++chunk) {
            for (uint32_t side = 0; side < 2; ++side) {
                const uint32_t count = counts[chunk][side];
                counts[chunk][side] = next[side];
                next[side] += count;
            }
        }
        pool_.run(chunks, [&](uint32_t chunk) {
            std::array<uint32_t, 2> place = counts[chunk];
            for (uint32_t i = range.begin + chunk * k_chunk; i < chunk_end(chunk); ++i) {
                scratch_[place[side_of(RefBounds(refs_[i]))]++] = refs_[i];
            }
        });
        pool_.run(chunks, [&](uint32_t chunk) {
            const uint32_t begin = range.begin + chunk * k_chunk;
            std::copy(scratch_.begin() + begin, scratch_.begin() + chunk_end(chunk), refs_.begin() + begin);
        });
    }

    std::vector<Ref>& refs_;
    std::vector<Ref> scratch_;
    const LeafRule& rule_;
    uint32_t max_depth_;
    ThreadPool& pool_;
    BinaryTree& tree_;
};

}  // namespace

BinaryTree build_binary(std::vector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool) {
    BinaryTree tree;
    if (!refs.empty()) Builder(refs, rule, max_depth, pool, tree).build();
    return tree;
}

}  // namespace vlp
