#include "core/memory.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/error.h"

namespace dfm {
namespace {

uint64_t memory_of_machine() {
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  uint64_t most = pages > 0 && page > 0 ? uint64_t(pages) * uint64_t(page) : UINT64_MAX;
  // A container's own limit; the file holds "max" where there is none.
  const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen("/sys/fs/cgroup/memory.max", "re"),
                                                    std::fclose);
  unsigned long long limit = 0;
  if (file && std::fscanf(file.get(), "%llu", &limit) == 1 && limit > 0)
    most = std::min<uint64_t>(most, limit);
  return most;
}

}  // namespace

void need_memory(uint64_t bytes, const char *what) {
  static const uint64_t most = memory_of_machine();
  if (bytes > most)
    fail(DFM_E_NOMEM, "%s needs about %.1f GiB of memory, and there are %.1f GiB in all; ask for less", what,
         double(bytes) / double(1u << 30), double(most) / double(1u << 30));
}

const Memory &Memory::standard() {
  static const Memory memory{nullptr,
                             [](void *, size_t bytes, size_t align) -> void * {
                               if (bytes == 0) bytes = align;
                               return std::aligned_alloc(align, (bytes + align - 1) / align * align);
                             },
                             [](void *, void *p, size_t, size_t) { std::free(p); }};
  return memory;
}

}  // namespace dfm
