// Python's Scene: datablocks go in as numpy arrays; rays can be asked of it for tests.
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>

#include <stdexcept>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bvh/traverse.h"
#include "camera/camera_build.h"
#include "geometry/surface.h"
#include "light/light_build.h"
#include "scene/material_build.h"
#include "scene/scene.h"

namespace vlp {
namespace {

using Floats = Array<const float, -1>;
using Triples = Array<const float, -1, 3>;  // points, directions, colours
using CornerNormals = Array<const float, -1, 3, 3>;
using CornerUvs = Array<const float, -1, 3, 2>;
using Ints = Array<const int32_t, -1>;
using IntTriples = Array<const int32_t, -1, 3>;

bool add_lamp(Scene& scene, const std::optional<Light>& light, uint32_t visibility) {
    if (light) scene.add_lamp(*light, visibility);
    return light.has_value();
}

void require_built(const Scene& scene) {
    if (!scene.built()) throw std::runtime_error("scene: build() has not been called");
}

void require_length(size_t length, size_t expected, const char* what) {
    if (length == expected) return;
    throw std::invalid_argument(std::string(what) + ": has " + std::to_string(length) + " elements, must have " +
                                std::to_string(expected));
}

LobeKind lobe_kind_of(int32_t kind) {
    if (kind >= 0 && kind <= static_cast<int32_t>(LobeKind::transparent)) return static_cast<LobeKind>(kind);
    throw std::invalid_argument("material: unknown kind of lobe " + std::to_string(kind));
}

Fresnel fresnel_of(int32_t term) {
    if (term >= 0 && term <= static_cast<int32_t>(Fresnel::tinted_dielectric)) return static_cast<Fresnel>(term);
    throw std::invalid_argument("material: unknown Fresnel term " + std::to_string(term));
}

Projection projection_of(int projection) {
    if (projection == 0 || projection == 1) return static_cast<Projection>(projection);
    throw std::invalid_argument("camera: unknown projection " + std::to_string(projection));
}

template <typename T>
nb::ndarray<nb::numpy, T, nb::ndim<1>> to_numpy(std::vector<T> values) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owned->data(), {owned->size()}, owner);
}

// (n, 3) float32.
nb::ndarray<nb::numpy, float, nb::ndim<2>> to_numpy(const std::vector<Vec3>& values) {
    auto* owned = new std::vector<Vec3>(values);
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<Vec3>*>(p); });
    return nb::ndarray<nb::numpy, float, nb::ndim<2>>(owned->data(), {owned->size(), 3}, owner);
}

// Directions need not be of unit length: t counts in their length.
nb::dict intersect_rays(const Scene& scene, Triples origins, Triples directions, Floats t_max) {
    require_built(scene);
    require_length(directions.size(), origins.size(), "directions");
    require_length(t_max.size(), origins.shape(0), "t_max");
    const auto o = span_of<Vec3>(origins), d = span_of<Vec3>(directions);
    const size_t n = o.size();
    std::vector<float> t(n), u(n), v(n);
    std::vector<Vec3> normal(n);
    std::vector<uint32_t> primitive(n), instance(n);
    {
        nb::gil_scoped_release release;
        for (size_t i = 0; i < n; ++i) {
            const Hit hit = closest_hit(scene.view(), {o[i], d[i], t_max.data()[i]}, {});
            if (hit.found()) normal[i] = surface_at(scene.view(), {o[i], d[i]}, hit).geometric_normal;
            t[i] = hit.t, u[i] = hit.u, v[i] = hit.v, primitive[i] = hit.primitive, instance[i] = hit.instance;
        }
    }
    nb::dict result;
    result["t"] = to_numpy(std::move(t));
    result["u"] = to_numpy(std::move(u));
    result["v"] = to_numpy(std::move(v));
    result["normal"] = to_numpy(normal);
    result["primitive"] = to_numpy(std::move(primitive));
    result["instance"] = to_numpy(std::move(instance));
    return result;
}

nb::ndarray<nb::numpy, uint8_t, nb::ndim<1>> occluded_rays(const Scene& scene, Triples origins, Triples directions,
                                                           Floats t_max) {
    require_built(scene);
    require_length(directions.size(), origins.size(), "directions");
    require_length(t_max.size(), origins.shape(0), "t_max");
    const auto o = span_of<Vec3>(origins), d = span_of<Vec3>(directions);
    std::vector<uint8_t> blocked(o.size());
    {
        nb::gil_scoped_release release;
        for (size_t i = 0; i < o.size(); ++i) {
            blocked[i] = any_hit(scene.view(), {o[i], d[i], t_max.data()[i]}, {}, {}) ? 1 : 0;
        }
    }
    return to_numpy(std::move(blocked));
}

nb::dict info_of(const Scene& scene) {
    const Scene::Info& info = scene.info();
    nb::dict bytes, d;
    const ByPart<size_t> parts = scene.bytes();
    for (size_t i = 0; i < parts.of.size(); ++i) bytes[k_scene_part_names[i]] = parts.of[i];
    d["triangles"] = info.triangles;
    d["spheres"] = info.spheres;
    d["instances"] = info.instances;
    d["lights"] = info.lamps;
    d["emitters"] = info.emitters;
    d["bytes"] = bytes;
    d["build_seconds"] = info.build_seconds;
    return d;
}

}  // namespace

void bind_scene(nb::module_& m) {
    nb::class_<Scene>(m, "Scene")
        .def(nb::init<>())
        .def(
            "add_mesh",
            [](Scene& s, Triples positions, IntTriples triangles, std::optional<CornerNormals> corner_normals,
               std::optional<CornerUvs> uvs, std::optional<Ints> material_index) {
                return s.add_mesh(span_of<Vec3>(positions), span_of<Triangle>(triangles), span_of<Vec3>(corner_normals),
                                  span_of<Vec2>(uvs), span_of<int32_t>(material_index));
            },
            nb::arg("positions"), nb::arg("triangles"), nb::arg("corner_normals").none(), nb::arg("uvs").none(),
            nb::arg("material_index").none())
        .def(
            "add_spheres",
            [](Scene& s, Triples centers, Floats radii, std::optional<Ints> material_index) {
                return s.add_spheres(span_of<Vec3>(centers), span_of<float>(radii), span_of<int32_t>(material_index));
            },
            nb::arg("centers"), nb::arg("radii"), nb::arg("material_index").none())
        .def("add_material",
             [](Scene& s, Ints kinds, Ints fresnels, Triples weights, Floats roughness, Floats ior, Triples f0,
                Triples f82, Ints layered_under, Ints compensate, Triple emission) {
                 const size_t count = kinds.size();
                 for (const size_t n : {fresnels.size(), weights.shape(0), roughness.size(), ior.size(), f0.shape(0),
                                        f82.shape(0), layered_under.size(), compensate.size()}) {
                     require_length(n, count, "material: an array of lobes");
                 }
                 std::vector<LobeInput> inputs(count);
                 for (size_t i = 0; i < count; ++i) {
                     inputs[i] = {lobe_kind_of(kinds.data()[i]),
                                  fresnel_of(fresnels.data()[i]),
                                  span_of<Rgb>(weights)[i],
                                  roughness.data()[i],
                                  ior.data()[i],
                                  span_of<Rgb>(f0)[i],
                                  span_of<Rgb>(f82)[i],
                                  layered_under.data()[i],
                                  compensate.data()[i] != 0};
                 }
                 return s.add_material(inputs, rgb_of(emission));
             })
        .def("add_instance",
             [](Scene& s, uint32_t geometry, FloatMatrix transform, Ints materials, uint32_t visibility) {
                 s.add_instance(geometry, affine_of(transform), span_of<int32_t>(materials), visibility);
             })
        .def("add_point_light",
             [](Scene& s, Triple position, Triple power, float radius, uint32_t visibility) {
                 return add_lamp(s, make_point(vec3_of(position), rgb_of(power), radius), visibility);
             })
        .def("add_spot_light",
             [](Scene& s, FloatMatrix transform, Triple power, float spot_size, float blend, float radius,
                uint32_t visibility) {
                 return add_lamp(s, make_spot(affine_of(transform), rgb_of(power), spot_size, blend, radius),
                                 visibility);
             })
        .def("add_sun_light",
             [](Scene& s, FloatMatrix transform, Triple irradiance, float angle, uint32_t visibility) {
                 return add_lamp(s, make_sun(affine_of(transform), rgb_of(irradiance), angle), visibility);
             })
        .def("add_area_light",
             [](Scene& s, FloatMatrix transform, Triple power, float size_x, float size_y, bool ellipse, float spread,
                uint32_t visibility) {
                 return add_lamp(s, make_area(affine_of(transform), rgb_of(power), size_x, size_y, ellipse, spread),
                                 visibility);
             })
        .def("set_world", [](Scene& s, Triple radiance) { s.set_world(rgb_of(radiance)); })
        .def("set_world_image",
             [](Scene& s, Array<const float, -1, -1, 3> texels, Array<const float, 3, 3> to_image) {
                 const std::span<const Vec3> r = span_of<Vec3>(to_image);
                 const Vec3 rows[3] = {r[0], r[1], r[2]};
                 s.set_world_image(span_of<Rgb>(texels), static_cast<uint32_t>(texels.shape(1)),
                                   static_cast<uint32_t>(texels.shape(0)), rows);
             })
        .def("set_camera",
             [](Scene& s, FloatMatrix transform, int projection, float half_width, float half_height, float shift_x,
                float shift_y, float clip_start, float clip_end, float aperture_radius, float focus_distance) {
                 CameraParameters p;
                 p.transform = affine_of(transform);
                 p.projection = projection_of(projection);
                 p.half_size = {half_width, half_height};
                 p.shift = {shift_x, shift_y};
                 p.clip_start = clip_start;
                 p.clip_end = clip_end;
                 p.aperture_radius = aperture_radius;
                 p.focus_distance = focus_distance;
                 const std::optional<Camera> camera = make_camera(p);
                 if (!camera)
                     throw std::invalid_argument("camera: its transform is singular or a number is out of range");
                 s.set_camera(*camera);
             })
        .def("set_film",
             [](Scene& s, uint32_t width, uint32_t height, uint32_t x, uint32_t y, uint32_t window_width,
                uint32_t window_height,
                bool transparent) { s.set_film(width, height, {x, y, window_width, window_height}, transparent); })
        .def(
            "reopen", [](Scene& s, bool materials, bool lamps, bool world) { s.reopen({materials, lamps, world}); },
            nb::arg("materials"), nb::arg("lamps"), nb::arg("world"))
        .def(
            "move_mesh",
            [](Scene& s, uint32_t geometry, Triples positions, std::optional<CornerNormals> corner_normals,
               std::optional<CornerUvs> uvs, std::optional<Ints> material_index) {
                s.move_mesh(geometry, span_of<Vec3>(positions), span_of<Vec3>(corner_normals), span_of<Vec2>(uvs),
                            span_of<int32_t>(material_index));
            },
            nb::arg("geometry"), nb::arg("positions"), nb::arg("corner_normals").none(), nb::arg("uvs").none(),
            nb::arg("material_index").none())
        .def(
            "move_spheres",
            [](Scene& s, uint32_t geometry, Triples centers, Floats radii, std::optional<Ints> material_index) {
                s.move_spheres(geometry, span_of<Vec3>(centers), span_of<float>(radii),
                               span_of<int32_t>(material_index));
            },
            nb::arg("geometry"), nb::arg("centers"), nb::arg("radii"), nb::arg("material_index").none())
        .def("move_instance", [](Scene& s, uint32_t instance,
                                 FloatMatrix transform) { s.move_instance(instance, affine_of(transform)); })
        .def("build", &Scene::build, nb::arg("threads") = 0, nb::call_guard<nb::gil_scoped_release>())
        .def("intersect", &intersect_rays, nb::arg("origins"), nb::arg("directions"), nb::arg("t_max"))
        .def("occluded", &occluded_rays, nb::arg("origins"), nb::arg("directions"), nb::arg("t_max"))
        .def("info", &info_of);
}

}  // namespace vlp
