// Binned surface area heuristic: large nodes with all threads on each, then smaller ones with one thread on each.
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
    uint32_t buffer = 0;  // which array they stand in
    Bounds box, centers;

    uint32_t size() const { return end - begin; }
    void include(const RefBounds& ref) { box.include(ref.box()), centers.include({ref.center, ref.center}); }
    void include(const Range& r) { box.include(r.box), centers.include(r.centers); }
};

// Around the centres of the refs that go to each side, which no branch waits for.
struct SideCenters {
    Bounds left, right;

    void include(Float4 center, uint32_t side) {
        const Int4 is_right = Int4{} - static_cast<int32_t>(side), bits = std::bit_cast<Int4>(center);
        // What goes to the other side is not a number, of which neither the least nor the most is taken.
        const Float4 to_left = std::bit_cast<Float4>(bits | is_right),
                     to_right = std::bit_cast<Float4>(bits | ~is_right);
        left.include_numbers({to_left, to_left}), right.include_numbers({to_right, to_right});
    }
    void include(const SideCenters& other) { left.include(other.left), right.include(other.right); }
};

// Puts the refs [begin, end) in their order on either side of a split.
SideCenters partition(const Ref* begin, const Ref* end, SideOf side_of, Ref* to, uint32_t left, uint32_t right) {
    SideCenters centers;
    for (const Ref* ref = begin; ref != end; ++ref) {
        const RefRows rows(*ref);
        const uint32_t side = side_of(*ref);
        centers.include(RefBounds(rows).center, side);
        rows.store(to[left ^ ((left ^ right) & (0 - side))]);  // a choice that is no branch, which would be a guess
        left += 1 - side, right += side;
    }
    return centers;
}

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
        : rule_(rule),
          max_depth_(max_depth),
          pool_(pool),
          tree_(tree),
          count_(static_cast<uint32_t>(refs.size())),
          scratch_(count_),
          buffer_{refs.data(), scratch_.data()} {}

    void build() {
        const Range all = bounds(0, count_, 0, true);
        tree_.box = all.box.box();
        tree_.nodes = LazyArray<BinaryNode>(count_);
        std::vector<Job> large{{all, &tree_.root}}, medium, small;
        while (!large.empty()) {
            const Job job = large.back();
            large.pop_back();
            if (job.range.size() < k_min_parallel) {
                medium.push_back(job);
            } else {
                cut(job, pool_.size() > 1, large);
            }
        }
        const uint32_t limit = max_of(k_min_job, count_ / (k_jobs_per_thread * pool_.size()));
        while (!medium.empty()) {
            std::vector<std::vector<Job>> sides(medium.size());
            pool_.run(static_cast<uint32_t>(medium.size()), [&](uint32_t i) {
                if (medium[i].range.size() >= limit) cut(medium[i], false, sides[i]);
            });
            std::vector<Job> next;
            for (size_t i = 0; i < medium.size(); ++i) {
                if (medium[i].range.size() < limit) small.push_back(medium[i]);
                next.insert(next.end(), sides[i].begin(), sides[i].end());
            }
            medium = std::move(next);
        }
        std::stable_sort(small.begin(), small.end(),
                         [](const Job& a, const Job& b) { return a.range.size() > b.range.size(); });
        pool_.run(static_cast<uint32_t>(small.size()), [&](uint32_t i) { build_small(small[i]); });
    }

private:
    void cut(const Job& job, bool parallel, std::vector<Job>& stack) {
        const Cut sides = split(job.range, parallel);
        // The subtree that ends where this node is cut needs one place fewer than it has refs.
        if (!sides.leaf) descend(job, sides, sides.split - 1, stack);
    }

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
        uint32_t next = first.range.begin;
        std::vector<Job> stack{first};
        while (!stack.empty()) {
            const Job job = stack.back();
            stack.pop_back();
            const Cut cut = split(job.range, false);
            if (!cut.leaf) descend(job, cut, next++, stack);
        }
    }

    // Takes the refs to the other buffer or leaves them where they are; those of a leaf end in the first one.
    Cut split(const Range& range, bool parallel) {
        const Cut cut = cut_of(range, parallel);
        if (cut.leaf && range.buffer != 0) {
            std::copy(buffer_[1] + range.begin, buffer_[1] + range.end, buffer_[0] + range.begin);
        }
        return cut;
    }

    Cut cut_of(const Range& range, bool parallel) {
        Cut cut;
        cut.leaf = range.size() == 1 || (is_cheapest_as_block(range.size()) && alike(range));
        if (cut.leaf) return cut;
        Ref* const refs = buffer_[range.buffer];
        const Binning binning(range.centers, bins_for(range.size()));
        Bins bins(binning.bins);
        std::vector<Bins> of_chunks;
        Split best;
        if (range.depth < max_depth_) {
            if (parallel) {
                of_chunks = bin_in_parallel(range, binning);
                for (const Bins& chunk : of_chunks) bins.include(chunk);
            } else {
                bins.add(refs, range.begin, range.end, binning);
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
            cut.side[0] = bounds(range.begin, cut.split, range.buffer, parallel);
            cut.side[1] = bounds(cut.split, range.end, range.buffer, parallel);
        } else {
            const SideOf side_of(binning, best);
            cut.split = range.begin + bins.count_below(best);
            Ref* const to = buffer_[1 - range.buffer];
            const SideCenters centers =
                parallel ? partition_in_parallel(range, side_of, of_chunks, best, cut.split)
                         : partition(refs + range.begin, refs + range.end, side_of, to, range.begin, cut.split);
            const std::array<Bounds, 2> boxes = boxes_of(bins, best);
            for (uint32_t i : {0u, 1u}) cut.side[i].box = boxes[i], cut.side[i].buffer = 1 - range.buffer;
            cut.side[0].centers = centers.left, cut.side[1].centers = centers.right;
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
        const Ref* const refs = buffer_[range.buffer];
        const Ref& first = refs[range.begin];
        if (range.size() == 1) return true;
        for (uint32_t i = range.begin; i < range.end; ++i) {
            if (refs[i].primitive == k_none) return false;
            if (rule_.kind_of_instance &&
                rule_.kind_of_instance[refs[i].instance] != rule_.kind_of_instance[first.instance]) {
                return false;
            }
        }
        return true;
    }

    Range bounds(uint32_t begin, uint32_t end, uint32_t buffer, bool parallel) {
        const Ref* const refs = buffer_[buffer];
        Range all;
        all.begin = begin, all.end = end, all.buffer = buffer;
        const uint32_t chunks = chunks_of(all);
        if (!parallel) {
            for (uint32_t i = begin; i < end; ++i) all.include(RefBounds(refs[i]));
            return all;
        }
        std::vector<Range> parts(chunks);
        pool_.run(chunks, [&](uint32_t chunk) {
            Range part;
            const uint32_t stop = min_of(end, begin + (chunk + 1) * k_chunk);
            for (uint32_t i = begin + chunk * k_chunk; i < stop; ++i) part.include(RefBounds(refs[i]));
            parts[chunk] = part;
        });
        for (const Range& part : parts) all.include(part);
        return all;
    }

    // Puts the lower centres along the longest axis first; equal ones stay as they stand.
    void halve(const Range& range, uint32_t middle) {
        const Vec3 e = to_vec3(range.centers.extent());
        const uint32_t axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
        if (!((&e.x)[axis] > 0)) return;
        const auto key = [axis](const Ref& r) { return (&r.low.x)[axis] + (&r.high.x)[axis]; };
        Ref* const refs = buffer_[range.buffer];
        std::nth_element(refs + range.begin, refs + middle, refs + range.end,
                         [&](const Ref& a, const Ref& b) { return key(a) < key(b); });
    }

    static uint32_t chunks_of(const Range& range) { return (range.size() + k_chunk - 1) / k_chunk; }

    std::vector<Bins> bin_in_parallel(const Range& range, const Binning& binning) {
        std::vector<Bins> parts(chunks_of(range), Bins(binning.bins));
        pool_.run(chunks_of(range), [&](uint32_t chunk) {
            const uint32_t begin = range.begin + chunk * k_chunk;
            parts[chunk].add(buffer_[range.buffer], begin, min_of(range.end, begin + k_chunk), binning);
        });
        return parts;
    }

    // Every chunk writes its refs to their places, which the bins tell beforehand.
    SideCenters partition_in_parallel(const Range& range, const SideOf& side_of, const std::vector<Bins>& bins,
                                      const Split& best, uint32_t split) {
        const Ref* const from = buffer_[range.buffer];
        Ref* const to = buffer_[1 - range.buffer];
        std::vector<uint32_t> left(bins.size());
        for (uint32_t chunk = 0, place = range.begin; chunk < left.size(); ++chunk) {
            left[chunk] = place;
            place += bins[chunk].count_below(best);
        }
        std::vector<SideCenters> parts(bins.size());
        pool_.run(static_cast<uint32_t>(parts.size()), [&](uint32_t chunk) {
            const uint32_t begin = range.begin + chunk * k_chunk, end = min_of(range.end, begin + k_chunk);
            const uint32_t right = split + (begin - left[chunk]);
            parts[chunk] = partition(from + begin, from + end, side_of, to, left[chunk], right);
        });
        SideCenters centers;
        for (const SideCenters& part : parts) centers.include(part);
        return centers;
    }

    const LeafRule& rule_;
    uint32_t max_depth_;
    ThreadPool& pool_;
    BinaryTree& tree_;
    uint32_t count_;
    RawVector<Ref> scratch_;
    Ref* buffer_[2];  // where the refs come from and are in the end, and the other one
};

}  // namespace

BinaryTree build_binary(RawVector<Ref>& refs, const LeafRule& rule, uint32_t max_depth, ThreadPool& pool) {
    BinaryTree tree;
    if (!refs.empty()) Builder(refs, rule, max_depth, pool, tree).build();
    return tree;
}

}  // namespace vlp
