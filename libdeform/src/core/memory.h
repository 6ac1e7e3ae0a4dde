// Memory of a context: an Array is allocated through the host's hooks, so that a host can count, pool or
// refuse what grows with meshes and contacts. Smaller tables (std::vector) use the ordinary heap.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace dfm {

struct Memory {
  void *user = nullptr;
  void *(*alloc)(void *user, size_t bytes, size_t align) = nullptr;  // never null after Memory::standard()
  void (*release)(void *user, void *p, size_t bytes, size_t align) = nullptr;
  static const Memory &standard();  // aligned malloc and free
};

// Memory that counts the bytes allocated through it and not yet freed. Must outlive these allocations.
class Meter {
 public:
  explicit Meter(const Memory &under) : under_(under), memory_{this, take, free_counted} {}
  Meter(const Meter &) = delete;
  const Memory &memory() const { return memory_; }
  uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }

 private:
  static void *take(void *self, size_t bytes, size_t align) {
    Meter &m = *static_cast<Meter *>(self);
    void *const p = m.under_.alloc(m.under_.user, bytes, align);
    if (p) m.bytes_.fetch_add(bytes, std::memory_order_relaxed);
    return p;
  }
  static void free_counted(void *self, void *p, size_t bytes, size_t align) {
    Meter &m = *static_cast<Meter *>(self);
    m.under_.release(m.under_.user, p, bytes, align);
    if (p) m.bytes_.fetch_sub(bytes, std::memory_order_relaxed);
  }
  const Memory &under_;
  Memory memory_;
  std::atomic<uint64_t> bytes_{0};
};

// Throws Error(DFM_E_NOMEM) if a computation that is about to start needs more memory than the machine has,
// or the control group allows.
void need_memory(uint64_t bytes, const char *what);

// Allocator of std::vector over Memory; 64-byte alignment so that kernels may load whole vectors.
template <class T>
struct HookAllocator {
  using value_type = T;
  const Memory *memory = &Memory::standard();
  HookAllocator() = default;
  HookAllocator(const Memory &m) : memory(&m) {}
  template <class U>
  HookAllocator(const HookAllocator<U> &other) : memory(other.memory) {}
  T *allocate(size_t n) {
    if (n > SIZE_MAX / sizeof(T)) throw std::bad_alloc();
    void *p = memory->alloc(memory->user, n * sizeof(T), 64);
    if (!p) throw std::bad_alloc();
    return static_cast<T *>(p);
  }
  void deallocate(T *p, size_t n) { memory->release(memory->user, p, n * sizeof(T), 64); }
  template <class U>
  bool operator==(const HookAllocator<U> &other) const {
    return memory == other.memory;
  }
  // Containers move only between worlds of one context, so allocators move with the content.
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;
};

template <class T>
using Array = std::vector<T, HookAllocator<T>>;

// Empties arrays; they allocate from m from now on.
template <class... T>
void use_memory(const Memory &m, Array<T> &...arrays) {
  ((arrays = Array<T>(m)), ...);
}

}  // namespace dfm
