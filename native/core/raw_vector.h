// A vector whose new elements have no value until one is assigned, so that threads can be the first to write to them (host
// only).
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#endif

namespace vlp {

inline constexpr size_t k_huge_page = size_t{1} << 21;

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

    // Large arrays ask for huge pages: the system takes long to hand out small ones.
    T* allocate(size_t count) {
        if (!is_large(count)) return std::allocator<T>::allocate(count);
        void* const place = ::operator new(count * sizeof(T), std::align_val_t{k_huge_page});
#ifdef MADV_HUGEPAGE
        madvise(place, count * sizeof(T), MADV_HUGEPAGE);
#endif
        return static_cast<T*>(place);
    }
    void deallocate(T* place, size_t count) {
        if (!is_large(count)) return std::allocator<T>::deallocate(place, count);
        ::operator delete(place, std::align_val_t{k_huge_page});
    }

    template <typename U>
    void construct(U*) noexcept {}
    template <typename U, typename... Args>
    void construct(U* place, Args&&... args) {
        std::construct_at(place, std::forward<Args>(args)...);
    }

private:
    static bool is_large(size_t count) { return count >= 2 * k_huge_page / sizeof(T); }
};

template <typename T>
using RawVector = std::vector<T, RawAllocator<T>>;

}  // namespace vlp
