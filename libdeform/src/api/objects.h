// Objects of handles, for the files of api/: each function throws Error(DFM_E_HANDLE).
#pragma once
#include <cstring>
#include <functional>
#include <memory>

#include "api/as_status.h"
#include "api/structs.h"
#include "core/error.h"
#include "core/handle.h"
#include "core/names.h"
#include "plugin/context.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {

// Registers an object of a context as in use by this call.
template <class T>
T &held(T &object, dfm_context &context) {
  Call::now().hold(&object);
  Call::now().hold(&context);
  Call::now().count(context.calls);
  return object;
}
inline World &held(World &w) { return held(w, *w.context); }
inline World &world_of(dfm_world h) { return held(resolve<World>(Kind::world, h)); }
template <class Part>
Part &part_of(Kind kind, uint64_t h) {
  Part &part = resolve<Part>(kind, h);
  held(*part.world);
  return part;
}
// Points may be late (Dynamics::see_points): calls that read only points of the surface use these functions.
inline Body &any_body_of(dfm_body h) { return part_of<Body>(Kind::body, h); }
// A body that has cells.
inline Body &shown_body_of(dfm_body h) {
  Body &b = any_body_of(h);
  if (b.rolled_back)
    refuse(b, DFM_E_STATE,
           " does not exist in the restored snapshot, which is older than the cut that made it; destroy it, "
           "or restore a later snapshot");
  if (b.emptied)
    refuse(b, DFM_E_STATE,
           " has no cells left: a cut has taken them all; destroy it, or restore a snapshot from before");
  return b;
}
inline Body &body_of(dfm_body h) {
  Body &b = shown_body_of(h);
  if (!b.world->busy) b.dynamics->see_points();
  return b;
}
// For calls that ask the model, which a step may be using.
inline Body &still_body_of(dfm_body h) {
  if (any_body_of(h).world->busy) Call::refuse("world");
  return body_of(h);
}
// For calls that read all points of all bodies.
inline World &whole(World &w) {
  for (auto &b : w.bodies) b->dynamics->see_points();
  return w;
}
inline Obstacle &obstacle_of(dfm_obstacle h) { return part_of<Obstacle>(Kind::obstacle, h); }
inline Material &material_of(dfm_material h) { return part_of<Material>(Kind::material, h); }

// For calls that change the world: no other call may be in progress on it, neither an outer call nor one on
// another thread.
inline World &exclusive(World &w) {
  Call::now().change(&w, w.busy, "world");
  return w;
}

// For calls that read arrays which are incomplete during a step.
inline World &not_in_step(World &w) {
  if (w.busy) Call::refuse("world");
  return w;
}

// The same for a body, an obstacle or a tool, of its world.
template <class Part>
Part &exclusive(Part &part) {
  exclusive(*part.world);
  return part;
}
template <class Part>
Part &not_in_step(Part &part) {
  not_in_step(*part.world);
  return part;
}

// Ends what keep_live() below keeps.
template <Kind kKind, class T>
void end_live(uint64_t handle) {
  T *const object = static_cast<T *>(handle_find(kKind, handle));
  handle_destroy(handle);
  delete object;
}

// Gives an object to a context, which ends it by `end` if the host does not; returns its handle.
template <class T>
uint64_t keep_live(dfm_context &context, Kind kind, std::unique_ptr<T> object, void (*end)(uint64_t)) {
  const uint64_t handle = handle_create(kind, object.get());
  try {
    context.add_live(handle, end);
  } catch (...) {
    handle_destroy(handle);
    throw;
  }
  object.release();
  return handle;
}

inline dfm_context &require(dfm_context *context) {
  if (!context) fail(DFM_E_ARG, "the context is NULL; create one with dfm_context_create");
  return *context;
}

// For calls that create something in a context.
inline dfm_context &used(dfm_context &context) {
  if (context.ending) Call::refuse("context");
  Call::now().hold(&context);
  Call::now().count(context.calls);
  return context;
}

// For calls that change the plugins of a context.
inline dfm_context &exclusive(dfm_context &context) {
  Call::now().need_alone(&context, "context");
  return used(context);
}

inline void need(const void *p, const char *name) {
  if (!p) fail(DFM_E_ARG, "argument '%s' is NULL", name);
}

// How a call takes the object of a handle, for as_status() below.
template <auto kOf>
auto &to_change(uint64_t h) {
  return exclusive(kOf(h));
}
template <auto kOf>
auto &to_read(uint64_t h) {
  return not_in_step(kOf(h));
}
inline World &whole_to_change(uint64_t h) { return whole(exclusive(world_of(h))); }

// A call on one object: `of` finds and takes it, f gets it.
template <class Of, class F>
dfm_status as_status(Of of, uint64_t handle, F &&f) noexcept {
  return as_status([&] { return f(of(handle)); });
}

inline constexpr auto kAny = [](const auto &) { return true; };

// The handle of the one with this name among those for which counts() is true. what: "tool", for the error.
template <class All, class Counts = decltype(kAny)>
void find_named(const All &all, const char *what, const char *name, uint64_t *out, Counts counts = kAny) {
  need(name, "name");
  need(out, "out");
  std::vector<std::string> names;
  for (const auto &x : all) {
    if (!counts(*x)) continue;
    if (x->name == name) {
      *out = x->handle;
      return;
    }
    names.push_back(x->name);
  }
  if (names.empty()) fail(DFM_E_ARG, "no %s is named '%s'; the world has none", what, name);
  fail(DFM_E_ARG, "no %s is named '%s'%s; there are: %s", what, name, did_you_mean(name, names, '\'').c_str(),
       join(names).c_str());
}

// Body or obstacle of this world.
inline uint64_t id_of(const World &w, uint64_t handle, const char *what) {
  for (auto &b : w.bodies)
    if (b->handle == handle) return b->id;
  for (auto &o : w.obstacles)
    if (o->handle == handle) return o->id;
  fail(DFM_E_HANDLE, "'%s' is not a body or obstacle of this world", what);
}

// The two-call convention: writes the count always, the data if there is room. Returns true if the data
// should be copied.
inline bool room(size_t size, uint32_t capacity, const void *out, uint32_t *n) {
  const uint32_t count = static_cast<uint32_t>(size);
  if (n) *n = count;
  if (!out && capacity == 0) return false;
  if (capacity < count || !out)
    fail(DFM_E_ARG, "capacity %u is too small for %u entries; call with capacity 0 to learn the number",
         capacity, count);
  return true;
}

// A text or buffer whose size the caller queries first.
inline void copy_bytes(const void *data, size_t size, void *to, size_t *bytes) {
  need(bytes, "bytes");
  const size_t room = *bytes;
  *bytes = size;
  if (!to) return;
  if (room < size)
    fail(DFM_E_ARG, "the buffer has %zu bytes, %zu are needed; call with NULL to learn the size", room, size);
  std::memcpy(to, data, size);
}

// of(x) for each x of a list, by that convention.
template <class List, class T, class Of = std::identity>
void copy_list(const List &list, uint32_t capacity, T *out, uint32_t *n, Of of = {}) {
  if (!room(std::size(list), capacity, out, n)) return;
  for (const auto &x : list) *out++ = of(x);
}
// [count,3] by it, of(i) each.
template <class Of>
void copy_vectors(uint32_t count, uint32_t capacity, double *out, uint32_t *n, Of of) {
  if (!room(count, capacity, out, n)) return;
  for (uint32_t i = 0; i < count; ++i) store3(out + size_t(3) * i, of(i));
}
// Handles of things.
inline constexpr auto kHandle = [](const auto &thing) { return thing->handle; };

// The rows of a list in the caller's memory, row_size bytes each: members unknown to the caller's header are
// left out, those unknown to this library are zero. `size`, if the row has one, is the number of bytes
// written.
template <class T>
class Rows {
 public:
  Rows(T *out, uint32_t row_size, const char *type)
      : at_(reinterpret_cast<unsigned char *>(out)), step_(row_size) {
    if (row_size < kMin || row_size % kMin != 0)
      fail(DFM_E_ARG,
           "row_size %u is not the size of a %s: expected a multiple of %zu (%zu in this version); pass "
           "sizeof(%s)",
           row_size, type, kMin, sizeof(T), type);
  }
  void add(T row) {
    const size_t known = step_ < sizeof(T) ? step_ : sizeof(T);
    if constexpr (requires { row.size; }) row.size = static_cast<uint32_t>(known);
    std::memcpy(at_, &row, known);
    std::memset(at_ + known, 0, step_ - known);
    at_ += step_;
  }

 private:
  static constexpr size_t kMin = 8;  // `size` and one more; rows are aligned to it
  static_assert(sizeof(T) % kMin == 0);
  unsigned char *at_;
  size_t step_;
};

}  // namespace dfm
