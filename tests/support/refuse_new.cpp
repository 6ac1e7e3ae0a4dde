// Preloaded into a program, refuses its n-th operator new (REFUSE_NEW, counted from 0; none: no refusal) and
// writes how many there were to the file that REFUSE_NEW_COUNT names. Only the tests build it.
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> calls{0};

long refused() {
  static const long n = [] {
    const char *const text = std::getenv("REFUSE_NEW");
    return text ? std::atol(text) : -1L;
  }();
  return n;
}

void *take(size_t bytes, size_t align) {
  if (calls++ != refused())
    if (void *const p = align ? std::aligned_alloc(align, (bytes + align - 1) / align * align)
                              : std::malloc(bytes ? bytes : 1))
      return p;
  throw std::bad_alloc();
}

struct Count {
  ~Count() {
    const char *const path = std::getenv("REFUSE_NEW_COUNT");
    if (FILE *const file = path ? std::fopen(path, "w") : nullptr) {
      std::fprintf(file, "%ld\n", calls.load());
      std::fclose(file);
    }
  }
} count;

}  // namespace

void *operator new(size_t bytes) { return take(bytes, 0); }
void *operator new[](size_t bytes) { return take(bytes, 0); }
void *operator new(size_t bytes, std::align_val_t align) { return take(bytes, size_t(align)); }
void *operator new[](size_t bytes, std::align_val_t align) { return take(bytes, size_t(align)); }
