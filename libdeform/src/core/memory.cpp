#include "core/memory.h"

#include <sys/mman.h>
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
  // The limit of the process's control group; the file contains "max" if there is none.
  const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen("/sys/fs/cgroup/memory.max", "re"),
                                                    std::fclose);
  unsigned long long limit = 0;
  if (file && std::fscanf(file.get(), "%llu", &limit) == 1 && limit > 0)
    most = std::min<uint64_t>(most, limit);
  return most;
}

// Size of a huge page on x86-64 (512 small pages).
constexpr size_t kHugePage = size_t(2) << 20;

// A step of a large body reads tens of arrays at the same time and exceeds the processor's buffer of page
// addresses. Large arrays therefore request huge pages, if the system grants them on request.
void *allocate(size_t bytes, size_t align) {
  if (bytes == 0) bytes = align;
  if (bytes < kHugePage || align > kHugePage)
    return std::aligned_alloc(align, (bytes + align - 1) / align * align);
  void *p = nullptr;
  if (posix_memalign(&p, kHugePage, bytes) != 0) return nullptr;
#ifdef MADV_HUGEPAGE
  madvise(p, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);  // advice only; a failure has no effect
#endif
  return p;
}

}  // namespace

void need_memory(uint64_t bytes, const char *what) {
  static const uint64_t most = memory_of_machine();
  if (bytes > most)
    fail(DFM_E_NOMEM, "%s needs about %.1f GiB of memory, and this machine has %.1f GiB; reduce the size",
         what, double(bytes) / double(1u << 30), double(most) / double(1u << 30));
}

const Memory &Memory::standard() {
  static const Memory memory{nullptr,
                             [](void *, size_t bytes, size_t align) { return allocate(bytes, align); },
                             [](void *, void *p, size_t, size_t) { std::free(p); }};
  return memory;
}

}  // namespace dfm
