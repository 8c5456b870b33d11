// A debug render that keeps apart what each strategy (s, t) finds, alone and with its weight (host only).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "film/window.h"
#include "integrator/pass.h"

namespace vlp {

class Scene;

// The iterations of a Renderer with the same settings, on the CPU. The weighted images add up to its picture.
class StrategyRenderer {
public:
    StrategyRenderer(std::shared_ptr<const Scene> scene, const PassSettings& pass, unsigned threads);

    void iterate(uint32_t iteration);
    // The mean of what strategy (s, t) found, 3 numbers a pixel of the window, rows from the bottom.
    void read(uint32_t s, uint32_t t, bool weighted, std::span<float> rgb) const;

    const Window& window() const { return window_; }
    uint32_t most_light_vertices() const { return pass_.light_path_length + 1; }
    uint32_t most_eye_vertices() const { return pass_.eye_path_length + 1; }

private:
    struct EyeSink;
    struct LightSink;
    void add(uint32_t s, uint32_t t, size_t pixel, Rgb value, float weight);
    size_t image(uint32_t s, uint32_t t, bool weighted) const;  // where its numbers begin

    std::shared_ptr<const Scene> scene_;
    PassSettings pass_;
    Window window_;
    ThreadPool pool_;
    std::vector<LightVertex> slots_;
    std::vector<VlpCandidate> stored_;
    std::vector<float> sums_;
    uint32_t iterations_ = 0;
};

}  // namespace vlp
