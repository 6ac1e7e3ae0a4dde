// FNV-1a, 64 bit.
#pragma once
#include <cstddef>
#include <cstdint>

namespace dfm {

struct Hash {
  uint64_t value = 14695981039346656037ull;
  void add(const void *data, size_t bytes) {
    const unsigned char *p = static_cast<const unsigned char *>(data);
    for (size_t i = 0; i < bytes; ++i) value = (value ^ p[i]) * 1099511628211ull;
  }
  template <class T>
  void add(const T &x) {
    add(&x, sizeof x);
  }
  template <class... List>
  void list(const List &...lists) {
    (add(lists.data(), lists.size() * sizeof lists[0]), ...);
  }
};

}  // namespace dfm
