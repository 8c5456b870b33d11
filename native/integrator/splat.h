// Joining a light path's vertex to the lens: strategies with t = 1, whose light falls on any pixel of the film.
//
// A vertex y_{s-1} of throughput beta adds beta f |cos| pixels_per_area h(film - pixel centre) / (R N) to every pixel whose
// filter h it meets (see camera/projection.h). R N light paths serve the whole film, whatever part of it is rendered.
#pragma once

#include "camera/projection.h"
#include "core/bits.h"
#include "film/exact_sum.h"
#include "film/window.h"
#include "integrator/trace.h"
#include "integrator/virtual_light_points.h"

namespace vlp {

struct Splat {
    Contribution found;  // `value` for h = 1 / pixel^2
    Vec2 film;  // pixels
};

// Joins y = y_{s-1}, whose surface is `point`, to the lens as far as the sink reaches there.
template <typename Sink>
VLP_HD inline void connect_to_lens(const SceneView& scene, const PassSettings& pass, const LightVertex& y,
                                   const SurfacePoint& point, Vec3 to_previous, Vec2 u_lens, Sink& sink) {
    if (!(scene.instances[point.instance].visibility & k_visible_to_camera)) return;
    const Camera& camera = scene.camera;
    const FilmProjection seen = project(camera, sample_lens(camera, u_lens), point.position);
    if (!seen.valid || !sink.reaches(seen.film)) return;
    const Vec3 to_lens = -seen.direction;
    const LobeValue at_y = evaluate(make_bsdf(scene, point), to_lens, to_previous);
    if (is_black(at_y.f)) return;

    // The eye walk begins at the near clip plane.
    const float to_clip = camera.clip_start / cosine_to_view(camera, seen.direction);
    const Anchor near_end{seen.lens + seen.direction * to_clip, {}, {}};
    const Rgb through = transmittance(scene, shadow_ray(anchor_of(point), near_end, to_lens), true);
    if (is_black(through)) return;

    // The density of an eye walk making z_1 here, over one pixel.
    const float eye_pdf = seen.pixels_per_area * abs_dot(point.geometric_normal, seen.direction);
    const uint32_t s = y.index() + 1;
    Splat splat{{.s = s, .t = 1, .vlp = &y}, seen.film};
    splat.found.value = y.throughput * at_y.f * through * (eye_pdf / static_cast<float>(pass.splat_paths()));
    auto sum = strategy_sum<typename SumFor<Sink>::Type>(pass, splat_count(pass, s), 1);
    add_shorter_light_walks(sum, pass, &y, s, s + 1, eye_pdf / y.pdf_area, at_y.pdf_light * y.rev_geometry);
    splat.found.weight = sum.weight();
    splat.found.shares = sum.shares();
    sink.add(splat);
}

// Light paths that are not joined to the lens.
struct NoSplats {
    VLP_HD bool wanted(uint32_t) const { return false; }
    VLP_HD bool reaches(Vec2) const { return false; }
    VLP_HD void add(const Splat&) {}
};

// The pixels of a window whose filters meet a splat: calls visit(x, y, h), x and y in the full picture.
template <typename Visit>
VLP_HD inline void for_each_pixel(const PassSettings& pass, Window window, Vec2 film, const Visit& visit) {
    const float radius = filter_radius(pass.filter, pass.filter_width);
    // The first pixel whose centre is not below `edge`, so that a box of one pixel holds one centre.
    const auto first = [](float edge, uint32_t low, uint32_t size) {
        return static_cast<uint32_t>(
            clamp(std::ceil(edge - 0.5f), static_cast<float>(low), static_cast<float>(low + size)));
    };
    const auto h = [&](float at, uint32_t pixel) {
        return eval_1d(pass.filter, pass.filter_width, at - (static_cast<float>(pixel) + 0.5f));
    };
    const uint32_t x_begin = first(film.x - radius, window.x, window.width);
    const uint32_t x_end = first(film.x + radius, window.x, window.width);
    const uint32_t y_end = first(film.y + radius, window.y, window.height);
    for (uint32_t y = first(film.y - radius, window.y, window.height); y < y_end; ++y) {
        const float h_y = h(film.y, y);
        for (uint32_t x = x_begin; x < x_end; ++x) visit(x, y, h(film.x, x) * h_y);
    }
}

// Adds splats to the exact sums of a window's pixels, 3 each, leaving out those that are not finite. `points`, where there
// are, get each splat a second time, whole in one pixel that is drawn by the filter: noise that neighbours share looks like
// texture to a denoiser.
template <typename FetchAdd>
struct SplatSink {
    const PassSettings& pass;
    Window window;
    ExactSum* sums;
    ExactSum* points;
    FetchAdd fetch_add;  // see add_shared
    uint32_t dropped = 0;

    // Whether y_i is to be joined to the lens.
    VLP_HD bool wanted(uint32_t i) const { return splats_from(pass, i); }
    VLP_HD bool reaches(Vec2 film) const {
        const float radius = filter_radius(pass.filter, pass.filter_width);
        const Vec2 low{static_cast<float>(window.x), static_cast<float>(window.y)};
        const Vec2 high = low + Vec2{static_cast<float>(window.width), static_cast<float>(window.height)};
        return film.x > low.x - radius && film.x < high.x + radius && film.y > low.y - radius &&
               film.y < high.y + radius;
    }
    VLP_HD void add(const Splat& splat) {
        const Rgb weighted = splat.found.value * splat.found.weight;
        if (!is_finite(weighted)) {
            ++dropped;
            return;
        }
        // An iteration has at most R N L splats, which together must not overflow.
        const float most =
            0x1p62f / (static_cast<float>(pass.splat_paths()) * static_cast<float>(pass.light_path_length));
        float total = 0;
        for_each_pixel(pass, window, splat.film, [&](uint32_t x, uint32_t y, float h) {
            add_to(sums, x, y, clamped(pass, splat.found.s + 1, weighted * h), most);
            total += h;
        });
        if (points == nullptr || !(total > 0)) return;
        const uint32_t random = hash(bits_of(splat.film.x), bits_of(splat.film.y), bits_of(weighted.r));
        float left = total * unit_float(random);
        bool drawn = false;
        for_each_pixel(pass, window, splat.film, [&](uint32_t x, uint32_t y, float h) {
            left -= h;
            if (drawn || left >= 0) return;
            drawn = true;
            add_to(points, x, y, clamped(pass, splat.found.s + 1, weighted * h) * (total / h), most);
        });
    }

private:
    VLP_HD void add_to(ExactSum* images, uint32_t x, uint32_t y, Rgb light, float most) {
        ExactSum* pixel = images + 3 * (static_cast<size_t>(y - window.y) * window.width + (x - window.x));
        const float rgb[3] = {light.r, light.g, light.b};
        for (int c = 0; c < 3; ++c) {
            if (rgb[c] > 0) add_shared(pixel[c], exact(rgb[c], most), fetch_add);
        }
    }
};

}  // namespace vlp
