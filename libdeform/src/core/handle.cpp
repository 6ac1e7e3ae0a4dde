#include "core/handle.h"

#include <mutex>
#include <shared_mutex>
#include <string>
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
  static Table *const t = new Table;  // never destroyed: handles may be used during exit
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
    case Kind::mesh: return "mesh";
    case Kind::tool: return "tool";
    case Kind::none: break;
  }
  return "object";
}

// Name of a kind, with its article.
std::string a_kind(Kind kind) {
  return std::string(kind == Kind::obstacle || kind == Kind::none ? "an " : "a ") + kind_name(kind);
}

// The slot of the handle; an empty one for a null, stale or invalid handle.
Slot slot_of(uint64_t handle) noexcept {
  const uint32_t index = static_cast<uint32_t>(handle);
  if (index == 0) return {};
  Table &t = table();
  std::shared_lock lock(t.mutex);
  if (index > t.slots.size()) return {};
  const Slot &slot = t.slots[index - 1];
  const bool fits =
      uint8_t(handle >> 32) == uint8_t(slot.kind) && (slot.generation & 0xffffff) == uint32_t(handle >> 40);
  return fits ? slot : Slot{};
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
  const Slot slot = slot_of(handle);
  return slot.kind == kind ? slot.object : nullptr;
}

Kind handle_kind(uint64_t handle) noexcept { return slot_of(handle).kind; }

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
  if (slot.generation != 0) t.free.push_back(index - 1);  // else an old handle would be valid again
}

void *handle_require(Kind kind, uint64_t handle) {
  const Slot slot = slot_of(handle);
  if (slot.kind == kind && slot.object) return slot.object;
  const unsigned long long value = handle;
  const char *const wanted = kind_name(kind);
  if (handle == 0)
    fail(DFM_E_HANDLE, "%s handle 0x0 is null; pass what a create or find function gave", wanted);
  if (slot.object)
    fail(DFM_E_HANDLE, "%s handle 0x%llx is that of %s; pass the handle of %s", wanted, value,
         a_kind(slot.kind).c_str(), a_kind(kind).c_str());
  if (uint8_t(handle >> 32) == uint8_t(kind))
    fail(DFM_E_HANDLE, "%s handle 0x%llx is stale; keep handles only while their object lives", wanted,
         value);
  fail(DFM_E_HANDLE, "%s handle 0x%llx refers to nothing; pass what a create or find function gave", wanted,
       value);
}

}  // namespace dfm
