// The parts of a scene that change, and take memory on a device, apart from each other. The camera and the film take none.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace vlp {

enum class ScenePart : uint8_t { geometry, bvh, instances, materials, lights, world, tables };
inline constexpr std::array<const char*, 7> k_scene_part_names{"geometry", "bvh",   "instances", "materials",
                                                               "lights",   "world", "tables"};

// In which form a device has the nodes of the tree: see BvhNode and CompressedNode.
enum class NodeForm : uint8_t { wide, compressed };

// A number for each part of a scene.
template <typename T>
struct ByPart {
    std::array<T, k_scene_part_names.size()> of{};

    T& operator[](ScenePart part) { return of[static_cast<size_t>(part)]; }
    const T& operator[](ScenePart part) const { return of[static_cast<size_t>(part)]; }
};

// Of what a part holds: never the same again, in any scene.
inline uint64_t next_revision() {
    static std::atomic<uint64_t> last{0};
    return ++last;
}

// Where a copy of an array stands.
using Place = std::function<const void*(ScenePart part, const void* data, size_t bytes)>;

inline const void* in_place(ScenePart, const void* data, size_t) { return data; }

// Null when the vector is empty.
template <typename T, typename Allocator>
const T* placed(const std::vector<T, Allocator>& v, ScenePart part, const Place& place) {
    return v.empty() ? nullptr : static_cast<const T*>(place(part, v.data(), v.size() * sizeof(T)));
}

}  // namespace vlp
