// Counts what a test program takes from the heap: its own operator new stands in for the library's, so what
// the library takes beside the context's hooks is counted too. Include it in one source of the program.
#pragma once
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace test {

inline std::atomic<uint64_t> heap_calls{0}, heap_bytes{0};  // since the program began

inline void *counted_alloc(size_t bytes, size_t align) {
  ++heap_calls;
  heap_bytes += bytes;
  if (void *p = align > sizeof(void *) ? std::aligned_alloc(align, (bytes + align - 1) / align * align)
                                       : std::malloc(bytes ? bytes : 1))
    return p;
  throw std::bad_alloc();
}

inline void *counted_or_null(size_t bytes, size_t align) noexcept {
  try {
    return counted_alloc(bytes, align);
  } catch (const std::bad_alloc &) {
    return nullptr;
  }
}

// Out of line: where a compiler sees free() behind its own operator new, it calls them mismatched.
[[gnu::noinline]] inline void counted_free(void *p) noexcept { std::free(p); }

}  // namespace test

void *operator new(size_t bytes) { return test::counted_alloc(bytes, 0); }
void *operator new[](size_t bytes) { return test::counted_alloc(bytes, 0); }
void *operator new(size_t bytes, std::align_val_t align) { return test::counted_alloc(bytes, size_t(align)); }
void *operator new[](size_t bytes, std::align_val_t align) {
  return test::counted_alloc(bytes, size_t(align));
}
// Under a sanitizer these would be the sanitizer's own, and not fit the delete below.
void *operator new(size_t bytes, const std::nothrow_t &) noexcept { return test::counted_or_null(bytes, 0); }
void *operator new[](size_t bytes, const std::nothrow_t &) noexcept {
  return test::counted_or_null(bytes, 0);
}
void *operator new(size_t bytes, std::align_val_t align, const std::nothrow_t &) noexcept {
  return test::counted_or_null(bytes, size_t(align));
}
void *operator new[](size_t bytes, std::align_val_t align, const std::nothrow_t &) noexcept {
  return test::counted_or_null(bytes, size_t(align));
}
void operator delete(void *p) noexcept { test::counted_free(p); }
void operator delete[](void *p) noexcept { test::counted_free(p); }
void operator delete(void *p, size_t) noexcept { test::counted_free(p); }
void operator delete[](void *p, size_t) noexcept { test::counted_free(p); }
void operator delete(void *p, std::align_val_t) noexcept { test::counted_free(p); }
void operator delete[](void *p, std::align_val_t) noexcept { test::counted_free(p); }
void operator delete(void *p, size_t, std::align_val_t) noexcept { test::counted_free(p); }
void operator delete[](void *p, size_t, std::align_val_t) noexcept { test::counted_free(p); }
