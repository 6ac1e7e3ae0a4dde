// Values and lists of values as bytes, one after the other, and back: a template over the stream names them
// once for both directions. Numbers lie as this machine has them, which is little-endian wherever the library
// runs.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/error.h"

namespace dfm {

class ByteWriter {
 public:
  explicit ByteWriter(std::string &out) : out_(out) {}
  template <class T>
  void one(const T &x) {
    static_assert(std::is_trivially_copyable_v<T>);
    out_.append(reinterpret_cast<const char *>(&x), sizeof x);
  }
  template <class C>
  void many(const C &c) {
    count(c);
    out_.append(reinterpret_cast<const char *>(c.data()), c.size() * sizeof c[0]);
  }
  template <class C>
  void count(const C &c) {
    one(uint64_t{c.size()});
  }

 private:
  std::string &out_;
};

class ByteReader {
 public:
  // what: they are, for the error of bytes that do not fit
  ByteReader(std::string_view in, const char *what) : left_(in), what_(what) {}
  bool ended() const { return left_.empty(); }
  template <class T>
  void one(T &x) {
    std::memcpy(&x, next(1, sizeof x), sizeof x);
  }
  template <class C>
  void many(C &c) {
    uint64_t n = 0;
    one(n);
    const char *const from = next(n, sizeof c[0]);
    c.resize(n);
    if (n > 0) std::memcpy(static_cast<void *>(c.data()), from, n * sizeof c[0]);
  }
  // Reads a list of things of which so many are left, or that follow, each of some bytes.
  template <class C>
  void count(C &c) {
    uint64_t n = 0;
    one(n);
    if (n > std::max(left_.size(), c.size())) refuse();
    c.resize(n);
  }
  [[noreturn]] void refuse() const { fail(DFM_E_FORMAT, "the %s is cut short or damaged", what_); }

 private:
  std::string_view left_;
  const char *what_;
  const char *next(uint64_t n, size_t size) {
    if (n > left_.size() / size) refuse();
    const char *const at = left_.data();
    left_.remove_prefix(n * size);
    return at;
  }
};

}  // namespace dfm
