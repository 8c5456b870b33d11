// A vector whose new elements have no value until one is assigned, so that threads can be the first to write to them.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace vlp {

template <typename T>
struct RawAllocator : std::allocator<T> {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

    template <typename U>
    struct rebind {
        using other = RawAllocator<U>;
    };

    RawAllocator() = default;
    template <typename U>
    RawAllocator(const RawAllocator<U>&) noexcept {}

    template <typename U>
    void construct(U*) noexcept {}
    template <typename U, typename... Args>
    void construct(U* place, Args&&... args) {
        std::construct_at(place, std::forward<Args>(args)...);
    }
};

template <typename T>
using RawVector = std::vector<T, RawAllocator<T>>;

}  // namespace vlp
