// Boxes around the shapes of lamps, sorted by the builder that sorts those of surfaces.
#include "light/lamp_tree_build.h"

#include "bvh/binary.h"

namespace vlp {

Box box_of(const Light& light) {
    if (light.kind == LightKind::triangle) {
        Box box;
        for (const Vec3 corner : {Vec3{}, light.axis_u, light.axis_v}) box.include(light.position + corner);
        return box;
    }
    const auto reach = [&](float u, float v) {
        return light.radius + std::fabs(u) * light.half_size.x + std::fabs(v) * light.half_size.y;
    };
    const Vec3 half{reach(light.axis_u.x, light.axis_v.x), reach(light.axis_u.y, light.axis_v.y),
                    reach(light.axis_u.z, light.axis_v.z)};
    const float size =
        max_of(std::fabs(light.position.x), max_of(std::fabs(light.position.y), std::fabs(light.position.z)));
    const float slack = 1e-5f * (size + max_of(half.x, max_of(half.y, half.z)));
    const Vec3 wide = half + Vec3{slack, slack, slack};
    return {light.position - wide, light.position + wide};
}

namespace {

uint32_t make_leaf(uint32_t begin, uint32_t end) {
    return k_lamp_leaf | (end - begin - 1) << k_lamp_leaf_shift | begin;
}

}  // namespace

LampTree build_lamp_tree(const std::vector<Light>& lights, std::vector<uint32_t> shapes, ThreadPool& pool) {
    LampTree result;
    if (shapes.size() <= k_max_lamps_in_leaf) {
        result.lights = std::move(shapes);
        return result;
    }
    RawVector<Ref> refs;
    for (const uint32_t index : shapes) {
        const Box box = box_of(lights[index]);
        refs.push_back({box.low, k_none, box.high, index});
    }
    const BinaryTree tree = build_binary(refs, {k_max_lamps_in_leaf, 1.0f, nullptr}, k_lamp_tree_depth, pool);
    for (const Ref& ref : refs) result.lights.push_back(ref.primitive);
    result.root = tree.root;
    result.nodes.resize(tree.nodes.size());
    struct Part {
        uint32_t node, begin, end;
    };
    std::vector<Part> left{{tree.root, 0, static_cast<uint32_t>(refs.size())}};
    while (!left.empty()) {
        const Part part = left.back();
        left.pop_back();
        const BinaryNode& from = tree.nodes[part.node];
        LampNode& to = result.nodes[part.node];
        const uint32_t begin[2] = {part.begin, from.split}, end[2] = {from.split, part.end};
        for (uint32_t side = 0; side < 2; ++side) {
            to.low[side] = from.box[side].low, to.high[side] = from.box[side].high;
            const bool is_leaf = from.child[side] == k_leaf_flag;
            to.child[side] = is_leaf ? make_leaf(begin[side], end[side]) : from.child[side];
            if (!is_leaf) left.push_back({from.child[side], begin[side], end[side]});
        }
    }
    return result;
}

}  // namespace vlp
