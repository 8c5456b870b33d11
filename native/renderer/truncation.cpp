// The pilot, and whether any strategy of the render could have made a path that it found.
#include "renderer/truncation.h"

#include <vector>

#include "integrator/path_tracing.h"

namespace vlp {

namespace {

constexpr uint32_t k_side = 48;     // pixels along each side of the picture, at most
constexpr uint32_t k_samples = 16;  // paths through each

// Whether strategy (k, n - k) of `pass` can make the path x_0 ... x_{n-1} that the pilot found: `eye` holds its vertices
// z_0 = x_{n-1}, z_1 = x_{n-2}, ... and which of them scattered specularly.
bool can_make(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye, const Contribution& found,
              uint32_t k) {
    const uint32_t n = found.s + found.t;
    if (n - k > pass.eye_path_length + 1 || k > pass.light_path_length + 1) return false;
    if ((k + 1 < n ? strategy_count(pass, k, n - k) : splat_count(pass, k)) <= 0) return false;
    const auto specular = [&](uint32_t i) { return i + 1 < n && i > 0 && eye.vertices[n - 1 - i].specular; };
    if (found.light == k_none) return k == 0;  // an emitter that only hits can find
    if (k == 0) return !is_delta(scene.lights[found.light]);
    if (n == 2) return false;
    return k == 1 ? !specular(1) : !specular(k - 1) && !specular(k);
}

struct TruncationSink {
    const SceneView& scene;
    const PassSettings& pass;
    const EyeWalk* eye = nullptr;
    double light = 0, lost = 0;

    void visit(const EyeWalk& walk) { eye = &walk; }
    void add(const Contribution& c) {
        const double here = static_cast<double>(average(c.value * c.weight));
        if (!(here > 0) || !(here < static_cast<double>(k_infinity))) return;
        light += here;
        if (c.s + c.t <= 2) return;
        for (uint32_t k = 0; k < c.s + c.t; ++k) {
            if (can_make(scene, pass, *eye, c, k)) return;
        }
        lost += here;
    }
};

}  // namespace

LostLight measure_lost_light(const SceneView& scene, const PassSettings& pass, ThreadPool& pool) {
    PassSettings pilot = pass;
    pilot.light_path_length = 0, pilot.eye_path_length = k_max_walk;
    pilot.kappa = 0, pilot.splats = false, pilot.hits = true, pilot.light_samples = 1;
    pilot.weighting = Weighting::balance, pilot.roulette = true;
    pilot.seed = hash(k_pilot_stream, 1);

    const Camera& camera = scene.camera;
    const uint32_t columns = min_of(camera.width, k_side), rows = min_of(camera.height, k_side);
    // The share is a ratio of means over pixels; its error is that of lost - share * light (Cochran 1977, 6.4).
    std::vector<TruncationSink> pixels(size_t{columns} * rows, TruncationSink{scene, pass});
    pool.run(rows, [&](uint32_t j) {
        for (uint32_t i = 0; i < columns; ++i) {
            TruncationSink& pixel = pixels[size_t{j} * columns + i];
            const uint32_t x = static_cast<uint32_t>((uint64_t{2} * i + 1) * camera.width / (2 * columns));
            const uint32_t y = static_cast<uint32_t>((uint64_t{2} * j + 1) * camera.height / (2 * rows));
            for (uint32_t s = 0; s < k_samples; ++s) trace_eye_path(scene, pilot, {}, {0, s}, x, y, pixel);
        }
    });
    double light = 0, lost = 0;
    for (const TruncationSink& pixel : pixels) light += pixel.light, lost += pixel.lost;
    if (!(light > 0)) return {};
    const double share = lost / light;
    double squares = 0;
    for (const TruncationSink& pixel : pixels) {
        const double residual = pixel.lost - share * pixel.light;
        squares += residual * residual;
    }
    return {static_cast<float>(share), static_cast<float>(std::sqrt(squares) / light)};
}

}  // namespace vlp
