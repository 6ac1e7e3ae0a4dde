// The process-wide table behind all handles: {generation:24, kind:8, index+1:32}. The generation of a slot
// increases when its object is destroyed, so old handles no longer match. Kinds are checked too.
#pragma once
#include <cstdint>

namespace dfm {

enum class Kind : uint8_t {
  none = 0,
  world = 1,
  body = 2,
  obstacle = 3,
  material = 4,
  law = 5,
  scene = 6,
  mesh = 7,
  // 9: DFM_HANDLE_RIGID; its handles have kind obstacle
  tool = 10
};

// Registers an object (not owned) and returns its handle. Thread-safe; throws std::bad_alloc.
uint64_t handle_create(Kind kind, void *object);
// The object, or nullptr for a null, stale or wrong-kind handle. Thread-safe.
void *handle_find(Kind kind, uint64_t handle) noexcept;
// Kind of the object, or none for a null, stale or invalid handle. Thread-safe.
Kind handle_kind(uint64_t handle) noexcept;
void handle_destroy(uint64_t handle) noexcept;

// Throws Error(DFM_E_HANDLE), which names the expected kind and what the handle is instead.
void *handle_require(Kind kind, uint64_t handle);
template <class T>
T &resolve(Kind kind, uint64_t handle) {
  return *static_cast<T *>(handle_require(kind, handle));
}

}  // namespace dfm
