#include "core/memory.h"

#include "core/error.h"
#include "core/system.h"

namespace dfm {

void need_memory(uint64_t bytes, const char *what) {
  static const uint64_t most = os::memory_of_machine();
  if (bytes > most)
    fail(DFM_E_NOMEM, "%s needs about %.1f GiB of memory, and this machine has %.1f GiB; reduce the size",
         what, double(bytes) / double(1u << 30), double(most) / double(1u << 30));
}

const Memory &Memory::standard() {
  static const Memory memory{nullptr,
                             [](void *, size_t bytes, size_t align) { return os::allocate(bytes, align); },
                             [](void *, void *p, size_t, size_t) { os::deallocate(p); }};
  return memory;
}

}  // namespace dfm
