// Preloaded into a program, refuses its n-th operator new (REFUSE_NEW, counted from 0; none: no refusal) and
// writes how many there were to the file that REFUSE_NEW_COUNT names. They count from main() on: other
// libraries that the program loads may need memory before it. Only the tests build it.
#include <dlfcn.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

using Main = int (*)(int, char **, char **);
using Start = int (*)(Main, int, char **, void (*)(), void (*)(), void (*)(), void *);

std::atomic<bool> begun{false};
std::atomic<long> calls{0};
Main program = nullptr;

int begin(int argc, char **argv, char **env) {
  begun = true;
  return program(argc, argv, env);
}

long refused() {
  static const long n = [] {
    const char *const text = std::getenv("REFUSE_NEW");
    return text ? std::atol(text) : -1L;
  }();
  return n;
}

void *take(size_t bytes, size_t align) {
  if (!begun || calls++ != refused())
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

// What the C library begins a program by.
extern "C" __attribute__((visibility("default"))) int  //
__libc_start_main(Main main, int argc, char **argv, void (*init)(), void (*fini)(), void (*end_loader)(),
                  void *stack_end) {
  program = main;
  const Start start = reinterpret_cast<Start>(dlsym(RTLD_NEXT, "__libc_start_main"));
  return start(begin, argc, argv, init, fini, end_loader, stack_end);
}
