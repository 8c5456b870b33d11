// An array that takes memory only where it is written to, and gives all of it back to the system at its end (host only).
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#define VLP_HAS_MMAP 1
#else
#define VLP_HAS_MMAP 0
#endif

namespace vlp {

// Elements have no value before one is assigned.
template <typename T>
class LazyArray {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    LazyArray() = default;
    // Throws std::bad_alloc.
    explicit LazyArray(size_t size) : size_(size) {
        if (size == 0) return;
#if VLP_HAS_MMAP
        void* const pages = mmap(nullptr, bytes(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (pages == MAP_FAILED) throw std::bad_alloc();
        data_ = static_cast<T*>(pages);
#else
        data_ = static_cast<T*>(::operator new(bytes(), std::align_val_t{alignof(T)}));
#endif
    }
    LazyArray(LazyArray&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
    LazyArray& operator=(LazyArray&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        return *this;
    }
    ~LazyArray() {
        if (!data_) return;
#if VLP_HAS_MMAP
        munmap(data_, bytes());
#else
        ::operator delete(data_, std::align_val_t{alignof(T)});
#endif
    }

    size_t size() const { return size_; }
    T* data() { return data_; }
    T& operator[](size_t i) { return data_[i]; }
    const T& operator[](size_t i) const { return data_[i]; }

private:
    size_t bytes() const { return size_ * sizeof(T); }

    T* data_ = nullptr;
    size_t size_ = 0;
};

}  // namespace vlp
