// What a GPU's threads do, each for one index: functions of plain data, which the host can run as well.
#pragma once

#include "backend/pixel.h"
#include "core/atomic_add.h"
#include "film/film.h"
#include "integrator/light_tracing.h"
#include "integrator/vlp_groups.h"

namespace vlp {

// What the passes count on the device.
struct PassCounts {
    uint64_t dropped = 0;      // estimates that were not finite, since the device was set up
    uint64_t stored_vlps = 0;  // V of the last light pass
};

// Traces light path `path` of a round into its own L slots.
struct LightPass {
    SceneView scene;
    PassSettings pass;
    uint32_t iteration, round;
    Window window;
    LightVertex* slots;
    uint8_t* vertices_in_path;
    ExactSum *splats, *point_splats;
    PassCounts* counts;

    VLP_HD void operator()(uint32_t path) const {
        LightVertex* own = slots + static_cast<size_t>(path) * pass.light_path_length;
        SplatSink<AtomicAdd> sink{pass, window, splats, point_splats, {}};
        const uint32_t vertices =
            trace_light_path(scene, pass, k_light_stream, iteration, round * pass.light_paths + path, own, sink);
        vertices_in_path[path] = static_cast<uint8_t>(vertices);
        if (sink.dropped > 0) AtomicAdd{}(counts->dropped, sink.dropped);
    }
};
static_assert(k_max_walk <= UINT8_MAX);

// A counting sort as in vlp_groups.h, of runs of a list, each by one thread: how many of the list there are in a run, and how
// many runs.
struct SortRuns {
    static constexpr uint32_t k_most = 4096, k_least_length = 32;
    uint32_t length, count;

    explicit SortRuns(uint32_t all)
        : length(max_of(k_least_length, (all + k_most - 1) / k_most)), count((all + length - 1) / length) {}
    // The size of the table: a row for each group, and the number of all at its end.
    size_t table(uint32_t groups) const { return size_t{groups} * count + 1; }
    // Of the largest table for a list of so many or fewer: shorter lists may have more runs.
    static size_t largest_table(uint32_t all, uint32_t groups) {
        return size_t{groups} * min_of(k_most, (all + k_least_length - 1) / k_least_length) + 1;
    }
};

// Counts the groups of the VLPs of run `run`, a column of `groups`.
struct CountStored {
    SceneView scene;
    PassSettings pass;
    SortRuns runs;  // of light paths
    const LightVertex* slots;
    const uint8_t* vertices_in_path;
    uint32_t* groups;

    // visit(begin, end) for the slots of each of its paths.
    template <typename Visit>
    VLP_HD void for_paths(uint32_t run, const Visit& visit) const {
        const uint32_t end = min_of((run + 1) * runs.length, pass.light_paths);
        for (uint32_t path = run * runs.length; path < end; ++path) {
            const uint32_t first = path * pass.light_path_length;
            visit(first, first + vertices_in_path[path]);
        }
    }
    VLP_HD void operator()(uint32_t run) const {
        for_paths(run, [&](uint32_t begin, uint32_t end) {
            count_groups(pass.vlp_grid, slots, begin, end, groups + run, runs.count);
        });
    }
};

// Lists them, once `groups` has been summed. One run tells V.
struct ListStored {
    CountStored counted;
    VlpCandidate* stored;
    PassCounts* counts;

    VLP_HD void operator()(uint32_t run) const {
        const CountStored& of = counted;
        const uint32_t stored_count = of.groups[size_t{k_vlp_groups} * of.runs.count];
        const Hands hands(of.pass.vlp_candidates, stored_count);
        of.for_paths(run, [&](uint32_t begin, uint32_t end) {
            list_groups(of.scene, of.pass, of.slots, begin, end, of.groups + run, of.runs.count, hands, stored);
        });
        if (run > 0) return;
        list_blanks(hands, stored_count, stored);
        counts->stored_vlps = stored_count;
    }
};

// Traces the eye paths of pixel number `pixel` of the window. Without light vertices `slots` is null.
struct EyePass {
    SceneView scene;
    PassSettings pass;
    SampleRates rates;
    Window window;
    LightVertex* slots;
    const VlpCandidate* stored;
    PixelSample* frame;
    GuideSample* guides;  // null without GuidedSink
    PassCounts* counts;

    VLP_HD uint32_t x_of(uint32_t pixel) const { return window.x + pixel % window.width; }
    VLP_HD uint32_t y_of(uint32_t pixel) const { return window.y + pixel / window.width; }
    VLP_HD LightVertexCache cache() const {
        const uint32_t stored_count = slots ? static_cast<uint32_t>(counts->stored_vlps) : 0;
        return {slots, stored, Hands(pass.vlp_candidates, stored_count).count};
    }
    VLP_HD void keep(uint32_t pixel, const PixelResult& result) const {
        if (result.dropped > 0) AtomicAdd{}(counts->dropped, result.dropped);
        frame[pixel] = result.found;
        if (guides) guides[pixel] = result.guide;
    }
    template <typename Sink>
    VLP_HD void trace(uint32_t pixel) const {
        const PixelTurn turn = turn_of(rates, pixel);
        if (turn.samples > 0) keep(pixel, trace_pixel<Sink>(scene, pass, cache(), turn, x_of(pixel), y_of(pixel)));
    }
    VLP_HD void operator()(uint32_t pixel) const { trace<PixelSink>(pixel); }
};

// The same with a denoiser's guides: a kernel of its own, so that the eye pass has no code for them.
struct GuidedEyePass {
    EyePass eye;

    VLP_HD void operator()(uint32_t pixel) const { eye.trace<GuidedSink>(pixel); }
};

// Adds what an iteration took to the moments of a pixel.
struct AddMoments {
    SampleRates rates;
    const PixelSample* frame;
    PixelMoments* moments;

    VLP_HD void operator()(uint32_t pixel) const {
        const PixelTurn turn = turn_of(rates, pixel);
        if (turn.samples > 0) moments[pixel].add(frame[pixel], turn.samples);
    }
};

// What the plan of a block is made of.
struct TellVariance {
    const PixelMoments* moments;
    float* relative_variance;

    VLP_HD void operator()(uint32_t pixel) const { relative_variance[pixel] = moments[pixel].relative_variance(); }
};

// Adds an iteration to the sums, one channel of a pixel at a time, as Film::commit_rows does, and clears its splats. `anew`:
// the sums hold nothing yet.
struct Commit {
    const PixelSample* frame;
    const GuideSample* guides;        // may be null
    ExactSum *splats, *point_splats;  // may be null
    ExactSum* sums;
    uint32_t channels;
    bool anew;

    VLP_HD void operator()(uint32_t i) const {
        const uint32_t pixel = i / channels, channel = i % channels;
        ExactSum sum = anew ? ExactSum{} : sums[i];
        if (channel < 4) {
            sum.add(frame[pixel].rgba[channel]);
            if (channel < 3) move_to(sum, splats, pixel, channel);
        } else if (channel < 7) {
            sum.add(frame[pixel].rgba[channel - 4]);
            move_to(sum, point_splats, pixel, channel - 4);
        } else if (channel < 10) {
            sum.add(guides[pixel].albedo[channel - 7]);
        } else {
            sum.add(max_of(guides[pixel].normal[channel - 10] + 1, 0.0f));
        }
        sums[i] = sum;
    }
    VLP_HD static void move_to(ExactSum& sum, ExactSum* of_pixels, uint32_t pixel, uint32_t channel) {
        if (!of_pixels) return;
        ExactSum& splat = of_pixels[size_t{3} * pixel + channel];
        sum.add(splat);
        splat = {};
    }
};

}  // namespace vlp
