// Refuses one allocation of a chosen number, whether it is asked of the context's hooks or of operator new,
// and counts them all. The program's own operator new stands in for the library's. Include it in one source
// of the program.
#pragma once
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "deform/deform.h"

namespace test {

struct Refusal {
  static inline std::atomic<int64_t> calls{0}, refuse{-1}, live{0};
  // True where this allocation is the one. Only between arm() and disarm().
  static bool now() { return refuse >= 0 && calls++ == refuse; }
  static void arm(int64_t n) {
    calls = 0;
    refuse = n;
  }
  // Whether it came to that.
  static bool disarm() {
    const bool came = calls > refuse;
    refuse = -1;
    return came;
  }
};

inline void *taken(size_t bytes, size_t align) {
  if (Refusal::now()) return nullptr;
  void *const p = align > sizeof(void *) ? std::aligned_alloc(align, (bytes + align - 1) / align * align)
                                         : std::malloc(bytes ? bytes : 1);
  Refusal::live += p != nullptr;
  return p;
}

inline void *taken_or_thrown(size_t bytes, size_t align) {
  if (void *const p = taken(bytes, align)) return p;
  throw std::bad_alloc();
}

// Out of line: where a compiler sees free() behind its own operator new, it calls them mismatched.
[[gnu::noinline]] inline void given_back(void *p) noexcept {
  Refusal::live -= p != nullptr;
  std::free(p);
}

inline dfm_context_def refusing_context() {
  dfm_context_def d = dfm_context_def_default();
  d.log = [](void *, int32_t, const char *) {};
  d.alloc = [](void *, size_t bytes, size_t align) { return taken(bytes + align, align); };
  d.release = [](void *, void *p, size_t, size_t) { given_back(p); };
  return d;
}

}  // namespace test

void *operator new(size_t bytes) { return test::taken_or_thrown(bytes, 0); }
void *operator new[](size_t bytes) { return test::taken_or_thrown(bytes, 0); }
void *operator new(size_t bytes, std::align_val_t align) {
  return test::taken_or_thrown(bytes, size_t(align));
}
void *operator new[](size_t bytes, std::align_val_t align) {
  return test::taken_or_thrown(bytes, size_t(align));
}
void operator delete(void *p) noexcept { test::given_back(p); }
void operator delete[](void *p) noexcept { test::given_back(p); }
void operator delete(void *p, size_t) noexcept { test::given_back(p); }
void operator delete[](void *p, size_t) noexcept { test::given_back(p); }
void operator delete(void *p, std::align_val_t) noexcept { test::given_back(p); }
void operator delete[](void *p, std::align_val_t) noexcept { test::given_back(p); }
void operator delete(void *p, size_t, std::align_val_t) noexcept { test::given_back(p); }
void operator delete[](void *p, size_t, std::align_val_t) noexcept { test::given_back(p); }
