// Where arrays of a context's own memory begin.
#include "core/memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

namespace {

using dfm::Memory;

TEST(Memory, BlocksOfAnySize_AreAlignedAsRequested) {
  const Memory &m = Memory::standard();
  for (const size_t bytes :
       {size_t(0), size_t(1), size_t(1) << 12, (size_t(2) << 20) - 1, size_t(2) << 20, (size_t(5) << 20) + 3})
    for (const size_t align : {size_t(8), size_t(64), size_t(4096), size_t(4) << 20}) {
      void *const p = m.alloc(m.user, bytes, align);
      ASSERT_NE(p, nullptr);
      EXPECT_EQ(reinterpret_cast<uintptr_t>(p) % align, 0u) << bytes << " " << align;
      std::memset(p, 1, bytes);
      m.release(m.user, p, bytes, align);
    }
}

// A huge page that is asked for is there only where it begins.
TEST(Memory, LargeBlocks_BeginAtAHugePage) {
  const Memory &m = Memory::standard();
  for (const size_t bytes : {size_t(2) << 20, size_t(7) << 20}) {
    void *const p = m.alloc(m.user, bytes, 64);
    EXPECT_EQ(reinterpret_cast<uintptr_t>(p) % (size_t(2) << 20), 0u);
    m.release(m.user, p, bytes, 64);
  }
}

TEST(Memory, MoreThanThereIs_GivesNothing) {
  const Memory &m = Memory::standard();
  EXPECT_EQ(m.alloc(m.user, SIZE_MAX / 2, 64), nullptr);
}

}  // namespace
