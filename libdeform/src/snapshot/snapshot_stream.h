// Writing, reading and checking the bytes of a snapshot. One list of fields (snapshot_fields.h) is used for
// both directions: each line gives name, location and valid values of a field.
//
//   bytes 0  "dfmsnap" 0 | u32 version | u32 0 | u64 length of all | u64 hash of what must be the same in
//   both worlds | u64 checksum | fields
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "deform/math.h"
#include "math/vec3.h"
#include "state/motion.h"

namespace dfm {

struct SnapshotHead {
  char magic[8];
  uint32_t version, zero;
  uint64_t length, structure, checksum;  // checksum: of all bytes except its own
};
inline constexpr char kSnapshotMagic[8] = {'d', 'f', 'm', 's', 'n', 'a', 'p', 0};
inline constexpr uint32_t kSnapshotVersion = 35;

inline uint64_t snapshot_checksum(const unsigned char *data, size_t bytes) {
  Hash h;
  h.add(data, offsetof(SnapshotHead, checksum));
  h.add(data + sizeof(SnapshotHead), bytes - sizeof(SnapshotHead));
  return h.value;
}

// Valid values; `what` completes "expected".
namespace must {

template <class Is>
struct Be {
  Is is;
  const char *what;
};
template <class Is>
Be(Is, const char *) -> Be<Is>;

inline bool all_finite(double x) { return std::isfinite(x); }
using dfm::all_finite;
inline bool all_finite(const Vec3 &v) { return all_finite(&v.x, 3); }
template <size_t n>
bool all_finite(const double (&x)[n]) {
  return all_finite(x, n);
}
inline bool all_finite(const dfm_sine &s) {
  return all_finite(s.amplitude) && all_finite(s.frequency) && all_finite(s.phase);
}

inline constexpr Be any{[](const auto &) { return true; }, "anything"};
inline constexpr Be finite{[](const auto &x) { return all_finite(x); }, "a finite number"};
inline constexpr Be not_negative{[](double x) { return x >= 0 && std::isfinite(x); },
                                 "a finite number that is not negative"};
inline constexpr Be positive{[](double x) { return x > 0 && std::isfinite(x); },
                             "a finite number above zero"};
// The length of quaternions comes from hosts, so it need not be exact.
inline constexpr Be rotation{[](const double (&q)[4]) {
                               const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
                               return n > 0.25 && n < 4;
                             },
                             "a unit quaternion"};
inline constexpr Be pose{[](const Pose &p) {
                           const double q[4] = {p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w};
                           return all_finite(p.position) && rotation.is(q);
                         },
                         "a finite position and a unit quaternion"};
// As the host gave it: a rotation of any length.
inline constexpr Be given_pose{
    [](const dfm_pose &p) { return all_finite(p.position) && all_finite(p.rotation); }, "a finite pose"};
inline constexpr Be flag{[](auto x) { return x == 0 || x == 1; }, "0 or 1"};
inline auto below(uint64_t n) {
  return Be{[n](uint64_t x) { return x < n; }, "a number of something that is there"};
}
inline auto at_most(uint64_t n) {
  return Be{[n](uint64_t x) { return x <= n; }, "a smaller number"};
}

}  // namespace must

// `count` of an array: exactly this; kAnyCount: as many as the bytes allow.
inline constexpr uint64_t kAnyCount = ~uint64_t{0};

class SnapshotWriter {
 public:
  explicit SnapshotWriter(std::vector<unsigned char> &out) : out_(out) {}
  void bytes(const void *p, size_t n) {
    const unsigned char *const from = static_cast<const unsigned char *>(p);
    if (n) out_.insert(out_.end(), from, from + n);
  }
  void where(const char *, const std::string &) {}
  template <class T, class B>
  void value(const char *, const T &x, const B &) {
    bytes(&x, sizeof x);
  }
  template <class A, class B>
  void array(const char *, const A &a, uint64_t, const B &) {
    count(a.size());
    bytes(a.data(), a.size() * sizeof a[0]);
  }
  template <class A, class F>
  void list(const char *, const A &a, F f) {
    count(a.size());
    for (const auto &x : a) f(x);
  }
  template <class A, class F>
  void members(const char *name, const A &a, uint64_t, F f) {
    list(name, a, f);
  }
  template <class F>
  void must_hold(const char *, const char *, F) {}

 private:
  void count(uint64_t n) { bytes(&n, sizeof n); }
  std::vector<unsigned char> &out_;
};

// Allocates no more memory than the given bytes can fill, and refuses the whole snapshot if something does
// not fit.
class SnapshotReader {
 public:
  SnapshotReader(const unsigned char *begin, const unsigned char *end) : p_(begin), end_(end) {}
  // Whose fields are being read, for error messages.
  void where(const char *kind, const std::string &name) {
    where_ = name.empty() ? std::string() : std::string(kind) + " '" + name + "': ";
  }
  bool at_end() const { return p_ == end_; }

  template <class T, class B>
  void value(const char *name, T &x, const B &be) {
    static_assert(std::is_trivially_copyable_v<T>);
    if constexpr (std::is_same_v<T, bool>) {
      uint8_t byte;
      bytes(name, &byte, sizeof byte);
      if (byte > 1) refuse(name, must::flag.what);
      x = byte;
    } else {
      bytes(name, &x, sizeof x);
      if (!be.is(x)) refuse(name, be.what);
    }
  }
  template <class A, class B>
  void array(const char *name, A &a, uint64_t expected, const B &be) {
    using T = std::remove_cvref_t<decltype(a[0])>;
    static_assert(std::is_trivially_copyable_v<T> && !std::is_same_v<T, bool>);
    const uint64_t n = count(name, expected, sizeof(T));
    a.resize(size_t(n));
    bytes(name, a.data(), size_t(n) * sizeof(T));
    for (const T &x : a)
      if (!be.is(x)) refuse(name, be.what);
  }
  // A list of entries; each has at least 8 bytes, and is created only when it is read.
  template <class A, class F>
  void list(const char *name, A &a, F f) {
    const uint64_t n = count(name, kAnyCount, 8);
    a.clear();
    for (uint64_t i = 0; i < n; ++i) f(a.emplace_back());
  }
  // A list that the world also has, of the same length.
  template <class A, class F>
  void members(const char *name, A &a, uint64_t expected, F f) {
    a.resize(size_t(count(name, expected, 1)));
    for (auto &x : a) f(x);
  }
  template <class F>
  void must_hold(const char *name, const char *what, F holds) {
    if (!holds()) refuse(name, what);
  }
  [[noreturn]] void refuse(const char *name, const char *what) const {
    fail(DFM_E_FORMAT, "the snapshot is damaged: %s%s: expected %s; nothing was restored", where_.c_str(),
         name, what);
  }

 private:
  void bytes(const char *name, void *to, size_t n) {
    if (size_t(end_ - p_) < n) refuse(name, "more bytes than there are");
    if (n) std::memcpy(to, p_, n);
    p_ += n;
  }
  uint64_t count(const char *name, uint64_t expected, size_t entry) {
    uint64_t n;
    bytes(name, &n, sizeof n);
    if (expected != kAnyCount && n != expected) refuse(name, "as many as this world has");
    if (n > uint64_t(end_ - p_) / entry) refuse(name, "no more than there are bytes for");
    return n;
  }
  const unsigned char *p_, *end_;
  std::string where_;
};

}  // namespace dfm
