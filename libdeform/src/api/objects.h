// Handles to objects for the files of api/: each throws Error(DFM_E_HANDLE).
#pragma once
#include <cstring>
#include <vector>

#include "api/as_status.h"
#include "core/handle.h"
#include "state/world.h"

namespace dfm {

inline World &held(World &w) {
  Call::now().hold(&w);
  Call::now().hold(w.context);
  Call::now().count(w.context->calls);
  return w;
}
inline World &world_of(dfm_world h) { return held(resolve<World>(Kind::world, h)); }
template <class Part>
Part &part_of(Kind kind, uint64_t h) {
  Part &part = resolve<Part>(kind, h);
  held(*part.world);
  return part;
}
inline Body &body_of(dfm_body h) { return part_of<Body>(Kind::body, h); }
inline Obstacle &obstacle_of(dfm_obstacle h) { return part_of<Obstacle>(Kind::obstacle, h); }
inline Material &material_of(dfm_material h) { return part_of<Material>(Kind::material, h); }

// For calls that change the world: no other one may be inside it, neither around this one nor on
// another thread.
inline World &exclusive(World &w) {
  Call::now().change(&w, w.busy, "world");
  return w;
}

// For calls that read arrays which a step has in pieces.
inline World &settled(World &w) {
  if (w.busy) Call::refuse("world");
  return w;
}

// For calls that make something in a context.
inline dfm_context &used(dfm_context &context) {
  if (context.ending) Call::refuse("context");
  Call::now().hold(&context);
  Call::now().count(context.calls);
  return context;
}

// For calls that change what a context has loaded.
inline dfm_context &exclusive(dfm_context &context) {
  Call::now().need_alone(&context, "context");
  return used(context);
}

// The part of a def that the caller's version of the struct has; the rest keeps its default.
template <class T>
T take_def(const T *given, const T &defaults) {
  T def = defaults;
  if (!given) return def;
  if (given->size < 2 * sizeof(uint32_t))
    fail(DFM_E_ARG, "a def's size is %u; start from its _default() function", given->size);
  std::memcpy(static_cast<void *>(&def), given, given->size < sizeof(T) ? given->size : sizeof(T));
  def.size = sizeof(T);
  return def;
}

// Defs that lie side by side, as far apart as the first one's size says: the caller's header may be
// older or newer.
template <class T>
std::vector<T> take_defs(const T *given, uint32_t n, const T &defaults, const char *what, const char *from) {
  constexpr uint32_t kMost = 4096;  // no header has such a def: a size that nobody has set
  std::vector<T> defs;
  if (!given || n == 0) return defs;
  const uint32_t step = given->size;
  if (step < 2 * sizeof(uint32_t) || step % alignof(T) != 0 || step > kMost)
    fail(DFM_E_ARG, "%s 0: size is %u, expected %zu; %s", what, step, sizeof(T), from);
  defs.reserve(n);
  for (uint32_t i = 0; i < n; ++i) {
    const T *const at =
        reinterpret_cast<const T *>(reinterpret_cast<const unsigned char *>(given) + size_t{step} * i);
    if (at->size != step)
      fail(DFM_E_ARG, "%s %u: size is %u, that of the first is %u; %s", what, i, at->size, step, from);
    defs.push_back(take_def(at, defaults));
  }
  return defs;
}

// Fills the part of an out struct that the caller's version has. size 0: taken as today's size.
template <class T>
void give(T *out, T value) {
  if (!out) fail(DFM_E_ARG, "the out argument is NULL");
  const uint32_t size = out->size && out->size < sizeof(T) ? out->size : static_cast<uint32_t>(sizeof(T));
  value.size = size;
  std::memcpy(static_cast<void *>(out), &value, size);
}

inline void need(const void *p, const char *name) {
  if (!p) fail(DFM_E_ARG, "argument '%s' is NULL", name);
}

// The two-call convention: the count always, the data where there is room. True: copy.
inline bool room(uint32_t count, uint32_t capacity, const void *out, uint32_t *n) {
  if (n) *n = count;
  if (!out && capacity == 0) return false;
  if (capacity < count || !out)
    fail(DFM_E_ARG, "capacity %u is too small for %u entries; call with capacity 0 to learn the number",
         capacity, count);
  return true;
}

// The rows of a list in the caller's memory, row_size bytes each: members that the caller's header lacks
// are left out, those that this library lacks read zero. `size`, where the row has one, says how many bytes
// are filled in.
template <class T>
class Rows {
 public:
  Rows(T *out, uint32_t row_size, const char *type)
      : at_(reinterpret_cast<unsigned char *>(out)), step_(row_size) {
    if (row_size < kLeast || row_size % kLeast != 0)
      fail(DFM_E_ARG,
           "row_size %u is no size of a %s: it is a multiple of %zu, %zu in this version; pass sizeof(%s)",
           row_size, type, kLeast, sizeof(T), type);
  }
  void add(T row) {
    const size_t known = step_ < sizeof(T) ? step_ : sizeof(T);
    if constexpr (requires { row.size; }) row.size = static_cast<uint32_t>(known);
    std::memcpy(at_, &row, known);
    std::memset(at_ + known, 0, step_ - known);
    at_ += step_;
  }

 private:
  static constexpr size_t kLeast = 8;  // `size` and one more; rows are aligned to it
  static_assert(sizeof(T) % kLeast == 0);
  unsigned char *at_;
  size_t step_;
};

}  // namespace dfm
