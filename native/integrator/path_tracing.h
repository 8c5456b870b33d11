// The eye pass (the paper's Listing 3): a path from a pixel gathers from lights and from virtual light points.
#pragma once

#include "camera/projection.h"
#include "integrator/light_hits.h"
#include "integrator/next_event.h"

namespace vlp {

// Roulette spares eye walks that still carry this share of what they began with: a walk that goes on has a light sample
// and a connection at each vertex, worth more than what ending it early saves. Nor does it end them at mirrors and glass,
// where they have brought nothing yet: the light that is seen in them comes seldom, and would weigh more.
inline constexpr float k_spared_throughput = 2.0f / 3.0f;

// The random numbers of a pixel's path: the number of a sequence, and which of it.
struct EyeSample {
    uint32_t sequence = 0;
    uint32_t index = 0;
};

// The radiance that one path through pixel (x, y) of the full picture finds, y counted from the bottom. Each strategy's
// share goes to sink.add(Contribution), each vertex of the walk to sink.visit(EyeWalk). Returns the pixel's alpha.
template <typename Sink>
VLP_HD inline float trace_eye_path(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                   EyeSample numbers, uint32_t x, uint32_t y, Sink& sink) {
    uint32_t seed = hash(pass.seed, k_eye_stream, y * scene.camera.width + x);
    if (numbers.sequence > 0) seed = hash(seed, numbers.sequence);
    Sampler sampler = make_sampler(seed, numbers.index);
    const Vec2 center{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
    const Vec2 film = center + sample(pass.filter, pass.filter_width, scene.filter_tables, sampler.next_2d());
    Ray ray = sample_ray(scene.camera, film, scene.camera.aperture_radius > 0 ? sampler.next_2d() : Vec2{});

    EyeWalk eye;
    eye.vertices[0] = {};
    float pdf_solid_angle = 1;  // of the direction that the walk took last
    PrimitiveId skip{};
    Anchor from{ray.origin - ray.direction * distance_from_lens(scene.camera, ray), {}, {}};
    const bool has_vlps = pass.kappa > 0 && cache.stored_count > 0 && pass.vlp_connections > 0;
    // Every step draws from dimensions of its own, so that a path's later draws do not shift with its earlier ones: two for
    // each light sample and connection, then direction, lobe and roulette.
    const uint32_t next_ray_draws = 2 * (pass.light_samples + pass.vlp_connections),
                   draws_per_step = next_ray_draws + 3;

    for (uint32_t hits = 1; hits <= pass.eye_path_length; ++hits) {
        const uint32_t first_draw = 2 + (hits - 1) * draws_per_step;
        const bool from_camera = eye.t == 1;
        const uint32_t key = hash(seed ^ numbers.index, k_transparency_stream, hits);
        const LightHits<Sink> lights{scene, pass, eye, ray.direction, pdf_solid_angle, sink};
        const Step step = walk(scene, ray, skip, from_camera, key, lights);
        if (!step.found) {
            if (from_camera && pass.transparent_film) return 0;
            lights.on_escape(step.throughput);
            break;
        }

        // z becomes the walk's last vertex.
        const SurfacePoint& z = step.surface;
        const VertexDensity& previous = eye.last();
        const float dist_squared = length_squared(z.position - from.position);
        // Splats alone are weighed against the density of z_1.
        const float per_area = from_camera && pass.splats
                                   ? pixels_per_area(scene.camera, ray.direction, std::sqrt(dist_squared))
                                   : pdf_solid_angle / dist_squared;
        VertexDensity& vertex = eye.vertices[eye.t];
        vertex.pdf_area = per_area * abs_dot(z.geometric_normal, ray.direction);
        vertex.rev_geometry =
            from_camera ? 0.0f : abs_dot(from.normal, ray.direction) / (dist_squared * previous.pdf_area);
        vertex.rev_ratio = 0;
        vertex.specular = false;
        if (!(vertex.pdf_area > 0) || !is_finite(vertex.pdf_area) || !is_finite(vertex.rev_geometry)) break;
        ++eye.t;
        eye.throughput *= step.throughput;
        eye.surface = z;
        eye.w_eye = -ray.direction;
        sink.visit(eye);

        const Bsdf bsdf = make_bsdf(scene, z);
        if (scene.materials[z.material].has_finite) {  // Listing 3: sample lights and VLPs
            const Receiver receiver = has_vlps ? make_receiver(scene, pass, eye) : Receiver{};
            const auto choose_vlp = [&](uint32_t i) {
                sampler.dimension = first_draw + 2 * (pass.light_samples + i);
                const uint32_t u_vlp = sampler.next_bits();
                return choose_virtual_light_point(pass, cache, receiver, u_vlp, sampler.next());
            };
            VlpChoice next_vlp = has_vlps ? choose_vlp(0) : VlpChoice{};
            sampler.dimension = first_draw;
            for (uint32_t i = 0; scene.light_count > 0 && i < pass.light_samples; ++i) {
                const uint32_t u_light = sampler.next_bits();
                Contribution c = sample_light(scene, pass, eye, bsdf, u_light, sampler.next_2d());
                c.value *= 1.0f / static_cast<float>(pass.light_samples);
                sink.add(c);
            }
            for (uint32_t i = 0; has_vlps && i < pass.vlp_connections; ++i) {
                const VlpChoice vlp = next_vlp;
                if (i + 1 < pass.vlp_connections) next_vlp = choose_vlp(i + 1);
                Contribution c = connect_virtual_light_point(scene, pass, cache, eye, bsdf, vlp);
                c.value *= 1.0f / static_cast<float>(pass.vlp_connections);
                sink.add(c);
            }
        }
        if (hits == pass.eye_path_length) break;

        sampler.dimension = first_draw + next_ray_draws;
        const Vec2 u_direction = sampler.next_2d();
        const float u_lobe = bsdf.is_diffuse() ? 0.0f : sampler.next();
        const BsdfSample next = sample(bsdf, eye.w_eye, Walk::eye, u_lobe, u_direction);
        if (!next.valid()) break;
        eye.throughput *= next.weight;
        if (pass.roulette && !next.specular) {
            const float survive = min_of(1.0f, max_component(eye.throughput) / k_spared_throughput);
            sampler.dimension = first_draw + next_ray_draws + 2;
            if (survive < 1 && sampler.next() >= survive) break;
            eye.throughput *= 1.0f / survive;
        }
        if (is_black(eye.throughput)) break;
        eye.last().rev_ratio = next.pdf_rev_solid_angle * eye.last().rev_geometry;
        eye.last().specular = next.specular;
        pdf_solid_angle = next.pdf_solid_angle;
        from = anchor_of(z);
        ray = {leave(from, next.direction), next.direction};
        skip = from.id;
    }
    return 1;
}

// Sums up what a pixel's path finds, leaving out estimates that are not finite.
struct PixelSink {
    const PassSettings& pass;
    Rgb radiance{};
    uint32_t dropped = 0;

    VLP_HD PixelSink(const PassSettings& settings, const SceneView&) : pass(settings) {}

    VLP_HD void add(const Contribution& c) {
        const Rgb weighted = c.value * c.weight;
        if (is_finite(weighted)) {
            radiance += clamped(pass, c.s + c.t, weighted);
        } else {
            ++dropped;
        }
    }
    VLP_HD void visit(const EyeWalk&) {}
};

}  // namespace vlp
