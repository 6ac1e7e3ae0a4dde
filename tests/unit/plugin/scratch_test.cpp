#include "plugin/scratch.h"

#include <gtest/gtest.h>

#include <cstring>
#include <thread>

namespace {

struct Counting {
  size_t live = 0, calls = 0;
  dfm::Memory memory{this,
                     [](void *user, size_t bytes, size_t align) -> void * {
                       auto &c = *static_cast<Counting *>(user);
                       c.live += bytes;
                       ++c.calls;
                       return std::aligned_alloc(align, bytes);
                     },
                     [](void *user, void *p, size_t bytes, size_t) {
                       static_cast<Counting *>(user)->live -= bytes;
                       std::free(p);
                     }};
};

TEST(Scratch, PiecesOfOneCall_DoNotOverlap) {
  Counting counting;
  dfm::Scratch scratch(counting.memory);
  for (int call = 0; call < 5; ++call) {
    const dfm::PluginCall scope(scratch);
    std::vector<std::pair<char *, size_t>> pieces;
    for (size_t bytes : {1u, 100u, 64u, 40000u, 7u, 200000u, 3u}) {
      char *p = static_cast<char *>(scratch.arena()->take(bytes));
      ASSERT_NE(p, nullptr);
      EXPECT_EQ(reinterpret_cast<uintptr_t>(p) % 64, 0u);
      std::memset(p, static_cast<int>(pieces.size()), bytes);
      pieces.push_back({p, bytes});
    }
    for (size_t i = 0; i < pieces.size(); ++i)
      for (size_t k = 0; k < pieces[i].second; ++k) ASSERT_EQ(pieces[i].first[k], static_cast<char>(i));
  }
}

TEST(Scratch, SameCallAgain_AllocatesNothing) {
  Counting counting;
  {
    dfm::Scratch scratch(counting.memory);
    size_t settled = 0;
    for (int call = 0; call < 20; ++call) {
      const dfm::PluginCall scope(scratch);
      for (size_t bytes : {100u, 40000u, 200000u}) scratch.arena()->take(bytes);
      if (call == 2) settled = counting.calls;
    }
    EXPECT_EQ(counting.calls, settled);
  }
  EXPECT_EQ(counting.live, 0u);
}

TEST(Scratch, NestedCall_GivesBackOnlyItsOwn) {
  dfm::Scratch scratch(dfm::Memory::standard());
  const dfm::PluginCall outer(scratch);
  auto *kept = static_cast<int *>(scratch.arena()->take(sizeof(int)));
  *kept = 42;
  void *first = nullptr, *second = nullptr;
  {
    const dfm::PluginCall inner(scratch);
    first = scratch.arena()->take(100000);
    std::memset(first, 0, 100000);
  }
  {
    const dfm::PluginCall inner(scratch);
    second = scratch.arena()->take(100000);
  }
  EXPECT_EQ(first, second);
  EXPECT_EQ(*kept, 42);
}

TEST(Scratch, EachThread_HasItsOwn) {
  dfm::Scratch scratch(dfm::Memory::standard());
  dfm::ScratchArena *here = scratch.arena(), *there = nullptr;
  std::thread([&] { there = scratch.arena(); }).join();
  EXPECT_NE(here, there);
  EXPECT_EQ(scratch.arena(), here);
}

TEST(Scratch, LaterContextAtTheSameAddress_IsNotMistakenForTheFirst) {
  alignas(dfm::Scratch) unsigned char place[sizeof(dfm::Scratch)];
  Counting counting;
  for (int i = 0; i < 3; ++i) {
    auto *scratch = new (place) dfm::Scratch(counting.memory);
    ASSERT_NE(scratch->arena()->take(1000), nullptr);
    scratch->~Scratch();
    EXPECT_EQ(counting.live, 0u);
  }
}

TEST(Scratch, AbsurdRequest_IsRefused) {
  dfm::Scratch scratch(dfm::Memory::standard());
  EXPECT_EQ(scratch.arena()->take(SIZE_MAX - 3), nullptr);
  EXPECT_NE(scratch.arena()->take(8), nullptr);
}

}  // namespace
