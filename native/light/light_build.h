// Lights from Blender's parameters, and how often each is chosen (host only).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "light/light_data.h"

namespace vlp {

// Units as in vlp_bpt.scene. Each returns nothing for a light that can't shine because its shape or transform is
// degenerate (no area, singular, not finite). `visibility` is left to the caller.
std::optional<Light> make_point(Vec3 position, Rgb power, float radius);
std::optional<Light> make_spot(const Affine& transform, Rgb power, float spot_size, float blend, float radius);
std::optional<Light> make_sun(const Affine& transform, Rgb irradiance, float angle);

// A sheared transform gives the upright rectangle or ellipse of the same area. Spreads below 0.001 count as that much.
std::optional<Light> make_area(const Affine& transform, Rgb power, float size_x, float size_y, bool ellipse,
                               float spread);

// Emitting surfaces in world space.
std::optional<Light> make_triangle(Vec3 v0, Vec3 v1, Vec3 v2, Rgb radiance, uint32_t instance, uint32_t primitive);
std::optional<Light> make_sphere(Vec3 center, float radius, Rgb radiance, uint32_t instance, uint32_t primitive);

Light make_environment(Rgb mean_radiance);

// Tables over the texels of an environment's picture (rows from the pole below), and its mean over all directions.
struct EnvironmentTables {
    std::vector<uint32_t> rows_below, columns_below;
    Rgb mean;
};
EnvironmentTables make_environment_tables(std::span<const Rgb> texels, uint32_t width, uint32_t height);

// Watts that leave the light, mean of the channels' sizes; for infinite lights what enters the scene's sphere.
float power(const Light& light, float scene_radius);

// The array of a Distribution. Each entry gets at least one of the 2^32 numbers, so that none is impossible that may
// still matter: an entry of weight 0 is drawn once in 2^32. What is not positive counts as 0; all 0: uniform.
std::vector<uint32_t> make_distribution(std::span<const double> weights);

}  // namespace vlp
