// What a GPU's threads do, each for one index: functions of plain data, which the host can run as well.
#pragma once

#include "backend/pixel.h"
#include "core/atomic_add.h"
#include "film/film.h"
#include "integrator/light_tracing.h"

namespace vlp {

// What the passes count on the device.
struct PassCounts {
    uint64_t dropped = 0;      // estimates that were not finite, since the device was set up
    uint64_t stored_vlps = 0;  // V of the last light pass
};

// Traces light path `path` into its own L slots.
struct LightPass {
    SceneView scene;
    PassSettings pass;
    uint32_t iteration;
    Window window;
    LightVertex* slots;
    uint32_t* stored_in_path;
    uint8_t* vertices_in_path;
    ExactSum *splats, *point_splats;
    PassCounts* counts;

    VLP_HD void operator()(uint32_t path) const {
        LightVertex* own = slots + static_cast<size_t>(path) * pass.light_path_length;
        SplatSink<AtomicAdd> sink{pass, window, splats, point_splats, {}};
        const LightPathCounts found = trace_light_path(scene, pass, k_light_stream, iteration, path, own, sink);
        vertices_in_path[path] = static_cast<uint8_t>(found.vertices);
        stored_in_path[path] = found.connectible;
        if (sink.dropped > 0) AtomicAdd{}(counts->dropped, sink.dropped);
    }
};
static_assert(k_max_walk <= UINT8_MAX);

// Lists the slots of a light path that can be connected, behind those of the paths before it: `end_of_path` is the inclusive
// scan of stored_in_path. The last path tells V.
struct ListStored {
    PassSettings pass;
    const LightVertex* slots;
    const uint32_t* end_of_path;
    const uint8_t* vertices_in_path;
    uint32_t* stored;
    PassCounts* counts;

    VLP_HD void operator()(uint32_t path) const {
        uint32_t next = path == 0 ? 0 : end_of_path[path - 1];
        const uint32_t first = path * pass.light_path_length;
        for (uint32_t slot = first; slot < first + vertices_in_path[path]; ++slot) {
            if (slots[slot].connectible()) stored[next++] = slot;
        }
        if (path + 1 == pass.light_paths) counts->stored_vlps = end_of_path[path];
    }
};

// Traces the eye paths of pixel number `pixel` of the window. Without light vertices `slots` is null.
struct EyePass {
    SceneView scene;
    PassSettings pass;
    SampleRates rates;
    Window window;
    LightVertex* slots;
    const uint32_t* stored;
    PixelSample* frame;
    GuideSample* guides;  // null without GuidedSink
    PassCounts* counts;

    template <typename Sink>
    VLP_HD void trace(uint32_t pixel) const {
        const PixelTurn turn = turn_of(rates, pixel);
        if (turn.samples == 0) return;
        const uint32_t x = window.x + pixel % window.width, y = window.y + pixel / window.width;
        const LightVertexCache cache{slots, stored, slots ? static_cast<uint32_t>(counts->stored_vlps) : 0};
        const PixelResult result = trace_pixel<Sink>(scene, pass, cache, turn, x, y);
        if (result.dropped > 0) AtomicAdd{}(counts->dropped, result.dropped);
        frame[pixel] = result.found;
        if (guides) guides[pixel] = result.guide;
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
