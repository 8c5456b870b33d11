// What the arrays of a datablock must satisfy so that no pass reads beyond them (host only). The Python layer says the same
// with the names of datablocks; these hold for every caller.
#pragma once

#include <span>

#include "scene/scene.h"

namespace vlp {

// Each throws std::invalid_argument that names the element and the value at fault.
void check_mesh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                std::span<const Vec3> corner_normals, std::span<const Vec2> uvs, std::span<const int32_t> slots);
void check_spheres(std::span<const Vec3> centers, std::span<const float> radii, std::span<const int32_t> slots);
void check_transform(const Affine& object_to_world);
void check_indices(std::span<const int32_t> indices, size_t count, const char* what);
void check_world_image(std::span<const Rgb> texels, uint32_t width, uint32_t height);
void check_film(uint32_t width, uint32_t height, Window window);

}  // namespace vlp
