// The eye pass (the paper's Listing 3): a path from a pixel gathers from lights and from virtual light points.
#pragma once

#include "camera/projection.h"
#include "integrator/light_density.h"
#include "integrator/virtual_light_points.h"

namespace vlp {

// A light that the walk's ray met at y_0 = z_{t-1}, seen from the walk's last vertex z_{t-2} (strategy s = 0).
VLP_HD inline Contribution hit_light(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye,
                                     Rgb throughput, float pdf_solid_angle, uint32_t light_index, Vec3 position,
                                     Vec3 normal, Vec3 direction) {
    const Light& light = scene.lights[light_index];
    const uint32_t t = eye.t + 1;
    Contribution c{.s = 0, .t = t, .value = throughput * emitted(scene, light, position, normal, -direction)};
    c.weight = 1;
    c.light = light_index;
    c.position = is_infinite(light) ? direction : position;
    c.normal = normal;
    if (is_black(c.value) || t == 2) return c;  // only the eye walk itself sees a light directly

    const SurfacePoint& x_1 = eye.surface;
    const float dist_squared = length_squared(position - x_1.position);
    const float eye_pdf =
        is_infinite(light) ? pdf_solid_angle : pdf_solid_angle * abs_dot(normal, direction) / dist_squared;
    const LightEnd end = light_end(scene, light_index, x_1, position, normal, direction, dist_squared);
    StrategySum sum = strategy_sum(pass, 0);
    if (!eye.last().specular) sum.add(end.pdf_next_event / eye_pdf, strategy_count(pass, 1));
    const float cos_x_1 = abs_dot(x_1.geometric_normal, direction);
    const float ratio = end.pdf_emission / eye_pdf * (end.pdf_next * cos_x_1 / eye.last().pdf_area);
    add_longer_light_walks(sum, pass, eye.vertices, t, 2, ratio, eye.last().rev_ratio);
    c.weight = sum.weight();
    return c;
}

// Next event at z_{t-1}: one of the S samples of a light (strategy s = 1).
VLP_HD inline Contribution sample_light(const SceneView& scene, const PassSettings& pass, const EyeWalk& eye,
                                        const Bsdf& bsdf, uint32_t u_light, Vec2 u) {
    Contribution found{.s = 1, .t = eye.t};
    const DiscreteSample choice = choose_light(scene, u_light);
    const Light& light = scene.lights[choice.index];
    const SurfacePoint& x_1 = eye.surface;
    if (is_on_light(light, x_1)) return found;
    const NextEvent event = sample_next_event(scene, light, x_1.position, u);
    if (!event.valid()) return found;
    found.light = choice.index;
    found.position = is_infinite(light) ? event.direction : event.position;
    found.normal = event.normal;
    const float cos_x_1 = abs_dot(x_1.geometric_normal, event.direction);
    const LobeValue at_x_1 = evaluate(bsdf, eye.w_eye, event.direction);
    if (!(cos_x_1 > 0) || is_black(at_x_1.f)) return found;

    const Anchor from = anchor_of(x_1);
    const Rgb through =
        is_infinite(light)
            ? transmittance(scene, Ray{leave(from, event.direction), event.direction}, from.id, {})
            : transmittance(scene, from, Anchor{event.position, event.normal, event.surface}, event.direction);
    if (is_black(through)) return found;
    const float pdf_next_event = choice.pdf * event.pdf_solid_angle;
    found.value = eye.throughput * at_x_1.f * event.radiance * through * (cos_x_1 / pdf_next_event);

    const uint32_t n = eye.t + 1;
    const float dist_squared = event.distance * event.distance;
    StrategySum sum = strategy_sum(pass, 1);
    if (!event.delta && n <= pass.eye_path_length + 1) {
        sum.add(at_x_1.pdf_light / pdf_next_event, strategy_count(pass, 0));
    }
    if (pass.light_path_length > 0 && eye.t > 2) {
        const LightEnd end =
            light_end(scene, choice.index, x_1, event.position, event.normal, event.direction, dist_squared);
        const float ratio = end.pdf_emission / end.pdf_next_event * (end.pdf_next * cos_x_1 / eye.last().pdf_area);
        add_longer_light_walks(sum, pass, eye.vertices, n, 2, ratio, at_x_1.pdf_eye * eye.last().rev_geometry);
    }
    found.weight = sum.weight();
    return found;
}

// The radiance that one path through pixel (x, y) of the full picture finds, y counted from the bottom. Each strategy's
// share goes to sink.add(Contribution), each vertex of the walk to sink.visit(EyeWalk). Returns the pixel's alpha.
template <typename Sink>
VLP_HD inline float trace_eye_path(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                   uint32_t iteration, uint32_t x, uint32_t y, Sink& sink) {
    const uint32_t seed = hash(pass.seed, k_eye_stream, y * scene.camera.width + x);
    Sampler sampler = make_sampler(seed, iteration);
    const Vec2 center{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
    const Vec2 film = center + sample(pass.filter, pass.filter_width, sampler.next_2d());
    Ray ray = sample_ray(scene.camera, film, sampler.next_2d());

    EyeWalk eye;
    float pdf_solid_angle = 1;  // of the direction that the walk took last
    PrimitiveId skip{};
    Anchor from{};
    float alpha = 1;
    const bool has_vlps = pass.kappa > 0 && cache.stored_count > 0 && pass.vlp_connections > 0;
    // Every step draws from dimensions of its own, so that a path's later draws do not shift with its earlier ones.
    const uint32_t draws_per_step = 4 + 2 * pass.light_samples + pass.vlp_connections;

    for (uint32_t hits = 1; hits <= pass.eye_path_length; ++hits) {
        sampler.dimension = 2 + (hits - 1) * draws_per_step;
        const bool from_camera = eye.t == 1;
        const uint32_t key = hash(seed ^ iteration, k_transparency_stream, hits);
        const auto find_lamps = [&](const Ray& stretch, Rgb through) {
            for_each_lamp_hit(scene, stretch, [&](uint32_t light, float, Vec3 position, Vec3 normal) {
                if (from_camera && !(scene.lights[light].visibility & k_visible_to_camera)) return;
                sink.add(hit_light(scene, pass, eye, eye.throughput * through, pdf_solid_angle, light, position, normal,
                                   ray.direction));
            });
        };
        const Step step = walk(scene, ray, skip, from_camera, key, find_lamps);
        const Rgb throughput = eye.throughput * step.throughput;
        if (!step.found) {
            if (from_camera && pass.transparent_film) return 0;
            for_each_infinite_light(scene, ray.direction, [&](uint32_t light) {
                if (from_camera && !(scene.lights[light].visibility & k_visible_to_camera)) return;
                sink.add(
                    hit_light(scene, pass, eye, throughput, pdf_solid_angle, light, {}, -ray.direction, ray.direction));
            });
            break;
        }
        const SurfacePoint& z = step.surface;
        const uint32_t emitter = light_of_surface(scene, z.instance, z.primitive);
        if (emitter != k_none) {
            const Vec3 normal = face_toward(z.geometric_normal, -ray.direction);
            sink.add(
                hit_light(scene, pass, eye, throughput, pdf_solid_angle, emitter, z.position, normal, ray.direction));
        } else if (!is_black(scene.materials[z.material].emission)) {  // an emitter that only hits can find
            sink.add({.s = 0, .t = eye.t + 1, .value = throughput * scene.materials[z.material].emission, .weight = 1});
        }

        // z becomes the walk's last vertex.
        const VertexDensity& previous = eye.last();
        const float dist_squared = length_squared(z.position - (from_camera ? ray.origin : from.position));
        VertexDensity& vertex = eye.vertices[eye.t];
        vertex.pdf_area = pdf_solid_angle * abs_dot(z.geometric_normal, ray.direction) / dist_squared;
        vertex.rev_geometry =
            from_camera ? 0.0f : abs_dot(from.normal, ray.direction) / (dist_squared * previous.pdf_area);
        vertex.rev_ratio = 0;
        vertex.specular = false;
        if (!(vertex.pdf_area > 0) || !is_finite(vertex.pdf_area) || !is_finite(vertex.rev_geometry)) break;
        ++eye.t;
        eye.throughput = throughput;
        eye.surface = z;
        eye.w_eye = -ray.direction;

        sink.visit(eye);

        const Bsdf bsdf = make_bsdf(scene, z);
        const float u_lobe = sampler.next();
        const Vec2 u_direction = sampler.next_2d();
        const float u_roulette = sampler.next();
        if (scene.materials[z.material].has_finite) {  // Listing 3: sample lights and VLPs
            for (uint32_t i = 0; scene.light_count > 0 && i < pass.light_samples; ++i) {
                const uint32_t u_light = sampler.next_bits();
                Contribution c = sample_light(scene, pass, eye, bsdf, u_light, sampler.next_2d());
                c.value *= 1.0f / static_cast<float>(pass.light_samples);
                sink.add(c);
            }
            for (uint32_t i = 0; has_vlps && i < pass.vlp_connections; ++i) {
                Contribution c = connect_virtual_light_point(scene, pass, cache, eye, bsdf, sampler.next_bits());
                c.value *= 1.0f / static_cast<float>(pass.vlp_connections);
                sink.add(c);
            }
        }
        if (hits == pass.eye_path_length) break;

        const BsdfSample next = sample(bsdf, eye.w_eye, Walk::eye, u_lobe, u_direction);
        if (!next.valid()) break;
        eye.throughput *= next.weight;
        if (pass.roulette) {
            const float survive = min_of(1.0f, max_component(eye.throughput));
            if (u_roulette >= survive) break;
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
    return alpha;
}

// Sums up what a pixel's path finds, leaving out estimates that are not finite.
struct PixelSink {
    Rgb radiance;
    uint32_t dropped = 0;

    VLP_HD void add(const Contribution& c) {
        const Rgb weighted = c.value * c.weight;
        if (is_finite(weighted)) {
            radiance += weighted;
        } else {
            ++dropped;
        }
    }
    VLP_HD void visit(const EyeWalk&) {}
};

}  // namespace vlp
