// Binned surface area heuristic: large nodes with all threads on each, then small ones with one thread on each.
#include "bvh/binary.h"

#include <algorithm>
#include <array>

#include "bvh/bins.h"

namespace vlp {

namespace {

using namespace binning;

constexpr uint32_t k_chunk = 16384;
constexpr uint32_t k_min_job = 4096;  // refs in a subtree that is worth a thread
constexpr uint32_t k_jobs_per_thread = 16;  // about, so that threads end together
constexpr uint32_t k_min_parallel = 65536;  // refs in a node that is worth all threads

// Refs [begin, end), around them, and around their centres.
struct Range {
    uint32_t begin = 0, end = 0;
    uint32_t depth = 0;
    Bounds box = k_nothing, centers = k_nothing;

    uint32_t size() const { return end - begin; }
    void include(const RefBounds& ref) { box.include(ref.low, ref.high), centers.include(ref.center, ref.center); }
    void include(const Range& r) { box.include(r.box), centers.include(r.centers); }
};

// Around the centres of the refs that go to each side, which no branch waits for.
struct SideCenters {
    Bounds side[2] = {k_nothing, k_nothing};

    void include(Float4 center, uint32_t to) {
        const Int4 right = Int4{} - static_cast<int32_t>(to), bits = std::bit_cast<Int4>(center);
        // What goes to the other side is not a number, of which neither the least nor the most is taken.
        const Float4 of_side[2] = {std::bit_cast<Float4>(bits | right), std::bit_cast<Float4>(bits | ~right)};
        for (uint32_t i : {0u, 1u}) {
            side[i].low = min4(of_side[i], side[i].low), side[i].high = max4(of_side[i], side[i].high);
        }
    }
    void include(const SideCenters& other) {
        for (uint32_t i : {0u, 1u}) side[i].include(other.side[i]);
    }
};

// A range and where its node's index is to be written.
struct Job {
    Range range;
    uint32_t* place;
};

struct Cut {
    bool leaf = false;
    uint32_t split = 0;
    Range side[2];
};

class Builder {
public:
    Builder(RawVector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool, BinaryTree& tree)
        : refs_(refs), rule_(rule), max_depth_(max_depth), pool_(pool), tree_(tree) {}

    void build() {
        const auto count = static_cast<uint32_t>(refs_.size());
        const Range all = bounds(0, count, true);
        tree_.box = all.box.box();
        tree_.nodes = LazyArray<BinaryNode>(count);
        std::vector<Job> large{{all, &tree_.root}}, small;
        const uint32_t limit = max_of(k_min_job, count / (k_jobs_per_thread * pool_.size()));
        LazyArray<Ref> scratch(count < limit ? 0 : count);
        while (!large.empty()) {
            const Job job = large.back();
            large.pop_back();
            if (job.range.size() < limit) {
                small.push_back(job);
                continue;
            }
            const bool parallel = pool_.size() > 1 && job.range.size() >= k_min_parallel;
            const Cut cut = split(job.range, parallel, scratch.data());
            // The subtree that ends where this node is cut needs one place fewer than it has refs.
            if (!cut.leaf) descend(job, cut, cut.split - 1, large);
        }
        scratch = {};
        std::stable_sort(small.begin(), small.end(),
                         [](const Job& a, const Job& b) { return a.range.size() > b.range.size(); });
        pool_.run(static_cast<uint32_t>(small.size()), [&](uint32_t i) { build_small(small[i]); });
    }

private:
    // Writes the node of a cut, and puts its sides on the stack, left one on top.
    void descend(const Job& job, const Cut& cut, uint32_t index, std::vector<Job>& stack) {
        BinaryNode& node = tree_.nodes[index];
        *job.place = index;
        node.box[0] = cut.side[0].box.box(), node.box[1] = cut.side[1].box.box();
        node.child[0] = node.child[1] = k_leaf_flag;
        node.split = cut.split;
        stack.push_back({cut.side[1], &node.child[1]});
        stack.push_back({cut.side[0], &node.child[0]});
    }

    void build_small(const Job& first) {
        LazyArray<Ref> scratch(first.range.size());
        uint32_t next = first.range.begin;
        std::vector<Job> stack{first};
        while (!stack.empty()) {
            const Job job = stack.back();
            stack.pop_back();
            const Cut cut = split(job.range, false, scratch.data());
            if (!cut.leaf) descend(job, cut, next++, stack);
        }
    }

    // `scratch`: for as many refs as the range has.
    Cut split(const Range& range, bool parallel, Ref* scratch) {
        Cut cut;
        cut.leaf = range.size() == 1 || (is_cheapest_as_block(range.size()) && alike(range));
        if (cut.leaf) return cut;
        const Binning binning(range.centers, bins_for(range.size()));
        Bins bins(binning.bins);
        std::vector<Bins> of_chunks;
        Split best;
        if (range.depth < max_depth_) {
            if (parallel) {
                of_chunks = bin_in_parallel(range, binning);
                for (const Bins& chunk : of_chunks) bins.include(chunk);
            } else {
                bins.add(refs_.data(), range.begin, range.end, binning);
            }
            best = best_split(bins);
        }
        const float area = range.box.half_area();
        const float leaf_cost = rule_.block_cost * static_cast<float>(blocks_for(range.size())) * area;
        const float split_cost = area + rule_.block_cost * best.cost;
        cut.leaf = range.size() <= rule_.max_refs && !(split_cost < leaf_cost) && alike(range);
        if (cut.leaf) return cut;
        if (best.axis == k_none) {
            cut.split = range.begin + range.size() / 2;
            halve(range, cut.split);
            cut.side[0] = bounds(range.begin, cut.split, parallel);
            cut.side[1] = bounds(cut.split, range.end, parallel);
        } else {
            const SideOf side_of(binning, best);
            const SideCenters centers = parallel
                                            ? partition_in_parallel(range, side_of, of_chunks, best, scratch, cut.split)
                                            : partition(range, side_of, scratch, cut.split);
            const std::array<Bounds, 2> boxes = boxes_of(bins, best);
            for (uint32_t i : {0u, 1u}) cut.side[i].box = boxes[i], cut.side[i].centers = centers.side[i];
        }
        cut.side[0].begin = range.begin, cut.side[0].end = cut.side[1].begin = cut.split, cut.side[1].end = range.end;
        cut.side[0].depth = cut.side[1].depth = range.depth + 1;
        return cut;
    }

    // Whether so few refs are one block, which costs no more than the step to two.
    bool is_cheapest_as_block(uint32_t size) const {
        return size <= min_of(rule_.max_refs, k_block_width) && rule_.block_cost <= 1;
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
        Range all;
        all.begin = begin, all.end = end;
        const uint32_t chunks = chunks_of(all);
        if (!parallel) {
            for (uint32_t i = begin; i < end; ++i) all.include(RefBounds(refs_[i]));
            return all;
        }
        std::vector<Range> parts(chunks);
        pool_.run(chunks, [&](uint32_t chunk) {
            Range part;
            const uint32_t stop = min_of(end, begin + (chunk + 1) * k_chunk);
            for (uint32_t i = begin + chunk * k_chunk; i < stop; ++i) part.include(RefBounds(refs_[i]));
            parts[chunk] = part;
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

    // Both partitions keep the order on each side, and tell where the right one begins.
    SideCenters partition(const Range& range, const SideOf& side_of, Ref* scratch, uint32_t& split) {
        SideCenters centers;
        Ref* const refs = refs_.data();
        uint32_t left = range.begin, right = 0;
        for (uint32_t i = range.begin; i < range.end; ++i) {
            const RefRows rows(refs[i]);
            const uint32_t side = side_of(refs[i]);
            centers.include(RefBounds(rows).center, side);
            rows.store(refs[left]), rows.store(scratch[right]);
            left += 1 - side, right += side;
        }
        std::copy_n(scratch, right, refs + left);
        split = left;
        return centers;
    }

    static uint32_t chunks_of(const Range& range) { return (range.size() + k_chunk - 1) / k_chunk; }

    std::vector<Bins> bin_in_parallel(const Range& range, const Binning& binning) {
        std::vector<Bins> parts(chunks_of(range), Bins(binning.bins));
        pool_.run(chunks_of(range), [&](uint32_t chunk) {
            const uint32_t begin = range.begin + chunk * k_chunk;
            parts[chunk].add(refs_.data(), begin, min_of(range.end, begin + k_chunk), binning);
        });
        return parts;
    }

    // Every chunk writes its refs to their places in `scratch`, which the bins tell beforehand.
    SideCenters partition_in_parallel(const Range& range, const SideOf& side_of, const std::vector<Bins>& bins,
                                      const Split& best, Ref* scratch, uint32_t& split) {
        struct Part {
            uint32_t place[2];
            SideCenters centers;
        };
        std::vector<Part> parts(bins.size());
        uint32_t left = 0;
        for (size_t chunk = 0; chunk < bins.size(); ++chunk) {
            parts[chunk].place[0] = left;
            left += bins[chunk].count_below(best);
        }
        for (uint32_t chunk = 0; chunk < parts.size(); ++chunk) {
            parts[chunk].place[1] = left + chunk * k_chunk - parts[chunk].place[0];
        }
        pool_.run(static_cast<uint32_t>(parts.size()), [&](uint32_t chunk) {
            Part part = parts[chunk];
            const uint32_t begin = range.begin + chunk * k_chunk, end = min_of(range.end, begin + k_chunk);
            for (uint32_t i = begin; i < end; ++i) {
                const RefRows rows(refs_[i]);
                const uint32_t side = side_of(refs_[i]);
                part.centers.include(RefBounds(rows).center, side);
                rows.store(scratch[part.place[side]++]);
            }
            parts[chunk].centers = part.centers;
        });
        pool_.run(static_cast<uint32_t>(parts.size()), [&](uint32_t chunk) {
            const uint32_t begin = chunk * k_chunk, end = min_of(range.size(), begin + k_chunk);
            std::copy(scratch + begin, scratch + end, refs_.data() + range.begin + begin);
        });
        SideCenters centers;
        for (const Part& part : parts) centers.include(part.centers);
        split = range.begin + left;
        return centers;
    }

    RawVector<Ref>& refs_;
    const LeafRule& rule_;
    uint32_t max_depth_;
    ThreadPool& pool_;
    BinaryTree& tree_;
};

}  // namespace

BinaryTree build_binary(RawVector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool) {
    BinaryTree tree;
    if (!refs.empty()) Builder(refs, rule, max_depth, pool, tree).build();
    return tree;
}

}  // namespace vlp
