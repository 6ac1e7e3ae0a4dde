// Structs of callers whose header may be older or newer than the library (base.h, "structs of another
// version").
#pragma once
#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "api/first_size.h"
#include "core/error.h"

namespace dfm {

// No header has a def of this size: the size was not set.
constexpr uint32_t kMaxDef = 4096;

// A caller with a newer header must not set members that this library would ignore.
template <class T>
void refuse_unknown(const T *given) {
  const unsigned char *const bytes = reinterpret_cast<const unsigned char *>(given);
  for (size_t i = sizeof(T); i < given->size; ++i)
    if (bytes[i])
      fail(DFM_E_UNSUPPORTED,
           "a def has %u bytes, of which this library (%d.%d.%d) knows %zu, and byte %zu is set: the program "
           "was compiled for a newer library; run it with that one, or leave the def's newer members zero",
           given->size, DFM_VERSION_MAJOR, DFM_VERSION_MINOR, DFM_VERSION_PATCH, sizeof(T), i);
}

// Copies the part of a def that the caller's version of the struct has; the rest keeps its default.
template <class T>
T take_known(const T *given, const T &defaults) {
  T def = defaults;
  if (!given) return def;
  if (given->size < 2 * sizeof(uint32_t) || given->size > kMaxDef)
    fail(DFM_E_ARG,
         "a def's size is %u; start from its _default() function, or set size to sizeof where it has none",
         given->size);
  std::memcpy(static_cast<void *>(&def), given, given->size < sizeof(T) ? given->size : sizeof(T));
  def.size = sizeof(T);
  return def;
}
// The cookie that a default function writes into a def. Headers of 0.1 have no member for it.
constexpr uint64_t kCookie = 0x6d726f666564;

template <class T>
void check_cookie(const T *given) {
  if constexpr (requires { given->cookie; }) {
    if (given->size >= offsetof(T, cookie) + sizeof given->cookie && given->cookie != kCookie)
      fail(DFM_E_ARG, "this %s was not made by %s_default(); start from that and set what differs",
           kStructName<T>, kStructName<T>);
  }
}

// Unknown flags are refused, not ignored.
template <class T>
void check_flags(const T &def, uint32_t known, const char *whose) {
  if (const uint32_t other = def.flags & ~known)
    fail(DFM_E_ARG, "%s: flags 0x%x: 0x%x is unknown; %s", whose, def.flags, other,
         known ? "see its header for those that there are" : "leave them 0");
}

// And nothing beyond it.
template <class T>
T take_def(const T *given, const T &defaults) {
  const T def = take_known(given, defaults);
  if (!given) return def;
  refuse_unknown(given);
  check_cookie(given);
  return def;
}

// An array of defs with the stride given by the size of the first: the caller's header may be older or newer.
template <class T>
std::vector<T> take_defs(const T *given, uint32_t n, const T &defaults, const char *what, const char *from) {
  std::vector<T> defs;
  if (!given || n == 0) return defs;
  const uint32_t step = given->size;
  if (step < 2 * sizeof(uint32_t) || step % alignof(T) != 0 || step > kMaxDef)
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

// A struct that a def points to, converted to the size of this library in `own`. An impossible size is left
// for the reader, who refuses it by name.
template <class T>
void take_pointed(const T *&given, T &own) {
  if (!given || given->size < kFirstSize<T>) return;
  own = take_def(given, T{});
  given = &own;
}

// The defaults of a def in the size of the caller's struct: members unknown to this library are zero.
template <class T>
void write_default(uint32_t size, T *out, std::type_identity_t<T> value) noexcept {
  if (!out) return;
  value.size = sizeof value;
  if constexpr (requires { value.cookie; }) value.cookie = kCookie;
  std::memset(static_cast<void *>(out), 0, size);
  std::memcpy(static_cast<void *>(out), &value, std::min<size_t>(size, sizeof(T)));
  if (size >= sizeof out->size) out->size = size;
}

// Fills the part of an out struct that the caller's version has. size 0: that of 0.1.
template <class T>
void copy_out(T *out, T value) {
  static_assert(kFirstSize<T> != 0 && kFirstSize<T> <= sizeof(T));
  if (!out) fail(DFM_E_ARG, "the out argument is NULL");
  const uint32_t requested = out->size ? out->size : kFirstSize<T>;
  const uint32_t size = std::min(requested, static_cast<uint32_t>(sizeof(T)));
  value.size = size;
  std::memcpy(static_cast<void *>(out), &value, size);
}

}  // namespace dfm
