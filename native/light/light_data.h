// Lights as plain data; what they emit and how they are sampled is in light.h.
#pragma once

#include "core/distribution.h"
#include "core/rgb.h"
#include "core/transform.h"

namespace vlp {

enum class LightKind : uint8_t { point, spot, sun, area, triangle, sphere, environment };

struct Light {
    LightKind kind = LightKind::point;
    bool ellipse = false;         // area
    uint32_t visibility = 0;      // lamps: which rays see the shape
    uint32_t instance = k_none;   // triangle and sphere: the surface that emits
    uint32_t primitive = 0;
    Rgb radiance;                 // point and spot of radius 0: intensity (W/sr); sun of angle 0: irradiance (W/m²);
                                  // environment: mean over all directions
    Vec3 position;                // point, spot, area: centre; sphere: centre in world space; triangle: first vertex
    Vec3 axis_u, axis_v;  // area: unit, along its sides; triangle: edges from the first vertex; spot: spot.h
    Vec2 half_size;  // area: half its sides (m)
    Vec3 normal;  // area, spot, sun: the direction of shining; triangle: unit geometric normal
    float radius = 0;  // point, spot, sphere; sun: sine of half the disc's angle
    float area = 0;  // of the emitting shape, one side (m²)
    float cos_outer = -1;  // spot: cosine of half its size; sun: cosine of half the disc's angle
    float blend = 0;  // spot
    float spread = 0;  // area: cotangent of half its spread, 0: Lambertian
    float spread_share = 1;  // area: of a Lambertian lamp's power, that the spread leaves
};

// A picture of the environment, row 0 at the pole below; `texels` null: constant radiance. See environment.h.
struct EnvironmentView {
    const Rgb* texels = nullptr;  // height rows of width
    const uint32_t* rows_below = nullptr;     // Distribution over rows
    const uint32_t* columns_below = nullptr;  // a Distribution over columns for each row
    uint32_t width = 0, height = 0;
    Vec3 to_image[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // rows of the rotation from the world to the picture
};

struct LightTreeNode;

// How next event chooses, see light_tree.h. Null `nodes`: no light is near.
struct LightTreeView {
    const LightTreeNode* nodes = nullptr;
    const uint32_t* places = nullptr;  // of each light: its leaf, or with k_tree_infinite its number in the list
    const uint32_t* infinite_lights = nullptr;  // all suns and the environment
    Distribution infinite;  // over these
    float infinite_irradiance = 0;
};

// Spheres that light from infinitely far away comes through on its way to what the picture shows, as a pilot found them: the
// windows of a room, or all that the camera looks at in a wide land. See portals.h.
inline constexpr uint32_t k_max_portals = 4;

struct Portals {
    uint32_t count = 0;
    bool in_next_event = false;  // of the environment, too
    Vec3 center[k_max_portals]{};
    float radius[k_max_portals]{};
    float share[k_max_portals]{};  // of what is sent through them; their sum is 1
};

// Lights that light paths begin at more often than their power has it, as a pilot found that the picture shows their light.
inline constexpr uint32_t k_max_favoured = 16;

struct FavouredLights {
    uint32_t count = 0;
    uint32_t light[k_max_favoured]{};
    uint32_t below[k_max_favoured]{};  // a Distribution over them
};

struct LightGuide {
    Portals portals;
    FavouredLights favoured;
};

struct LampNode;

// Lamps with a shape (radius or area), found by rays but not blocking them.
struct LampView {
    const uint32_t* lights = nullptr;  // indices of such lamps
    uint32_t count = 0;
    const LampNode* nodes = nullptr;  // see lamp_tree.h; null: a list
    uint32_t root = 0;
};

}  // namespace vlp
