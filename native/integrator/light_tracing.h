// The light pass (the paper's Listing 2): a path from a light leaves virtual light points where it meets surfaces.
#pragma once

#include "bsdf/bsdf.h"
#include "integrator/light_density.h"
#include "integrator/splat.h"

namespace vlp {

// Traces light path `path` of an iteration into slots[0], slots[1], ..., y_1 first, L at most. Each vertex that can be
// connected is joined to the lens too, for sink.add(Splat), as far as sink.wanted(i) and sink.reaches(film). `stream` keeps
// the pilot's paths apart from the render's. Returns how many vertices are in the slots.
template <typename Sink>
VLP_HD inline uint32_t trace_light_path(const SceneView& scene, const PassSettings& pass, Stream stream,
                                        uint32_t iteration, uint32_t path, LightVertex* slots, Sink& sink) {
    uint32_t vertices = 0;
    if (scene.light_count == 0) return 0;

    // The paths of an iteration are one stratified set.
    const uint32_t seed = hash(pass.seed, stream, iteration);
    Sampler sampler = make_sampler(seed, path);
    Sampler lens_sampler = make_sampler(hash(seed, k_lens_stream), path);
    const DiscreteSample choice = choose_source(scene, sampler.next_bits());
    const Light& light = scene.lights[choice.index];
    const Vec2 u_position = sampler.next_2d(), u_direction = sampler.next_2d();
    const Emission emission = sample_emission(scene, light, u_position, u_direction);
    const bool infinite = is_infinite(light);

    Rgb throughput = emission.weight * (1.0f / choice.pdf);
    if (is_black(throughput) || !is_finite(throughput)) return 0;
    const Rgb emitted_throughput = throughput;

    // y_0 as the weights see it. The end of a path at infinity is a direction: its density is per solid angle, and y_1
    // has that of the disc around the scene that the light comes through.
    Vec3 previous_position = emission.position, previous_normal = emission.normal;
    float previous_pdf = choice.pdf * (infinite ? emission.pdf_direction : emission.pdf_position);
    float pdf_solid_angle = emission.pdf_direction;
    Ray ray{emission.position, emission.direction};
    Anchor from{emission.position, emission.normal, {light.instance, light.primitive}};
    if (light.instance != k_none) ray.origin = leave(from, ray.direction);

    for (uint32_t i = 1; i <= pass.light_path_length; ++i) {
        const uint32_t key = hash(seed ^ path, k_transparency_stream, i);
        Way way{ray, from.id};
        SurfacePoint y;
        if (!walk(scene, false, key, NoLights{}, way, y)) break;
        throughput *= way.throughput;
        const Edge edge = edge_between(y.position, previous_position);
        const float cos_here = abs_dot(y.geometric_normal, ray.direction);

        LightVertex& vertex = slots[i - 1];
        vertex.next_event_ratio = 0;
        if (i == 1 && infinite) {
            vertex.pdf_area = emission.pdf_position * cos_here;
            vertex.rev_geometry = is_delta(light) ? 0.0f : 1.0f / previous_pdf;
        } else {
            const bool delta = i == 1 && is_delta(light);
            vertex.pdf_area = pdf_solid_angle * cos_here / edge.dist_squared;
            vertex.rev_geometry =
                delta ? 0.0f : abs_dot(previous_normal, ray.direction) / (edge.dist_squared * previous_pdf);
        }
        if (!(vertex.pdf_area > 0) || !is_finite(vertex.pdf_area) || !is_finite(vertex.rev_geometry)) break;
        if (i == 1) {
            const float next_event =
                pdf_next_event_from(scene, choice.index, y, emission.position, emission.normal, -ray.direction);
            const LightEnd end = light_end(scene, choice.index, y.position, emission.position, emission.normal,
                                           -ray.direction, edge.dist_squared, next_event);
            vertex.next_event_ratio = end.pdf_emission > 0 ? end.pdf_next_event / end.pdf_emission : 0.0f;
        }

        const Material& material = scene.materials[y.material];
        vertex.position = y.position;
        vertex.geometric_normal = encode(y.geometric_normal);
        vertex.shading_normal = encode(y.shading_normal);
        vertex.to_previous = encode(-ray.direction);
        vertex.throughput = throughput;
        vertex.instance = y.instance;
        vertex.primitive = y.primitive;
        vertex.rev_ratio = 0;
        vertex.packed = (i << LightVertex::k_index_shift) | y.material;
        vertices = i;
        if (material.has_finite) {  // Listing 2: save a VLP
            vertex.packed |= LightVertex::k_connectible;
            if (sink.wanted(i)) {
                lens_sampler.dimension = i;
                connect_to_lens(scene, pass, vertex, y, -ray.direction, lens_sampler.next_2d(), sink);
            }
        }
        if (i == pass.light_path_length) break;

        // The next ray of Listing 2, off any kind of surface.
        const Bsdf bsdf = make_bsdf(scene, y);
        sampler.dimension = 3 * i;  // three a step, as at the light: direction, lobe, roulette
        const Vec2 u = sampler.next_2d();
        const float u_lobe = bsdf.is_diffuse() ? 0.0f : sampler.next();
        const BsdfSample next = sample(bsdf, -ray.direction, Walk::light, u_lobe, u);
        if (!next.valid()) break;
        throughput *= next.weight;
        if (pass.roulette) {
            const float survive = min_of(1.0f, max_component(throughput) / max_component(emitted_throughput));
            sampler.dimension = 3 * i + 2;
            if (survive < 1 && sampler.next() >= survive) break;
            throughput *= 1.0f / survive;
        }
        if (is_black(throughput) || !is_finite(throughput)) break;
        vertex.rev_ratio = next.pdf_rev_solid_angle * vertex.rev_geometry;
        if (next.specular) vertex.packed |= LightVertex::k_specular;

        previous_position = y.position;
        previous_normal = y.geometric_normal;
        previous_pdf = vertex.pdf_area;
        pdf_solid_angle = next.pdf_solid_angle;
        from = anchor_of(y);
        ray = {leave(from, next.direction), next.direction};
    }
    return vertices;
}

}  // namespace vlp
