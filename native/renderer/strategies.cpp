// What each strategy finds, image by image.
#include "renderer/strategies.h"

#include <stdexcept>

#include "backend/memory.h"
#include "integrator/light_tracing.h"
#include "integrator/path_tracing.h"
#include "renderer/pilot.h"
#include "renderer/vlp_list.h"
#include "scene/scene.h"

namespace vlp {

// Of one pixel's eye path.
struct StrategyRenderer::EyeSink {
    StrategyRenderer& images;
    size_t pixel;

    void add(const Contribution& c) { images.add(c.s, c.t, pixel, c.value, c.weight); }
    void visit(const EyeWalk&) {}
};

// Of light paths, one at a time.
struct StrategyRenderer::LightSink {
    StrategyRenderer& images;

    bool wanted(uint32_t i) const { return splats_from(images.pass_, i); }
    bool reaches(Vec2) const { return true; }
    void add(const Splat& splat) {
        const Window& window = images.window_;
        for_each_pixel(images.pass_, window, splat.film, [&](uint32_t x, uint32_t y, float h) {
            const size_t pixel = static_cast<size_t>(y - window.y) * window.width + (x - window.x);
            images.add(splat.found.s, splat.found.t, pixel, splat.found.value * h, splat.found.weight);
        });
    }
};

namespace {

// Each of them as often in every pixel, whether it pays or not.
PassSettings for_all_strategies(const SceneView& scene, PassSettings pass) {
    pass.adaptive = false;
    return for_scene(scene, pass);
}

}  // namespace

StrategyRenderer::StrategyRenderer(std::shared_ptr<const Scene> scene, const PassSettings& pass, unsigned threads)
    : scene_(std::move(scene)),
      pass_(for_all_strategies(scene_->view(), pass)),
      window_(scene_->window()),
      pool_(threads) {
    if (pass_.traces_light()) slots_.resize(light_vertex_capacity(pass_));
    sums_.resize(image(most_light_vertices() + 1, 0, false));
}

void StrategyRenderer::iterate(uint32_t iteration) {
    const SceneView scene = guided(scene_->view(), pass_);
    LightSink splats{*this};
    uint32_t end = 0;
    for (uint32_t path = 0; path < pass_.light_paths && pass_.traces_light(); ++path) {
        end += trace_light_path(scene, pass_, k_light_stream, iteration, path, &slots_[end], splats);
    }
    const LightVertexCache cache = list_vlps(scene, pass_, slots_.data(), end, stored_);
    pool_.run(window_.height, [&](uint32_t y) {
        for (uint32_t x = 0; x < window_.width; ++x) {
            EyeSink found{*this, static_cast<size_t>(y) * window_.width + x};
            trace_eye_path(scene, pass_, cache, {0, iteration}, window_.x + x, window_.y + y, found);
        }
    });
    ++iterations_;
}

void StrategyRenderer::add(uint32_t s, uint32_t t, size_t pixel, Rgb value, float weight) {
    if (!is_finite(value * weight)) return;
    float* raw = &sums_[image(s, t, false) + 3 * pixel];
    float* weighted = &sums_[image(s, t, true) + 3 * pixel];
    const float rgb[3] = {value.r, value.g, value.b};
    for (int c = 0; c < 3; ++c) {
        raw[c] += rgb[c];
        weighted[c] += rgb[c] * weight;
    }
}

size_t StrategyRenderer::image(uint32_t s, uint32_t t, bool weighted) const {
    const size_t strategy = static_cast<size_t>(s) * (most_eye_vertices() + 1) + t;
    return (2 * strategy + (weighted ? 1 : 0)) * 3 * window_.pixel_count();
}

void StrategyRenderer::read(uint32_t s, uint32_t t, bool weighted, std::span<float> rgb) const {
    if (s > most_light_vertices() || t > most_eye_vertices() || rgb.size() != 3 * window_.pixel_count()) {
        throw std::invalid_argument("no strategy or picture of that size");
    }
    const float scale = iterations_ > 0 ? 1.0f / static_cast<float>(iterations_) : 0.0f;
    const size_t first = image(s, t, weighted);
    for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = sums_[first + i] * scale;
}

}  // namespace vlp
