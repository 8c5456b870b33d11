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

// An eye walk under way, and all that its next step needs.
struct EyePath {
    EyeWalk eye;  // at t = 1 its surface is a point of the lens, which has no normal
    Way way;      // to the next vertex
    float pdf_solid_angle = 1;  // of the direction of the way
    uint32_t seed = 0, index = 0;  // of its random numbers
    float alpha = 1;               // of the pixel
};

// The numbers of every step come from dimensions of their own, so that a path's later draws do not shift with its earlier
// ones: one for all connections and two for each light sample, then direction, lobe and roulette.
struct StepDraws {
    uint32_t connections, lights, direction;

    VLP_HD StepDraws(const PassSettings& pass, uint32_t hits) {
        const uint32_t gathered = min_of(pass.vlp_connections, 1u) + 2 * pass.light_samples;
        connections = 2 + (hits - 1) * (gathered + 3);
        lights = connections + gathered - 2 * pass.light_samples;
        direction = connections + gathered;
    }
};

VLP_HD inline bool connects(const PassSettings& pass, const LightVertexCache& cache) {
    return pass.kappa > 0 && cache.hand_count > 0 && pass.vlp_connections > 0;
}

// Member by member: processors are slow to load at once what was stored in parts.
VLP_HD VLP_FORCE_INLINE void set_out(Way& way, Vec3 origin, Vec3 direction, float t_max, PrimitiveId skip) {
    way.ray.origin = origin;
    way.ray.direction = direction;
    way.ray.t_max = t_max;
    way.skip = skip;
    way.passed = 0;
    way.throughput = rgb(1);
}

// Begins a path through pixel (x, y) of the full picture, y counted from the bottom. `vertices`: room for K + 1.
VLP_HD VLP_FORCE_INLINE EyePath begin_eye_path(const SceneView& scene, const PassSettings& pass, EyeSample numbers,
                                               uint32_t x, uint32_t y, VertexDensity* vertices, Sampler& sampler) {
    uint32_t seed = hash(pass.seed, k_eye_stream, y * scene.camera.width + x);
    if (numbers.sequence > 0) seed = hash(seed, numbers.sequence);
    sampler = make_sampler(seed, numbers.index);
    const Vec2 center{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
    const Vec2 film = center + sample(pass.filter, pass.filter_width, scene.filter_tables, sampler.next_2d());
    const Vec2 u_lens = scene.camera.aperture_radius > 0 ? sampler.next_2d() : Vec2{};
    const Ray ray = sample_ray(scene.camera, film, u_lens);

    vertices[0] = {};
    EyePath path;
    path.eye.vertices = vertices;
    set_out(path.way, ray.origin, ray.direction, ray.t_max, {});
    path.seed = seed, path.index = numbers.index;
    SurfacePoint& lens = path.eye.surface;
    lens.position = ray.origin - ray.direction * distance_from_lens(scene.camera, ray);
    lens.geometric_normal = {};
    lens.instance = lens.primitive = k_none;
    return path;
}

// Takes a path to what find_closest found along its way: the walk's next vertex, a surface that it passes through, or
// nothing more, where it ends. What shines on the way goes to the sink.
template <typename Sink>
VLP_HD VLP_FORCE_INLINE Met arrive(const SceneView& scene, const PassSettings& pass, EyePath& path, const Hit& hit,
                                   Sink& sink) {
    EyeWalk& eye = path.eye;
    const bool from_camera = eye.t == 1;
    const Vec3 direction = path.way.ray.direction;
    const uint32_t key = hash(path.seed ^ path.index, k_transparency_stream, eye.t);
    const LightHits<Sink> lights{scene, pass, eye, direction, path.pdf_solid_angle, sink};
    SurfacePoint z;
    const Met met = meet(scene, hit, from_camera, key, lights, path.way, z);
    if (met == Met::passage) return met;
    if (met == Met::nothing) {
        path.alpha = from_camera && pass.transparent_film ? 0.0f : 1.0f;
        if (path.alpha > 0) lights.on_escape(path.way.throughput);
        return met;
    }

    // z becomes the walk's last vertex.
    const SurfacePoint& from = eye.surface;
    const VertexDensity& previous = eye.last();
    const float dist_squared = length_squared(z.position - from.position);
    // Splats alone are weighed against the density of z_1.
    const float per_area = from_camera && pass.splats
                               ? pixels_per_area(scene.camera, direction, std::sqrt(dist_squared))
                               : path.pdf_solid_angle / dist_squared;
    VertexDensity& vertex = eye.vertices[eye.t];
    vertex.pdf_area = per_area * abs_dot(z.geometric_normal, direction);
    vertex.rev_geometry =
        from_camera ? 0.0f : abs_dot(from.geometric_normal, direction) / (dist_squared * previous.pdf_area);
    vertex.rev_ratio = 0;
    vertex.specular = false;
    if (!(vertex.pdf_area > 0) || !is_finite(vertex.pdf_area) || !is_finite(vertex.rev_geometry)) return Met::nothing;
    ++eye.t;
    eye.throughput *= path.way.throughput;
    eye.surface = z;
    eye.w_eye = -direction;
    sink.visit(eye);
    return met;
}

// Joins the last vertex to lights and VLPs. `join(ShadowRay)` tells what gets through, and `join.add(Contribution)` takes
// what was found, black or not: of S light samples, then of the connections where there are VLPs.
template <typename Join>
VLP_HD VLP_FORCE_INLINE void gather(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                    const EyePath& path, Sampler& sampler, Join& join) {
    const EyeWalk& eye = path.eye;
    if (!scene.materials[eye.surface.material].has_finite) return;
    const Bsdf bsdf = make_bsdf(scene, eye.surface);
    const bool has_vlps = connects(pass, cache);
    const StepDraws draws(pass, eye.t - 1);
    const Receiver receiver = has_vlps ? make_receiver(scene, pass, eye) : Receiver{};
    const uint32_t connections = has_vlps ? pass.connections_at(eye.t) : 0;
    sampler.dimension = draws.connections;
    const SamplePair u = has_vlps ? sampler.next_pair() : SamplePair{};
    const auto choose = [&](uint32_t i) {
        const VlpChoice choice =
            choose_virtual_light_point(pass, cache, receiver, draw_of_connection(u, i, connections));
        prefetch_virtual_light_point(cache, choice);
        return choice;
    };
    VlpChoice next = has_vlps ? choose(0) : VlpChoice{};
    sampler.dimension = draws.lights;
    for (uint32_t i = 0; scene.light_count > 0 && i < pass.light_samples; ++i) {
        const uint32_t u_light = sampler.next_bits();
        join.add(sample_light(scene, pass, eye, bsdf, u_light, sampler.next_2d(), join));
    }
    for (uint32_t i = 0; i < connections; ++i) {
        const VlpChoice vlp = next;
        if (i + 1 < connections) next = choose(i + 1);
        Contribution found = connect_virtual_light_point(scene, pass, cache, eye, bsdf, vlp, join);
        found.number = i;
        join.add(found);
    }
}

// Sets a path on its way from the last vertex, or ends it: whether it goes on.
VLP_HD VLP_FORCE_INLINE bool go_on(const SceneView& scene, const PassSettings& pass, EyePath& path, Sampler& sampler) {
    EyeWalk& eye = path.eye;
    const uint32_t hits = eye.t - 1;
    if (hits == pass.eye_path_length) return false;

    const Bsdf bsdf = make_bsdf(scene, eye.surface);
    sampler.dimension = StepDraws(pass, hits).direction;
    const Vec2 u_direction = sampler.next_2d();
    const float u_lobe = bsdf.is_diffuse() ? 0.0f : sampler.next();
    const BsdfSample next = sample(bsdf, eye.w_eye, Walk::eye, u_lobe, u_direction);
    if (!next.valid()) return false;
    eye.throughput *= next.weight;
    if (pass.roulette && !next.specular) {
        const float survive = min_of(1.0f, max_component(eye.throughput) / k_spared_throughput);
        sampler.dimension = StepDraws(pass, hits).direction + 2;
        if (survive < 1 && sampler.next() >= survive) return false;
        eye.throughput *= 1.0f / survive;
    }
    if (is_black(eye.throughput)) return false;
    eye.last().rev_ratio = next.pdf_rev_solid_angle * eye.last().rev_geometry;
    eye.last().specular = next.specular;
    path.pdf_solid_angle = next.pdf_solid_angle;
    const Anchor from = anchor_of(eye.surface);
    set_out(path.way, leave(from, next.direction), next.direction, k_infinity, from.id);
    return true;
}

// Looks at once whether the ends of connections see each other.
template <typename Sink>
struct JoinNow {
    using Sum = typename SumFor<Sink>::Type;

    const SceneView& scene;
    Sink& sink;

    VLP_HD Rgb operator()(const ShadowRay& shadow) const { return transmittance(scene, shadow); }
    VLP_HD void add(const Contribution& c) const { sink.add(c); }
};

// The radiance that one path through pixel (x, y) finds. Each strategy's share goes to sink.add(Contribution), each vertex
// of the walk to sink.visit(EyeWalk). Returns the pixel's alpha.
template <typename Sink>
VLP_HD inline float trace_eye_path(const SceneView& scene, const PassSettings& pass, const LightVertexCache& cache,
                                   EyeSample numbers, uint32_t x, uint32_t y, Sink& sink) {
    VertexDensity vertices[k_max_walk + 1];
    Sampler sampler;
    EyePath path = begin_eye_path(scene, pass, numbers, x, y, vertices, sampler);
    JoinNow<Sink> join{scene, sink};
    for (;;) {
        if (connects(pass, cache)) {  // they take as long to come as the next surface
            sampler.dimension = StepDraws(pass, path.eye.t).connections;
            prefetch_candidates(pass, cache, sampler.next_pair(), pass.connections_at(path.eye.t + 1));
        }
        const Met met = arrive(scene, pass, path, find_closest(scene, path.way.ray, path.way.skip), sink);
        if (met == Met::nothing) break;
        if (met == Met::passage) continue;
        gather(scene, pass, cache, path, sampler, join);
        if (!go_on(scene, pass, path, sampler)) break;
    }
    return path.alpha;
}

// Sums up what a pixel's path finds, leaving out estimates that are not finite.
struct PathFinds {
    Rgb radiance{};
    uint32_t dropped = 0;

    VLP_HD void add(const PassSettings& pass, const Contribution& c) {
        const Rgb weighted = c.value * c.weight;
        if (is_finite(weighted)) {
            radiance += clamped(pass, c.s + c.t, weighted);
        } else {
            ++dropped;
        }
    }
};

// Keeps to that.
struct PixelSink {
    using Finds = PathFinds;

    const PassSettings& pass;
    Finds finds{};

    VLP_HD PixelSink(const PassSettings& settings, const SceneView&) : pass(settings) {}
    // Goes on with what a path had found, where `eye` stands.
    VLP_HD void resume(const Finds& before, const EyeWalk&) { finds = before; }

    VLP_HD void add(const Contribution& c) { finds.add(pass, c); }
    VLP_HD void visit(const EyeWalk&) {}
};

}  // namespace vlp
