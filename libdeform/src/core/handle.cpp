#include "core/handle.h"

#include <mutex>
#include <shared_mutex>
#include <vector>

#include "core/error.h"

namespace dfm {
namespace {

struct Slot {
  void *object = nullptr;
  uint32_t generation = 1;
  Kind kind = Kind::none;
};

struct Table {
  std::shared_mutex mutex;
  std::vector<Slot> slots;
  std::vector<uint32_t> free;
};

Table &table() {
  static Table *const t = new Table;  // never destroyed: handles may be asked about during exit
  return *t;
}

const char *kind_name(Kind kind) {
  switch (kind) {
    case Kind::world: return "world";
    case Kind::body: return "body";
    case Kind::obstacle: return "obstacle";
    case Kind::material: return "material";
    case Kind::law: return "law";
    case Kind::scene: return "scene";
    case Kind::tetmesh: return "mesh";
    case Kind::trimesh: return "surface mesh";
    case Kind::none: break;
  }
  return "object";
}

}  // namespace

uint64_t handle_create(Kind kind, void *object) {
  Table &t = table();
  std::unique_lock lock(t.mutex);
  uint32_t index;
  if (t.free.empty()) {
    t.free.reserve(t.slots.size() + 1);  // so that handle_destroy cannot throw
    t.slots.emplace_back();
    index = static_cast<uint32_t>(t.slots.size() - 1);
  } else {
    index = t.free.back();
    t.free.pop_back();
  }
  Slot &slot = t.slots[index];
  slot.object = object;
  slot.kind = kind;
  return (uint64_t(slot.generation & 0xffffff) << 40) | (uint64_t(kind) << 32) | (index + 1);
}

void *handle_find(Kind kind, uint64_t handle) noexcept {
  const uint32_t index = static_cast<uint32_t>(handle);
  if (index == 0 || uint8_t(handle >> 32) != uint8_t(kind)) return nullptr;
  Table &t = table();
  std::shared_lock lock(t.mutex);
  if (index > t.slots.size()) return nullptr;
  const Slot &slot = t.slots[index - 1];
  return slot.kind == kind && (slot.generation & 0xffffff) == uint32_t(handle >> 40) ? slot.object : nullptr;
}

void handle_destroy(uint64_t handle) noexcept {
  const uint32_t index = static_cast<uint32_t>(handle);
  Table &t = table();
  std::unique_lock lock(t.mutex);
  if (index == 0 || index > t.slots.size()) return;
  Slot &slot = t.slots[index - 1];
  if ((slot.generation & 0xffffff) != uint32_t(handle >> 40) || slot.kind == Kind::none) return;
  slot.object = nullptr;
  slot.kind = Kind::none;
  slot.generation = (slot.generation + 1) & 0xffffff;
  if (slot.generation == 0) slot.generation = 1;
  t.free.push_back(index - 1);
}

void *handle_require(Kind kind, uint64_t handle) {
  void *object = handle_find(kind, handle);
  if (!object)
    fail(DFM_E_HANDLE,
         "%s handle 0x%llx is stale, null or of another kind; keep handles only while their object lives",
         kind_name(kind), static_cast<unsigned long long>(handle));
  return object;
}

}  // namespace dfm
