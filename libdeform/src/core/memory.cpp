#include "core/memory.h"

#include <cstdlib>

namespace dfm {

const Memory &Memory::standard() {
  static const Memory memory{
      nullptr,
      [](void *, size_t bytes, size_t align) -> void * {
        if (bytes == 0) bytes = align;
        return std::aligned_alloc(align, (bytes + align - 1) / align * align);
      },
      [](void *, void *p, size_t, size_t) { std::free(p); }};
  return memory;
}

}  // namespace dfm
