// Bounds of lights, and the tree over them, which the builder for surfaces cuts by their boxes.
#include "light/light_tree_build.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bvh/binary.h"
#include "light/lamp_tree_build.h"
#include "light/light.h"
#include "light/light_build.h"

namespace vlp {
namespace {

constexpr double k_pi_d = std::numbers::pi;

// Along the normals.
float intensity_of(const Light& light) {
    const double mean = (std::fabs(double{light.radiance.r}) + std::fabs(double{light.radiance.g}) +
                         std::fabs(double{light.radiance.b})) /
                        3;
    const bool is_round =
        light.kind == LightKind::point || light.kind == LightKind::spot || light.kind == LightKind::sphere;
    const double area = !is_round ? double{light.area} : light.radius > 0 ? k_pi_d * light.radius * light.radius : 1.0;
    return static_cast<float>(std::min(mean * area, 1e30));
}

// What an infinite light brings to a surface that faces it (W/m^2); the environment, to any on average. In a scene of radius 1 its
// power comes through a disc of area pi, from every direction or from one.
double irradiance_of(const Light& light) {
    const double directions = light.kind == LightKind::environment ? 4.0 : 1.0;
    return static_cast<double>(power(light, 1)) / (directions * k_pi_d);
}

float cosine_of_spread(const Light& light) { return light.spread / std::sqrt(1 + light.spread * light.spread); }

// A spot's cone is as it seems unless its transform stretches it.
bool is_stretched(const Light& spot) {
    const auto is_one = [](float x) { return std::fabs(x - 1) < 1e-3f; };
    return !is_one(length(spot.axis_u)) || !is_one(length(spot.axis_v)) ||
           std::fabs(dot(spot.axis_u, spot.axis_v)) > 1e-3f || std::fabs(dot(spot.axis_u, spot.normal)) > 1e-3f ||
           std::fabs(dot(spot.axis_v, spot.normal)) > 1e-3f;
}

// The narrowest cone around two, each given by an axis and an angle.
void merge_cones(const LightTreeNode& a, Vec3 axis_b, float cos_b, LightTreeNode& result) {
    const auto angle_of = [](float cosine) { return std::acos(std::clamp(double{cosine}, -1.0, 1.0)); };
    const double angle_a = angle_of(a.cos_normals), angle_b = angle_of(cos_b);
    const double between = angle_of(dot(a.axis, axis_b)), whole = (angle_a + between + angle_b) / 2;
    result.axis = a.axis, result.cos_normals = a.cos_normals;
    if (between + angle_b <= angle_a) return;
    result.axis = axis_b, result.cos_normals = cos_b;
    if (between + angle_a <= angle_b) return;
    const Vec3 aside = axis_b - a.axis * dot(a.axis, axis_b);
    result.cos_normals = -1;
    if (whole >= k_pi_d || !(length_squared(aside) > 1e-12f)) return;
    const double turn = whole - angle_a;
    result.axis =
        normalize(a.axis * static_cast<float>(std::cos(turn)) + normalize(aside) * static_cast<float>(std::sin(turn)));
    result.cos_normals = max_of(static_cast<float>(std::cos(whole)) - 1e-5f, -1.0f);
}

}  // namespace

LightTreeNode bounds_of(const Light& light) {
    const Box box = box_of(light);
    LightTreeNode node{};
    node.center = (box.low + box.high) * 0.5f;
    node.radius = 0.5f * length(box.high - box.low);
    node.axis = {0, 0, 1};
    node.cos_normals = -1;
    node.intensity = intensity_of(light);
    const bool turned = light.kind == LightKind::area || light.kind == LightKind::triangle ||
                        (light.kind == LightKind::spot && !is_stretched(light));
    if (turned) node.axis = light.normal, node.cos_normals = 1;
    if (light.kind == LightKind::area) node.cos_shine = cosine_of_spread(light);
    if (light.kind == LightKind::spot) node.cos_shine = turned ? light.cos_outer : -1.0f;
    node.two_sided = light.kind == LightKind::triangle;
    return node;
}

LightTreeNode merge(const LightTreeNode& a, const LightTreeNode& b) {
    LightTreeNode node{};
    const Vec3 d = b.center - a.center;
    const float distance = length(d);
    if (distance + b.radius <= a.radius) {
        node.center = a.center, node.radius = a.radius;
    } else if (distance + a.radius <= b.radius) {
        node.center = b.center, node.radius = b.radius;
    } else {
        node.radius = 0.5f * (distance + a.radius + b.radius) * 1.00001f;
        node.center = distance > 0 ? a.center + d * ((node.radius - a.radius) / distance) : a.center;
    }
    node.two_sided = a.two_sided || b.two_sided;
    const bool turn = a.two_sided && b.two_sided && dot(a.axis, b.axis) < 0;
    merge_cones(a, turn ? -b.axis : b.axis, b.cos_normals, node);
    node.cos_shine = min_of(a.cos_shine, b.cos_shine);
    node.intensity = min_of(a.intensity + b.intensity, 1e30f);
    return node;
}

LightTree build_light_tree(const std::vector<Light>& lights, ThreadPool& pool) {
    LightTree result;
    RawVector<Ref> refs;
    std::vector<double> irradiances;
    for (uint32_t i = 0; i < lights.size(); ++i) {
        if (is_infinite(lights[i])) {
            irradiances.push_back(irradiance_of(lights[i]));
            result.places.push_back(k_tree_infinite | static_cast<uint32_t>(result.infinite_lights.size()));
            result.infinite_lights.push_back(i);
        } else {
            const Box box = box_of(lights[i]);
            refs.push_back({box.low, k_none, box.high, i});
            result.places.push_back(k_none);
        }
    }
    double irradiance = 0;
    for (const double x : irradiances) irradiance += x;
    result.infinite_irradiance = static_cast<float>(std::min(irradiance, 1e30));
    result.infinite_below = make_distribution(irradiances);
    if (refs.empty()) return result;

    const BinaryTree tree = build_binary(refs, {1, 1.0f, nullptr}, k_lamp_tree_depth, pool);
    result.nodes.resize(2 * refs.size());  // none, the root and the pairs of children
    struct Part {
        uint32_t from, begin, end, to;
        Box box;
    };
    std::vector<Part> left{{tree.root, 0, static_cast<uint32_t>(refs.size()), k_tree_root, tree.box}};
    std::vector<Box> boxes(result.nodes.size());
    std::vector<uint32_t> inner;  // parents before children
    uint32_t next = 2;
    while (!left.empty()) {
        const Part part = left.back();
        left.pop_back();
        if (part.end - part.begin == 1) {
            const uint32_t light = refs[part.begin].primitive, parent = result.nodes[part.to].parent;
            result.nodes[part.to] = bounds_of(lights[light]);
            result.nodes[part.to].child = k_tree_leaf | light, result.nodes[part.to].parent = parent;
            result.places[light] = part.to;
            continue;
        }
        const BinaryNode& from = tree.nodes[part.from];
        inner.push_back(part.to);
        boxes[part.to] = part.box;
        result.nodes[part.to].child = next;
        result.nodes[next].parent = result.nodes[next + 1].parent = part.to;
        left.push_back({from.child[0], part.begin, from.split, next, from.box[0]});
        left.push_back({from.child[1], from.split, part.end, next + 1, from.box[1]});
        next += 2;
    }
    for (auto node = inner.rbegin(); node != inner.rend(); ++node) {
        LightTreeNode& here = result.nodes[*node];
        const uint32_t child = here.child, parent = here.parent;
        here = merge(result.nodes[child], result.nodes[child + 1]);
        here.child = child, here.parent = parent;
        const Box& box = boxes[*node];
        const float radius = 0.5f * length(box.high - box.low);
        if (radius < here.radius) here.radius = radius, here.center = (box.low + box.high) * 0.5f;
    }
    return result;
}

}  // namespace vlp
