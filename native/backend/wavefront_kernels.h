// What a GPU's threads do in a wavefront of eye paths (Laine, Karras & Aila 2013): the steps of trace_eye_path, a kernel
// each, over many paths that wait between them in memory. So threads that search the tree do nothing else, and those that
// shade do so side by side with others on the same material.
#pragma once

#include "backend/gpu_kernels.h"
#include "backend/memory.h"

namespace vlp {

// What a path is joined to, and the ray that has yet to tell whether they see each other.
struct alignas(16) Connection {
    ShadowRay shadow;
    Rgb value;
    float weight;
    uint8_t s, t;
    bool pending;
};
static_assert(sizeof(Connection) == 64);

// A path under way.
struct alignas(16) PathSlot {
    EyePath path;
    uint32_t connections;  // from its last vertex
    uint32_t sample;  // whose path it is, k_none: of none any more
};

// What a sample of a pixel has found so far.
template <typename Sink>
struct SampleFinds {
    typename Sink::Finds finds;
    float alpha = 1;
};

// What paths in a list do next: they shade a surface of some material, search on behind one that they have passed, or end.
// Many materials share the first kinds.
enum PathKind : uint8_t { k_first_material = 0, k_passing = 62, k_ended = 63, k_gone = 64 };
inline constexpr uint32_t k_path_kinds = k_gone;

// How far the paths of each kind reach in a list that is sorted by kinds.
struct ListEnds {
    uint32_t surfaces = 0, passing = 0, all = 0;
};

// What a device counts, of which the host reads how far it is.
struct WavefrontCounts {
    ListEnds ends[2];
    uint64_t begun = 0;  // samples so far
};

// The samples of an iteration in the order of their pixels. `first`: of each pixel, and their number; null where every pixel
// has one.
struct SampleList {
    const uint32_t* first;
    uint32_t pixels;

    VLP_HD uint32_t count() const { return first ? first[pixels] : pixels; }
    VLP_HD uint32_t first_of(uint32_t pixel) const { return first ? first[pixel] : pixel; }
    VLP_HD uint32_t pixel_of(uint32_t sample) const {
        if (!first) return sample;
        uint32_t low = 0, high = pixels;  // the last pixel whose first sample is not behind it
        while (high - low > 1) {
            const uint32_t middle = (low + high) / 2;
            (first[middle] <= sample ? low : high) = middle;
        }
        return low;
    }
};

// How much of everything a pass over `pixels` takes: as many paths at a time as keep a GPU at work, within bounds.
struct WavefrontSize {
    static constexpr uint32_t k_most_slots = 1u << 18;
    static constexpr size_t k_most_bytes = size_t{1} << 28;
    // Queued at a time. The last rounds are short: a device would be done with one before the host has heard of the other.
    static constexpr uint32_t k_rounds_ahead = 3;

    uint32_t vertices_each, connections_each, slots, pixels;
    size_t samples, finds;  // most in an iteration, and the bytes of what they find

    WavefrontSize(const PassSettings& pass, size_t pixel_count)
        : vertices_each(pass.eye_path_length + 1),
          connections_each(pass.light_samples + (pass.kappa > 0 ? pass.connections_at(2) : 0)),
          pixels(static_cast<uint32_t>(pixel_count)),
          samples(pixel_count * (pass.adaptive ? k_most_samples_a_pixel : 1)),
          finds(samples * (pass.guides ? sizeof(SampleFinds<GuidedSink>) : sizeof(SampleFinds<PixelSink>))) {
        const size_t most = max_of(k_most_bytes / slot_bytes(), size_t{1});
        slots = static_cast<uint32_t>(min_of(min_of(samples, most), size_t{k_most_slots}));
    }

    bool operator==(const WavefrontSize&) const = default;

    size_t slot_bytes() const {
        return sizeof(PathSlot) + vertices_each * sizeof(VertexDensity) + sizeof(Hit) +
               connections_each * sizeof(Connection) + 2 * sizeof(uint32_t) + sizeof(uint8_t);
    }
    // Of two scans: of the samples of pixels, where they differ, and of the kinds of paths.
    size_t first_samples() const { return samples > pixels ? size_t{pixels} + 1 : 0; }
    size_t groups() const { return SortRuns::largest_table(slots, k_path_kinds); }
    size_t scratch_bytes() const { return scan_bytes(max_of(first_samples(), groups())); }

    size_t bytes() const {
        return slots * slot_bytes() + finds + (first_samples() + groups()) * sizeof(uint32_t) + scratch_bytes() +
               sizeof(WavefrontCounts);
    }
    size_t bytes_on_host() const { return k_rounds_ahead * sizeof(WavefrontCounts); }
};

// The memory of the paths. Lists and their ends are two: a round of steps goes through one and sorts it into the other.
struct PathQueue {
    uint32_t vertices_each, connections_each;
    PathSlot* slots;
    VertexDensity* vertices;
    Hit* hits;
    Connection* connections;
    uint32_t* lists[2];
    WavefrontCounts* counts;
    uint8_t* kinds;  // of the paths of the list
    uint32_t* groups;  // the table of the sort
    void* finds;  // SampleFinds, one a sample

    template <typename Sink>
    VLP_HD SampleFinds<Sink>& finds_of(uint32_t sample) const {
        return static_cast<SampleFinds<Sink>*>(finds)[sample];
    }
};

// A round: every path in list `from` takes a step, and is then in the other list.
struct PathRound {
    EyePass eye;
    PathQueue queue;
    SampleList samples;
    uint32_t from;

    // Number `i` of the list that the round begins with or, sorted, of the one that it leaves; null behind its end.
    VLP_HD const ListEnds& ends_before() const { return queue.counts->ends[from]; }
    VLP_HD const ListEnds& ends_sorted() const { return queue.counts->ends[1 - from]; }
    VLP_HD uint32_t slot_before(uint32_t i) const { return queue.lists[from][i]; }
    VLP_HD uint32_t slot_sorted(uint32_t i) const { return queue.lists[1 - from][i]; }

    // Begins sample number `sample`, if there are so many.
    template <typename Sink>
    VLP_HD void begin(uint32_t slot, uint64_t sample) const {
        PathSlot& to = queue.slots[slot];
        to.sample = k_none;
        if (sample >= samples.count()) return;
        to.sample = static_cast<uint32_t>(sample);
        const uint32_t pixel = samples.pixel_of(to.sample);
        const PixelTurn turn = turn_of(eye.rates, pixel);
        const EyeSample numbers{turn.sequence, turn.first_index + (to.sample - samples.first_of(pixel))};
        VertexDensity* const vertices = queue.vertices + size_t{queue.vertices_each} * slot;
        Sampler sampler;
        to.path = begin_eye_path(eye.scene, eye.pass, numbers, eye.x_of(pixel), eye.y_of(pixel), vertices, sampler);
        queue.finds_of<Sink>(to.sample) = {};
    }
};

// Counts the samples of pixels, for sums over them to be taken.
struct CountSamples {
    SampleRates rates;
    uint32_t* first;
    uint32_t pixels;

    VLP_HD void operator()(uint32_t pixel) const { first[pixel] = pixel < pixels ? turn_of(rates, pixel).samples : 0; }
};

// Begins the first samples, one in each of `slots`.
template <typename Sink>
struct BeginPaths {
    PathRound round;
    uint32_t slots;

    VLP_HD void operator()(uint32_t slot) const {
        round.begin<Sink>(slot, slot);
        round.queue.lists[0][slot] = slot;
        if (slot == 0) round.queue.counts->ends[0].all = slots, round.queue.counts->begun = slots;
    }
};

// Searches the tree.
struct FindSurfaces {
    PathRound round;

    VLP_HD void operator()(uint32_t i) const {
        if (i >= round.ends_before().all) return;
        const uint32_t slot = round.slot_before(i);
        const PathSlot& at = round.queue.slots[slot];
        if (at.sample == k_none) return;
        round.queue.hits[slot] = find_closest(round.eye.scene, at.path.way.ray, at.path.way.skip);
    }
};

// Takes paths to what they have found.
template <typename Sink>
struct ArriveAtSurfaces {
    PathRound round;

    VLP_HD void operator()(uint32_t i) const {
        if (i >= round.ends_before().all) return;
        const uint32_t slot = round.slot_before(i);
        PathSlot& at = round.queue.slots[slot];
        round.queue.kinds[i] = k_gone;
        if (at.sample == k_none) return;
        const EyePass& eye = round.eye;
        SampleFinds<Sink>& found = round.queue.finds_of<Sink>(at.sample);
        Sink sink(eye.pass, eye.scene);
        sink.resume(found.finds, at.path.eye);
        const Met met = arrive(eye.scene, eye.pass, at.path, round.queue.hits[slot], sink);
        found = {sink.finds, at.path.alpha};
        round.queue.kinds[i] = met == Met::surface ? static_cast<uint8_t>(at.path.eye.surface.material % k_passing)
                                                   : static_cast<uint8_t>(met == Met::passage ? k_passing : k_ended);
    }
};

// Counts the kinds of run `run`, a column of the table.
struct CountKinds {
    PathRound round;
    SortRuns runs;

    // visit(i, entry) for each of its paths that are not gone, and where the table counts them.
    template <typename Visit>
    VLP_HD void for_paths(uint32_t run, const Visit& visit) const {
        const uint32_t end = min_of((run + 1) * runs.length, round.ends_before().all);
        for (uint32_t i = run * runs.length; i < end; ++i) {
            const uint8_t kind = round.queue.kinds[i];
            if (kind != k_gone) visit(i, round.queue.groups[size_t{runs.count} * kind + run]);
        }
    }
    VLP_HD void operator()(uint32_t run) const {
        for_paths(run, [](uint32_t, uint32_t& count) { ++count; });
    }
};

// Sorts the list by kinds into the other one, once the table has been summed.
struct SortPaths {
    CountKinds counted;

    VLP_HD void operator()(uint32_t run) const {
        const PathRound& round = counted.round;
        if (run == 0) {
            const auto begin_of = [&](uint32_t kind) { return round.queue.groups[size_t{counted.runs.count} * kind]; };
            round.queue.counts->ends[1 - round.from] = {begin_of(k_passing), begin_of(k_ended), begin_of(k_path_kinds)};
        }
        counted.for_paths(run, [&](uint32_t i, uint32_t& place) {
            round.queue.lists[1 - round.from][place++] = round.slot_before(i);
        });
    }
};

// Keeps connections until SeeConnections has looked.
struct JoinLater {
    Connection* next;

    VLP_HD Rgb operator()(const ShadowRay& shadow) {
        next->shadow = shadow;
        next->pending = true;
        return rgb(1);
    }
    VLP_HD void add(const Contribution& c) {
        next->value = c.value, next->weight = c.weight;
        next->s = static_cast<uint8_t>(c.s), next->t = static_cast<uint8_t>(c.t);
        ++next;
    }
};

// Joins paths at surfaces to lights and VLPs.
struct GatherLight {
    PathRound round;

    VLP_HD void operator()(uint32_t i) const {
        if (i >= round.ends_sorted().surfaces) return;
        const uint32_t slot = round.slot_sorted(i);
        const EyePass& eye = round.eye;
        PathSlot& at = round.queue.slots[slot];
        Sampler sampler = make_sampler(at.path.seed, at.path.index);
        Connection* const first = round.queue.connections + size_t{round.queue.connections_each} * slot;
        for (uint32_t c = 0; c < round.queue.connections_each; ++c) first[c].pending = false;
        JoinLater join{first};
        gather(eye.scene, eye.pass, eye.cache(), at.path, sampler, join);
        at.connections = static_cast<uint32_t>(join.next - first);
    }
};

// Sends the shadow rays: the first connections of all `paths`, then the second, ...
struct SeeConnections {
    PathRound round;
    uint32_t paths;

    VLP_HD void operator()(uint32_t ray) const {
        const uint32_t i = ray % paths, which = ray / paths;
        if (i >= round.ends_sorted().surfaces) return;
        const uint32_t slot = round.slot_sorted(i);
        if (which >= round.queue.slots[slot].connections) return;
        Connection& c = round.queue.connections[size_t{round.queue.connections_each} * slot + which];
        if (!c.pending) return;
        const Rgb through = transmittance(round.eye.scene, c.shadow);
        c.value *= through;
        if (is_black(through)) c.value = {}, c.weight = 0;
    }
};

// Adds what was found, and sets paths on their way. Where one ends, the next sample begins.
template <typename Sink>
struct GoOn {
    PathRound round;

    VLP_HD void operator()(uint32_t i) const {
        const ListEnds& ends = round.ends_sorted();
        if (i >= ends.all || (i >= ends.surfaces && i < ends.passing)) return;
        const uint32_t slot = round.slot_sorted(i);
        if (i < ends.surfaces && leave_surface(slot)) return;
        round.begin<Sink>(slot, AtomicAdd{}(round.queue.counts->begun, 1));
    }

private:
    VLP_HD bool leave_surface(uint32_t slot) const {
        const EyePass& eye = round.eye;
        PathSlot& at = round.queue.slots[slot];
        typename Sink::Finds& finds = round.queue.finds_of<Sink>(at.sample).finds;
        Sink sink(eye.pass, eye.scene);
        sink.resume(finds, at.path.eye);
        const Connection* const first = round.queue.connections + size_t{round.queue.connections_each} * slot;
        for (const Connection* c = first; c < first + at.connections; ++c) {
            sink.add({.s = c->s, .t = c->t, .value = c->value, .weight = c->weight});
        }
        finds = sink.finds;
        Sampler sampler = make_sampler(at.path.seed, at.path.index);
        return go_on(eye.scene, eye.pass, at.path, sampler);
    }
};

// Means the samples of a pixel, in the order in which trace_pixel does.
template <typename Sink>
struct MeanSamples {
    PathRound round;

    VLP_HD void operator()(uint32_t pixel) const {
        const PixelTurn turn = turn_of(round.eye.rates, pixel);
        if (turn.samples == 0) return;
        PixelResult mean;
        const float share = 1.0f / static_cast<float>(turn.samples);
        const uint32_t first = round.samples.first_of(pixel);
        for (uint32_t i = 0; i < turn.samples; ++i) {
            const SampleFinds<Sink>& found = round.queue.finds_of<Sink>(first + i);
            add_share(mean, found.finds, found.alpha, share);
        }
        round.eye.keep(pixel, mean);
    }
};

}  // namespace vlp
