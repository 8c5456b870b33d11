// Checks of sizes, indices and numbers.
#include "scene/input_checks.h"

#include <stdexcept>
#include <string>

namespace vlp {
namespace {

constexpr size_t k_most_slots = 65536;  // 16 bits a primitive

[[noreturn]] void fail(const std::string& message) { throw std::invalid_argument(message); }

void check_length(size_t length, size_t expected, const char* what) {
    if (length != 0 && length != expected) {
        fail(std::string(what) + ": " + std::to_string(length) + " given, but there must be " +
             std::to_string(expected));
    }
}

void check_finite(std::span<const Vec3> points, const char* what) {
    for (size_t i = 0; i < points.size(); ++i) {
        if (!is_finite(points[i])) fail(std::string(what) + " " + std::to_string(i) + " is not finite");
    }
}

}  // namespace

void check_indices(std::span<const int32_t> indices, size_t count, const char* what) {
    for (size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] < 0 || static_cast<size_t>(indices[i]) >= count) {
            fail(std::string(what) + " " + std::to_string(i) + " is " + std::to_string(indices[i]) +
                 ", but there are " + std::to_string(count));
        }
    }
}

void check_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                std::span<const Vec3> corner_normals, std::span<const Vec2> uvs, std::span<const int32_t> slots) {
    check_finite(positions, "mesh: position");
    for (size_t i = 0; i < triangles.size(); ++i) {
        for (const uint32_t v : triangles[i].v) {
            if (v >= positions.size()) {
                fail("mesh: triangle " + std::to_string(i) + " has index " + std::to_string(static_cast<int32_t>(v)) +
                     ", but there are " + std::to_string(positions.size()) + " positions");
            }
        }
    }
    check_length(corner_normals.size(), 3 * triangles.size(), "mesh: corner normals");
    check_length(uvs.size(), 3 * triangles.size(), "mesh: uvs");
    check_length(slots.size(), triangles.size(), "mesh: material slots");
    check_finite(corner_normals, "mesh: corner normal");
    check_indices(slots, k_most_slots, "mesh: material slot of triangle");
}

void check_spheres(std::span<const Vec3> centers, std::span<const float> radii, std::span<const int32_t> slots) {
    check_finite(centers, "spheres: center");
    if (radii.size() != centers.size()) {
        fail("spheres: " + std::to_string(radii.size()) + " radii given for " + std::to_string(centers.size()) +
             " centers");
    }
    for (size_t i = 0; i < radii.size(); ++i) {
        if (!(radii[i] >= 0) || !is_finite(radii[i])) {
            fail("spheres: radius " + std::to_string(i) + " is " + std::to_string(radii[i]));
        }
    }
    check_length(slots.size(), centers.size(), "spheres: material slots");
    check_indices(slots, k_most_slots, "spheres: material slot of sphere");
}

void check_transform(const Affine& object_to_world) {
    const Affine back = inverse(object_to_world);
    const bool finite = is_finite(object_to_world.row(0)) && is_finite(object_to_world.row(1)) &&
                        is_finite(object_to_world.row(2)) && is_finite(object_to_world.column(3));
    const bool regular = is_finite(back.row(0)) && is_finite(back.row(1)) && is_finite(back.row(2));
    if (!finite || !regular) fail("instance: transform is singular or not finite");
}

void check_world_image(std::span<const Rgb> texels, uint32_t width, uint32_t height) {
    if (width == 0 || height == 0 || texels.size() != size_t{width} * height) {
        throw std::invalid_argument("world: its picture has " + std::to_string(texels.size()) + " texels, must have " +
                                    std::to_string(width) + " x " + std::to_string(height));
    }
    for (size_t i = 0; i < texels.size(); ++i) {
        const Rgb c = texels[i];
        if (is_finite(c) && c.r >= 0 && c.g >= 0 && c.b >= 0) continue;
        throw std::invalid_argument("world: texel " + std::to_string(i) + " of its picture is negative or not finite");
    }
}

void check_film(uint32_t width, uint32_t height, Window window) {
    const bool inside = static_cast<uint64_t>(window.x) + window.width <= width &&
                        static_cast<uint64_t>(window.y) + window.height <= height;
    if (window.width == 0 || window.height == 0 || !inside) {
        fail("film: window of " + std::to_string(window.width) + " x " + std::to_string(window.height) + " at (" +
             std::to_string(window.x) + ", " + std::to_string(window.y) + ") is not a part of " +
             std::to_string(width) + " x " + std::to_string(height) + " pixels");
    }
}

}  // namespace vlp
